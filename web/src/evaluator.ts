/**
 * A material's emitted functions applied to arrays on the GPU; results are floats.
 *
 * Directions are passed as float32 textures, one texel per query; one fragment per query calls the emitted function;
 * results are read through RGBA32F targets and a pixel buffer, so that the page does not wait for the GPU (fenceSync).
 * Values that depend on the parameters alone (`derive`) are computed once per call, not per query (`derived.ts`).
 * All values on this page that are not pixels of the picture come from here: web/ contains no formula of a material.
 */
import type { Values } from "./data";
import { derivedIn, derivedOut } from "./derived";
import { HEADER, type Program, type Source } from "./programs";
import type { Shader, ShaderLibrary } from "./shaders";
import { isLong } from "./size";
import { SOBOL_WIDTH, sobolTexels } from "./sobol";

/** One entry per query; `value` is f(wo, wi) |cos theta_i| in 1/sr per channel, interleaved RGB. */
export interface Evaluated {
  value: Float32Array;
  pdf: Float32Array;
}

export interface Sampled {
  wi: Float32Array;
  weight: Float32Array;
  pdf: Float32Array;
  delta: Uint8Array;
  eta: Float32Array;
}

/** Mean of the samples' weights (power) per direction and channel, with its standard error. */
export interface AlbedoEstimate {
  value: Float64Array;
  error: Float64Array;
  samples: number;
}

type Floats = Float32Array | readonly number[];

/** Queries per row of the target; the target's height follows from their number. */
const WIDTH = 1024;
/** Independent digital shifts: their variance gives the standard error (15 degrees of freedom). */
const REPLICATES = 16;
/** Points of a shift per pass, one fragment each: few enough for about 50 ms per pass on a software rasterizer. */
const POINTS = 64;

const VERTEX_MAIN = `
  gl_Position = vec4(vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0), 0.0, 1.0);`;

export class Evaluator {
  private readonly gl: WebGL2RenderingContext;
  private readonly vao: WebGLVertexArrayObject;
  private sobol: WebGLTexture | null = null;

  constructor(private readonly library: ShaderLibrary) {
    this.gl = library.gl;
    if (!this.gl.getExtension("EXT_color_buffer_float"))
      throw new Error("This browser's WebGL cannot render to float textures (EXT_color_buffer_float); plots are not available.");
    this.vao = this.gl.createVertexArray();
  }

  /** `wo`, `wi`: xyz, local frame; either may be one direction for all queries. */
  async evaluate(shader: Shader, values: Values, wo: Floats, wi: Floats): Promise<Evaluated> {
    const { eval: evaluate, pdf } = shader.manifest.functions;
    const body = `
  result0 = vec4(${evaluate}(${self(shader)}, first, second), ${pdf ? `${pdf}(${self(shader)}, first, second)` : "0.0"});`;
    const count = rows(wo, wi);
    const [packed] = await this.run(shader, values, "eval", body, 1, wo, wi, count);
    const value = new Float32Array(3 * count);
    const density = new Float32Array(count);
    const all = packed as Float32Array;
    for (let i = 0; i < count; i++) {
      for (let c = 0; c < 3; c++) value[3 * i + c] = all[4 * i + c] as number;
      density[i] = all[4 * i + 3] as number;
    }
    return { value, pdf: density };
  }

  /** `u`: three uniform numbers per query, in [0, 1). */
  async sample(shader: Shader, values: Values, wo: Floats, u: Floats): Promise<Sampled> {
    const body = `
  Sample drawn = ${needed(shader, "sample")}(${self(shader)}, first, second);
  result0 = vec4(drawn.wi, drawn.pdf);
  result1 = vec4(drawn.weight, 0.0);
  result2 = vec4(drawn.delta ? 1.0 : 0.0, drawn.eta, 0.0, 0.0);`;
    const count = rows(wo, u);
    const [a, b, c] = (await this.run(shader, values, "sample", body, 3, wo, u, count)) as [Float32Array, Float32Array, Float32Array];
    const column = (from: Float32Array, channel: number) => Float32Array.from({ length: count }, (_, i) => from[4 * i + channel] as number);
    return { wi: triples(a, count), weight: triples(b, count), pdf: column(a, 3), delta: Uint8Array.from(column(c, 0)), eta: column(c, 1) };
  }

  /** The terms (D, G, F, single, multi) by name: one float per query, or RGB, as declared in the manifest. */
  async terms(shader: Shader, values: Values, wo: Floats, wi: Floats): Promise<Record<string, Float32Array>> {
    const terms = shader.manifest.terms ?? [];
    const count = rows(wo, wi);
    const read: Record<string, Float32Array> = {};
    // WebGL2 guarantees four targets; a model with more terms needs several passes.
    for (let from = 0; from < terms.length; from += 4) {
      const some = terms.slice(from, from + 4);
      const lines = some.map((t, i) => `result${i} = vec4(${t.type === "vec3" ? `terms.${t.name}` : `vec3(terms.${t.name})`}, 0.0);`);
      const body = `
  ${shader.manifest.struct}Terms terms = ${needed(shader, "terms")}(${self(shader)}, first, second);
  ${lines.join("\n  ")}`;
      const packed = await this.run(shader, values, `terms${from}`, body, some.length, wo, wi, count);
      some.forEach((t, i) => {
        const all = packed[i] as Float32Array;
        read[t.name] = t.type === "vec3" ? triples(all, count) : Float32Array.from({ length: count }, (_, k) => all[4 * k] as number);
      });
    }
    return read;
  }

  /**
   * Fraction of the power arriving along each `wo` that the material scatters: the mean weight of the emitted sample().
   *
   * Sobol points, digitally shifted in 16 independent ways. It ends when the largest standard error over directions and
   * channels is at most `error`, after `limit` points per direction, or when `progress`, called after every pass,
   * returns false.
   * A sample's weight is of radiance; eta^2, the index on wi's side over that on wo's, converts it to power.
   */
  async albedo(
    shader: Shader,
    values: Values,
    wo: Floats,
    options: { error?: number; limit?: number; progress?: (estimate: AlbedoEstimate) => boolean } = {},
  ): Promise<AlbedoEstimate> {
    const { error = 5e-4, limit = REPLICATES * 4096, progress } = options;
    const body = `
  uvec3 shift = shifts[int(gl_FragCoord.y) / ${POINTS}];
  int at = start + int(gl_FragCoord.y) % ${POINTS};
  vec3 wo = texelFetch(first_rows, ivec2(int(gl_FragCoord.x), 0), 0).xyz;
  uvec3 point = texelFetch(sobol, ivec2(at % ${SOBOL_WIDTH}, at / ${SOBOL_WIDTH}), 0).xyz ^ shift;
  // 24 bits: the most that a float below 1 can represent without rounding up to 1.
  Sample drawn = ${needed(shader, "sample")}(${self(shader)}, wo, vec3(point >> 8u) * (1.0 / 16777216.0));
  result0 = vec4(drawn.weight * (drawn.eta * drawn.eta), 0.0);`;
    const extra = `
uniform highp usampler2D sobol;
uniform uvec3 shifts[${REPLICATES}];
uniform int start;`;
    const count = wo.length / 3;
    const sums = new Float64Array(REPLICATES * count * 3);
    const shifts = shiftsOf(REPLICATES);
    let points = 0;
    for (;;) {
      const start = points;
      const [packed] = await this.run(shader, values, "albedo", body, 1, wo, [0, 0, 0], count, {
        declarations: extra,
        height: REPLICATES * POINTS,
        width: count,
        bind: (program, unit) => {
          const gl = this.gl;
          gl.uniform1i(program.uniform("start"), start);
          gl.uniform3uiv(program.uniform("shifts") ?? program.uniform("shifts[0]"), shifts);
          gl.activeTexture(gl.TEXTURE0 + unit);
          gl.bindTexture(gl.TEXTURE_2D, this.sobolTexture());
          gl.uniform1i(program.uniform("sobol"), unit);
        },
      });
      const all = packed as Float32Array;
      for (let row = 0; row < REPLICATES * POINTS; row++)
        for (let i = 0; i < count; i++) {
          const [from, to] = [4 * (row * count + i), 3 * (Math.floor(row / POINTS) * count + i)];
          for (let c = 0; c < 3; c++) sums[to + c] = (sums[to + c] as number) + (all[from + c] as number);
        }
      points += POINTS;
      const estimate = summarise(sums, count, points);
      const worst = estimate.error.reduce((a, b) => Math.max(a, b), 0);
      const go = progress ? progress(estimate) : true;
      // At least four passes: the variance over a few points can be small by chance.
      if (!go || points * REPLICATES >= limit || (points >= 4 * POINTS && worst <= error)) return estimate;
    }
  }

  private sobolTexture(): WebGLTexture {
    if (this.sobol) return this.sobol;
    const gl = this.gl;
    const texels = sobolTexels();
    this.sobol = texture(gl, gl.RGBA32UI, SOBOL_WIDTH, texels.length / 4 / SOBOL_WIDTH, gl.RGBA_INTEGER, gl.UNSIGNED_INT, texels);
    return this.sobol;
  }

  private async run(
    shader: Shader,
    values: Values,
    kind: string,
    body: string,
    outputs: number,
    first: Floats,
    second: Floats,
    count: number,
    more: { declarations?: string; width?: number; height?: number; bind?: (program: Program, unit: number) => void } = {},
  ): Promise<Float32Array[]> {
    const gl = this.gl;
    const program = await this.library.programs.made(source(shader, kind, body, outputs, more.declarations ?? ""));
    for (const one of this.library.derivingSources(shader)) await this.library.programs.made(one);
    this.library.derive(shader, values);
    const width = more.width ?? Math.min(count, WIDTH);
    const height = more.height ?? Math.ceil(count / WIDTH);
    const inputs = [first, second].map((floats) => directions(gl, floats));
    const targets = Array.from({ length: outputs }, () => texture(gl, gl.RGBA32F, width, height, gl.RGBA, gl.FLOAT, null));
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    const attachments = targets.map((target, i) => {
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, target, 0);
      return gl.COLOR_ATTACHMENT0 + i;
    });
    gl.drawBuffers(attachments);
    for (const state of [gl.BLEND, gl.DEPTH_TEST, gl.SCISSOR_TEST, gl.CULL_FACE]) gl.disable(state);
    gl.viewport(0, 0, width, height);
    gl.colorMask(true, true, true, true);
    gl.useProgram(program.handle);
    let unit = this.library.bind(program, shader, values, 0);
    inputs.forEach((input, i) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, input);
      gl.uniform1i(program.uniform(i === 0 ? "first_rows" : "second_rows"), unit);
      unit += 1;
    });
    more.bind?.(program, unit);
    gl.bindVertexArray(this.vao);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
    const bytes = width * height * 16;
    const buffers = attachments.map((attachment) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.PIXEL_PACK_BUFFER, buffer);
      gl.bufferData(gl.PIXEL_PACK_BUFFER, bytes, gl.STREAM_READ);
      gl.readBuffer(attachment);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, 0);
      return buffer;
    });
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(framebuffer);
    for (const used of [...inputs, ...targets]) gl.deleteTexture(used);
    gl.activeTexture(gl.TEXTURE0);
    try {
      await finished(gl);
      this.library.programs.drawn();
      return buffers.map((buffer) => {
        const floats = new Float32Array(width * height * 4);
        gl.bindBuffer(gl.PIXEL_PACK_BUFFER, buffer);
        gl.getBufferSubData(gl.PIXEL_PACK_BUFFER, 0, floats);
        gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
        return floats;
      });
    } finally {
      for (const buffer of buffers) gl.deleteBuffer(buffer);
    }
  }
}

function source(shader: Shader, kind: string, body: string, outputs: number, declarations: string): Source {
  return {
    key: `${shader.code}/evaluator/${kind}`,
    title: shader.material.title,
    long: isLong(shader),
    vertex: () => vertexText(shader),
    fragment: () => fragmentText(shader, body, outputs, declarations),
  };
}

function vertexText(shader: Shader): string {
  const out = derivedOut(shader);
  if (!out) return `${HEADER}void main() {${VERTEX_MAIN}\n}`;
  return `${HEADER}${shader.text}
uniform ${shader.manifest.struct} material;
${out.declarations}
void main() {
${out.body}${VERTEX_MAIN}
}`;
}

function fragmentText(shader: Shader, body: string, outputs: number, declarations: string): string {
  const derived = derivedIn(shader, true);
  return `${HEADER}${shader.text}
uniform ${shader.manifest.struct} material;
uniform sampler2D first_rows;
uniform sampler2D second_rows;
${declarations}
${derived.declarations}${Array.from({ length: outputs }, (_, i) => `layout(location = ${i}) out vec4 result${i};`).join("\n")}
vec3 row_of(sampler2D rows) {
  // A texture of one texel contains one direction shared by all queries.
  return texelFetch(rows, min(ivec2(gl_FragCoord.xy), textureSize(rows, 0) - 1), 0).xyz;
}
void main() {
  vec3 first = row_of(first_rows), second = row_of(second_rows);
${derived.body}${body}
}`;
}

const self = (shader: Shader) => (shader.manifest.derived ? "material, derived" : "material");

function needed(shader: Shader, name: "sample" | "terms"): string {
  const called = shader.manifest.functions[name];
  if (!called) throw new Error(`The page's shader of ${shader.manifest.title} has no ${name}().`);
  return called;
}

function rows(a: Floats, b: Floats): number {
  const [m, n] = [a.length / 3, b.length / 3];
  if (!Number.isInteger(m) || !Number.isInteger(n) || (m !== n && m !== 1 && n !== 1) || m * n === 0)
    throw new Error(`${a.length} and ${b.length} numbers given: expected three per direction, and equally many directions or a single one.`);
  return Math.max(m, n);
}

function triples(packed: Float32Array, count: number): Float32Array {
  const out = new Float32Array(3 * count);
  for (let i = 0; i < count; i++) for (let c = 0; c < 3; c++) out[3 * i + c] = packed[4 * i + c] as number;
  return out;
}

function directions(gl: WebGL2RenderingContext, floats: Floats): WebGLTexture {
  const count = floats.length / 3;
  const [width, height] = [Math.min(count, WIDTH), Math.ceil(count / WIDTH)];
  const padded = new Float32Array(width * height * 3);
  padded.set(floats);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
  return texture(gl, gl.RGB32F, width, height, gl.RGB, gl.FLOAT, padded);
}

function texture(
  gl: WebGL2RenderingContext,
  internal: number,
  width: number,
  height: number,
  format: number,
  type: number,
  data: ArrayBufferView | null,
): WebGLTexture {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
  gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, type, data as ArrayBufferView);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  return made;
}

/** Resolves when everything drawn so far is complete, without blocking the page. */
async function finished(gl: WebGL2RenderingContext): Promise<void> {
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  if (!fence) throw new Error("The graphics context was lost.");
  try {
    for (;;) {
      const status = gl.clientWaitSync(fence, 0, 0);
      if (status === gl.ALREADY_SIGNALED || status === gl.CONDITION_SATISFIED) return;
      if (status === gl.WAIT_FAILED || gl.isContextLost()) throw new Error("The graphics context was lost.");
      await new Promise((resolve) => setTimeout(resolve, 1));
    }
  } finally {
    gl.deleteSync(fence);
  }
}

/** Fixed shifts (xorshift32 from one seed): the same curve every time it is drawn. */
function shiftsOf(count: number): Uint32Array {
  let x = 0x9e3779b9;
  return Uint32Array.from({ length: 3 * count }, () => {
    x ^= x << 13;
    x ^= x >>> 17;
    x ^= x << 5;
    return x >>> 0;
  });
}

/** Mean over the shifts, and its standard error from their variance. */
function summarise(sums: Float64Array, count: number, points: number): AlbedoEstimate {
  const value = new Float64Array(3 * count);
  const error = new Float64Array(3 * count);
  for (let i = 0; i < 3 * count; i++) {
    let mean = 0;
    let square = 0;
    for (let r = 0; r < REPLICATES; r++) {
      const one = (sums[r * 3 * count + i] as number) / points;
      mean += one / REPLICATES;
      square += (one * one) / REPLICATES;
    }
    value[i] = mean;
    error[i] = Math.sqrt(Math.max(0, square - mean * mean) / (REPLICATES - 1));
  }
  return { value, error, samples: points * REPLICATES };
}
