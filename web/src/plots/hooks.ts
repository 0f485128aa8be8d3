/** Interface for the tests: the evaluator by slot and ball, and the metrics, on plain arrays. */
import type { App } from "../panel";
import { comparisonOf, type Comparison } from "./comparison";
import { flipMap } from "./flip";
import { counted, measure, type Pair, type Pixels } from "./metrics";

const plain = (floats: ArrayLike<number>) => Array.from(floats);
const plainAll = (object: object) => Object.fromEntries(Object.entries(object).map(([name, value]) => [name, plain(value as ArrayLike<number>)]));

export interface TestHooks {
  evaluate(slot: number, ball: number, wo: number[], wi: number[]): Promise<Record<string, number[]>>;
  sample(slot: number, ball: number, wo: number[], u: number[]): Promise<Record<string, number[]>>;
  terms(slot: number, ball: number, wo: number[], wi: number[]): Promise<Record<string, number[]>>;
  albedo(slot: number, ball: number, wo: number[], error: number): Promise<{ value: number[]; error: number[]; samples: number }>;
  flip(test: number[], reference: number[], width: number, height: number): Promise<number[]>;
  measure(test: number[], reference: number[], width: number, height: number, pixels: Pixels): ReturnType<typeof measure>;
  comparison(): Comparison;
}

export function testHooks(app: App): TestHooks {
  return {
    evaluate: async (slot, ball, wo, wi) => plainAll(await app.evaluator.evaluate(app.shaderOf(slot, ball), app.valuesOf(slot, ball), wo, wi)),
    sample: async (slot, ball, wo, u) => plainAll(await app.evaluator.sample(app.shaderOf(slot, ball), app.valuesOf(slot, ball), wo, u)),
    terms: async (slot, ball, wo, wi) => plainAll(await app.evaluator.terms(app.shaderOf(slot, ball), app.valuesOf(slot, ball), wo, wi)),
    albedo: async (slot, ball, wo, error) => {
      const estimate = await app.evaluator.albedo(app.shaderOf(slot, ball), app.valuesOf(slot, ball), wo, { error });
      return { value: plain(estimate.value), error: plain(estimate.error), samples: estimate.samples };
    },
    flip: async (test, reference, width, height) => plain(await flipMap(test, reference, width, height)),
    measure: (test, reference, width, height, pixels) => {
      const pair: Pair = { width, height, test: Float32Array.from(test), reference: Float32Array.from(reference) };
      return measure(pair, counted(pair, pixels));
    },
    comparison: () => comparisonOf(app),
  };
}
