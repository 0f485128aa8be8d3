/**
 * Values that depend on a material's parameters alone: computed once per draw and passed to every pixel.
 *
 * A few of them travel as varyings from the vertex shader. If they exceed the varyings, a separate pass computes them
 * into a row of float texels; in a browser that cannot render to float textures, every pixel computes them.
 */
import type { Manifest, Values } from "./data";
import { HEADER, type Program, type Source } from "./programs";
import type { Shader } from "./shaders";
import { isLong } from "./size";

const SIZES = { float: 1, vec2: 2, vec3: 3 } as const;

/** Flat varyings: WebGL 2 guarantees 15 vectors per stage, of which a mesh needs four. */
const MAX_VARYINGS = 11;
/** Cached rows of texels, one per set of parameters: more than there are balls in a picture. */
const MAX_ROWS = 256;

/** Packs the struct into as few vec4 as possible: the contents of each, and the struct rebuilt from `derived_0`, ... */
function packed(manifest: Manifest): { vectors: string[]; unpack: string } {
  const parts: string[] = [];
  const arguments_: string[] = [];
  for (const field of manifest.derived?.fields ?? []) {
    const size = SIZES[field.type];
    const slots: string[] = [];
    for (let i = 0; i < size; i++) {
      slots.push(`derived_${parts.length >> 2}.${"xyzw"[parts.length & 3]}`);
      parts.push(size === 1 ? `derived.${field.name}` : `derived.${field.name}.${"xyz"[i]}`);
    }
    arguments_.push(size === 1 ? (slots[0] as string) : `${field.type}(${slots.join(", ")})`);
  }
  while (parts.length & 3) parts.push("0.0");
  const vectors = Array.from({ length: parts.length >> 2 }, (_, v) => `vec4(${parts.slice(4 * v, 4 * v + 4).join(", ")})`);
  return { vectors, unpack: `${manifest.derived?.struct}(${arguments_.join(", ")})` };
}

/** Whether the values exceed the varyings. */
export const derivesMuch = (manifest: Manifest): boolean => packed(manifest).vectors.length > MAX_VARYINGS;

const computed = ({ derived, functions }: Manifest) => `  ${derived?.struct} derived = ${functions.derive}(material);\n`;

/** For a vertex shader that includes the material's text: its outputs, and the statements that compute them. */
export function derivedOut(shader: Shader): { declarations: string; body: string } | null {
  const { manifest } = shader;
  if (!manifest.derived || !manifest.functions.derive || derivesMuch(manifest)) return null;
  const { vectors } = packed(manifest);
  return {
    declarations: vectors.map((_, v) => `flat out vec4 derived_${v};\n`).join(""),
    body: computed(manifest) + vectors.map((one, v) => `  derived_${v} = ${one};\n`).join(""),
  };
}

/**
 * For a fragment shader: its inputs, and the statements that define `derived`.
 *
 * `handed`: whether its vertex shader passes the values on.
 */
export function derivedIn(shader: Shader, handed: boolean): { declarations: string; body: string } {
  const { manifest } = shader;
  if (!manifest.derived || !manifest.functions.derive) return { declarations: "", body: "" };
  const { vectors, unpack } = packed(manifest);
  const made = `  ${manifest.derived.struct} derived = ${unpack};\n`;
  if (shader.tabled) {
    const read = vectors.map((_, v) => `  vec4 derived_${v} = texelFetch(derived_table, ivec2(${v}, 0), 0);\n`);
    return { declarations: "uniform sampler2D derived_table;\n", body: read.join("") + made };
  }
  if (!handed || derivesMuch(manifest)) return { declarations: "", body: computed(manifest) };
  return { declarations: vectors.map((_, v) => `flat in vec4 derived_${v};\n`).join(""), body: made };
}

/** Cache of texel rows by shader and parameters. */
export class DerivedTables {
  private readonly rows = new Map<string, WebGLTexture>();
  private vao: WebGLVertexArrayObject | null = null;

  constructor(private readonly gl: WebGL2RenderingContext) {}

  /** Whether a browser can render them. */
  static possible(gl: WebGL2RenderingContext): boolean {
    return Boolean(gl.getExtension("EXT_color_buffer_float"));
  }

  /** The program that computes the rows of a shader. */
  source(shader: Shader): Source {
    const { manifest, code, text } = shader;
    return {
      key: `${code} derived`,
      title: shader.material.title,
      long: isLong(shader),
      vertex: () => `${HEADER}void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0), 0.0, 1.0); }\n`,
      fragment: () => {
        const { vectors } = packed(manifest);
        return `${HEADER}${text}
uniform ${manifest.struct} material;
layout(location = 0) out vec4 texel;
void main() {
${computed(manifest)}  vec4 all[${vectors.length}] = vec4[${vectors.length}](${vectors.join(", ")});
  texel = all[int(gl_FragCoord.x)];
}
`;
      },
    };
  }

  /** The row of a shader's parameters, once it is drawn. */
  row(shader: Shader, values: Values): WebGLTexture | null {
    const key = keyOf(shader, values);
    const known = this.rows.get(key);
    if (!known) return null;
    this.rows.delete(key); // moved to the end of the queue
    this.rows.set(key, known);
    return known;
  }

  /** Draws a row with the program of `source`; `bind` sets its uniforms and tables. */
  draw(shader: Shader, values: Values, program: Program, bind: () => void): void {
    const { gl } = this;
    const width = packed(shader.manifest).vectors.length;
    const texture = gl.createTexture();
    const framebuffer = gl.createFramebuffer();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, 1);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.viewport(0, 0, width, 1);
    for (const one of [gl.BLEND, gl.DEPTH_TEST, gl.SCISSOR_TEST, gl.STENCIL_TEST, gl.CULL_FACE]) gl.disable(one);
    gl.colorMask(true, true, true, true);
    gl.useProgram(program.handle);
    bind();
    this.vao ??= gl.createVertexArray();
    gl.bindVertexArray(this.vao);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(framebuffer);
    this.rows.set(keyOf(shader, values), texture);
    for (const [old, one] of this.rows) {
      if (this.rows.size <= MAX_ROWS) break;
      gl.deleteTexture(one);
      this.rows.delete(old);
    }
  }

  /** Drops the rows of shaders that the page no longer uses. */
  forget(keys: readonly string[]): void {
    for (const [key, texture] of this.rows)
      if (!keys.some((known) => key.startsWith(known))) {
        this.gl.deleteTexture(texture);
        this.rows.delete(key);
      }
  }
}

const keyOf = (shader: Shader, values: Values): string => `${shader.key} ${JSON.stringify(shader.manifest.fields.map(({ path }) => values[path]))}`;
