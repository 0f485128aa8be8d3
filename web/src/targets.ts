/** Float and half-float render targets, and the low-discrepancy points of the samples. */

export interface Target {
  framebuffer: WebGLFramebuffer;
  texture: WebGLTexture;
  depth: WebGLRenderbuffer | null;
  width: number;
  height: number;
}

/** Whether sums can be stored in 32 bits: needs rendering to and blending of float32. Phones often support only 16. */
export function floatBlending(gl: WebGL2RenderingContext): boolean {
  return Boolean(gl.getExtension("EXT_color_buffer_float") && gl.getExtension("EXT_float_blend"));
}

export function createTarget(gl: WebGL2RenderingContext, width: number, height: number, full: boolean, withDepth: boolean): Target {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, full ? gl.RGBA32F : gl.RGBA16F, width, height);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  let depth: WebGLRenderbuffer | null = null;
  if (withDepth) {
    depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH24_STENCIL8, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_STENCIL_ATTACHMENT, gl.RENDERBUFFER, depth);
  }
  const status = gl.checkFramebufferStatus(gl.FRAMEBUFFER);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  if (status !== gl.FRAMEBUFFER_COMPLETE) throw new Error("This browser cannot render to float textures (EXT_color_buffer_float is missing).");
  return { framebuffer, texture, depth, width, height };
}

export function deleteTarget(gl: WebGL2RenderingContext, target: Target | null): void {
  if (!target) return;
  gl.deleteFramebuffer(target.framebuffer);
  gl.deleteTexture(target.texture);
  if (target.depth) gl.deleteRenderbuffer(target.depth);
}

/** RGBA float32 of a target, top row first. */
export function readTarget(gl: WebGL2RenderingContext, target: Target): Float32Array {
  const { width, height } = target;
  const upward = new Float32Array(4 * width * height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, upward);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  const down = new Float32Array(upward.length);
  const row = 4 * width;
  for (let y = 0; y < height; y++) down.set(upward.subarray(y * row, (y + 1) * row), (height - 1 - y) * row);
  return down;
}

/** Kronecker sequences of the generalized golden ratios (Roberts 2018), in double precision: point n of dimension d. */
const RATIOS: Record<number, number[]> = {
  2: [0.7548776662466927, 0.5698402909980532],
  3: [0.8191725133961645, 0.6710436067037893, 0.5497004779019703],
};
export const sequence = (dimension: 2 | 3, n: number): number[] => (RATIOS[dimension] as number[]).map((a) => (0.5 + n * a) % 1);
/** Two more dimensions, linearly independent of the others over the rationals. */
export const areaSequence = (n: number): [number, number] => [(n * Math.SQRT2) % 1, (n * Math.sqrt(3)) % 1];

const HALF = new Float32Array(65536);
let halfReady = false;
/** float16 bits to float32, by a table of all 65,536: a frame of a live picture has a few million of them. */
export function halfToFloat(bits: Uint16Array, out = new Float32Array(bits.length)): Float32Array {
  if (!halfReady) {
    for (let i = 0; i < 65536; i++) {
      const exponent = (i >> 10) & 31;
      const mantissa = i & 1023;
      const size = exponent === 0 ? mantissa * 2 ** -24 : exponent === 31 ? (mantissa ? NaN : Infinity) : (1 + mantissa / 1024) * 2 ** (exponent - 15);
      HALF[i] = i & 32768 ? -size : size;
    }
    halfReady = true;
  }
  for (let i = 0; i < bits.length; i++) out[i] = HALF[bits[i] as number] as number;
  return out;
}

const FLOAT = new Float32Array(1);
const BITS = new Uint32Array(FLOAT.buffer);
/** float32 to the nearest float16; larger values become the largest finite one. */
export function floatToHalf(value: number): number {
  FLOAT[0] = Math.max(-65504, Math.min(65504, value || 0));
  const bits = BITS[0] as number;
  const sign = (bits >>> 16) & 0x8000;
  const exponent = ((bits >>> 23) & 255) - 112;
  const mantissa = bits & 0x7fffff;
  if (exponent <= 0) return exponent < -10 ? sign : sign | (((mantissa | 0x800000) >>> (1 - exponent)) + 0x1000) >>> 13;
  return sign | (((exponent << 23) | mantissa) + 0xfff + ((mantissa >>> 13) & 1)) >>> 13;
}
