/** From linear radiance to the screen: exposure, tone curve, sRGB; in a separate pass over the sums. */
import type { Tone } from "./data";
import { HEADER, link, type Program } from "./programs";

export const TONES: Record<Tone, { index: number; doc: string }> = {
  none: { index: 0, doc: "Clipped at 1, then sRGB." },
  reinhard: { index: 1, doc: "x / (1 + x), per channel, then sRGB." },
  filmic: { index: 2, doc: "Fit of the ACES curve (Narkowicz 2016), then sRGB." },
};

/** `vec3 tone_mapped(vec3 linear, int curve)` and `vec3 srgb(vec3)`, for all programs that draw to the screen. */
export const TONE_GLSL = `
vec3 srgb(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(max(c, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
vec3 tone_mapped(vec3 c, int curve) {
  c = max(c, vec3(0.0));
  if (curve == 1) c = c / (1.0 + c);
  if (curve == 2) c = c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14);
  return srgb(c);
}
`;

/**
 * `page_finite(vec3)` and `page_broken(vec3)`: a NaN, which replaces all values that are not finite in a picture.
 * The tests are of bits, since compilers may assume that no value is NaN.
 */
export const BROKEN_GLSL = `
bool page_finite(vec3 v) {
  return all(notEqual(floatBitsToUint(v) & uvec3(0x7f800000u), uvec3(0x7f800000u)));
}
bool page_broken(vec3 v) {
  return any(greaterThan(floatBitsToUint(v) & uvec3(0x7fffffffu), uvec3(0x7f800000u)));
}
`;

/** The pattern that marks values that are not finite. */
export const CHECKER_GLSL = `
vec3 page_checker() {
  ivec2 cell = ivec2(gl_FragCoord.xy) / 6;
  return ((cell.x + cell.y) & 1) == 0 ? vec3(1.0, 0.0, 0.8) : vec3(0.0);
}
`;

export const FULLSCREEN_VERTEX = `${HEADER}
void main() { gl_Position = vec4(4.0 * float(gl_VertexID & 1) - 1.0, 4.0 * float(gl_VertexID >> 1) - 1.0, 0.0, 1.0); }
`;

/** Boxes of balls that are known to be black by a fault. */
export const MAX_BLACK = 64;

const FRAGMENT = `${HEADER}${TONE_GLSL}${BROKEN_GLSL}${CHECKER_GLSL}
uniform sampler2D picture;      // sums
uniform sampler2D early;        // first samples, used while there are few: see renderer.ts
uniform float samples, early_share, exposure;
uniform int curve;
uniform bool has_sign;          // a difference: negative values are blue, positive ones orange
uniform vec3 theme;             // color behind the balls, sRGB
uniform bool in_environment;
uniform sampler2D environment_map;
uniform float has_map, environment_scale, environment_rotation;
uniform vec3 environment_constant, right, up, back;
uniform vec2 half_size, size;
uniform bool has_broken;        // values that are not finite: each is enlarged to be visible
uniform int black_count;
uniform vec4 black_boxes[${MAX_BLACK}];
out vec4 color;

bool wrong(vec2 position) {
  ivec2 pixels = textureSize(picture, 0);
  ivec2 at = ivec2(position * vec2(pixels));
  int reach = has_broken ? 2 : 0;
  for (int y = -reach; y <= reach; y++)
    for (int x = -reach; x <= reach; x++)
      if (page_broken(texelFetch(picture, clamp(at + ivec2(x, y), ivec2(0), pixels - 1), 0).rgb)) return true;
  vec2 p = 2.0 * position - 1.0;
  for (int i = 0; i < black_count; i++)
    if (all(greaterThan(p, black_boxes[i].xy)) && all(lessThan(p, black_boxes[i].zw))) return texelFetch(picture, at, 0).a > 0.0;
  return false;
}

vec3 behind(vec2 p) {
  if (has_map < 0.5) return environment_constant * environment_scale;
  vec3 d = normalize(right * p.x * half_size.x + up * p.y * half_size.y - back);
  float angle = atan(d.x, d.z) - environment_rotation;
  vec2 uv = vec2(angle * 0.15915494309189535, acos(clamp(d.y, -1.0, 1.0)) * 0.3183098861837907);
  return textureLod(environment_map, uv, 0.0).rgb * environment_scale;
}

void main() {
  vec2 position = gl_FragCoord.xy / size;
  if (wrong(position)) {
    color = vec4(page_checker(), 1.0);
    return;
  }
  vec4 sum = texture(picture, position) / samples;
  if (has_sign) {
    float value = dot(sum.rgb, vec3(1.0 / 3.0)) / max(sum.a, 1e-6) * exposure;
    vec3 hue = value >= 0.0 ? vec3(1.0, 0.55, 0.15) : vec3(0.2, 0.5, 1.0);
    color = vec4(mix(theme, srgb(hue * min(abs(value), 1.0)), sum.a), 1.0);
    return;
  }
  vec4 both = sum * samples + early_share * texture(early, position);
  vec3 mean = both.rgb / max(both.a, 1e-6);
  if (in_environment) {
    vec3 light = mean * sum.a + (1.0 - min(sum.a, 1.0)) * behind(2.0 * position - 1.0);
    color = vec4(tone_mapped(light * exposure, curve), 1.0);
    return;
  }
  // The theme's color is not light: it is mixed in after the tone curve, so that rims stay smooth.
  vec3 ball = tone_mapped(mean * exposure, curve);
  color = vec4(mix(theme, ball, min(sum.a, 1.0)), 1.0);
}
`;

let program: Program | null = null;
export function displayProgram(gl: WebGL2RenderingContext): Program {
  program ??= link(gl, "display", FULLSCREEN_VERTEX, FRAGMENT);
  return program;
}
