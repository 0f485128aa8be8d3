/** The state in the URL's fragment: what differs from the page's initial state, as JSON in base64url. */
import type { State } from "./state";

type Json = null | boolean | number | string | Json[] | { [key: string]: Json };

export function encodeState(state: State, initial: State): string {
  const patch = difference(initial as unknown as Json, state as unknown as Json);
  if (patch === undefined) return "";
  const bytes = new TextEncoder().encode(JSON.stringify(patch));
  let binary = "";
  for (const byte of bytes) binary += String.fromCharCode(byte);
  return `s=${btoa(binary).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "")}`;
}

/** The initial state with the fragment's patch; whatever does not fit (a newer page's, a stranger's) is left out. */
export function decodeState(fragment: string, initial: State): State {
  const match = /(?:^#?|&)s=([A-Za-z0-9_-]+)/.exec(fragment);
  const state = structuredClone(initial);
  if (!match) return state;
  try {
    const binary = atob((match[1] as string).replaceAll("-", "+").replaceAll("_", "/"));
    const patch = JSON.parse(new TextDecoder().decode(Uint8Array.from(binary, (c) => c.charCodeAt(0)))) as Json;
    return merge(state as unknown as Json, patch, "") as unknown as State;
  } catch {
    return state;
  }
}

const isObject = (value: unknown): value is { [key: string]: Json } =>
  typeof value === "object" && value !== null && !Array.isArray(value);

/** What `after` has that `before` has not; undefined when they are equal. Arrays of one length go by index. */
function difference(before: Json | undefined, after: Json): Json | undefined {
  if (Array.isArray(after) && Array.isArray(before) && after.length === before.length && after.some(isObject)) {
    const changed: { [key: string]: Json } = {};
    after.forEach((value, index) => {
      const inner = difference(before[index], value);
      if (inner !== undefined) changed[index] = inner;
    });
    return Object.keys(changed).length ? changed : undefined;
  }
  if (isObject(after) && isObject(before)) {
    const changed: { [key: string]: Json } = {};
    for (const key of Object.keys(after)) {
      const inner = difference(before[key], after[key] as Json);
      if (inner !== undefined) changed[key] = inner;
    }
    // A key that is gone (a value set back to its declaration) is written as null.
    for (const key of Object.keys(before)) if (!(key in after)) changed[key] = null;
    return Object.keys(changed).length ? changed : undefined;
  }
  return JSON.stringify(before) === JSON.stringify(after) ? undefined : after;
}

/** Objects with free keys: values by parameter path, choices, what panels keep. */
const FREE = /(^|\.)(values|choices|set|panels)(\.|$)/;
const FORBIDDEN = new Set(["__proto__", "constructor", "prototype"]);

function merge(base: Json, patch: Json, path: string): Json {
  if (Array.isArray(base)) {
    if (Array.isArray(patch)) return base.length === 0 || patch.every((v) => sameKind(base[0] as Json, v)) ? patch : base;
    if (!isObject(patch)) return base;
    return base.map((value, index) => (index in patch ? merge(value, patch[index] as Json, `${path}.${index}`) : value));
  }
  if (isObject(base)) {
    if (!isObject(patch)) return base;
    const merged: { [key: string]: Json } = { ...base };
    const free = FREE.test(path);
    for (const [key, value] of Object.entries(patch)) {
      if (FORBIDDEN.has(key)) continue;
      const inner = path ? `${path}.${key}` : key;
      if (key in base) {
        if (value === null && free) delete merged[key];
        else merged[key] = merge(base[key] as Json, value, inner);
      } else if (free && value !== null) merged[key] = value;
    }
    return merged;
  }
  // null stands for "none" in solo, an open tab or an environment's picture, so it may take a value and give it back.
  if (base === null || patch === null) return isObject(patch) && !/image$/.test(path) ? base : patch;
  return sameKind(base, patch) ? patch : base;
}

function sameKind(a: Json, b: Json): boolean {
  if (typeof a !== typeof b || Array.isArray(a) !== Array.isArray(b)) return false;
  return typeof b !== "number" || Number.isFinite(b);
}
