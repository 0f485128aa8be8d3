"""Shaders run in a browser on many random pairs of directions and parameters, beside the float64 of Python."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Collection
from typing import Any, NamedTuple

import gonio as go
import numpy as np
from gonio.material import Parameter, binding, tree
from gonio.ops import backend
from gonio.shaders.program import Program

SIDE = 256  # the target is SIDE x SIDE pixels, one draw each
COUNT = SIDE * SIDE
TIGHT = 1e-5  # relative error that is always allowed
MOVES = 8  # times the change of the float64 value when the inputs move by one float32, each at its worst
DIM = 1e-6  # values below are not judged


class Draws(NamedTuple):
    """Random inputs, all float32: directions, numbers and the parameters by path, one row a draw."""

    wo: np.ndarray
    wi: np.ndarray
    u: np.ndarray
    fields: dict[str, np.ndarray]

    def columns(self) -> np.ndarray:
        """Everything side by side, as the shader reads it."""
        return np.concatenate([self.wo, self.wi, self.u, *self.fields.values()], axis=1).astype(np.float32)

    def rows(self, which: np.ndarray) -> Draws:
        """Some of the draws."""
        fields = {path: rows[which] for path, rows in self.fields.items()}
        return Draws(self.wo[which], self.wi[which], self.u[which], fields)

    def moved_each(self) -> Draws:
        """The draws as often as there are inputs, each time with one of them moved."""
        parts = [self.moved(column) for column in range(self.columns().shape[1])]
        fields = {path: np.concatenate([p.fields[path] for p in parts]) for path in self.fields}
        return Draws(*(np.concatenate([p[i] for p in parts]) for i in range(3)), fields)

    def moved(self, column: int) -> Draws:
        """One input, by its place among `columns`, one float32 toward 0; what is 0 stays."""
        columns = self.columns()
        x = columns[:, column]
        columns[:, column] = np.nextafter(x, np.float32(0.0))
        fields, place = {}, 9
        for path, rows in self.fields.items():
            fields[path] = columns[:, place : place + rows.shape[1]]
            place += rows.shape[1]
        return Draws(columns[:, :3], columns[:, 3:6], columns[:, 6:9], fields)


# ------------------------------------------------------------------ inputs


def draw(model: go.BSDF, rng: np.random.Generator, count: int = COUNT, without: Collection[str] = ()) -> Draws:
    """Directions and parameters over all that is allowed, extremes among them; `without` keep the model's values."""
    fields = {path: values for path, values in _fields(model, rng, count) if path not in without}
    wo = _directions(rng, count, model.transmits)
    wi = _directions(rng, count, model.transmits)
    u = rng.random((count, 3)).astype(np.float32)
    u = np.minimum(u, np.float32(0.99999994))
    draws = Draws(wo, wi, u, fields)
    # half of the pairs where the lobe is
    sampled = reference(model, draws, "sample")[0].astype(np.float32)
    good = np.isfinite(sampled).all(1) & (np.abs(np.linalg.norm(sampled, axis=1) - 1.0) < 1e-3)
    wi = np.where((good & (rng.random(count) < 0.5))[:, None], sampled, wi)
    return draws._replace(wi=wi)


def _directions(rng: np.random.Generator, count: int, below: bool) -> np.ndarray:
    v = rng.normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    kind = rng.integers(0, 20, count)
    z = np.where(kind == 0, 10.0 ** rng.uniform(-6, -1, count), v[:, 2])  # grazing
    z = np.where(kind == 1, 1.0 - 10.0 ** rng.uniform(-7, -2, count), z)  # along the normal
    phi = rng.uniform(0, 2 * np.pi, count)
    r = np.sqrt(np.maximum(1 - z * z, 0.0))
    v = np.stack([r * np.cos(phi), r * np.sin(phi), z], 1)
    v[kind == 2] = (0.0, 0.0, 1.0)
    up = ~(rng.random(count) < (0.5 if below else 0.1))
    v[:, 2] = np.where(up, np.abs(v[:, 2]), v[:, 2])
    return v.astype(np.float32)


def _fields(model: go.BSDF, rng: np.random.Generator, count: int) -> Any:
    for path, parameter, value, owner in tree.surface(model):
        if parameter.numeric and not (parameter.kind == "angle" and isinstance(value, int | float) and value == 0):
            yield path, _values(type(owner).__name__, parameter, value, rng, count)


def _values(owner: str, parameter: Parameter, value: Any, rng: np.random.Generator, count: int) -> np.ndarray:
    if parameter.kind == "alpha":
        pair = 10.0 ** rng.uniform(-3.5, 0.0, (count, 2))
        pair[rng.random((count, 2)) < 0.05] = 1.0
        if not isinstance(value, tuple):
            pair[:, 1] = pair[:, 0]
        pair[rng.random(count) < 0.03] = 0.0
        return np.maximum(pair, parameter.low).astype(np.float32)
    if parameter.kind == "angle":
        angle = rng.uniform(-np.pi, np.pi, count)
        return np.stack([np.cos(angle), np.sin(angle)], 1).astype(np.float32)
    shape = (count, 3 if parameter.kind == "spectrum" else 1)
    low, high = parameter.low, parameter.high
    if owner == "Dielectric" and parameter.name == "eta":
        x = np.exp(rng.uniform(np.log(low), np.log(high), shape))
        near = rng.random(shape) < 0.1
        x = np.where(near, 1.0 + rng.choice([-1, 1], shape) * 10.0 ** rng.uniform(-3, -1, shape), x)
    elif np.isinf(high):
        x = rng.uniform(0.0, 10.0, shape) if parameter.name != "p" else 10.0 ** rng.uniform(-2, 3.5, shape)
    else:
        x = rng.uniform(low, high, shape)
    x = np.maximum(x, low)
    x = np.where(rng.random(shape) < 0.03, low if np.isfinite(low) else 0.0, x)
    return np.where(rng.random(shape) < 0.03, high, x).astype(np.float32) if np.isfinite(high) else x.astype(np.float32)


# ------------------------------------------------------------------ Python


def bound(model: go.BSDF, draws: Draws, column: Callable[[np.ndarray], Any]) -> tuple[Any, Callable[[np.ndarray], Any]]:
    """(The model over the draws' parameters, what makes a direction of an array), both of columns by `column`."""
    kind = backend.types("float64")
    rows, drawn = iter(draws.fields.values()), {path.rpartition(".")[2] for path in draws.fields}

    def vector(x: np.ndarray) -> Any:
        return {2: kind.vec2, 3: kind.vec3}[x.shape[1]](*[column(c) for c in x.T])

    def convert(parameter: Parameter, value: Any) -> Any:
        if parameter.inside or (parameter.kind == "angle" and isinstance(value, int | float) and value == 0):
            return None
        if parameter.is_off(value) and parameter.name not in drawn:
            return value
        x = next(rows)
        return column(x[:, 0]) if x.shape[1] == 1 else vector(x)

    return binding.bind(model, convert), vector


def reference(model: go.BSDF, draws: Draws, method: str) -> tuple[np.ndarray, ...]:
    """What Python says in float64; each result as (N, channels) or (N,)."""
    kind = backend.types("float64")
    of, vector = bound(model, draws, lambda x: kind.float(np.ascontiguousarray(x, dtype=np.float64)))
    count = len(draws.wo)
    found = getattr(of, method)(vector(draws.wo), vector(draws.u if method == "sample" else draws.wi))
    results = found if isinstance(found, tuple) else (found,)
    return tuple(np.asarray(backend.to_numpy(r, count)) for r in results)


# ------------------------------------------------------------------ the browser


def pack(x: np.ndarray) -> str:
    """float32 as base64."""
    return base64.b64encode(np.ascontiguousarray(x, dtype="<f4").tobytes()).decode()


def _filled(bundle: Any, draws: Draws, assign: str, types: dict[str, str]) -> list[str]:
    lines, place = [], 9
    by_path = {f["path"]: f for f in bundle.manifest["fields"]}
    for path, rows in draws.fields.items():
        n = rows.shape[1]
        values = ", ".join(f"given({place + i})" for i in range(n))
        field = by_path[path]
        lines.append(f"{assign}{field['name']} = {types[field['type']]}({values});")
        place += n
    return lines


GLSL_HEAD = """#version 300 es
precision highp float; precision highp int; precision highp sampler2D; precision highp sampler3D;
"""


def glsl_program(bundle: Any, draws: Draws) -> str:
    """A fragment shader that answers one draw a pixel."""
    m = bundle.manifest
    width = -(-draws.columns().shape[1] // 4)
    f = m["functions"]
    derived = ", derived" if m["derived"] else ""
    lines = [
        f"{m['struct']} self;",
        *_filled(bundle, draws, "self.", {"float": "float", "vec2": "vec2", "vec3": "vec3"}),
    ]
    if m["derived"]:
        lines.append(f"{m['derived']['struct']} derived = {f['derive']}(self);")
    lines += [
        "vec3 wo = vec3(given(0), given(1), given(2)), wi = vec3(given(3), given(4), given(5));",
        "vec3 u = vec3(given(6), given(7), given(8));",
        f"o0 = vec4({f['eval']}(self{derived}, wo, wi), {f['pdf']}(self{derived}, wo, wi));",
        f"Sample s = {f['sample']}(self{derived}, wo, u);",
        "o1 = vec4(s.wi, s.pdf); o2 = vec4(s.weight, s.delta ? 1.0 : 0.0); o3 = vec4(s.eta, 0.0, 0.0, 0.0);",
        "o4 = vec4(0.0); o5 = vec4(0.0);",
    ]
    if "terms" in f:
        names = [t["name"] for t in m["terms"]]
        lines.append(f"{m['struct']}Terms t = {f['terms']}(self{derived}, wo, wi);")
        if "D" in names:
            lines.append("o3.yz = vec2(t.D, t.G); o4 = vec4(t.F, 0.0);")
        if "multi" in names:
            lines.append("o5 = vec4(t.multi, 0.0);")
    body = "\n    ".join(lines)
    outs = "\n".join(f"layout(location = {i}) out vec4 o{i};" for i in range(6))
    return f"""{GLSL_HEAD}{bundle.text}
uniform sampler2D inputs;
{outs}
float given(int i) {{
    ivec2 at = ivec2(gl_FragCoord.xy);
    return texelFetch(inputs, ivec2(at.x * {width} + i / 4, at.y), 0)[i % 4];
}}
void main() {{
    {body}
}}
"""


RUN_GLSL = """async ({text, inputs, width, textures, side}) => {
  const floats = (s) => new Float32Array(Uint8Array.from(atob(s), c => c.charCodeAt(0)).buffer);
  const canvas = document.createElement('canvas');
  const gl = canvas.getContext('webgl2');
  gl.getExtension('EXT_color_buffer_float');
  const shader = (kind, source) => {
    const s = gl.createShader(kind); gl.shaderSource(s, source); gl.compileShader(s);
    if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
    return s;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
    void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, text));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  let unit = 0;
  const bind = (name, dim, size, channels, data) => {
    const target = dim === 3 ? gl.TEXTURE_3D : gl.TEXTURE_2D;
    const format = {1: [gl.R32F, gl.RED], 2: [gl.RG32F, gl.RG], 4: [gl.RGBA32F, gl.RGBA]}[channels];
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(target, gl.createTexture());
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    if (dim === 3) gl.texImage3D(target, 0, format[0], ...size, 0, format[1], gl.FLOAT, data);
    else gl.texImage2D(target, 0, format[0], ...size, 0, format[1], gl.FLOAT, data);
    gl.uniform1i(gl.getUniformLocation(program, name), unit++);
  };
  bind('inputs', 2, [side * width, side], 4, floats(inputs));
  for (const t of textures) bind(t.uniform, t.dimension, t.size, t.channels, floats(t.data));
  const frame = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  const buffers = [];
  for (let i = 0; i < 6; i++) {
    const t = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, t);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, side, side);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, t, 0);
    buffers.push(gl.COLOR_ATTACHMENT0 + i);
  }
  gl.drawBuffers(buffers);
  gl.viewport(0, 0, side, side);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const out = [];
  for (let i = 0; i < 6; i++) {
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + i);
    const data = new Float32Array(side * side * 4);
    gl.readPixels(0, 0, side, side, gl.RGBA, gl.FLOAT, data);
    const bytes = new Uint8Array(data.buffer);
    let s = '';
    for (let j = 0; j < bytes.length; j += 32768) s += String.fromCharCode(...bytes.subarray(j, j + 32768));
    out.push(btoa(s));
  }
  const error = gl.getError();
  if (error) throw new Error('WebGL error ' + error);
  gl.getExtension('WEBGL_lose_context').loseContext();
  return out;
}"""


def run_glsl(page: Any, bundle: Any, draws: Draws) -> dict[str, np.ndarray]:
    """The shader's answers, by the names of `compared`."""
    columns = draws.columns()
    width = -(-columns.shape[1] // 4)
    padded = np.zeros((len(columns), width * 4), np.float32)
    padded[:, : columns.shape[1]] = columns
    textures = [{**t, "data": pack(bundle.tables[t["uniform"]])} for t in bundle.manifest["textures"]]
    side = int(np.sqrt(len(columns)))
    given = {"text": glsl_program(bundle, draws), "inputs": pack(padded), "width": width, "textures": textures}
    found = page.evaluate(RUN_GLSL, {**given, "side": side})
    return unpack([np.frombuffer(base64.b64decode(x), "<f4").reshape(-1, 4) for x in found])


def wgsl_program(bundle: Any, draws: Draws) -> str:
    """A compute shader that answers one draw an invocation."""
    m = bundle.manifest
    width = draws.columns().shape[1]
    f = m["functions"]
    derived = ", derived" if m["derived"] else ""
    types = {"float": "f32", "vec2": "vec2f", "vec3": "vec3f"}
    lines = [f"var model: {m['struct']};", *_filled(bundle, draws, "model.", types)]
    if m["derived"]:
        lines.append(f"let derived = {f['derive']}(model);")
    lines += [
        "let wo = vec3f(given(0), given(1), given(2)); let wi = vec3f(given(3), given(4), given(5));",
        "let u = vec3f(given(6), given(7), given(8));",
        f"put(0, vec4f({f['eval']}(model{derived}, wo, wi), {f['pdf']}(model{derived}, wo, wi)));",
        f"let s = {f['sample']}(model{derived}, wo, u);",
        "put(1, vec4f(s.wi, s.pdf)); put(2, vec4f(s.weight, select(0.0, 1.0, s.delta)));",
        "var o3 = vec4f(s.eta, 0.0, 0.0, 0.0); var o4 = vec4f(0.0); var o5 = vec4f(0.0);",
    ]
    if "terms" in f:
        names = [t["name"] for t in m["terms"]]
        lines.append(f"let t = {f['terms']}(model{derived}, wo, wi);")
        if "D" in names:
            lines.append("o3.y = t.D; o3.z = t.G; o4 = vec4f(t.F, 0.0);")
        if "multi" in names:
            lines.append("o5 = vec4f(t.multi, 0.0);")
    lines.append("put(3, o3); put(4, o4); put(5, o5);")
    body = "\n    ".join(lines)
    count = len(draws.wo)
    return f"""{bundle.text}
@group(1) @binding(0) var<storage, read> inputs: array<f32>;
@group(1) @binding(1) var<storage, read_write> outputs: array<vec4f>;
var<private> place: u32;
fn given(i: u32) -> f32 {{ return inputs[place * {width}u + i]; }}
fn put(i: u32, value: vec4f) {{ outputs[i * {count}u + place] = value; }}
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {{
    place = id.x;
    {body}
}}
"""


RUN_WGSL = """async ({text, inputs, count, textures}) => {
  const floats = (s) => new Float32Array(Uint8Array.from(atob(s), c => c.charCodeAt(0)).buffer);
  const adapter = await navigator.gpu.requestAdapter();
  const device = await adapter.requestDevice();
  const errors = [];
  device.addEventListener('uncapturederror', (e) => errors.push(e.error.message));
  const module = device.createShaderModule({code: text});
  const info = await module.getCompilationInfo();
  const bad = info.messages.filter(m => m.type === 'error').map(m => `${m.lineNum}: ${m.message}`);
  if (bad.length) throw new Error(bad.join('\\n'));
  const pipeline = await device.createComputePipelineAsync({layout: 'auto', compute: {module, entryPoint: 'main'}});
  const data = floats(inputs);
  const input = device.createBuffer({size: data.byteLength, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST});
  device.queue.writeBuffer(input, 0, data);
  const size = count * 6 * 16;
  const output = device.createBuffer({size, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC});
  const back = device.createBuffer({size, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST});
  const entries = textures.map((t) => {
    const format = {1: 'r32float', 2: 'rg32float', 4: 'rgba32float'}[t.channels];
    const texture = device.createTexture({size: t.size, dimension: `${t.dimension}d`, format,
      usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST});
    device.queue.writeTexture({texture}, floats(t.data),
      {bytesPerRow: t.size[0] * t.channels * 4, rowsPerImage: t.size[1]}, t.size);
    return {binding: t.binding, resource: texture.createView()};
  });
  const encoder = device.createCommandEncoder();
  const pass = encoder.beginComputePass();
  pass.setPipeline(pipeline);
  if (entries.length) pass.setBindGroup(0, device.createBindGroup({layout: pipeline.getBindGroupLayout(0), entries}));
  pass.setBindGroup(1, device.createBindGroup({layout: pipeline.getBindGroupLayout(1), entries: [
    {binding: 0, resource: {buffer: input}}, {binding: 1, resource: {buffer: output}}]}));
  pass.dispatchWorkgroups(count / 64);
  pass.end();
  encoder.copyBufferToBuffer(output, 0, back, 0, size);
  device.queue.submit([encoder.finish()]);
  await back.mapAsync(GPUMapMode.READ);
  const bytes = new Uint8Array(back.getMappedRange().slice(0));
  let s = '';
  for (let j = 0; j < bytes.length; j += 32768) s += String.fromCharCode(...bytes.subarray(j, j + 32768));
  if (errors.length) throw new Error(errors.join('\\n'));
  device.destroy();
  return btoa(s);
}"""


def run_wgsl(page: Any, bundle: Any, draws: Draws) -> dict[str, np.ndarray]:
    """As `run_glsl`, in WebGPU."""
    textures = [{**t, "data": pack(bundle.tables[t["uniform"]])} for t in bundle.manifest["textures"]]
    given = {"text": wgsl_program(bundle, draws), "inputs": pack(draws.columns()), "count": len(draws.wo)}
    found = page.evaluate(RUN_WGSL, {**given, "textures": textures})
    return unpack(list(np.frombuffer(base64.b64decode(found), "<f4").reshape(6, -1, 4)))


def unpack(o: list[np.ndarray]) -> dict[str, np.ndarray]:
    """The six targets by name."""
    return {
        "eval": o[0][:, :3],
        "pdf": o[0][:, 3],
        "sample.wi": o[1][:, :3],
        "sample.pdf": o[1][:, 3],
        "sample.weight": o[2][:, :3],
        "sample.delta": o[2][:, 3],
        "sample.eta": o[3][:, 0],
        "terms.D": o[3][:, 1],
        "terms.G": o[3][:, 2],
        "terms.F": o[4][:, :3],
        "terms.multi": o[5][:, :3],
    }


# ------------------------------------------------------------------ the verdict


def expected(model: go.BSDF, draws: Draws, chosen: np.ndarray, terms: list[str]) -> dict[str, np.ndarray]:
    """float64 by the same names.

    chosen  the directions that the shader sampled. Its pdf and weight are right where they are those of u, or where
            they are pdf and eval / pdf at its own direction ("there"): where a lobe is narrow, or a pair grazes, the
            rounding of the direction alone moves both
    """
    found = {"eval": reference(model, draws, "eval")[0], "pdf": reference(model, draws, "pdf")[0]}
    for name, value in zip(go.Sample._fields, reference(model, draws, "sample"), strict=True):
        found[f"sample.{name}"] = value.astype(float)
    there = draws._replace(wi=chosen)
    density = reference(model, there, "pdf")[0]
    found["there.pdf"] = density
    found["there.weight"] = reference(model, there, "eval")[0] / np.where(density > 0, density, 1.0)[:, None]
    if terms:
        for name, value in zip(terms, reference(model, draws, "terms"), strict=True):
            found[f"terms.{name}"] = value
    return found


class Verdict(NamedTuple):
    """The worst of one result: error over what is allowed, share of draws over it, and the draw."""

    ratio: float
    share: float
    draw: int
    got: Any
    right: Any


def judge(model: go.BSDF, draws: Draws, got: dict[str, np.ndarray], terms: list[str]) -> dict[str, Verdict]:
    """A verdict for each result: error <= max(TIGHT of the value, MOVES times its change when inputs move)."""
    chosen = np.where(np.isfinite(got["sample.wi"]), got["sample.wi"], 0.0).astype(np.float32)
    right = expected(model, draws, chosen, terms)
    error, size = {}, {}
    doubtful = np.zeros(len(draws.wo), bool)
    right = {name: value for name, value in right.items() if name.replace("there", "sample") in got}
    for name, value in right.items():
        mine = np.asarray(got[name.replace("there", "sample")], float)
        error[name] = np.where(np.isnan(mine), np.inf, np.abs(mine - value))
        size[name] = np.abs(value)
        if name == "sample.wi":  # a vector is measured by its length
            size[name] = np.linalg.norm(value, axis=1, keepdims=True) + 0 * value
        if name == "terms.multi":  # shown, and added, beside what is scattered once
            size[name] = np.maximum(size[name], np.abs(right["eval"]))
        over = error[name] > TIGHT * size[name]
        doubtful |= over.any(axis=1) if over.ndim == 2 else over
    # only where the first bar is missed need it be asked how well conditioned the value is
    change = {name: np.zeros(value.shape) for name, value in right.items()}
    if doubtful.any():
        few, there = draws.rows(doubtful), draws._replace(wi=chosen).rows(doubtful)
        base = {name: value[doubtful] for name, value in right.items()}
        times, count = draws.columns().shape[1], len(few.wo)
        # the sampled direction moves too, where wi would: the shader's pdf and weight are those at its own
        near = expected(model, few.moved_each(), there.moved_each().wi, terms)
        for name, value in base.items():
            each = near[name].reshape(times, count, *value.shape[1:])
            change[name][doubtful] = np.abs(each - value).sum(axis=0)
    ratios = {}
    for name in right:
        allowed = np.maximum(TIGHT * size[name], MOVES * change[name])
        dim = np.where(error[name] > DIM, np.inf, 0.0)
        ratio = np.where(size[name] > DIM, error[name] / np.maximum(allowed, 1e-300), dim)
        if name.startswith("sample.") and name != "sample.pdf":  # a failed sample has no direction
            ratio[(right["sample.pdf"] <= DIM) & (np.asarray(got["sample.pdf"]) <= DIM)] = 0.0
        ratios[name] = ratio
    verdicts = {}
    for name in (n for n in right if not n.startswith("there")):
        ratio = np.minimum(ratios[name], ratios.get(name.replace("sample", "there"), np.inf))
        worst = int(np.argmax(ratio.max(axis=1) if ratio.ndim == 2 else ratio))
        mine, share = np.asarray(got[name])[worst], float((ratio > 1).mean())
        verdicts[name] = Verdict(float(ratio.max()), share, worst, mine, right[name][worst])
    return verdicts


__all__ = ["COUNT", "Draws", "Program", "draw", "json", "judge", "reference", "run_glsl"]
