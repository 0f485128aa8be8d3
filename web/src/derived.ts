/**
 * What follows from a material's parameters alone: computed once a draw and handed to every pixel.
 *
 * A little travels from the vertex shader. What is more than fits between the stages is computed by a pass of its own
 * into a row of float texels; where a browser cannot draw into floats, every pixel computes it again.
 */
import type { Manifest, Values } from "./data";
import { HEADER, type Program, type Shader } from "./shaders";

const SIZES = { float: 1, vec2: 2, vec3: 3 } as const;

/** Flat varyings: WebGL 2 promises 15 vectors a stage, of which a mesh needs four. */
const MOST_VARYINGS = 11;
/** Rows of texels kept, one for each set of parameters. */
const MOST_KEPT = 64;

/** In as few vec4 as will hold it: what each holds, and the struct made again of `derived_0`, `derived_1`, ... */
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

/** Whether it is more than fits between the stages. */
export const derivesMuch = (manifest: Manifest): boolean => packed(manifest).vectors.length > MOST_VARYINGS;

const computed = ({ derived, functions }: Manifest) => `  ${derived?.struct} derived = ${functions.derive}(material);\n`;

/** For a vertex shader that has the material's text: what it hands on, and the lines that compute it. */
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
 * For a fragment shader: what it reads, and the lines by which `derived` is there.
 *
 * `handed`: whether its vertex shader hands on what there is.
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

/** Rows of texels by shader and parameters. */
export class DerivedTables {
  private readonly kept = new Map<string, WebGLTexture>();
  private vao: WebGLVertexArrayObject | null = null;

  constructor(private readonly gl: WebGL2RenderingContext) {}

  /** Whether a browser can draw them. */
  static possible(gl: WebGL2RenderingContext): boolean {
    return Boolean(gl.getExtension("EXT_color_buffer_float"));
  }

  /** The row of a shader's parameters; `use` puts a program with its uniforms and tables in use. */
  row(shader: Shader, values: Values, use: (vertex: string, fragment: string) => Program): WebGLTexture {
    const fields = shader.manifest.fields.map(({ path }) => values[path]);
    const key = `${shader.key} ${JSON.stringify(fields)}`;
    const known = this.kept.get(key);
    if (known) {
      this.kept.delete(key); // and last in line again
      this.kept.set(key, known);
      return known;
    }
    const { gl } = this;
    const { vectors } = packed(shader.manifest);
    const texture = gl.createTexture();
    const state = this.state();
    const framebuffer = gl.createFramebuffer();
    // its own unit, so that no binding of another is lost
    gl.activeTexture(gl.TEXTURE0 + gl.getParameter(gl.MAX_COMBINED_TEXTURE_IMAGE_UNITS) - 1);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, vectors.length, 1);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.viewport(0, 0, vectors.length, 1);
    for (const one of STATES(gl)) gl.disable(one);
    gl.colorMask(true, true, true, true);
    use(
      `${HEADER}void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0), 0.0, 1.0); }\n`,
      `${HEADER}${shader.text}
uniform ${shader.manifest.struct} material;
layout(location = 0) out vec4 texel;
void main() {
${computed(shader.manifest)}  vec4 all[${vectors.length}] = vec4[${vectors.length}](${vectors.join(", ")});
  texel = all[int(gl_FragCoord.x)];
}
`,
    );
    this.vao ??= gl.createVertexArray();
    gl.bindVertexArray(this.vao);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.deleteFramebuffer(framebuffer);
    state();
    this.kept.set(key, texture);
    for (const [old, one] of this.kept) {
      if (this.kept.size <= MOST_KEPT) break;
      gl.deleteTexture(one);
      this.kept.delete(old);
    }
    return texture;
  }

  /** Drops the rows of shaders that the page has no more. */
  forget(keys: readonly string[]): void {
    for (const [key, texture] of this.kept)
      if (!keys.some((known) => key.startsWith(known))) {
        this.gl.deleteTexture(texture);
        this.kept.delete(key);
      }
  }

  /** What a draw in the middle of another one changes; called, it is as it was. */
  private state(): () => void {
    const { gl } = this;
    const framebuffer = gl.getParameter(gl.FRAMEBUFFER_BINDING) as WebGLFramebuffer | null;
    const program = gl.getParameter(gl.CURRENT_PROGRAM) as WebGLProgram | null;
    const array = gl.getParameter(gl.VERTEX_ARRAY_BINDING) as WebGLVertexArrayObject | null;
    const viewport = gl.getParameter(gl.VIEWPORT) as Int32Array;
    const mask = gl.getParameter(gl.COLOR_WRITEMASK) as boolean[];
    const on = STATES(gl).filter((one) => gl.isEnabled(one));
    return () => {
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.useProgram(program);
      gl.bindVertexArray(array);
      gl.viewport(...(Array.from(viewport) as [number, number, number, number]));
      gl.colorMask(...(mask as [boolean, boolean, boolean, boolean]));
      for (const one of on) gl.enable(one);
    };
  }
}

const STATES = (gl: WebGL2RenderingContext) => [gl.BLEND, gl.DEPTH_TEST, gl.SCISSOR_TEST, gl.STENCIL_TEST, gl.CULL_FACE];
