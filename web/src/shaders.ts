/**
 * The emitted shaders of the page's materials: which one a slot uses, its program, its uniforms and tables.
 *
 * Nothing here knows a formula. The text, the struct's fields and the table list come from the manifest.
 */
import type { Choices, Field, Manifest, Material, PageData, Parameter, Values, Variant } from "./data";
import { decodeFloats } from "./data";
import { DerivedTables, derivesMuch } from "./derived";

export interface Shader {
  /** The variant's: programs are kept by it. */
  key: string;
  material: Material;
  variant: Variant;
  manifest: Manifest;
  text: string;
  /** Whether what it derives stands in a row of texels (`derived.ts`). */
  tabled: boolean;
}

export const HEADER = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;
`;

/** Linked program with the locations of its uniforms, looked up once. */
export interface Program {
  handle: WebGLProgram;
  uniform(name: string): WebGLUniformLocation | null;
}

/** Whether a parameter has sliders: a number, also of a layer that this variant was written without. */
export const isNumeric = (parameter: Parameter): boolean => parameter.field !== null || parameter.off !== null;

/** What a variant's choices are: those it was made for, and the model's own for the rest. */
export function variantChoice(variant: Variant, path: string): string | boolean | undefined {
  const own = variant.choices[path];
  return own !== undefined ? own : (variant.manifest.parameters.find((p) => p.path === path)?.value as string | boolean | undefined);
}

const fits = (variant: Variant, choices: Choices) => Object.keys(choices).every((path) => choices[path] === variantChoice(variant, path));

export class ShaderLibrary {
  private programs = new Map<string, Program>();
  private textures = new Map<string, WebGLTexture>();

  private readonly derived: DerivedTables;
  private readonly tables: boolean;

  constructor(
    readonly gl: WebGL2RenderingContext,
    readonly data: PageData,
  ) {
    this.derived = new DerivedTables(gl);
    this.tables = DerivedTables.possible(gl);
  }

  material(id: string): Material {
    const material = this.data.materials.find((m) => m.id === id);
    if (!material) throw new Error(`The page has no material '${id}'.`);
    return material;
  }

  /**
   * The shortest variant that fits all choices and has the weights that are on, or null where the page lacks it (a
   * live page asks the server for it).
   */
  find(id: string, choices: Choices, on: readonly string[] = []): Shader | null {
    const material = this.material(id);
    let found: number | null = null;
    material.variants.forEach((variant, index) => {
      if (!fits(variant, choices) || on.some((path) => variant.off.includes(path))) return;
      if (found === null || variant.off.length > (material.variants[found] as Variant).off.length) found = index;
    });
    return found === null ? null : this.at(material, found);
  }

  at(material: Material, index: number): Shader {
    const variant = material.variants[index] as Variant;
    const { key, manifest, text } = variant;
    return { key, material, variant, manifest, text, tabled: this.tables && derivesMuch(manifest) };
  }

  /** Drops the programs and tables of shaders that the page has no more. */
  forget(): void {
    const keys = this.data.materials.flatMap((material) => material.variants.map((variant) => variant.key));
    const gone = (name: string) => /[0-9a-f]{16}/.test(name) && !keys.some((key) => name.includes(key));
    for (const [name, { handle }] of this.programs)
      if (gone(name)) {
        this.gl.deleteProgram(handle);
        this.programs.delete(name);
      }
    for (const [name, texture] of this.textures)
      if (gone(name)) {
        this.gl.deleteTexture(texture);
        this.textures.delete(name);
      }
    this.derived.forget(keys);
  }

  /** Compiles once per key. `key` must name the sources: shader key and what is drawn with it. */
  program(key: string, vertex: string, fragment: string): Program {
    const known = this.programs.get(key);
    if (known) return known;
    const program = link(this.gl, key, vertex, fragment);
    this.programs.set(key, program);
    return program;
  }

  /**
   * Sets `uniform STRUCT name` from the values and binds the tables from texture unit `unit` on; returns the next
   * free unit. The program must be in use.
   */
  bind(program: Program, shader: Shader, values: Values, unit: number, name = "material"): number {
    const gl = this.gl;
    const location = program.uniform("derived_table");
    if (location) {
      const row = this.derived.row(shader, values, (vertex, fragment) => {
        const own = this.program(`${shader.key} derived`, vertex, fragment);
        gl.useProgram(own.handle);
        this.bind(own, shader, values, unit);
        return own;
      });
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, row);
      gl.uniform1i(location, unit);
      unit += 1;
    }
    for (const field of shader.manifest.fields) {
      const location = program.uniform(`${name}.${field.name}`);
      if (location) setField(gl, location, field, fieldValue(field, shader.manifest, values));
    }
    for (const table of shader.manifest.textures) {
      const location = program.uniform(table.uniform);
      if (!location) continue;
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(table.dimension === 3 ? gl.TEXTURE_3D : gl.TEXTURE_2D, this.table(shader, table.uniform));
      gl.uniform1i(location, unit);
      unit += 1;
    }
    return unit;
  }

  /** The table as a texture: float32, nearest, since the shader reads texels and blends them itself. */
  table(shader: Shader, uniform: string): WebGLTexture {
    const key = `${shader.key}/${uniform}`;
    const known = this.textures.get(key);
    if (known) return known;
    const gl = this.gl;
    const table = shader.manifest.textures.find((t) => t.uniform === uniform);
    const data = shader.variant.tables[uniform];
    if (!table || data === undefined) throw new Error(`${shader.manifest.title} needs the table '${uniform}'; the page does not hold it.`);
    const texture = gl.createTexture();
    const target = table.dimension === 3 ? gl.TEXTURE_3D : gl.TEXTURE_2D;
    const [internal, format] = { 1: [gl.R32F, gl.RED], 2: [gl.RG32F, gl.RG], 4: [gl.RGBA32F, gl.RGBA] }[table.channels] as [number, number];
    const [width, height, depth] = table.size as [number, number, number];
    const floats = decodeFloats(data);
    gl.bindTexture(target, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    if (table.dimension === 3) gl.texImage3D(target, 0, internal, width, height, depth, 0, format, gl.FLOAT, floats);
    else gl.texImage2D(target, 0, internal, width, height, 0, format, gl.FLOAT, floats);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(target, wrap, gl.CLAMP_TO_EDGE);
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.textures.set(key, texture);
    return texture;
  }
}

/** What a field holds for these values. An angle's field is (cos, sin); its value in the state is the angle. */
export function fieldValue(field: Field, manifest: Manifest, values: Values): number[] {
  const value = values[field.path];
  if (value === undefined) return [field.value].flat();
  const kind = manifest.parameters.find((p) => p.path === field.path)?.kind;
  if (kind === "angle" && typeof value === "number") return [Math.cos(value), Math.sin(value)];
  const size = { float: 1, vec2: 2, vec3: 3 }[field.type];
  if (typeof value === "number" && Number.isFinite(value)) return Array<number>(size).fill(value);
  // A link may say anything: what does not fit counts as not said.
  return Array.isArray(value) && value.length === size && value.every(Number.isFinite) ? value : [field.value].flat();
}

function setField(gl: WebGL2RenderingContext, location: WebGLUniformLocation, field: Field, value: number[]): void {
  if (field.type === "float") gl.uniform1f(location, value[0] as number);
  else if (field.type === "vec2") gl.uniform2fv(location, value);
  else gl.uniform3fv(location, value);
}

export function link(gl: WebGL2RenderingContext, name: string, vertex: string, fragment: string): Program {
  const handle = gl.createProgram();
  const stages = [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].map((type, index) => {
    const stage = gl.createShader(type) as WebGLShader;
    gl.shaderSource(stage, index === 0 ? vertex : fragment);
    gl.compileShader(stage);
    gl.attachShader(handle, stage);
    return stage;
  });
  gl.linkProgram(handle);
  if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) {
    const log = [gl.getProgramInfoLog(handle), ...stages.map((s) => gl.getShaderInfoLog(s))].filter(Boolean).join("\n");
    throw new Error(`The shader ${name} does not compile:\n${log}`);
  }
  for (const stage of stages) gl.deleteShader(stage);
  const locations = new Map<string, WebGLUniformLocation | null>();
  return {
    handle,
    uniform(uniform: string) {
      let location = locations.get(uniform);
      if (location === undefined) {
        location = gl.getUniformLocation(handle, uniform);
        locations.set(uniform, location);
      }
      return location;
    },
  };
}
