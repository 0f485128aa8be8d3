// Materials that gonio emits in GLSL, in three.js.
import {
  Data3DTexture, DataTexture, FloatType, NearestFilter, RedFormat, RGFormat, RGBAFormat, ShaderLib, ShaderMaterial,
  UniformsLib, UniformsUtils, Vector2, Vector3,
} from "three";
import { fieldOf, fields, read } from "./bundle.js";

const FORMATS = { 1: RedFormat, 2: RGFormat, 4: RGBAFormat };
const held = new WeakMap(); // of a material: its bundle, and the struct that is its uniform

/**
 * Read a folder that `gonio emit MATERIAL --prefix g_ -o DIR/` wrote. Its materials share the textures.
 * @param {string} url address of the folder
 * @param {string} [model] the material's name, where the folder holds several
 */
export async function load(url, model) {
  const bundle = await read(url, "glsl", model);
  if (bundle.manifest.struct === bundle.manifest.title) {
    throw new Error(`${url}: its names are also names of three.js, such as PI: write it by gonio emit --prefix g_`);
  }
  const textures = bundle.manifest.textures.map((texture) => [texture.uniform, table(texture, bundle.tables)]);
  return { ...bundle, textures: Object.fromEntries(textures) };
}

function table({ uniform, dimension, size, channels }, tables) {
  const texture = new (dimension === 3 ? Data3DTexture : DataTexture)(tables[uniform], ...size);
  const filters = { minFilter: NearestFilter, magFilter: NearestFilter, unpackAlignment: 4 };
  return Object.assign(texture, { format: FORMATS[channels], type: FloatType, ...filters, needsUpdate: true });
}

/**
 * A ShaderMaterial lit by three's directional, point, spot and sun lights, with their shadows, and by nothing else.
 * @param {object} bundle from `load`
 * @param {Object<string, number | number[]>} [values] by the parameter's path; others are the bundle's
 * @param {{tangents?: boolean}} [options] tangents: the geometry has the attribute `tangent`
 */
export function material(bundle, values = {}, { tangents = false } = {}) {
  const own = uniforms(bundle, values);
  const made = new ShaderMaterial({
    name: bundle.manifest.title,
    defines: defines(tangents),
    uniforms: { ...UniformsUtils.clone(UniformsLib.lights), ...UniformsUtils.clone(UniformsLib.fog), ...own },
    vertexShader: ShaderLib.physical.vertexShader,
    fragmentShader: fragment(bundle),
    lights: true,
    fog: true,
  });
  held.set(made, { manifest: bundle.manifest, struct: own.gonio_values.value });
  return made;
}

/**
 * Replace the BRDF of a MeshPhysicalMaterial (or MeshStandardMaterial) under punctual lights; all else stays three's.
 * @param {MeshPhysicalMaterial} physical is changed
 * @param {object} bundle from `load`
 * @param {Object<string, number | number[]>} [values] by the parameter's path; others are the bundle's
 * @param {{tangents?: boolean, fields?: Object<string, string>}} [options]
 *   fields: GLSL expressions, by the parameter's path, that replace its field in every pixel. They may read three's
 *   variables, which hold its maps: `{ albedo: "diffuseColor.rgb", alpha: "vec2(roughnessFactor * roughnessFactor)" }`
 * @returns the same material
 */
export function patch(physical, bundle, values = {}, { tangents = false, fields: expressions = {} } = {}) {
  const own = uniforms(bundle, values);
  Object.assign((physical.defines ??= {}), defines(tangents));
  const assigned = Object.entries(expressions).map(([path, expression]) => {
    return `gonio_self.${fieldOf(bundle.manifest, path).name} = ${expression};`;
  });
  physical.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, own);
    const after = "#include <lights_physical_pars_fragment>";
    const before = "#include <lights_fragment_begin>";
    shader.fragmentShader = shader.fragmentShader
      .replace(after, () => `${after}\n${declarations(bundle)}`)
      .replace(before, () => `${pixel(bundle, assigned)}\n${before}`);
  };
  const key = [bundle.text, ...assigned].join();
  physical.customProgramCacheKey = () => key;
  physical.needsUpdate = true;
  held.set(physical, { manifest: bundle.manifest, struct: own.gonio_values.value });
  return physical;
}

/**
 * Change parameters of a material that `material` or `patch` returned; nothing is compiled again.
 * @param {Material} made
 * @param {Object<string, number | number[]>} values by the parameter's path; others become the bundle's
 */
export function set(made, values) {
  if (!held.has(made)) throw new Error(`${made.name || made.type}: not a material that material or patch returned`);
  const { manifest, struct } = held.get(made);
  Object.assign(struct, vectors(manifest, values));
}

function vectors(manifest, values) {
  const vector = (x) => (x.length === 1 ? x[0] : new (x.length === 2 ? Vector2 : Vector3)(...x));
  return Object.fromEntries(Object.entries(fields(manifest, values)).map(([name, x]) => [name, vector(x)]));
}

function uniforms(bundle, values) {
  const tables = Object.entries(bundle.textures).map(([name, value]) => [name, { value }]);
  return { gonio_values: { value: vectors(bundle.manifest, values) }, ...Object.fromEntries(tables) };
}

const defines = (tangents) => ({ USE_UV: "", ...(tangents ? { USE_TANGENT: "" } : {}) });

// The frame of a pixel: three's normal after its maps; x along the tangent or, without, along dP/du.
const FRAME = `
mat3 gonio_frame(vec3 n) {
  #ifdef USE_TANGENT
    vec3 t = vTangent, b = vBitangent;
  #else
    vec3 px = dFdx(-vViewPosition), py = dFdy(-vViewPosition);
    vec2 x = dFdx(vUv), y = dFdy(vUv);
    float turned = x.x * y.y - x.y * y.x < 0.0 ? -1.0 : 1.0;
    vec3 t = turned * (px * y.y - py * x.y), b = turned * (py * x.x - px * y.x);
  #endif
  t -= n * dot(n, t);
  if (dot(t, t) == 0.0) t = abs(n.x) < 0.5 ? cross(n, vec3(1.0, 0.0, 0.0)) : cross(n, vec3(0.0, 1.0, 0.0));
  t = normalize(t);
  vec3 right = cross(n, t);
  return mat3(t, dot(right, b) < 0.0 ? -right : right, n);
}
`;

// Struct and functions of the bundle, and the macro by which three's lights call them; `eval` holds the cosine.
function declarations({ manifest, text }) {
  const { struct, derived, functions } = manifest;
  const self = derived ? "gonio_self, gonio_derived" : "gonio_self";
  const local = (w) => `(gonio_to_local * ${w})`;
  return `${text}
uniform ${struct} gonio_values;
${struct} gonio_self;
${derived ? `${derived.struct} gonio_derived;` : ""}
mat3 gonio_to_local;
${FRAME}
#undef RE_Direct
#define RE_Direct(light, at, n, view, coat, three, result) \\
  (result.directSpecular += light.color * ${functions.eval}(${self}, ${local("view")}, ${local("light.direction")}))
`;
}

// What is computed once per pixel, for all lights.
function pixel({ manifest: { derived, functions } }, assigned = []) {
  return `gonio_to_local = transpose(gonio_frame(normal));
gonio_self = gonio_values;
${assigned.join("\n")}
${derived ? `gonio_derived = ${functions.derive}(gonio_self);` : ""}`;
}

const fragment = (bundle) => `
varying vec3 vViewPosition;
#include <common>
#include <uv_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <shadowmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
${declarations(bundle)}
void main() {
  #include <clipping_planes_fragment>
  #include <logdepthbuf_fragment>
  #include <normal_fragment_begin>
  ${pixel(bundle)}
  ReflectedLight reflectedLight = ReflectedLight(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
  #include <lights_fragment_begin>
  gl_FragColor = vec4(reflectedLight.directSpecular, 1.0);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
  #include <fog_fragment>
}
`;
