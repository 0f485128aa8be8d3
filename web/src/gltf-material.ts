/** The parameters of a glTF file's material, converted to those of the page's models. */
import type { PageApp } from "./app";
import type { Parameter, Value, Values } from "./data";
import * as edits from "./edits";
import { isNumeric } from "./shaders";

export interface Factors {
  name: string;
  base: [number, number, number];
  metallic: number;
  roughness: number;
  index: number;
  transmission: number;
  clearcoat: number;
  clearcoatRoughness: number;
  /** Whether textures vary some of it, which the page ignores. */
  pictured: boolean;
}

type Json = Record<string, unknown>;

const member = (of: unknown, key: string): Json => {
  const nested = (of as Json | undefined)?.[key];
  return typeof nested === "object" && nested !== null ? (nested as Json) : {};
};
const share = (value: unknown, otherwise: number): number =>
  typeof value === "number" && Number.isFinite(value) ? Math.min(Math.max(value, 0), 1) : otherwise;

/** The material of the file's first mesh, else its first material; null if it has none or is not glTF. */
export function readFactors(bytes: Uint8Array): Factors | null {
  let file: Json;
  try {
    file = JSON.parse(new TextDecoder().decode(jsonOf(bytes))) as Json;
  } catch {
    return null;
  }
  const list = (key: string) => (Array.isArray(file[key]) ? (file[key] as Json[]) : []);
  const primitives = list("meshes").flatMap((mesh) => (Array.isArray(mesh?.primitives) ? (mesh.primitives as Json[]) : []));
  const index = primitives.map((primitive) => primitive?.material).find((i) => typeof i === "number") ?? 0;
  const material = list("materials")[index as number];
  if (!material) return null;
  const pbr = member(material, "pbrMetallicRoughness");
  const extension = (name: string) => member(member(material, "extensions"), `KHR_materials_${name}`);
  const color = Array.isArray(pbr.baseColorFactor) ? (pbr.baseColorFactor as unknown[]) : [];
  const ior = extension("ior").ior;
  const coat = extension("clearcoat");
  return {
    name: typeof material.name === "string" ? material.name.slice(0, 60) : "",
    base: [share(color[0], 1), share(color[1], 1), share(color[2], 1)],
    metallic: share(pbr.metallicFactor, 1),
    roughness: share(pbr.roughnessFactor, 1),
    index: typeof ior === "number" && ior >= 1 && ior <= 3 ? ior : 1.5,
    transmission: share(extension("transmission").transmissionFactor, 0),
    clearcoat: share(coat.clearcoatFactor, 0),
    clearcoatRoughness: share(coat.clearcoatRoughnessFactor, 0),
    pictured: "baseColorTexture" in pbr || "metallicRoughnessTexture" in pbr,
  };
}

function jsonOf(bytes: Uint8Array): Uint8Array {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  // "glTF", version, length; length of the first chunk, which is JSON, and its kind
  return bytes.byteLength >= 20 && view.getUint32(0, true) === 0x46546c67 ? bytes.subarray(20, 20 + view.getUint32(12, true)) : bytes;
}

/** A model's parameters by name; parameters that glTF lacks keep their values. */
const WORDS: Record<string, (f: Factors) => Values> = {
  openpbr: (f) => ({
    base_color: f.base,
    base_metalness: f.metallic,
    specular_roughness: f.roughness,
    specular_ior: f.index,
    transmission_weight: f.transmission,
    coat_weight: f.clearcoat,
    coat_roughness: f.clearcoatRoughness,
  }),
  disney: (f) => ({
    base_color: f.base,
    metallic: f.metallic,
    roughness: f.roughness,
    specular: Math.min(((f.index - 1) / (f.index + 1)) ** 2 / 0.08, 1),
    clearcoat: f.clearcoat,
    clearcoat_gloss: 1 - f.clearcoatRoughness,
  }),
  metal: (f) => ({ r0: f.base, alpha: f.roughness ** 2 }),
  conductor: (f) => {
    const roots = f.base.map((r) => Math.sqrt(Math.min(r, 0.999)));
    return { eta: roots.map((r) => (1 + r) / (1 - r)), k: [0, 0, 0], alpha: f.roughness ** 2 };
  },
  coat: (f) => ({ albedo: f.base, index: f.index, alpha: f.roughness ** 2 }),
  dielectric: (f) => ({ eta: f.index, alpha: f.roughness ** 2 }),
  "thin-dielectric": (f) => ({ eta: f.index }),
  lambert: (f) => ({ albedo: f.base }),
  "oren-nayar": (f) => ({ albedo: f.base }),
  eon: (f) => ({ albedo: f.base }),
};

/** The models that fit, the best first. */
function fitting(f: Factors): string[] {
  if (f.metallic >= 0.5) return ["openpbr", "disney", "metal", "conductor"];
  if (f.transmission >= 0.5) return ["openpbr", "dielectric", "thin-dielectric"];
  return ["openpbr", "disney", "coat", "lambert", "eon", "oren-nayar"];
}

/** Applies the parameters to the selected ball, by its own model or another of the page; returns a report of one line. */
export function applyFactors(app: PageApp, factors: Factors): string {
  const { slot } = app.state.selection;
  const called = factors.name ? `its material "${factors.name}"` : "its material";
  const here = app.state.slots[slot]?.material;
  const known = app.data.materials.map(({ id, title, variants }) => ({ id, title, model: innermost(variants[0]?.manifest.parameters ?? [], variants[0]?.manifest.model ?? "") }));
  const fit = fitting(factors)
    .flatMap((name) => known.filter(({ model }) => model === name))
    .sort((a, b) => Number(b.id === here) - Number(a.id === here))[0];
  if (!fit) return `the page has no model for ${called}.`;
  if (fit.id !== here) edits.setMaterial(app, slot, fit.id);
  const words = (WORDS[fit.model] as (f: Factors) => Values)(factors);
  const set: Record<string, Value> = {};
  for (const parameter of app.shaders.at(app.shaders.material(fit.id), 0).manifest.parameters) {
    const value = words[edits.bare(parameter.path)];
    if (isNumeric(parameter) && value !== undefined) set[parameter.path] = spread(parameter.kind, value);
  }
  edits.setBall(app, slot, set, factors.name || fit.title);
  return `${called} is applied as ${fit.title} to the selected ball${factors.pictured ? ", without its textures" : ""}.`;
}

/** A compensated metal contains its metal as "base": it is identified by its base's parameters. */
const innermost = (parameters: readonly { path: string }[], model: string): string =>
  model in WORDS ? model : parameters.some(({ path }) => path === "base.eta") && parameters.some(({ path }) => path === "base.k") ? "conductor" : model;

/** A single number applies to every component of the parameter. */
const spread = (kind: Parameter["kind"], value: Value): Value => {
  const count = { alpha: 2, spectrum: 3 }[kind as string];
  return count && typeof value === "number" ? Array.from({ length: count }, () => value) : value;
};
