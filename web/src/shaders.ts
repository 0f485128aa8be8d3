/**
 * The emitted shaders of the page's materials: which one a slot uses, its program, its uniforms and tables.
 *
 * Nothing here knows a formula. The text, the struct's fields and the table list come from the manifest.
 */
import type { Choices, Field, Manifest, Material, PageData, Parameter, SplitSum, Value, Values, Variant } from "./data";
import { decodeFloats } from "./data";
import { DerivedTables, derivesMuch } from "./derived";
import { type Program, Programs, type Source } from "./programs";

export interface Shader {
  /** The variant's: tables are kept by it. */
  key: string;
  /** The same for variants of one text, which differ in their tables: programs are kept by it. */
  code: string;
  material: Material;
  variant: Variant;
  manifest: Manifest;
  text: string;
  /** Whether what it derives stands in a row of texels (`derived.ts`). */
  tabled: boolean;
}

/** Whether a parameter has sliders: a number, also of a layer that this variant was written without. */
export const isNumeric = (parameter: Parameter): boolean => parameter.field !== null || parameter.off !== null;

/** What a variant's choices are: those it was made for, and the model's own for the rest. */
export function variantChoice(variant: Variant, path: string): string | boolean | undefined {
  const own = variant.choices[path];
  return own !== undefined ? own : (variant.manifest.parameters.find((p) => p.path === path)?.value as string | boolean | undefined);
}

/** Whether two numbers, or as many, are the same; one stands for all where the other side has several. */
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

  /** The values of a material that nothing was set of. */
  declared(id: string): Values {
    const parameters = this.material(id).variants[0]?.manifest.parameters ?? [];
    return Object.fromEntries(parameters.filter(isNumeric).map((parameter) => [parameter.path, parameter.value]));
  }

  /**
   * The shortest variant that fits all choices and the values that tables are found from, and has the weights that are
   * on, or null where the page lacks it (a live page asks the server for it).
   */
  find(id: string, choices: Choices, values: Values, on: readonly string[] = []): Shader | null {
    const material = this.material(id);
    let found: number | null = null;
    material.variants.forEach((variant, index) => {
      if (!fits(variant, choices, values) || on.some((path) => variant.off.includes(path))) return;
      if (found === null || variant.off.length > (material.variants[found] as Variant).off.length) found = index;
    });
    return found === null ? null : this.at(material, found);
  }

  at(material: Material, index: number): Shader {
    const variant = material.variants[index] as Variant;
    const { key, manifest, text } = variant;
    if (!this.codes.has(text)) this.codes.set(text, key);
    const code = this.codes.get(text) as string;
    return { key, code, material, variant, manifest, text, tabled: this.tables && derivesMuch(manifest) };
  }

  /** The split sum of a shader's facets, by its own distribution and masking; null where the page has none. */
  splitSum(shader: Shader): SplitSum | null {
    const { facets } = shader.variant;
    return (facets && this.data.dfg.find((table) => table.facets.join() === facets.join())) ?? null;
  }

  /** `splitSum` as a texture. */
  splitSumTexture(shader: Shader): WebGLTexture | null {
    const table = this.splitSum(shader);
    return table && this.texture(`split sum ${table.facets.join()}`, table.size, 2, table.data);
  }

  /** Drops the programs and tables of shaders that the page has no more. */
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

  /** The programs by which `derive` does so: one or none. */
  derivingSources(shader: Shader): Source[] {
    return shader.tabled ? [this.derived.source(shader)] : [];
  }

  /** Computes what follows from a ball's values alone, where that is a pass of its own: before the draw that binds them. */
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
    if (!table || data === undefined) throw new Error(`${shader.manifest.title} needs the table '${uniform}'; the page does not hold it.`);
    return this.texture(`${shader.key}/${uniform}`, table.dimension === 3 ? table.size : table.size.slice(0, 2), table.channels, data);
  }

  /** A table as a texture: float32, nearest, since the shader reads texels and blends them itself. */
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
