// The nodes of 'three/tsl' that emitted modules use, as plain numbers: what a module says without a GPU.
const METHODS = {
  add: (a, b) => a + b, sub: (a, b) => a - b, mul: (a, b) => a * b, div: (a, b) => a / b,
  lessThan: (a, b) => a < b, lessThanEqual: (a, b) => a <= b, greaterThan: (a, b) => a > b,
  greaterThanEqual: (a, b) => a >= b, equal: (a, b) => a === b, notEqual: (a, b) => a !== b,
  and: (a, b) => a && b, or: (a, b) => a || b, not: (a) => !a, negate: (a) => -a,
  shiftRight: (a, b) => a >> b, shiftLeft: (a, b) => a << b,
};

export function node(parts) {
  const made = { parts };
  return new Proxy(made, {
    get(own, name) {
      if (name === 'parts' || typeof name !== 'string') return own[name];
      if (name in METHODS) return (...others) => each(METHODS[name])(proxies.get(own), ...others);
      if (/^[xyzw]+$/.test(name)) return node([...name].map((c) => own.parts['xyzw'.indexOf(c)]));
      throw new Error(`a node has no ${name}`);
    },
  });
}
const proxies = { get: (own) => node(own.parts) };

const each = (f) => (...nodes) => {
  const size = Math.max(...nodes.map((n) => n.parts.length));
  return node(Array.from({ length: size }, (_, i) => f(...nodes.map((n) => n.parts[n.parts.length === 1 ? 0 : i]))));
};
const vector = (size) => (...nodes) => {
  const flat = nodes.flatMap((n) => n.parts ?? [n]);
  return node(flat.length === 1 ? Array(size).fill(flat[0]) : flat);
};
const bits = new DataView(new ArrayBuffer(4));

export const float = (x) => node([Number(x.parts ? x.parts[0] : x)]);
export const int = (x) => node([Math.trunc(x.parts ? x.parts[0] : x)]);
export const bool = (x) => node([x]);
export const [vec2, vec3, vec4, ivec2, ivec3, bvec2, bvec3] = [2, 3, 4, 2, 3, 2, 3].map(vector);
export const [abs, cos, exp, floor, log, sin, sqrt] = ['abs', 'cos', 'exp', 'floor', 'log', 'sin', 'sqrt'].map((n) => each(Math[n]));
export const [max, min, atan] = [Math.max, Math.min, Math.atan2].map(each);
export const clamp = each((x, low, high) => Math.min(Math.max(x, low), high));
export const mix = each((a, b, t) => a + (b - a) * t);
export const select = (mask, a, b) => (mask.parts[0] ? a : b);
export const dot = (a, b) => node([a.parts.reduce((sum, x, i) => sum + x * b.parts[i], 0)]);
export const normalize = (v) => v.div(sqrt(dot(v, v)));
export const floatBitsToInt = each((x) => (bits.setFloat32(0, x), bits.getInt32(0)));
export const intBitsToFloat = each((x) => (bits.setInt32(0, x), bits.getFloat32(0)));

// a texture: set its value to {data, size, channels}
const made = () => ({
  load(at) {
    const { data, size, channels } = this.value;
    const index = at.parts.reduceRight((sum, x, i) => sum * size[i] + x, 0);
    return node(Array.from({ length: 4 }, (_, c) => (c < channels ? data[index * channels + c] : 0)));
  },
});
export const [texture, texture3D] = [made, made];
export class DataTexture {}
export class Data3DTexture {}
