/**
 * Draws the raster picture and the path-traced one instead of the page's own display pass: side by side, wiped, or as
 * their difference in false color. Both have the same exposure and tone curve (display.ts).
 */
import type { App, Picture, Presenter } from "../panel";
import { BROKEN_GLSL, CHECKER_GLSL, FULLSCREEN_VERTEX, TONE_GLSL, TONES } from "../display";
import { HEADER, link, type Program } from "../programs";
import type { CompareMode } from "../state";
import { createTarget, deleteTarget, readTarget } from "../targets";
import { colorTable } from "./colormaps";
import type { Pair } from "./metrics";
import { rgb } from "./theme";

const MODES: Record<CompareMode | "reference", number> = { off: 0, reference: 1, wipe: 2, side: 3, difference: 4 };

const FRAGMENT = `${HEADER}${TONE_GLSL}${BROKEN_GLSL}${CHECKER_GLSL}
uniform sampler2D raster;      // sums, bottom row first
uniform sampler2D reference;   // means, top row first
uniform sampler2D differences; // top row first; negative: excluded
uniform sampler2D colors;
uniform float samples, exposure, wipe, high, shrink;
uniform vec2 middle;
uniform int curve, mode;
uniform bool stacked, furnace;
uniform vec3 theme;            // color behind the balls, sRGB
uniform vec2 size;
out vec4 color;

vec4 picture(bool second, vec2 at) {
  return second ? texture(reference, vec2(at.x, 1.0 - at.y)) : texture(raster, at) / samples;
}

vec3 shown(vec4 light) {
  if (page_broken(light.rgb)) return page_checker();
  // In the furnace the light is everywhere, behind the balls too; otherwise the background is the theme's color.
  if (furnace) return tone_mapped((light.rgb + max(1.0 - light.a, 0.0)) * exposure, curve);
  vec3 ball = tone_mapped(light.rgb / max(light.a, 1e-6) * exposure, curve);
  return mix(theme, ball, min(light.a, 1.0));
}

void main() {
  vec2 at = gl_FragCoord.xy / size;
  if (mode <= 1) color = vec4(shown(picture(mode == 1, at)), 1.0);
  else if (mode == 2) color = vec4(shown(picture(at.x > wipe, at)), 1.0);
  else if (mode == 3) {
    // Both are cropped to the balls, one per half, and averaged over four positions: single pixels would alias.
    bool second = stacked ? at.y < 0.5 : at.x > 0.5;
    vec2 part = stacked ? vec2(at.x, fract(2.0 * at.y)) : vec2(fract(2.0 * at.x), at.y);
    vec2 half_at = middle + (part - 0.5) * (stacked ? vec2(shrink, 0.5 * shrink) : vec2(0.5 * shrink, shrink));
    color = vec4(theme, 1.0);
    if (any(lessThan(half_at, vec2(0.0))) || any(greaterThan(half_at, vec2(1.0)))) return;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; i++) sum += picture(second, half_at + 0.5 * shrink * (vec2(i & 1, i >> 1) - 0.5) / size);
    color = vec4(shown(0.25 * sum), 1.0);
  } else {
    float value = texture(differences, vec2(at.x, 1.0 - at.y)).r;
    color = vec4(value < 0.0 ? theme : texture(colors, vec2(clamp(value / high, 0.0, 1.0), 0.5)).rgb, 1.0);
  }
}
`;

/** Left, bottom, right, top; 0 to 1. */
type Box = [number, number, number, number];

/** The balls' bounds with a margin, in steps of 1/32, so that they are constant while the picture converges. */
function coveredBox({ width, height, data }: Picture): Box {
  let [left, top, right, bottom] = [1, 1, 0, 0];
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++)
      if ((data[4 * (y * width + x) + 3] as number) > 0.5) {
        left = Math.min(left, x / width);
        right = Math.max(right, (x + 1) / width);
        top = Math.min(top, y / height);
        bottom = Math.max(bottom, (y + 1) / height);
      }
  if (left > right) return [0, 0, 1, 1];
  const out = (v: number) => Math.max(0, Math.floor(32 * v - 0.25) / 32);
  return [out(left), out(1 - bottom), 1 - out(1 - right), 1 - out(top)];
}

interface Drawn {
  raster: WebGLTexture;
  samples: number;
  reference: WebGLTexture;
  width: number;
  height: number;
}

export class CompareView implements Presenter {
  private program: Program | null = null;
  private reference: { picture: Picture; samples: number; texture: WebGLTexture; box: Box } | null = null;
  private differences: WebGLTexture | null = null;
  private colors: WebGLTexture | null = null;
  private vao: WebGLVertexArrayObject | null = null;
  /** Upper end of the difference's color scale. */
  high = 1;
  /** Whether a map was set since the sizes last changed. */
  private mapped: [number, number] | null = null;

  constructor(
    private readonly app: App,
    private readonly presented: () => void,
  ) {}

  present(gl: WebGL2RenderingContext, raster: WebGLTexture, samples: number, width: number, height: number): boolean {
    this.presented();
    const { mode } = this.app.state.compare;
    if (mode === "off" || !this.upload(gl)) return false;
    if (mode === "difference" && !this.mapped) return false;
    this.draw(mode, { raster, reference: (this.reference as NonNullable<typeof this.reference>).texture, samples, width, height });
    return true;
  }

  /** The position in the picture of a point of the canvas, both 0 to 1 from the top left; null in the margins. */
  pictureAt(width: number, height: number, x: number, y: number): [number, number] | null {
    if (this.app.state.compare.mode !== "side" || !this.upload(this.app.gl)) return [x, y];
    const { middle, shrink } = this.crop(width, height);
    const stacked = height > width;
    const part = stacked ? [x, (2 * y) % 1] : [(2 * x) % 1, y];
    const size = stacked ? [shrink, 0.5 * shrink] : [0.5 * shrink, shrink];
    const u = middle[0] + ((part[0] as number) - 0.5) * (size[0] as number);
    const v = 1 - middle[1] + ((part[1] as number) - 0.5) * (size[1] as number);
    return u >= 0 && v >= 0 && u < 1 && v < 1 ? [u, v] : null;
  }

  /** Center of the part that both halves show, from the bottom left, and picture pixels per screen pixel. */
  private crop(width: number, height: number): { middle: [number, number]; shrink: number } {
    const [left, bottom, right, top] = this.reference?.box ?? [0, 0, 1, 1];
    const [w, h] = [right - left, top - bottom];
    const shrink = Math.min(2, height > width ? Math.max(w, 2 * h) : Math.max(2 * w, h));
    return { middle: [(left + right) / 2, (bottom + top) / 2], shrink };
  }

  /** Values per pixel, top row first; NaN: excluded. */
  setMap(map: Float32Array, width: number, height: number): void {
    const { gl } = this.app;
    this.differences ??= gl.createTexture();
    image(gl, this.differences, gl.R32F, width, height, gl.RED, gl.FLOAT, map.map((v) => (Number.isNaN(v) ? -1 : v)));
    this.mapped = [width, height];
  }

  /** Both pictures as displayed, as linear RGB in [0, 1], top row first. */
  screens({ width, height, test, reference }: Pair): { test: Float32Array; reference: Float32Array } {
    const { gl } = this.app;
    const target = createTarget(gl, width, height, true, false);
    const texture = gl.createTexture();
    const read = (data: Float32Array) => {
      image(gl, texture, gl.RGBA32F, width, height, gl.RGBA, gl.FLOAT, data);
      gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
      gl.viewport(0, 0, width, height);
      this.draw("reference", { reference: texture, raster: texture, samples: 1, width, height });
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      return linear(readTarget(gl, target));
    };
    const both = { test: read(test), reference: read(reference) };
    deleteTarget(gl, target);
    gl.deleteTexture(texture);
    return both;
  }

  /**
   * Both pictures' linear radiance, at the reference's size: if the raster picture is an integer number of times larger,
   * its pixels are averaged, which equals a box filter of the larger pixels. Null for any other sizes.
   */
  pair(): (Pair & { samples: [number, number] }) | null {
    const reference = this.app.referencePicture();
    if (!reference) return null;
    const raster = this.app.picture();
    const { width, height } = reference;
    const factor = raster.width / width;
    if (!Number.isInteger(factor) || raster.height !== factor * height) return null;
    return { width, height, test: shrunk(raster, factor), reference: reference.data, samples: [raster.samples, reference.samples] };
  }

  private upload(gl: WebGL2RenderingContext): boolean {
    const picture = this.app.referencePicture();
    if (!picture || picture.samples === 0) return false;
    const known = this.reference;
    if (known && known.picture === picture && known.samples === picture.samples) return true;
    const texture = known?.texture ?? gl.createTexture();
    image(gl, texture, gl.RGBA32F, picture.width, picture.height, gl.RGBA, gl.FLOAT, picture.data);
    this.reference = { picture, samples: picture.samples, texture, box: coveredBox(picture) };
    return true;
  }

  private draw(mode: CompareMode | "reference", { raster, reference, samples, width, height }: Drawn): void {
    const { gl } = this.app;
    const { display, compare, furnace } = this.app.state;
    this.program ??= link(gl, "compare", FULLSCREEN_VERTEX, FRAGMENT);
    const { program } = this;
    if (!this.colors) {
      this.colors = gl.createTexture();
      image(gl, this.colors, gl.RGBA8, 256, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(colorTable("magma")));
    }
    for (const state of [gl.BLEND, gl.DEPTH_TEST, gl.SCISSOR_TEST, gl.CULL_FACE]) gl.disable(state);
    gl.useProgram(program.handle);
    const textures = { raster, reference, differences: this.differences ?? raster, colors: this.colors };
    Object.entries(textures).forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(program.uniform(name), unit);
    });
    const numbers = { samples, exposure: 2 ** display.exposure, wipe: compare.wipe, high: this.high };
    for (const [name, value] of Object.entries(numbers)) gl.uniform1f(program.uniform(name), value);
    const { middle, shrink } = this.crop(width, height);
    gl.uniform2fv(program.uniform("middle"), middle);
    gl.uniform1f(program.uniform("shrink"), shrink);
    gl.uniform1i(program.uniform("curve"), TONES[display.tone].index);
    gl.uniform1i(program.uniform("mode"), MODES[mode]);
    gl.uniform1i(program.uniform("stacked"), height > width ? 1 : 0);
    gl.uniform1i(program.uniform("furnace"), furnace ? 1 : 0);
    gl.uniform3fv(program.uniform("theme"), rgb(this.app.cssColor("--paper")));
    gl.uniform2f(program.uniform("size"), width, height);
    this.vao ??= gl.createVertexArray();
    gl.bindVertexArray(this.vao);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
    gl.activeTexture(gl.TEXTURE0);
  }
}

function image(
  gl: WebGL2RenderingContext,
  texture: WebGLTexture,
  internal: number,
  width: number,
  height: number,
  format: number,
  type: number,
  data: ArrayBufferView,
): void {
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
  gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, type, data);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
  for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
}

function shrunk({ width, height, data }: Picture, factor: number): Float32Array {
  if (factor === 1) return data;
  const [w, h] = [width / factor, height / factor];
  const out = new Float32Array(4 * w * h);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++) {
      const to = 4 * (Math.floor(y / factor) * w + Math.floor(x / factor));
      for (let c = 0; c < 4; c++) out[to + c] = (out[to + c] as number) + (data[4 * (y * width + x) + c] as number) / (factor * factor);
    }
  return out;
}

/** Inverts the display's sRGB curve; RGBA in, RGB out. */
function linear(shown: Float32Array): Float32Array {
  const out = new Float32Array((shown.length / 4) * 3);
  for (let i = 0; i < out.length / 3; i++)
    for (let c = 0; c < 3; c++) {
      const v = shown[4 * i + c] as number;
      out[3 * i + c] = v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    }
  return out;
}
