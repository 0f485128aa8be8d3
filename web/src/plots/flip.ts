/**
 * LDR-FLIP [Andersson2020], "FLIP: A Difference Evaluator for Alternating Images": the difference perceived by a viewer
 * who alternates between two pictures on a screen, 0 (none) to 1, per pixel.
 *
 * Both pictures are as displayed, as linear RGB in [0, 1]. The eye's contrast sensitivity blurs both, colors are
 * compared in L*a*b* with Hunt's adjustment, and edges and points that differ increase the result.
 * The same constants and border rule as gonio.pictures.metrics.
 */

/** The usual desk: a 3840-pixel monitor, 0.7 m wide, viewed from 0.7 m (section 6 of the paper). */
export const PIXELS_PER_DEGREE = (0.7 * (3840 / 0.7) * Math.PI) / 180;

const XYZ_FROM_RGB = [
  [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
  [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
  [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
] as const;
const RGB_FROM_XYZ = inverse(XYZ_FROM_RGB);
const WHITE = XYZ_FROM_RGB.map((row) => row[0] + row[1] + row[2]) as [number, number, number];

const HYAB_POWER = 0.7; // q_c
const KNEE_IN = 0.4; // p_c: 40 % of the largest distance maps to ...
const KNEE_OUT = 0.95; // ... p_t
const FEATURE_WIDTH = 0.082; // w, degrees: the width of an edge or point that the eye detects
const FEATURE_POWER = 0.5; // q_f
/** Contrast sensitivity as sums of Gaussians (a1, b1, a2, b2), table 1: achromatic, red-green, blue-yellow. */
const SENSITIVITY = [
  [1.0, 0.0047, 0.0, 1e-5],
  [1.0, 0.0053, 0.0, 1e-5],
  [34.1, 0.04, 13.5, 0.025],
] as const;
const WIDEST = 0.04;

type Plane = Float64Array;
type Planes = [Plane, Plane, Plane];

/** A pause between steps: the map of a large picture takes about a second, and the page has to stay responsive. */
const breathe = () => new Promise((resolve) => setTimeout(resolve, 0));

/** Interleaved RGB, row 0 on top; returns one value per pixel. */
export async function flipMap(
  test: ArrayLike<number>,
  reference: ArrayLike<number>,
  width: number,
  height: number,
  pixelsPerDegree = PIXELS_PER_DEGREE,
): Promise<Float32Array> {
  const opponents: Planes[] = [];
  const labs: Planes[] = [];
  for (const picture of [test, reference]) {
    const opponent = toOpponent(picture, width * height);
    opponents.push(opponent);
    const filtered: Plane[] = [];
    for (const [i, plane] of opponent.entries()) {
      filtered.push(contrastFilter(plane, SENSITIVITY[i] as (typeof SENSITIVITY)[number], width, height, pixelsPerDegree));
      await breathe();
    }
    labs.push(huntLab(filtered as Planes));
    await breathe();
  }
  const features = await featureDistance((opponents[0] as Planes)[0], (opponents[1] as Planes)[0], width, height, pixelsPerDegree);
  const [a, b] = labs as [Planes, Planes];
  // The most distant pair of the sRGB cube is green and blue.
  const largest = hyab(labOf(0, 1, 0), labOf(0, 0, 1)) ** HYAB_POWER;
  const knee = KNEE_IN * largest;
  return Float32Array.from(features, (feature, i) => {
    const power = hyab(at(a, i), at(b, i)) ** HYAB_POWER;
    const distance = power < knee ? power * (KNEE_OUT / knee) : KNEE_OUT + ((power - knee) / (largest - knee)) * (1 - KNEE_OUT);
    return distance ** (1 - feature); // eq. 5
  });
}

const at = (planes: Planes, i: number): [number, number, number] => [planes[0][i] as number, planes[1][i] as number, planes[2][i] as number];

function inverse(m: typeof XYZ_FROM_RGB): number[][] {
  const [[a, b, c], [d, e, f], [g, h, i]] = m;
  const determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
  return [
    [e * i - f * h, c * h - b * i, b * f - c * e],
    [f * g - d * i, a * i - c * g, c * d - a * f],
    [d * h - e * g, b * g - a * h, a * e - b * d],
  ].map((row) => row.map((x) => x / determinant));
}

/** XYZ over the white point's. */
function relativeXyz(r: number, g: number, b: number): [number, number, number] {
  return XYZ_FROM_RGB.map((row, i) => (row[0] * r + row[1] * g + row[2] * b) / (WHITE[i] as number)) as [number, number, number];
}

/** YyCxCz, a linear counterpart of L*a*b* in which the eye's filter is applied. */
function toOpponent(rgb: ArrayLike<number>, count: number): Planes {
  const planes: Planes = [new Float64Array(count), new Float64Array(count), new Float64Array(count)];
  const clamp = (v: number) => Math.min(1, Math.max(0, v));
  for (let i = 0; i < count; i++) {
    const [x, y, z] = relativeXyz(clamp(rgb[3 * i] as number), clamp(rgb[3 * i + 1] as number), clamp(rgb[3 * i + 2] as number));
    planes[0][i] = 116 * y - 16;
    planes[1][i] = 500 * (x - y);
    planes[2][i] = 200 * (y - z);
  }
  return planes;
}

/** Back to RGB in [0, 1], then L*a*b* with a and b scaled by 0.01 L: brighter colors appear more saturated. */
function huntLab(ycc: Planes): Planes {
  const count = ycc[0].length;
  const lab: Planes = [new Float64Array(count), new Float64Array(count), new Float64Array(count)];
  for (let i = 0; i < count; i++) {
    const [yy, cx, cz] = at(ycc, i);
    const y = (yy + 16) / 116;
    const xyz = [(y + cx / 500) * WHITE[0], y * WHITE[1], (y - cz / 200) * WHITE[2]];
    const rgb = RGB_FROM_XYZ.map((row) => {
      const v = (row[0] as number) * (xyz[0] as number) + (row[1] as number) * (xyz[1] as number) + (row[2] as number) * (xyz[2] as number);
      return Math.min(1, Math.max(0, v));
    }) as [number, number, number];
    const [l, a, b] = labOf(...rgb);
    lab[0][i] = l;
    lab[1][i] = a;
    lab[2][i] = b;
  }
  return lab;
}

function labOf(r: number, g: number, b: number): [number, number, number] {
  const delta = 6 / 29;
  const [x, y, z] = relativeXyz(r, g, b).map((t) => (t > delta ** 3 ? Math.cbrt(t) : t / (3 * delta * delta) + 4 / 29)) as [number, number, number];
  const lightness = 116 * y - 16;
  return [lightness, 5 * lightness * (x - y), 2 * lightness * (y - z)];
}

/** City-block distance in lightness, Euclidean in chroma: better than either for large differences. */
function hyab(a: readonly number[], b: readonly number[]): number {
  const [l, u, v] = a.map((x, i) => x - (b[i] as number)) as [number, number, number];
  return Math.abs(l) + Math.hypot(u, v);
}

/** The eye's blur: two separable Gaussians with weights that sum to one. */
function contrastFilter(plane: Plane, [a1, b1, a2, b2]: readonly [number, number, number, number], width: number, height: number, ppd: number): Plane {
  const radius = Math.ceil(3 * Math.sqrt(WIDEST / (2 * Math.PI ** 2)) * ppd);
  const total = new Float64Array(plane.length);
  let weight = 0;
  for (const [a, b] of [[a1, b1], [a2, b2]] as const) {
    if (a === 0) continue;
    const line = Float64Array.from({ length: 2 * radius + 1 }, (_, i) => Math.exp((-(Math.PI ** 2) * ((i - radius) / ppd) ** 2) / b));
    const scale = a * Math.sqrt(Math.PI / b);
    const blurred = along(along(plane, line, width, height, false), line, width, height, true);
    for (let i = 0; i < total.length; i++) total[i] = (total[i] as number) + scale * (blurred[i] as number);
    weight += scale * line.reduce((s, x) => s + x, 0) ** 2;
  }
  return total.map((x) => x / weight);
}

/** The larger of the edge and the point difference, eq. 4. */
async function featureDistance(test: Plane, reference: Plane, width: number, height: number, ppd: number): Promise<Plane> {
  const sigma = 0.5 * FEATURE_WIDTH * ppd;
  const radius = Math.ceil(3 * sigma);
  const x = Float64Array.from({ length: 2 * radius + 1 }, (_, i) => i - radius);
  const gauss = x.map((v) => Math.exp((-v * v) / (2 * sigma * sigma)));
  const across = gauss.map((g) => g / gauss.reduce((s, v) => s + v, 0));
  const detectors = [x.map((v, i) => -v * (gauss[i] as number)), x.map((v, i) => ((v * v) / sigma ** 2 - 1) * (gauss[i] as number))];
  const worst = new Float64Array(test.length);
  for (const detector of detectors) {
    // Positive and negative weights each sum to one, as those of the two-dimensional filter do.
    const negative = -detector.reduce((s, v) => s + Math.min(v, 0), 0);
    const positive = detector.reduce((s, v) => s + Math.max(v, 0), 0);
    const filter = detector.map((v) => v / (v < 0 ? negative : positive));
    const strengths: Plane[] = [];
    for (const opponent of [reference, test]) {
      const lightness = opponent.map((v) => (v + 16) / 116);
      const horizontal = along(along(lightness, filter, width, height, true), across, width, height, false);
      const vertical = along(along(lightness, filter, width, height, false), across, width, height, true);
      strengths.push(horizontal.map((v, i) => Math.hypot(v, vertical[i] as number)));
      await breathe();
    }
    const [a, b] = strengths as [Plane, Plane];
    for (let i = 0; i < worst.length; i++) worst[i] = Math.max(worst[i] as number, Math.abs((a[i] as number) - (b[i] as number)));
  }
  return worst.map((v) => Math.min(1, (v / Math.SQRT2) ** FEATURE_POWER));
}

/** Correlates along a row (or a column), with the border pixels repeated outward. */
function along(plane: Plane, weights: Float64Array, width: number, height: number, horizontal: boolean): Plane {
  const radius = (weights.length - 1) / 2;
  const [length, lines, step, next] = horizontal ? [width, height, 1, width] : [height, width, width, 1];
  const out = new Float64Array(plane.length);
  const line = new Float64Array(length + 2 * radius);
  for (let k = 0; k < lines; k++) {
    const start = k * next;
    for (let i = 0; i < line.length; i++)
      line[i] = plane[start + Math.min(Math.max(i - radius, 0), length - 1) * step] as number;
    for (let i = 0; i < length; i++) {
      let sum = 0;
      for (let j = 0; j < weights.length; j++) sum += (weights[j] as number) * (line[i + j] as number);
      out[start + i * step] = sum;
    }
  }
  return out;
}
