/**
 * The emitted shaders of the page's materials: the selection per slot, the program, its uniforms and tables.
 *
 * No formula is contained here. The text, the struct's fields and the table list come from the manifest.
 */
import type { Choices, Field, Manifest, Material, PageData, Parameter, SplitSum, Value, Values, Variant } from "./data";
import { decodeFloats } from "./data";
import { DerivedTables, derivesMuch } from "./derived";
import { type Program, Programs, type Source } from "./programs";

export interface Shader {
  /** Key of the variant, which identifies its tables. */
  key: string;
  /** Key of the text, shared by variants that differ only in their tables; it identifies programs. */
  code: string;
  material: Material;
  variant: Variant;
  manifest: Manifest;
  text: string;
  /** Whether its derived values are in a row of texels (`derived.ts`). */
  tabled: boolean;
}

/** Whether a parameter has sliders: a number, also of a layer that this variant was written without. */
export const isNumeric = (parameter: Parameter): boolean => parameter.field !== null || parameter.off !== null;

/** The choices of a variant: those it was written for, and the model's defaults for the rest. */
export function variantChoice(variant: Variant, path: string): string | boolean | undefined {
  const own = variant.choices[path];
  return own !== undefined ? own : (variant.manifest.parameters.find((p) => p.path === path)?.value as string | boolean | undefined);
}

/** Whether two values are equal; a number equals a vector all components of which equal it. */
export function sameNumbers(one: Value, other: Value): boolean {
  const [x, y] = [[one].flat(), [other].flat()] as [number[], number[]];
  return (x.length > y.length ? x : y).every((_, i) => {
    const [a, b] = [x[i] ?? x[0], y[i] ?? y[0]] as [number, number];
    return Math.abs(a - b) <= 1e-6 * Math.max(1, Math.abs(a));
  });
}

const fits = (variant: Variant, choices: Choices, values: Values) =>
  Object.keys(choices).every((path) => choices[path] === variantChoice(variant, path)) &&
  Object.entries(variant.fixed).every(([path, value]) => sameNumbers(value, values[path] ?? value));

export class ShaderLibrary {
  readonly programs: Programs;
  private codes = new Map<string, string>();
  private textures = new Map<string, WebGLTexture>();

  private readonly derived: DerivedTables;
  private readonly tables: boolean;

  constructor(
    readonly gl: WebGL2RenderingContext,
    readonly data: PageData,
  ) {
    this.programs = new Programs(gl);
    this.derived = new DerivedTables(gl);
    this.tables = DerivedTables.possible(gl);
  }

  material(id: string): Material {
    const material = this.data.materials.find((m) => m.id === id);
    if (!material) throw new Error(`The page has no material '${id}'.`);
    return material;
  }

  /** The values of a material before any edit. */
  declared(id: string): Values {
    const parameters = this.material(id).variants[0]?.manifest.parameters ?? [];
    return Object.fromEntries(parameters.filter(isNumeric).map((parameter) => [parameter.path, parameter.value]));
  }

  /**
   * The shortest variant that matches all choices and the values that its tables depend on, and includes all nonzero
   * weights; null if the page has none (a live page requests it from the server).
   */
  find(id: string, choices: Choices, values: Values, on: readonly string[] = []): Shader | null {
    const material = this.material(id);
    let best: number | null = null;
    material.variants.forEach((variant, index) => {
      if (!fits(variant, choices, values) || on.some((path) => variant.off.includes(path))) return;
      if (best === null || variant.off.length > (material.variants[best] as Variant).off.length) best = index;
    });
    return best === null ? null : this.at(material, best);
  }

  at(material: Material, index: number): Shader {
    const variant = material.variants[index] as Variant;
    const { key, manifest, text } = variant;
    if (!this.codes.has(text)) this.codes.set(text, key);
    const code = this.codes.get(text) as string;
    return { key, code, material, variant, manifest, text, tabled: this.tables && derivesMuch(manifest) };
  }

  /** The split sum of a shader's microfacet model, by its distribution and masking; null if the page has none. */
  splitSum(shader: Shader): SplitSum | null {
    const { facets } = shader.variant;
    return (facets && this.data.dfg.find((table) => table.facets.join() === facets.join())) ?? null;
  }

  /** `splitSum` as a texture. */
  splitSumTexture(shader: Shader): WebGLTexture | null {
    const table = this.splitSum(shader);
    return table && this.texture(`split sum ${table.facets.join()}`, table.size, 2, table.data);
  }

  /** Drops the programs and tables of shaders that the page no longer uses. */
  forget(): void {
    const keys = this.data.materials.flatMap((material) => material.variants.map((variant) => variant.key));
    const gone = (name: string) => /[0-9a-f]{16}/.test(name) && !keys.some((key) => name.includes(key));
    this.programs.forget(gone);
    this.codes.clear();
    for (const [name, texture] of this.textures)
      if (gone(name)) {
        this.gl.deleteTexture(texture);
        this.textures.delete(name);
      }
    this.derived.forget(keys);
  }

  program(source: Source): Program {
    return this.programs.program(source);
  }

  /** The programs that `derive` runs: one or none. */
  derivingSources(shader: Shader): Source[] {
    return shader.tabled ? [this.derived.source(shader)] : [];
  }

  /** Computes a ball's derived values if they need a pass of their own: before the draw that binds them. */
  derive(shader: Shader, values: Values): void {
    if (!shader.tabled || this.derived.row(shader, values)) return;
    const program = this.program(this.derived.source(shader));
    this.derived.draw(shader, values, program, () => this.bind(program, shader, values, 0));
  }

  /**
   * Sets `uniform STRUCT name` from the values and binds the tables from texture unit `unit` on; returns the next
   * free unit. The program must be in use, and the values derived.
   */
  bind(program: Program, shader: Shader, values: Values, unit: number, name = "material"): number {
    const gl = this.gl;
    const location = program.uniform("derived_table");
    if (location) {
      const row = this.derived.row(shader, values);
      if (!row) throw new Error(`${shader.manifest.title} was not derived before it was drawn.`);
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

  private table(shader: Shader, uniform: string): WebGLTexture {
    const table = shader.manifest.textures.find((t) => t.uniform === uniform);
    const data = shader.variant.tables[uniform];
    if (!table || data === undefined) throw new Error(`${shader.manifest.title} needs the table '${uniform}', which the page lacks.`);
    return this.texture(`${shader.key}/${uniform}`, table.dimension === 3 ? table.size : table.size.slice(0, 2), table.channels, data);
  }

  /** A table as a texture: float32, nearest, since the shader fetches texels and interpolates them itself. */
  private texture(key: string, size: number[], channels: 1 | 2 | 4, data: string): WebGLTexture {
    const known = this.textures.get(key);
    if (known) return known;
    const gl = this.gl;
    const texture = gl.createTexture();
    const target = size.length === 3 ? gl.TEXTURE_3D : gl.TEXTURE_2D;
    const [internal, format] = { 1: [gl.R32F, gl.RED], 2: [gl.RG32F, gl.RG], 4: [gl.RGBA32F, gl.RGBA] }[channels] as [number, number];
    const [width, height, depth] = size as [number, number, number];
    const floats = decodeFloats(data);
    gl.bindTexture(target, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    if (size.length === 3) gl.texImage3D(target, 0, internal, width, height, depth, 0, format, gl.FLOAT, floats);
    else gl.texImage2D(target, 0, internal, width, height, 0, format, gl.FLOAT, floats);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(target, wrap, gl.CLAMP_TO_EDGE);
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.textures.set(key, texture);
    return texture;
  }
}

/** A field's value for these parameter values. An angle's field is (cos, sin); its value in the state is the angle. */
export function fieldValue(field: Field, manifest: Manifest, values: Values): number[] {
  const value = values[field.path];
  if (value === undefined) return [field.value].flat();
  const kind = manifest.parameters.find((p) => p.path === field.path)?.kind;
  if (kind === "angle" && typeof value === "number") return [Math.cos(value), Math.sin(value)];
  const size = { float: 1, vec2: 2, vec3: 3 }[field.type];
  if (typeof value === "number" && Number.isFinite(value)) return Array<number>(size).fill(value);
  // Links are untrusted: values that do not fit are ignored.
  return Array.isArray(value) && value.length === size && value.every(Number.isFinite) ? value : [field.value].flat();
}

function setField(gl: WebGL2RenderingContext, location: WebGLUniformLocation, field: Field, value: number[]): void {
  if (field.type === "float") gl.uniform1f(location, value[0] as number);
  else if (field.type === "vec2") gl.uniform2fv(location, value);
  else gl.uniform3fv(location, value);
}
