/**
 * Importance sampling of an environment: a distribution over its texels, by luminance and solid angle, and the GLSL
 * that samples it. A small sun is found by every sample instead of by one in a hundred.
 */
import { halfToFloat } from "./targets";

export interface Distribution {
  width: number;
  height: number;
  /** Inclusive sums: of each row over its columns, and of the rows in one additional column. */
  sums: Float32Array;
}

/** Fraction of directions that are drawn uniformly: bilinear lookups have light where a texel's mean is dark. */
const EVEN = 0.02;

export function distribution(half: Uint16Array, width: number, height: number): Distribution {
  const floats = halfToFloat(half);
  const step = Math.max(1, Math.ceil(width / 256));
  const [w, h] = [Math.ceil(width / step), Math.ceil(height / step)];
  const weights = new Float64Array(w * h);
  let total = 0;
  for (let y = 0; y < height; y++) {
    const sine = Math.sin((Math.PI * (y + 0.5)) / height);
    for (let x = 0; x < width; x++) {
      const at = 4 * (y * width + x);
      // Rec. 709 luminance
      const weight = sine * (0.2126 * (floats[at] as number) + 0.7152 * (floats[at + 1] as number) + 0.0722 * (floats[at + 2] as number));
      const cell = Math.floor(y / step) * w + Math.floor(x / step);
      weights[cell] = (weights[cell] as number) + weight;
      total += weight;
    }
  }
  const sums = new Float32Array((w + 1) * h);
  const rows = new Float64Array(h);
  for (let y = 0; y < h; y++) {
    const even = (EVEN * Math.max(total, 1e-30) * Math.sin((Math.PI * (y + 0.5)) / h)) / (w * h);
    let sum = 0;
    const running = new Float64Array(w);
    for (let x = 0; x < w; x++) running[x] = sum += (weights[y * w + x] as number) + even;
    for (let x = 0; x < w; x++) sums[y * (w + 1) + x] = x === w - 1 ? 1 : (running[x] as number) / sum;
    rows[y] = sum;
  }
  const all = rows.reduce((a, b) => a + b, 0);
  let below = 0;
  for (let y = 0; y < h; y++) {
    below += rows[y] as number;
    sums[y * (w + 1) + w] = y === h - 1 ? 1 : below / all;
  }
  return { width: w, height: h, sums };
}

export const IMPORTANCE_GLSL = `
uniform sampler2D environment_sums;   // see importance.ts

float page_sum(int i, int row) {      // row < 0: sums of the rows
  if (i < 0) return 0.0;
  int last = textureSize(environment_sums, 0).x - 1;
  return texelFetch(environment_sums, row < 0 ? ivec2(last, i) : ivec2(i, row), 0).r;
}

int page_find(int count, int row, float u) {
  int low = 0, high = count - 1;
  while (low < high) {
    int middle = (low + high) / 2;
    if (page_sum(middle, row) > u) high = middle; else low = middle + 1;
  }
  return low;
}

// 1/sr of a cell with probability (share of the row) x (share of the column), at this elevation
float page_density(float share, ivec2 cells, float v) {
  return share * float(cells.x * cells.y) / (19.739208802178716 * max(sin(3.141592653589793 * v), 1e-6));
}

vec3 page_bright_direction(vec2 u, out float density) {
  ivec2 cells = textureSize(environment_sums, 0) - ivec2(1, 0);
  int y = page_find(cells.y, -1, u.y);
  float y0 = page_sum(y - 1, -1), y1 = page_sum(y, -1);
  int x = page_find(cells.x, y, u.x);
  float x0 = page_sum(x - 1, y), x1 = page_sum(x, y);
  vec2 uv = (vec2(x, y) + vec2((u.x - x0) / max(x1 - x0, 1e-12), (u.y - y0) / max(y1 - y0, 1e-12))) / vec2(cells);
  density = page_density((x1 - x0) * (y1 - y0), cells, uv.y);
  float p = 6.283185307179586 * uv.x + environment_rotation, theta = 3.141592653589793 * uv.y;
  return vec3(sin(theta) * sin(p), cos(theta), sin(theta) * cos(p));
}

float page_bright_density(vec3 d) {
  ivec2 cells = textureSize(environment_sums, 0) - ivec2(1, 0);
  vec2 uv = environment_uv(d);
  uv.x = fract(uv.x);
  ivec2 i = min(ivec2(uv * vec2(cells)), cells - 1);
  float share = (page_sum(i.x, i.y) - page_sum(i.x - 1, i.y)) * (page_sum(i.y, -1) - page_sum(i.y - 1, -1));
  return page_density(share, cells, uv.y);
}
`;
