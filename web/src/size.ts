/**
 * How much a compiler has to do with a material's functions.
 *
 * What draws in software writes every call out in its place, so a function's length says little: what counts is its own
 * text and, at each call, that of what it calls.
 */
import type { FunctionName } from "./data";
import type { Shader } from "./shaders";

/** Characters that a texel counts as: where it is fetched, a sampler's code is written out too. */
const FETCH = 400;
/** More than that in a loop takes a software renderer minutes, or all memory. */
const MOST_IN_LOOP = 10_000;
/** From so much on a program is some seconds in the making. */
const LONG = 60_000;

const sizes = new Map<string, Map<string, number>>();

/** Characters of a function of the material, written out. */
function writtenOut(shader: Shader, name: FunctionName): number {
  let known = sizes.get(shader.code);
  if (!known) {
    known = measured(shader.text);
    sizes.set(shader.code, known);
  }
  return known.get(shader.manifest.functions[name] ?? "") ?? 0;
}

function measured(text: string): Map<string, number> {
  const bodies = new Map<string, string>();
  for (const [, name, body] of text.replace(/\/\/[^\n]*/g, "").matchAll(/^\w+ (\w+)\([^)]*\) \{\n(.*?)^\}/gms))
    bodies.set(name as string, (bodies.get(name as string) ?? "") + body); // functions of one name count together
  const found = new Map<string, number>();
  const size = (name: string): number => {
    const known = found.get(name);
    if (known !== undefined) return known;
    const body = bodies.get(name) as string;
    found.set(name, 0); // one of the same name may be called by it
    let sum = body.length;
    for (const [, called] of body.matchAll(/\b(\w+)\(/g)) sum += called === "texelFetch" ? FETCH : bodies.has(called as string) ? size(called as string) : 0;
    found.set(name, sum);
    return sum;
  };
  for (const name of bodies.keys()) size(name);
  return found;
}

/** Whether a function may be called in a loop. */
export const fitsLoop = (shader: Shader, name: FunctionName): boolean => writtenOut(shader, name) <= MOST_IN_LOOP;

/** Whether a browser may be busy for seconds with a program of the material. */
export const isLong = (shader: Shader): boolean => (["derive", "eval", "sample", "terms"] as const).some((name) => writtenOut(shader, name) > LONG);
