/**
 * What the Python side writes into the page: models as shader text with their declarations, the scene, the display.
 *
 * Units and frames: world right-handed, y up; directions point away from the surface, toward the light; angles in
 * radians except the vertical field of view (degrees); radiance, irradiance and intensity are linear RGB.
 */

export type Value = number | number[] | string | boolean;
/** Values by parameter path, e.g. {"base.alpha": [0.04, 0.04]}: only those that differ from the declared ones. */
export type Values = Record<string, Value>;
export type Choices = Record<string, string | boolean>;
export type Rgb = [number, number, number];
export type Vec3 = [number, number, number];

export type FieldType = "float" | "vec2" | "vec3";

export interface Field {
  name: string;
  path: string;
  type: FieldType;
  value: number | number[];
}

export interface Parameter {
  path: string;
  kind: "float" | "spectrum" | "alpha" | "angle" | "choice" | "flag";
  value: Value;
  default: Value;
  low: number | null;
  high: number | null;
  unit: string;
  doc: string;
  symbol: string;
  choices?: Record<string, string> | null;
  /**
   * The struct's field of this parameter; null for choices and flags, which select a variant of the code, and for a
   * weight that this variant was written without.
   */
  field: string | null;
  /** The value of a weight at which its part vanishes; null if there is none. */
  off: number | null;
  /** Whether tables depend on its value: another value needs another variant. */
  fixed: boolean;
}

export interface TableTexture {
  uniform: string;
  dimension: 2 | 3;
  size: number[];
  channels: 1 | 2 | 4;
  file: string;
  /** Quantities along x, y and z, and the quantity in a texel, where known. */
  axes?: string[];
  doc?: string;
}

export type FunctionName = "eval" | "pdf" | "sample" | "terms" | "derive";

export interface Manifest {
  version: number;
  lang: string;
  model: string;
  title: string;
  doc: string;
  struct: string;
  fields: Field[];
  derived: null | { struct: string; fields: { name: string; type: FieldType }[] };
  functions: Partial<Record<FunctionName, string>>;
  terms?: { name: string; type: "float" | "vec3"; doc: string }[];
  parameters: Parameter[];
  textures: TableTexture[];
  transmits: boolean;
  delta: "never" | "maybe" | "always";
  stochastic: boolean;
  isotropic: boolean;
}

export interface Variant {
  /** Equal keys imply equal text and tables. */
  key: string;
  choices: Choices;
  /** Weights that the variant was written without: it fits balls at which they are off. */
  off: string[];
  /** Values that its tables were computed from: it fits balls with these values. */
  fixed: Record<string, number | number[]>;
  /** Distribution and masking of the microfacets that reflect; null if there are none. */
  facets: [string, string] | null;
  manifest: Manifest;
  text: string;
  /** Uniform name to little-endian float32 in base64, x fastest, channels last. */
  tables: Record<string, string>;
}

/** A and B of the split sum of a microfacet model, over mu (x) and roughness (y), at texel centers. */
export interface SplitSum {
  facets: [string, string];
  size: [number, number];
  channels: 2;
  data: string;
}

export interface Preset {
  name: string;
  set: Values;
  /** Reflectance at normal incidence, linear. */
  f0?: Rgb;
}

export interface Material {
  id: string;
  title: string;
  presets: Preset[];
  variants: Variant[];
}

export interface Ball {
  label: string;
  set: Values;
}

export interface Row {
  label: string;
  material: string;
  balls: Ball[];
}

export interface EnvironmentImage {
  width: number;
  height: number;
  /** Base64 float16 RGBA, top row first, or "studio", which the page computes; a light that refers to an uploaded picture has its key instead. */
  data: string | null;
}

export interface DirectionalLight {
  type: "directional";
  direction: Vec3;
  irradiance: Rgb;
}
export interface PointLight {
  type: "point";
  position: Vec3;
  intensity: Rgb;
}
export interface AreaLight {
  type: "area";
  center: Vec3;
  u: Vec3;
  v: Vec3;
  radiance: Rgb;
}
export interface EnvironmentLight {
  type: "environment";
  image: EnvironmentImage | null;
  constant: Rgb;
  rotation: number;
  scale: number;
}
export type SceneLight = DirectionalLight | PointLight | AreaLight | EnvironmentLight;

export interface Camera {
  target: Vec3;
  distance: number;
  azimuth: number;
  elevation: number;
  fov: number;
}

export type Tone = "none" | "reinhard" | "filmic";

export interface PageData {
  version: number;
  title: string;
  mode: "export" | "live";
  socket: string | null;
  /** How often the materials were reloaded since the server started, each time because the user's file was saved. */
  revision: number;
  materials: Material[];
  scene: { rows: Row[]; lights: SceneLight[]; camera: Camera; spacing: number; mesh: string };
  display: { tone: Tone; exposure: number };
  /** Notes for the reader of this scene, one line each. */
  notes?: string[];
  dfg: SplitSum[];
}

/** Reads the JSON that page.py wrote into the document. */
export function readPageData(): PageData {
  const element = document.getElementById("gonio-data");
  if (!element?.textContent) throw new Error("This page is the template without data. Make a page with: gonio view MODEL --export page.html");
  const data = JSON.parse(element.textContent) as PageData;
  if (data.version !== 1) throw new Error(`The page data has version ${data.version}; this script reads version 1.`);
  return data;
}

export function decodeBase64(text: string): Uint8Array {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/** Float32 from base64; the page's numbers are little-endian, as are all machines that run browsers today. */
export function decodeFloats(text: string): Float32Array {
  return new Float32Array(decodeBase64(text).buffer as ArrayBuffer);
}
