/**
 * The shader text around a material: the surface's position, the incident light, the terms to show.
 *
 * No scattering is computed here; the material's functions are called by the names in the manifest.
 */
import type { Manifest } from "./data";
import { derivedIn, derivedOut } from "./derived";
import { BROKEN_GLSL } from "./display";
import { IMPORTANCE_GLSL } from "./importance";
import { HEADER } from "./programs";
import type { Shader } from "./shaders";
import { fitsLoop } from "./size";
import type { Term } from "./state";

export const MAX_LIGHTS = 8;

/** How an environment is integrated; "mapped" is "sampled" with a picture to sample as well. */
export type EnvironmentUse = "none" | "sampled" | "mapped" | "albedo" | "split-sum" | "dfg";

export interface ShadingKey {
  geometry: "sphere" | "mesh";
  /** 0: none; else how many times the lights' code is written (`copies`). */
  lights: number;
  environment: EnvironmentUse;
  /** The integral that is subtracted, to show the difference of two ways. */
  minus: EnvironmentUse;
  term: Term;
}

/** How many times the lights' code is written for this number: once, in a loop, or for each. */
export const copies = (shader: Shader, lights: number): number => (fitsLoop(shader, "eval") ? Math.min(lights, 1) : lights);

/** The material's text, its uniform, and `call("eval", "wo, wi")`, which adds further arguments such as `derived`. */
export function materialText(shader: Shader): { text: string; call: (name: "eval" | "pdf" | "sample" | "terms", rest: string) => string } {
  const { manifest } = shader;
  const extra = manifest.derived ? ", derived" : "";
  return {
    text: `${shader.text}\nuniform ${manifest.struct} material;\n`,
    call: (name, rest) => {
      const named = manifest.functions[name];
      if (!named) throw new Error(`${manifest.title} has no function '${name}'.`);
      return `${named}(material${extra}, ${rest})`;
    },
  };
}

const CAMERA = `
uniform vec3 eye, right, up, back;
uniform vec2 half_size;   // tangents of half the field of view, across and up
uniform vec2 jitter;      // position in the pixel, -1/2 ... 1/2 pixels, in device coordinates
uniform vec3 ball_center;
`;

const DEPTH_RANGE = `
// z toward the viewer, negative in front of the camera; near and far suit balls of radius 1
float page_depth(float z) {
  const float near = 0.05, far = 1000.0;
  return (far + near + 2.0 * far * near / z) / (far - near);
}
`;

/** For the pass that determines the visible surface of a mesh: depth only, with bit-identical positions. */
export const DEPTH_VERTEX = `${HEADER}${CAMERA}${DEPTH_RANGE}
layout(location = 0) in vec3 mesh_position;
invariant gl_Position;
void main() {
  vec3 world = mesh_position + ball_center;
  vec3 d = world - eye;
  vec3 v = vec3(dot(d, right), dot(d, up), dot(d, back));
  gl_Position = vec4(v.xy / half_size + jitter * v.z, -v.z * page_depth(v.z), -v.z);
}
`;
export const DEPTH_FRAGMENT = `${HEADER}out vec4 color;\nvoid main() { color = vec4(0.0); }\n`;

export function vertexText(shader: Shader, geometry: "sphere" | "mesh"): string {
  const out = derivedOut(shader);
  const material = out ? materialText(shader).text : "";
  const { declarations, body } = out ?? { declarations: "", body: "" };
  if (geometry === "sphere")
    return `${HEADER}${material}${CAMERA}${declarations}
uniform vec4 bounds;   // of the ball in the picture, device coordinates
out vec3 ray;
void main() {
${body}  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  vec2 position = mix(bounds.xy, bounds.zw, corner);
  vec2 through = (position + jitter) * half_size;
  ray = right * through.x + up * through.y - back;
  gl_Position = vec4(position, 0.0, 1.0);
}
`;
  return `${HEADER}${material}${CAMERA}${declarations}${DEPTH_RANGE}
layout(location = 0) in vec3 mesh_position;
layout(location = 1) in vec3 mesh_normal;
layout(location = 2) in vec3 mesh_tangent;
invariant gl_Position;
out vec3 world, world_normal, world_tangent;
void main() {
${body}  world = mesh_position + ball_center;
  world_normal = mesh_normal;
  world_tangent = mesh_tangent;
  vec3 d = world - eye;
  vec3 v = vec3(dot(d, right), dot(d, up), dot(d, back));
  gl_Position = vec4(v.xy / half_size + jitter * v.z, -v.z * page_depth(v.z), -v.z);
}
`;
}

export const ENVIRONMENT = `
uniform sampler2D environment_map;
uniform float has_map;
uniform vec3 environment_constant;
uniform float environment_scale, environment_rotation;

vec2 environment_uv(vec3 d) {
  float p = atan(d.x, d.z) - environment_rotation;
  return vec2(p * 0.15915494309189535, acos(clamp(d.y, -1.0, 1.0)) * 0.3183098861837907);
}

vec3 environment_radiance(vec3 d) {
  if (has_map < 0.5) return environment_constant * environment_scale;
  return textureLod(environment_map, environment_uv(d), 0.0).rgb * environment_scale;
}
`;

export const RANDOM = `
uniform vec3 random_point;       // this picture's point of a low-discrepancy sequence
uniform vec2 area_point;

// PCG in three dimensions (Jarzynski and Olano 2020): a shift of the sequence per pixel
vec3 page_shift(uvec2 pixel, uint salt) {
  uvec3 v = uvec3(pixel, salt) * 1664525u + 1013904223u;
  v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
  v ^= v >> 16u;
  v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
  return vec3(v >> 8u) / 16777216.0;
}
`;

const LIGHTS = `
uniform int light_count;
uniform ivec4 light_kind[${MAX_LIGHTS}];   // x: 0 directional, 1 point, 2 area
uniform vec3 light_place[${MAX_LIGHTS}];   // direction, position or center
uniform vec3 light_power[${MAX_LIGHTS}];   // irradiance, intensity or radiance
uniform vec3 light_u[${MAX_LIGHTS}], light_v[${MAX_LIGHTS}];

// What a light contributes at the point: direction toward it, and irradiance at perpendicular incidence.
vec3 page_light_at(int i, vec3 where, out vec3 direction) {
  int kind = light_kind[i].x;
  if (kind == 0) { direction = light_place[i]; return light_power[i]; }
  vec3 to = light_place[i] - where;
  vec3 power = light_power[i];
  if (kind == 2) {
    vec2 s = 2.0 * fract(area_point + page_shift(uvec2(gl_FragCoord.xy), uint(i) + 7u).xy) - 1.0;
    to += s.x * light_u[i] + s.y * light_v[i];
    // both sides shine; area = 4 |u x v|, cosine at the light = |to . (u x v)| / (|to| |u x v|)
    power *= 4.0 * abs(dot(to, cross(light_u[i], light_v[i]))) / max(length(to), 1e-6);
  }
  float squared = max(dot(to, to), 1e-12);
  direction = to * inversesqrt(squared);
  return power / squared;
}
`;

const ALBEDO = `
uniform sampler2D albedo_table;   // x: sqrt(mu) at texel centers, y: ball; sums over alpha samples
uniform float albedo_row;

vec3 page_albedo(float mu) {
  float width = float(textureSize(albedo_table, 0).x);
  float x = clamp(sqrt(max(mu, 0.0)) * width - 0.5, 0.0, width - 1.0);
  int i = int(min(floor(x), width - 2.0));
  vec4 a = texelFetch(albedo_table, ivec2(i, int(albedo_row)), 0);
  vec4 b = texelFetch(albedo_table, ivec2(i + 1, int(albedo_row)), 0);
  return mix(a.rgb / a.a, b.rgb / b.a, x - float(i));
}
`;

const SPLIT = `
uniform sampler2D prefiltered;    // levels of the environment, sums over alpha samples
uniform float prefiltered_level;

vec3 prefiltered_radiance(vec3 d) {
  vec4 sum = textureLod(prefiltered, environment_uv(d), prefiltered_level);
  return sum.rgb / max(sum.a, 1e-6);
}
`;

const DFG = `
uniform sampler2D dfg_table;      // A, B over mu (x) and roughness (y), at texel centers
uniform float dfg_roughness;

// Scale and bias of the reflectance at normal incidence (Karis2013), bilinear between texel centers
vec2 page_dfg(float mu) {
  vec2 size = vec2(textureSize(dfg_table, 0));
  vec2 at = clamp(vec2(mu, dfg_roughness) * size - 0.5, vec2(0.0), size - 1.0);
  ivec2 i = ivec2(min(floor(at), size - 2.0));
  vec2 t = at - vec2(i);
  vec2 low = mix(texelFetch(dfg_table, i, 0).rg, texelFetch(dfg_table, i + ivec2(1, 0), 0).rg, t.x);
  vec2 high = mix(texelFetch(dfg_table, i + ivec2(0, 1), 0).rg, texelFetch(dfg_table, i + ivec2(1, 1), 0).rg, t.x);
  return mix(low, high, t.y);
}
`;

/** The part of the scattering that a term shows, in place of eval's value: expression over `wo` and `wi`. */
function scattered(shader: Shader, term: Term): string {
  const { call } = materialText(shader);
  const has = (name: string) => shader.manifest.terms?.some((t) => t.name === name) ?? false;
  if (term === "single") return has("single") ? `${call("terms", "wo, wi")}.single` : call("eval", "wo, wi");
  if (term === "multi") return has("multi") ? `${call("terms", "wo, wi")}.multi` : "vec3(0.0)";
  if (term === "difference") return has("single") ? `${call("eval", "wo, wi")} - ${call("terms", "wo, wi")}.single` : "vec3(0.0)";
  return call("eval", "wo, wi");
}

/** D, G and F are functions of a half vector rather than light: the page shows their values. */
export const isFactor = (term: Term): term is "D" | "G" | "F" => term === "D" || term === "G" || term === "F";

/** Differences, which may be negative. */
export const isSigned = (term: Term): boolean => term === "difference" || term === "split-error";

/** Terms that cover the whole scattering of a material. */
export const isWhole = (term: Term): boolean => ["full", "compensated", "rows", "split", "split-error"].includes(term);

/**
 * Whether the split sum is valid for a material: one isotropic microfacet lobe about the mirror direction. For
 * transmitted light, or a lobe about the normal, the lookup would be in the wrong place.
 */
export const splits = (manifest: Manifest): boolean =>
  manifest.isotropic && !manifest.stochastic && !manifest.transmits && Boolean(manifest.functions.terms && manifest.terms?.some((t) => t.name === "D"));

export function hasTerm(manifest: Manifest, term: Term): boolean {
  if (term === "split" || term === "split-error") return splits(manifest);
  if (isWhole(term)) return true;
  const name = term === "difference" ? "single" : term;
  return Boolean(manifest.functions.terms && manifest.terms?.some((t) => t.name === name));
}

/** Statements that add an environment's contribution by one way of integrating it, or subtract it. */
function environmentBody(shader: Shader, use: EnvironmentUse, term: Term, add: "+=" | "-="): string[] {
  if (use === "none") return [];
  const { call } = materialText(shader);
  const split = (reflectance: string) => ["  {", "    vec3 mirrored = frame * vec3(-wo.xy, wo.z);", `    radiance ${add} ${reflectance} * prefiltered_radiance(mirrored) * environment_scale;`, "  }"];
  if (use === "albedo") return [`  radiance ${add} page_albedo(wo.z) * environment_constant * environment_scale;`];
  if (use === "split-sum") return split("page_albedo(wo.z)");
  if (use === "dfg") {
    const straight = `${call("terms", "vec3(0.0, 0.0, 1.0), vec3(0.0, 0.0, 1.0)")}.F`;
    return ["  vec2 scale_bias = page_dfg(wo.z);", ...split(`(${straight} * scale_bias.x + scale_bias.y)`)];
  }
  const mapped = use === "mapped";
  const weight = isWhole(term) ? "s.weight" : `s.pdf > 0.0 && !s.delta ? (${scattered(shader, term)}) / s.pdf : vec3(0.0)`;
  const body = [
    "  {",
    "    vec3 u = fract(random_point + page_shift(uvec2(gl_FragCoord.xy), 3u));",
    `    Sample s = ${call("sample", "wo, u")};`,
    "    vec3 wi = s.wi;",
    `    vec3 weight = ${weight};`,
    // A rejected sample has weight 0 and an arbitrary direction.
    "    if (any(notEqual(weight, vec3(0.0)))) {",
    "      vec3 d = normalize(frame * wi);",
    // Both ways to sample a direction, by the picture and by the material, are weighted by their densities (Veach1997).
    ...(mapped ? ["      if (!s.delta) weight *= s.pdf / (s.pdf + page_bright_density(d));"] : []),
    `      radiance ${add} weight * environment_radiance(d);`,
    "    }",
  ];
  if (mapped)
    body.push(`    float density;
    vec3 bright = page_bright_direction(fract(area_point + page_shift(uvec2(gl_FragCoord.xy), 5u).xy), density);
    wi = bright * frame;
    vec3 value = ${scattered(shader, term)};
    if (any(greaterThan(abs(value), vec3(0.0)))) radiance ${add} value * environment_radiance(bright) / (density + ${call("pdf", "wo, wi")});`);
  return [...body, "  }"];
}

export function fragmentText(shader: Shader, key: ShadingKey): string {
  const { manifest } = shader;
  const { text, call } = materialText(shader);
  const derived = derivedIn(shader, true);
  const factor = isFactor(key.term);
  const parts = [HEADER, text, BROKEN_GLSL, CAMERA, DEPTH_RANGE, derived.declarations, RANDOM];
  const body: string[] = [];
  if (factor) {
    const known = hasTerm(manifest, key.term);
    parts.push(LIGHTS);
    // Without such a light the half vector is the normal.
    body.push("  vec3 wi = vec3(-wo.xy, wo.z);");
    body.push("  if (light_count > 0) { vec3 d; page_light_at(0, surface, d); wi = d * frame; }");
    if (known) body.push(`  if (wi.z > 0.0 && wo.z > 0.0) radiance = vec3(${call("terms", "wo, wi")}.${key.term});`);
  } else {
    if (key.lights) {
      parts.push(LIGHTS);
      const light = (i: string) => `    vec3 d;
    vec3 irradiance = page_light_at(${i}, surface, d);
    vec3 wi = d * frame;
    radiance += irradiance * (${scattered(shader, key.term)});
  }`;
      if (fitsLoop(shader, "eval")) body.push(`  for (int i = 0; i < light_count; i++) {\n${light("i")}`);
      else for (let i = 0; i < key.lights; i++) body.push(`  {\n${light(String(i))}`);
    }
    const uses = [key.environment, key.minus];
    const any = (...wanted: EnvironmentUse[]) => uses.some((use) => wanted.includes(use));
    if (uses.some((use) => use !== "none")) parts.push(ENVIRONMENT);
    if (any("mapped")) parts.push(IMPORTANCE_GLSL);
    if (any("albedo", "split-sum")) parts.push(ALBEDO);
    if (any("split-sum", "dfg")) parts.push(SPLIT);
    if (any("dfg")) parts.push(DFG);
    body.push(...environmentBody(shader, key.environment, key.term, "+="), ...environmentBody(shader, key.minus, key.term, "-="));
  }
  const place =
    key.geometry === "sphere"
      ? `  // Nearest hit with the unit sphere at the center; from the closest approach, which is more accurate than b^2 - c.
  vec3 toward = normalize(ray);
  vec3 from = eye - ball_center;
  float along = -dot(from, toward);
  vec3 closest = from + along * toward;
  float inside = 1.0 - dot(closest, closest);
  if (inside <= 0.0) discard;
  vec3 n = normalize(closest - sqrt(inside) * toward);
  vec3 surface = ball_center + n;
  vec2 t = vec2(n.z, -n.x);
  vec3 tangent = dot(t, t) > 1e-12 ? normalize(vec3(t.x, 0.0, t.y)) : vec3(1.0, 0.0, 0.0);
  vec3 outward = -toward;
  gl_FragDepth = 0.5 + 0.5 * page_depth(dot(surface - eye, back)) - nearer;`
      : `  vec3 surface = world;
  vec3 n = normalize(world_normal);
  vec3 outward = normalize(eye - surface);
  // Interpolated normals may face away from the viewer at the rim: the visible side is the outside.
  if (dot(n, outward) < 0.0) n = normalize(n - 1.001 * dot(n, outward) * outward);
  vec3 tangent = page_across(world_tangent, n);`;
  const inputs = key.geometry === "sphere" ? "in vec3 ray;\nuniform float draw_gain, draw_cover, nearer;\n" : `in vec3 world, world_normal, world_tangent;
uniform float draw_gain, draw_cover;
vec3 page_across(vec3 t, vec3 n) {
  t -= dot(t, n) * n;
  if (dot(t, t) < 1e-8) t = abs(n.y) < 0.9 ? vec3(n.z, 0.0, -n.x) : vec3(1.0, 0.0, 0.0) - n.x * n;
  return normalize(t);
}
`;
  return `${parts.join("")}${inputs}
layout(location = 0) out vec4 color;
void main() {
${place}
  mat3 frame = mat3(tangent, cross(n, tangent), n);
  vec3 wo = outward * frame;
  vec3 radiance = vec3(0.0);
${derived.body}${body.join("\n")}
  // Values that are not finite are kept in the sum and shown as such: without them it would look like a dark material.
  if (!page_finite(radiance)) radiance = vec3(uintBitsToFloat(0x7fc00000u));
  color = vec4(draw_gain * radiance, draw_cover);
}
`;
}
