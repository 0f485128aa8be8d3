/**
 * The environment picture and what the GPU computes from it by the materials' own sampling: the albedo E(mu) of every
 * ball and, for the split sum, the environment blurred by the lobe at several widths.
 */
import { type Values, decodeBase64 } from "./data";
import { SAMPLES_VERTEX, albedoText, prefilterText } from "./environment-glsl";
import { distribution } from "./importance";
import type { Source } from "./programs";
import type { Shader, ShaderLibrary } from "./shaders";
import { isLong } from "./size";
import { createTarget, floatToHalf, sequence, type Target } from "./targets";

export interface EnvironmentPicture {
  /** Changes with the picture: results of an earlier one are recomputed. */
  key: string;
  width: number;
  height: number;
  texture: WebGLTexture;
  /** Importance sampling of its bright parts: see importance.ts. */
  sums: WebGLTexture;
  /** Float16 RGBA, top row first, as a live server expects it. */
  half: Uint16Array;
}

let made = 0;

export function createEnvironment(gl: WebGL2RenderingContext, width: number, height: number, half: Uint16Array): EnvironmentPicture {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, width, height, 0, gl.RGBA, gl.HALF_FLOAT, half);
  gl.generateMipmap(gl.TEXTURE_2D);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.REPEAT);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  const bright = distribution(half, width, height);
  const sums = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, sums);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, bright.width + 1, bright.height, 0, gl.RED, gl.FLOAT, bright.sums);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  made += 1;
  // Distinct from the keys of other pages: a server may know several.
  return { key: `environment${made}-${Math.random().toString(36).slice(2)}`, width, height, texture, sums, half };
}

export function environmentFromData(gl: WebGL2RenderingContext, width: number, height: number, data: string): EnvironmentPicture {
  return createEnvironment(gl, width, height, new Uint16Array(decodeBase64(data).buffer as ArrayBuffer));
}

/** From float RGB(A), reduced to 2048 on the longer side: more detail is not visible in a ball. */
export function environmentFromFloats(gl: WebGL2RenderingContext, width: number, height: number, floats: Float32Array, channels: 3 | 4): EnvironmentPicture {
  const step = Math.max(1, Math.ceil(width / 2048));
  const [w, h] = [Math.floor(width / step), Math.floor(height / step)];
  const half = new Uint16Array(4 * w * h);
  for (let y = 0; y < h; y++)
    for (let x = 0; x < w; x++)
      for (let c = 0; c < 4; c++) {
        if (c === 3) {
          half[4 * (y * w + x) + 3] = 0x3c00;
          continue;
        }
        let sum = 0;
        for (let j = 0; j < step; j++) for (let i = 0; i < step; i++) sum += floats[channels * ((y * step + j) * width + x * step + i) + c] as number;
        half[4 * (y * w + x) + c] = floatToHalf(sum / (step * step));
      }
  return createEnvironment(gl, w, h, half);
}

const ALBEDO_WIDTH = 64;
const ALBEDO_ROWS = 64;
const ALBEDO_SAMPLES = 128;
const ALBEDO_PASSES = 48; // 6,144 points per node: E(mu) to a few 1e-4, far below the 1/255 that a screen shows

/** E(mu) of many balls, one row each, accumulated over passes. */
export class AlbedoTables {
  private target: Target | null = null;
  private rows = new Map<string, { row: number; passes: number; used: number }>();
  private clock = 0;

  constructor(
    private gl: WebGL2RenderingContext,
    private shaders: ShaderLibrary,
    private full: boolean,
  ) {}

  get texture(): WebGLTexture | null {
    return this.target?.texture ?? null;
  }

  /** The program that accumulates the rows of a shader. */
  source(shader: Shader): Source {
    return {
      key: `albedo ${shader.code}`,
      title: shader.material.title,
      long: isLong(shader),
      vertex: () => SAMPLES_VERTEX,
      fragment: () => albedoText(shader),
    };
  }

  /** The row of a ball, whose values are derived; runs `passes` more passes while its sum is not complete. */
  row(shader: Shader, values: Values, passes: number): { row: number; complete: boolean; finished: boolean } {
    const { gl } = this;
    this.target ??= createTarget(gl, ALBEDO_WIDTH, ALBEDO_ROWS, this.full, false);
    const key = `${shader.key} ${JSON.stringify(values)}`;
    this.clock += 1;
    let entry = this.rows.get(key);
    if (!entry) {
      entry = { row: this.freeRow(), passes: 0, used: this.clock };
      this.rows.set(key, entry);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.framebuffer);
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(0, entry.row, ALBEDO_WIDTH, 1);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT);
      gl.disable(gl.SCISSOR_TEST);
    }
    entry.used = this.clock;
    const before = entry.passes;
    const limit = this.full ? ALBEDO_PASSES : 2; // float16 sums saturate
    if (entry.passes < limit) {
      const program = this.shaders.program(this.source(shader));
      gl.useProgram(program.handle);
      this.shaders.bind(program, shader, values, 0);
      gl.uniform1f(program.uniform("width"), ALBEDO_WIDTH);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.framebuffer);
      gl.viewport(0, entry.row, ALBEDO_WIDTH, 1);
      gl.disable(gl.DEPTH_TEST);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE);
      for (let i = 0; i < passes && entry.passes < limit; i++, entry.passes++) {
        gl.uniform3fv(program.uniform("random_point"), sequence(3, entry.passes * ALBEDO_SAMPLES));
        gl.drawArraysInstanced(gl.TRIANGLES, 0, 3, ALBEDO_SAMPLES);
      }
      gl.disable(gl.BLEND);
    }
    return { row: entry.row, complete: entry.passes >= limit, finished: before < limit && entry.passes >= limit };
  }

  /** An unused row, or the least recently used one. */
  private freeRow(): number {
    if (this.rows.size < ALBEDO_ROWS) {
      const used = new Set([...this.rows.values()].map((e) => e.row));
      for (let row = 0; row < ALBEDO_ROWS; row++) if (!used.has(row)) return row;
    }
    const [oldest, entry] = [...this.rows].reduce((a, b) => (a[1].used <= b[1].used ? a : b));
    this.rows.delete(oldest);
    return entry.row;
  }
}

/** Path of the parameter that sets a material's roughness, or null. */
export const alphaOf = (shader: Shader): string | null => shader.manifest.parameters.find((p) => p.kind === "alpha" && p.field !== null)?.path ?? null;

/** Square root of the width, or of the geometric mean of two widths; null if the material has none. */
export function roughnessOf(shader: Shader, values: Values): number | null {
  const path = alphaOf(shader);
  if (!path) return null;
  const width = [values[path] as number | number[]].flat();
  return Math.min(Math.sqrt(width.reduce((a, b) => a * b, 1) ** (1 / width.length)), 1);
}

const LEVELS = 7;
const LEVEL_WIDTH = 512; // of the sharpest level; the last one is 8 texels wide
const LEVEL_SAMPLES = 16;
const LEVEL_PASSES = 16;
const SHARP_PASSES = [1, 4]; // of the first levels: their lobe is nearly a mirror's, and they have the most texels

export interface PrefilteredLevel {
  texture: WebGLTexture;
  level: number;
  complete: boolean;
  finished: boolean;
}

interface Prefiltered {
  texture: WebGLTexture;
  framebuffers: WebGLFramebuffer[];
  width: number;
  passes: number;
}

/** The environment blurred by a material's lobe, one mip level per width: roughness 0 to 1 over the levels. */
export class PrefilteredEnvironments {
  private made = new Map<string, Prefiltered>();

  constructor(
    private gl: WebGL2RenderingContext,
    private shaders: ShaderLibrary,
    private full: boolean,
  ) {}

  /** The program that blurs by the lobe of a shader. */
  source(shader: Shader): Source {
    return {
      key: `prefilter ${shader.code}`,
      title: shader.material.title,
      long: isLong(shader),
      vertex: () => SAMPLES_VERTEX,
      fragment: () => prefilterText(shader),
    };
  }

  /** Texture and level for a ball; null if none is computed yet and none is to be computed now. */
  of(shader: Shader, values: Values, picture: EnvironmentPicture, make = true): PrefilteredLevel | null {
    const alpha = alphaOf(shader);
    const rest = { ...values };
    if (alpha) delete rest[alpha];
    // Maps are in the environment's own frame, so a rotation invalidates none of them.
    const key = `${shader.key} ${picture.key} ${JSON.stringify(rest)}`;
    let entry = this.made.get(key);
    if (!make && !entry) return null;
    if (!entry) {
      if (this.made.size >= 8) this.forget();
      entry = this.create(alpha ? LEVELS : 1, alpha ? LEVEL_WIDTH : 64);
      this.made.set(key, entry);
    }
    const before = entry.passes;
    if (make && entry.passes < LEVEL_PASSES) this.pass(entry, shader, values, alpha, picture);
    return {
      texture: entry.texture,
      level: (roughnessOf(shader, values) ?? 0) * (entry.framebuffers.length - 1),
      complete: entry.passes >= LEVEL_PASSES,
      finished: before < LEVEL_PASSES && entry.passes >= LEVEL_PASSES,
    };
  }

  private create(levels: number, width: number): Prefiltered {
    const { gl } = this;
    const linear = this.full && gl.getExtension("OES_texture_float_linear");
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, levels, linear ? gl.RGBA32F : gl.RGBA16F, width, width / 2);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.REPEAT);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    const framebuffers: WebGLFramebuffer[] = [];
    for (let level = 0; level < levels; level++) {
      const framebuffer = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, level);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT);
      framebuffers.push(framebuffer);
    }
    return { texture, framebuffers, width, passes: 0 };
  }

  private pass(entry: Prefiltered, shader: Shader, values: Values, alpha: string | null, picture: EnvironmentPicture): void {
    const { gl } = this;
    const program = this.shaders.program(this.source(shader));
    entry.framebuffers.forEach((framebuffer, level) => {
      const passes = (alpha ? SHARP_PASSES[level] : undefined) ?? LEVEL_PASSES;
      if (entry.passes >= passes) return;
      const size = entry.width >> level;
      const roughness = level / Math.max(entry.framebuffers.length - 1, 1);
      const width = Math.max(roughness * roughness, 1e-3);
      const own = alpha ? { ...values, [alpha]: [width, width] } : values;
      this.shaders.derive(shader, own);
      gl.useProgram(program.handle);
      gl.disable(gl.DEPTH_TEST);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE);
      this.shaders.bind(program, shader, own, 1);
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, picture.texture);
      gl.uniform1i(program.uniform("environment_map"), 0);
      gl.uniform1f(program.uniform("has_map"), 1);
      gl.uniform1f(program.uniform("environment_scale"), 1);
      gl.uniform1f(program.uniform("environment_rotation"), 0);
      gl.uniform2f(program.uniform("size"), size, size / 2);
      gl.uniform1f(program.uniform("points"), LEVEL_SAMPLES * passes);
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.viewport(0, 0, size, size / 2);
      gl.uniform3fv(program.uniform("random_point"), sequence(3, entry.passes * LEVEL_SAMPLES));
      gl.drawArraysInstanced(gl.TRIANGLES, 0, 3, LEVEL_SAMPLES);
    });
    gl.disable(gl.BLEND);
    entry.passes += 1;
  }

  private forget(): void {
    for (const entry of this.made.values()) {
      this.gl.deleteTexture(entry.texture);
      for (const framebuffer of entry.framebuffers) this.gl.deleteFramebuffer(framebuffer);
    }
    this.made.clear();
  }
}
