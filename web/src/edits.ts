/**
 * How an edit of a parameter, a preset or a choice changes the state: of a row, or of one ball of it, and, if rows are
 * linked, of the parameter of the same name in the others.
 */
import type { PageApp } from "./app";
import type { Material, Parameter, Preset, Value } from "./data";
import { sameNumbers, variantChoice } from "./shaders";
import type { Slot, State } from "./state";
import { short } from "./ui/dom";

/** A compensated material contains its base: "base.alpha" corresponds to "alpha" of the material without compensation. */
export const bare = (path: string): string => path.replace(/^(base\.)+/, "");

/** Whether the balls of the row differ in this parameter: an edit then applies to the selected ball alone. */
export const perBall = (slot: Slot, path: string): boolean => slot.balls.some((ball) => path in ball.set);

/** The parameter of the same name in another row: of its material, of its base, or the only nested one of that name. */
function twin(app: PageApp, slot: number, path: string): string | null {
  const paths = app.shaderOf(slot).manifest.parameters.map((p) => p.path);
  const name = path.split(".").at(-1);
  const inside = paths.filter((one) => one.split(".").at(-1) === name);
  return paths.find((one) => one === path) ?? paths.find((one) => bare(one) === bare(path)) ?? (inside.length === 1 ? (inside[0] as string) : null);
}

/** Replaces a row, unless the page has no server and no shader for it, which it then reports. */
function commit(app: PageApp, state: State, index: number, row: Slot): void {
  if (app.possible(row)) state.slots[index] = row;
  else app.say(`Row ${String.fromCharCode(65 + index)} is unchanged: this page contains no shader for it. \`gonio view\` has them all.`);
}

const others = (app: PageApp, slot: number): number[] => (app.state.linked ? app.state.slots.map((_, i) => i).filter((i) => i !== slot) : []);

export function setParameter(app: PageApp, slot: number, path: string, value: Value): void {
  const { ball } = app.state.selection;
  app.store.update("slots", (state) => {
    const write = (index: number, target: string) => {
      const row = structuredClone(state.slots[index] as Slot);
      if (perBall(row, target)) {
        const one = row.balls[Math.min(ball, row.balls.length - 1)];
        if (!one) return;
        one.set = { ...one.set, [target]: value };
        one.label = labelOf(one.set);
      } else row.values = { ...row.values, [target]: value };
      commit(app, state, index, row);
    };
    write(slot, path);
    for (const other of others(app, slot)) {
      const target = twin(app, other, path);
      if (target && kindOf(app, other, target) === kindOf(app, slot, path)) write(other, target);
    }
  });
}

const kindOf = (app: PageApp, slot: number, path: string) => app.shaderOf(slot).manifest.parameters.find((p) => p.path === path)?.kind;

/** Values of the selected ball, independent of the other balls of its row. */
export function setBall(app: PageApp, slot: number, values: Record<string, Value>, label: string): void {
  const { ball } = app.state.selection;
  app.store.update("slots", (state) => {
    const { balls } = state.slots[slot] as Slot;
    const one = balls[Math.min(ball, balls.length - 1)];
    if (!one) return;
    one.set = { ...one.set, ...values };
    one.label = label;
  });
}

/** "roughness 0.55", from the parameters that differ per ball; page.py formats the first labels in the same way. */
function labelOf(set: Record<string, Value>): string {
  const bits = Object.entries(set).map(([path, value]) => {
    const name = bare(path);
    const numbers = [value].flat();
    if (name.endsWith("alpha")) {
      const roughness = numbers.map((a) => short(Math.sqrt(a as number)));
      return `roughness ${roughness[0] === roughness[1] || roughness.length < 2 ? roughness[0] : roughness.join(" × ")}`;
    }
    const same = numbers.every((v) => v === numbers[0]);
    return `${name} ${(same ? numbers.slice(0, 1) : numbers).map((v) => (typeof v === "number" ? short(v) : String(v))).join(", ")}`;
  });
  return bits.join(", ");
}

/** The value that a double click restores: the ball's own first value, or the declared one. */
export function initialValue(app: PageApp, slot: number, parameter: Parameter): Value {
  const row = app.state.slots[slot];
  const first = app.store.initial.slots[slot];
  if (row && first && perBall(row, parameter.path)) {
    const value = first.balls[Math.min(app.state.selection.ball, first.balls.length - 1)]?.set[parameter.path];
    if (value !== undefined) return value;
  }
  return parameter.value;
}

export function currentValue(app: PageApp, slot: number, parameter: Parameter): Value {
  const row = app.state.slots[slot];
  const own = row && perBall(row, parameter.path) ? row.balls[Math.min(app.state.selection.ball, row.balls.length - 1)]?.set[parameter.path] : undefined;
  return own ?? row?.values[parameter.path] ?? parameter.value;
}

// ------------------------------------------------------------------ presets

export function applyPreset(app: PageApp, slot: number, preset: Preset): void {
  app.store.update("slots", (state) => {
    commit(app, state, slot, withPreset(state.slots[slot] as Slot, preset));
    for (const other of others(app, slot)) {
      const row = state.slots[other] as Slot;
      const same = app.shaders.material(row.material).presets.find((p) => p.name === preset.name);
      if (same) commit(app, state, other, withPreset(row, same));
    }
  });
}

/** Whether this page can show a preset on a row; evaluated for hundreds of presets at every change. */
export function possiblePreset(app: PageApp, slot: number, preset: Preset): boolean {
  const row = app.slot(slot);
  const parameters = app.shaders.material(row.material).variants[0]?.manifest.parameters ?? [];
  const shapes = ({ path, field, off, fixed }: Parameter) => path in preset.set && (fixed || off !== null || field === null);
  return Boolean(app.data.socket) || !parameters.some(shapes) || app.possible(withPreset(row, preset));
}

function withPreset(row: Slot, preset: Preset): Slot {
  const [choices, values, own] = [{ ...row.choices }, { ...row.values }, {} as Record<string, Value>];
  for (const [path, value] of Object.entries(preset.set)) {
    if (typeof value === "string" || typeof value === "boolean") choices[path] = value;
    else if (perBall(row, path)) own[path] = value;
    else values[path] = value;
  }
  const written = (set: Record<string, Value>) => ({ label: labelOf({ ...set, ...own }), set: { ...set, ...own } });
  return { ...row, choices, values, balls: Object.keys(own).length ? row.balls.map(({ set }) => written(set)) : row.balls };
}

/** The preset whose values the row, or the selected ball of it, has now. */
export function currentPreset(app: PageApp, slot: number, material: Material): string {
  const values = app.wantedValues(app.slot(slot), app.state.selection.slot === slot ? app.state.selection.ball : 0);
  const same = (path: string, value: Value): boolean =>
    typeof value === "string" || typeof value === "boolean" ? currentChoice(app, slot, path) === value : sameNumbers(value, values[path] as Value);
  return material.presets.find((preset) => Object.entries(preset.set).every(([path, value]) => same(path, value)))?.name ?? "";
}

// ------------------------------------------------------------------ choices

export function currentChoice(app: PageApp, slot: number, path: string): string | boolean | undefined {
  return app.state.slots[slot]?.choices[path] ?? variantChoice(app.shaderOf(slot).variant, path);
}

/** Values of a choice for which the page has shaders, with the other choices fixed. */
export function possibleChoices(app: PageApp, slot: number, parameter: Parameter): { value: string; doc: string; here: boolean }[] {
  const row = app.slot(slot);
  const names = parameter.kind === "flag" ? { true: "on", false: "off" } : (parameter.choices ?? {});
  const here = (value: string) => app.lacking({ ...row, choices: { ...row.choices, [parameter.path]: typed(parameter, value) } }).length === 0;
  return Object.entries(names).map(([value, doc]) => ({ value, doc, here: here(value) }));
}

const typed = (parameter: Parameter, value: string): string | boolean => (parameter.kind === "flag" ? value === "true" : value);

export function setChoice(app: PageApp, slot: number, parameter: Parameter, text: string): void {
  const value = typed(parameter, text);
  app.store.update("slots", (state) => {
    const write = (index: number, path: string) => {
      const row = state.slots[index] as Slot;
      commit(app, state, index, { ...row, choices: { ...row.choices, [path]: value } });
    };
    write(slot, parameter.path);
    for (const other of others(app, slot)) {
      const path = twin(app, other, parameter.path);
      const known = path && app.shaderOf(other).manifest.parameters.find((p) => p.path === path);
      if (known && known.kind === parameter.kind && (known.kind === "flag" || text in (known.choices ?? {}))) write(other, known.path);
    }
  });
}

export function setMaterial(app: PageApp, slot: number, id: string): void {
  app.store.update("slots", (state) => {
    const row = state.slots[slot] as Slot;
    const first = app.shaders.material(id).variants[0];
    row.material = id;
    row.choices = { ...first?.choices };
    // Values of parameters that both materials have under one name are kept; the others would be meaningless.
    const paths = new Map((first?.manifest.parameters ?? []).map((p) => [bare(p.path), p.path]));
    const shared = (set: Record<string, Value>) =>
      Object.fromEntries(Object.entries(set).flatMap(([path, value]) => (paths.has(bare(path)) ? [[paths.get(bare(path)) as string, value]] : [])));
    row.values = shared(row.values);
    for (const ball of row.balls) ball.set = shared(ball.set);
    row.label = app.shaders.material(id).title;
    // Values that differ from those that this page's tables were computed from cannot be kept.
    if (!app.possible(row)) for (const set of [row.values, ...row.balls.map((ball) => ball.set)]) Object.assign(set, first?.fixed);
  });
}
