/**
 * Size of a material's functions as seen by a compiler.
 *
 * Software renderers inline every call, so the length of a function alone means little: its size is that of its own
 * text plus, at each call, that of the called function.
 */
import type { FunctionName } from "./data";
import type { Shader } from "./shaders";

/** Characters that a texel fetch counts as: the sampler's code is inlined as well. */
const FETCH = 400;
/** A larger function in a loop takes a software renderer minutes, or all memory. */
const MAX_IN_LOOP = 10_000;
/** From this size on, a program takes several seconds to compile. */
const LONG = 60_000;

const sizes = new Map<string, Map<string, number>>();

/** Characters of a function of the material after inlining. */
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
    bodies.set(name as string, (bodies.get(name as string) ?? "") + body); // overloads count together
  const sizes = new Map<string, number>();
  const size = (name: string): number => {
    const known = sizes.get(name);
    if (known !== undefined) return known;
    const body = bodies.get(name) as string;
    sizes.set(name, 0); // it may call an overload of the same name
    let sum = body.length;
    for (const [, called] of body.matchAll(/\b(\w+)\(/g)) sum += called === "texelFetch" ? FETCH : bodies.has(called as string) ? size(called as string) : 0;
    sizes.set(name, sum);
    return sum;
  };
  for (const name of bodies.keys()) size(name);
  return sizes;
}

/** Whether a function may be called in a loop. */
export const fitsLoop = (shader: Shader, name: FunctionName): boolean => writtenOut(shader, name) <= MAX_IN_LOOP;

/** Whether a program of the material may take seconds to compile. */
export const isLong = (shader: Shader): boolean => (["derive", "eval", "sample", "terms"] as const).some((name) => writtenOut(shader, name) > LONG);
