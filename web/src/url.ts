/** The state in the URL's fragment: the difference from the page's initial state, as JSON in base64url. */
import { newLight } from "./lights";
import type { Material, Parameter, Values } from "./data";
import { type Light, type State, TERMS } from "./state";

type Json = null | boolean | number | string | Json[] | { [key: string]: Json };

export function encodeState(state: State, initial: State): string {
  const patch = difference(initial as unknown as Json, state as unknown as Json);
  if (patch === undefined) return "";
  const bytes = new TextEncoder().encode(JSON.stringify(patch));
  let binary = "";
  for (const byte of bytes) binary += String.fromCharCode(byte);
  return `s=${btoa(binary).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "")}`;
}

/**
 * The initial state with the fragment's patch; whatever does not fit (a newer page's, an untrusted one) is ignored.
 * `materials` are those of the page: a link may refer to no others.
 */
export function decodeState(fragment: string, initial: State, materials: readonly Material[]): State {
  const match = /(?:^#?|&)s=([A-Za-z0-9_-]+)/.exec(fragment);
  const state = structuredClone(initial);
  if (!match) return state;
  try {
    const binary = atob((match[1] as string).replaceAll("-", "+").replaceAll("_", "/"));
    const patch = JSON.parse(new TextDecoder().decode(Uint8Array.from(binary, (c) => c.charCodeAt(0)))) as Json;
    return bounded(merge(state as unknown as Json, patch, "") as unknown as State, initial, materials);
  } catch {
    return state;
  }
}

/** Types are correct here; this checks what types do not express: names that exist, numbers that can be drawn. */
function bounded(state: State, initial: State, materials: readonly Material[]): State {
  const clamp = (value: number, low: number, high: number) => Math.min(high, Math.max(low, value));
  state.slots.forEach((slot, index) => {
    const material = materials.find(({ id }) => id === slot.material);
    if (!material) state.slots[index] = structuredClone(initial.slots[index] as State["slots"][number]);
    else {
      const parameters = material.variants[0]?.manifest.parameters ?? [];
      for (const [path, value] of Object.entries(slot.choices)) {
        const parameter = parameters.find((p) => p.path === path);
        if (!(parameter?.kind === "flag" ? typeof value === "boolean" : Object.hasOwn(parameter?.choices ?? {}, String(value)))) {
          const own = material.variants[0]?.choices[path];
          if (own === undefined) delete slot.choices[path];
          else slot.choices[path] = own;
        }
      }
      slot.values = inRange(slot.values, parameters);
      for (const ball of slot.balls) ball.set = inRange(ball.set, parameters);
    }
  });
  if (state.solo !== null && !state.slots[state.solo]) state.solo = null;
  if (!state.slots.some((slot) => slot.visible)) state.slots.forEach((slot) => (slot.visible = true));
  const slot = state.solo ?? Math.round(clamp(state.selection.slot, 0, state.slots.length - 1));
  const balls = state.slots[slot]?.balls.length ?? 1;
  state.selection = { slot, ball: Math.round(clamp(state.selection.ball, 0, balls - 1)) };
  state.camera.distance = clamp(state.camera.distance, 0.5, 500);
  state.camera.elevation = clamp(state.camera.elevation, -1.55, 1.55);
  state.camera.fov = clamp(state.camera.fov, 2, 140);
  state.view.spacing = clamp(state.view.spacing, 2, 20);
  state.display.exposure = clamp(state.display.exposure, -30, 30);
  state.dock.height = clamp(state.dock.height, 100, 4000);
  state.compare.wipe = clamp(state.compare.wipe, 0, 1);
  // A dropped shape or picture is not in the link.
  const pictured = initial.lights.some((light) => light.type === "environment" && light.image);
  for (const light of state.lights) if (light.type === "environment" && !pictured) light.image = null;
  const named: [holder: object, key: string, values: string[]][] = [
    [state, "environment", ["sampled", "split-sum", "dfg"]],
    [state.view, "mesh", ["sphere", "shaderball", "torus"]],
    [state.view, "term", [...TERMS]],
    [state.view, "background", ["theme", "environment"]],
    [state.display, "tone", ["none", "reinhard", "filmic"]],
    [state.display, "theme", ["auto", "light", "dark"]],
    [state.compare, "mode", ["off", "side", "wipe", "difference"]],
  ];
  for (const [holder, key, values] of named) {
    const record = holder as Record<string, string>;
    if (!values.includes(record[key] as string)) record[key] = values[0] as string;
  }
  return state;
}

/** Numbers within the parameters' declared ranges and of their shape; others are ignored. */
function inRange(values: Values, parameters: readonly Parameter[]): Values {
  const valid: Values = {};
  for (const parameter of parameters) {
    const value = values[parameter.path];
    if (value === undefined) continue;
    const numbers = [value].flat() as unknown[];
    const size = parameter.kind === "spectrum" ? 3 : parameter.kind === "alpha" ? 2 : 1;
    if ((numbers.length !== 1 && numbers.length !== size) || !numbers.every((v) => typeof v === "number" && Number.isFinite(v))) continue;
    // A number for a parameter of three components stays one: it applies to all.
    const { low, high } = parameter;
    const clamped = (numbers as number[]).map((v) => Math.min(high ?? Infinity, Math.max(low ?? -Infinity, v)));
    valid[parameter.path] = Array.isArray(value) ? clamped : (clamped[0] as number);
  }
  return valid;
}

/** A light of the link over a new one of its kind, which supplies missing values. */
function lightFrom(patch: Json): Json[] {
  const type = isObject(patch) ? patch["type"] : null;
  if (type !== "directional" && type !== "point" && type !== "area" && type !== "environment") return [];
  const made = newLight(type as Light["type"]) as unknown as { [key: string]: Json };
  const image = isObject(patch) && isObject(patch["image"]) ? patch["image"] : null;
  const sized = image && typeof image["width"] === "number" && typeof image["height"] === "number";
  const merged = merge(made, patch, "light") as { [key: string]: Json };
  if (type === "directional") {
    const length = Math.hypot(...(merged["direction"] as number[]));
    if (!(length > 0 && length < Infinity)) merged["direction"] = made["direction"] as Json;
  }
  if (type === "environment") merged["scale"] = Math.max(0, merged["scale"] as number);
  return [type === "environment" ? { ...merged, image: sized ? { width: image["width"] as Json, height: image["height"] as Json, data: null } : null } : merged];
}

const isObject = (value: unknown): value is { [key: string]: Json } =>
  typeof value === "object" && value !== null && !Array.isArray(value);

/** The difference of `after` from `before`; undefined if they are equal. Arrays of equal length are compared by index. */
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
      // Lights can be added and removed: a list of another length is written in full.
      if (key === "lights") {
        if (JSON.stringify(before[key]) !== JSON.stringify(after[key])) changed[key] = after[key] as Json;
        continue;
      }
      const inner = difference(before[key], after[key] as Json);
      if (inner !== undefined) changed[key] = inner;
    }
    // A removed key (a value set back to its declaration) is written as null.
    for (const key of Object.keys(before)) if (!(key in after)) changed[key] = null;
    return Object.keys(changed).length ? changed : undefined;
  }
  return JSON.stringify(before) === JSON.stringify(after) ? undefined : after;
}

/** Objects with free keys: values by parameter path, choices, panels' state. */
const FREE = /(^|\.)(values|choices|set|panels)(\.|$)/;
const FORBIDDEN = new Set(["__proto__", "constructor", "prototype"]);

function merge(base: Json, patch: Json, path: string): Json {
  if (Array.isArray(base)) {
    if (path === "lights") return Array.isArray(patch) ? patch.slice(0, 8).flatMap(lightFrom) : base;
    if (Array.isArray(patch)) return patch.length === base.length && base.every((v, i) => !isObject(v) && sameKind(v, patch[i] as Json)) ? patch : base;
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
  // null means "none" for these, which may change to a value and back.
  if (path === "solo") return patch === null || (typeof patch === "number" && Number.isFinite(patch)) ? patch : base;
  if (path === "dock.open") return patch === null || typeof patch === "string" ? patch : base;
  if (FREE.test(path) && !isObject(patch)) return patch;
  return patch !== null && sameKind(base, patch) ? patch : base;
}

function sameKind(a: Json, b: Json): boolean {
  if (typeof a !== typeof b || Array.isArray(a) !== Array.isArray(b)) return false;
  return typeof b !== "number" || Number.isFinite(b);
}
