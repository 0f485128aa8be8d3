/** The lobe as a surface: radius = eval over wi, on rings that are denser near the largest value. */
import type { Vec3 } from "../data";
import type { Evaluator } from "../evaluator";
import { sequence } from "../targets";
import { type Channel, channelOf, type Model } from "./base";
import { frameAround, polar } from "./directions";

export const RINGS = 120;
export const SPOKES = 120;
/**
 * Ring k of n is at pi (k/n)^2.5 from the axis: the first at 0.02 degrees, so that a lobe of alpha = 0.001 still has
 * rings, and the last 2.6 degrees apart.
 */
const CROWDING = 2.5;

export interface Lobe {
  model: Model;
  directions: Float32Array;
  values: Float32Array;
  /** Largest value of the channel, 1/sr. */
  peak: number;
}

/** Triangles between the rings, the same for every lobe. */
export function lobeIndices(): Uint32Array {
  const indices: number[] = [];
  for (let k = 0; k < RINGS; k++)
    for (let s = 0; s < SPOKES; s++) {
      const [a, b] = [k * SPOKES + s, k * SPOKES + ((s + 1) % SPOKES)];
      indices.push(a, a + SPOKES, b, b, a + SPOKES, b + SPOKES);
    }
  return Uint32Array.from(indices);
}

export async function lobeOf(evaluator: Evaluator, model: Model, wo: Vec3, channel: Channel): Promise<Lobe> {
  const axis = await peakDirection(evaluator, model, wo, channel);
  const [x, y] = frameAround(axis);
  const directions = new Float32Array(3 * (RINGS + 1) * SPOKES);
  for (let k = 0, at = 0; k <= RINGS; k++)
    for (let s = 0; s < SPOKES; s++) {
      const d = polar(Math.PI * (k / RINGS) ** CROWDING, (2 * Math.PI * s) / SPOKES);
      for (let c = 0; c < 3; c++) directions[at++] = d[0] * (x[c] as number) + d[1] * (y[c] as number) + d[2] * (axis[c] as number);
    }
  const { value } = await evaluator.evaluate(model.shader, model.values, wo, directions);
  let peak = 0;
  for (let i = 0; i < value.length / 3; i++) peak = Math.max(peak, channelOf(value, i, channel));
  return { model, directions, values: value, peak };
}

/**
 * The direction of the largest value among a uniform grid and 512 samples of the material's own sample(), which finds
 * lobes that are too narrow for the grid.
 */
async function peakDirection(evaluator: Evaluator, model: Model, wo: Vec3, channel: Channel): Promise<Vec3> {
  const candidates: number[] = [];
  for (let k = 0; k < 45; k++) for (let s = 0; s < 60; s++) candidates.push(...polar(((k + 0.5) / 45) * Math.PI, (2 * Math.PI * s) / 60));
  if (model.shader.manifest.functions.sample) {
    const u = Array.from({ length: 512 }, (_, i) => sequence(3, i)).flat();
    const drawn = await evaluator.sample(model.shader, model.values, wo, u);
    for (let i = 0; i < drawn.pdf.length; i++)
      if ((drawn.pdf[i] as number) > 0 && !drawn.delta[i]) for (let c = 0; c < 3; c++) candidates.push(drawn.wi[3 * i + c] as number);
  }
  const { value } = await evaluator.evaluate(model.shader, model.values, wo, candidates);
  let best = 0;
  for (let i = 1; i < value.length / 3; i++) if (channelOf(value, i, channel) > channelOf(value, best, channel)) best = i;
  return [candidates[3 * best] as number, candidates[3 * best + 1] as number, candidates[3 * best + 2] as number];
}

/** Length of an arrow: 1 for `peak`; on the logarithmic axis 0 for `decades` below it. */
export function radius(value: number, peak: number, decades: number | null): number {
  if (!(value > 0) || peak <= 0) return 0;
  return decades === null ? value / peak : Math.max(0, 1 + Math.log10(value / peak) / decades);
}
