/** Shaders that compute tables from an environment and a material's own sampling: the albedo and the blurred picture. */
import { derivedIn } from "./derived";
import { ENVIRONMENT, RANDOM, materialText } from "./glsl";
import { HEADER } from "./programs";
import type { Shader } from "./shaders";

/**
 * Covers the target once per sample: one draw of as many instances adds them up. No shader has a loop around a
 * material, which takes software renderers minutes to compile.
 */
export const SAMPLES_VERTEX = `${HEADER}
flat out int index;
void main() {
  index = gl_InstanceID;
  gl_Position = vec4(4.0 * float(gl_VertexID & 1) - 1.0, 4.0 * float(gl_VertexID >> 1) - 1.0, 0.0, 1.0);
}
`;

// R3 (Roberts 2018) from a start
const POINT = "fract(START + float(index) * vec3(0.8191725133961645, 0.6710436067037893, 0.5497004779019703))";

/** E(mu) of a ball, by the material's own sampling: rows of the albedo table. */
export function albedoText(shader: Shader): string {
  const { text, call } = materialText(shader);
  const derived = derivedIn(shader, false);
  return `${HEADER}${text}${derived.declarations}
uniform vec3 random_point;   // differs per pass
uniform float width;
flat in int index;
layout(location = 0) out vec4 color;
void main() {
${derived.body}  float t = gl_FragCoord.x / width;
  float mu = t * t;
  vec3 wo = vec3(sqrt(max(1.0 - mu * mu, 0.0)), 0.0, mu);
  vec3 u = ${POINT.replace("START", "random_point")};
  color = vec4(${call("sample", "wo, u")}.weight, 1.0);
}
`;
}

/** One level of the prefiltered environment, at normal incidence, along the lobe, with normalized weights. */
export function prefilterText(shader: Shader): string {
  const { text, call } = materialText(shader);
  const derived = derivedIn(shader, false);
  return `${HEADER}${text}${derived.declarations}${RANDOM}${ENVIRONMENT}
uniform vec2 size;
uniform float points;   // over all passes
flat in int index;
layout(location = 0) out vec4 color;
void main() {
${derived.body}  vec2 uv = gl_FragCoord.xy / size;
  float p = 6.283185307179586 * uv.x + environment_rotation, theta = 3.141592653589793 * uv.y;
  vec3 n = vec3(sin(theta) * sin(p), cos(theta), sin(theta) * cos(p));
  vec3 t = normalize(abs(n.y) < 0.99 ? vec3(n.z, 0.0, -n.x) : vec3(1.0, 0.0, 0.0) - n.x * n);
  mat3 frame = mat3(t, cross(n, t), n);
  vec3 u = ${POINT.replace("START", "random_point + page_shift(uvec2(gl_FragCoord.xy), 11u)")};
  Sample s = ${call("sample", "vec3(0.0, 0.0, 1.0), u")};
  float weight = dot(s.weight, vec3(1.0 / 3.0));
  // The mip level whose texel has the sample's solid angle (Krivanek and Colbert 2008): otherwise few samples would
  // hit a small sun and leave blotches.
  float share = 1.0 / (points * max(s.pdf, 1e-6));
  vec2 texels = vec2(textureSize(environment_map, 0));
  float lod = s.delta ? 0.0 : max(0.0, 0.5 * log2(share * texels.x * texels.y / 12.566370614359172) + 0.5);
  color = weight > 0.0 ? weight * vec4(textureLod(environment_map, environment_uv(frame * s.wi), lod).rgb, 1.0) : vec4(0.0);
}
`;
}
