/**
 * What an edit of a parameter, a preset or a choice does to the state: to a row, or to one ball of it, and, where rows
 * are linked, to the parameter of the same name in the others.
 */
import type { PageApp } from "./app";
import type { Choices, Material, Parameter, Preset, Value } from "./data";
import { variantChoice } from "./shaders";
import type { State } from "./state";
import { short } from "./ui/dom";

/** A compensated material holds its base: "base.alpha" there is "alpha" of a plain one. */
export const bare = (path: string): string => path.replace(/^(base\.)+/, "");

/** Whether the balls of the row differ in this parameter: then an edit goes to the selected ball alone. */
export const perBall = (slot: State["slots"][number], path: string): boolean => slot.balls.some((ball) => path in ball.set);

function twin(app: PageApp, slot: number, path: string): string | null {
  const parameters = app.shaderOf(slot).manifest.parameters;
  return parameters.find((p) => p.path === path)?.path ?? parameters.find((p) => bare(p.path) === bare(path))?.path ?? null;
}

const others = (app: PageApp, slot: number): number[] => (app.state.linked ? app.state.slots.map((_, i) => i).filter((i) => i !== slot) : []);

export function setParameter(app: PageApp, slot: number, path: string, value: Value): void {
  const { ball } = app.state.selection;
  app.store.update("slots", (state) => {
    const write = (index: number, target: string) => {
      const row = state.slots[index] as State["slots"][number];
      if (perBall(row, target)) {
        const one = row.balls[Math.min(ball, row.balls.length - 1)];
        if (!one) return;
        one.set = { ...one.set, [target]: value };
        one.label = labelOf(one.set);
      } else row.values = { ...row.values, [target]: value };
    };
    write(slot, path);
    for (const other of others(app, slot)) {
      const target = twin(app, other, path);
      if (target && kindOf(app, other, target) === kindOf(app, slot, path)) write(other, target);
    }
  });
}

const kindOf = (app: PageApp, slot: number, path: string) => app.shaderOf(slot).manifest.parameters.find((p) => p.path === path)?.kind;

/** Values of one ball, the selected one, whatever the others of its row have. */
export function setBall(app: PageApp, slot: number, values: Record<string, Value>, label: string): void {
  const { ball } = app.state.selection;
  app.store.update("slots", (state) => {
    const balls = (state.slots[slot] as State["slots"][number]).balls;
    const one = balls[Math.min(ball, balls.length - 1)];
    if (!one) return;
    one.set = { ...one.set, ...values };
    one.label = label;
  });
}

/** "roughness .55", from what sets a ball apart; the page's first labels are written the same way. */
function labelOf(set: Record<string, Value>): string {
  const bits = Object.entries(set).map(([path, value]) => {
    const name = bare(path);
    const numbers = [value].flat();
    if (name.endsWith("alpha")) {
      const roughness = numbers.map((a) => trim(Math.sqrt(a as number)));
      return `roughness ${roughness[0] === roughness[1] || roughness.length < 2 ? roughness[0] : roughness.join(" × ")}`;
    }
    const same = numbers.every((v) => v === numbers[0]);
    return `${name} ${(same ? numbers.slice(0, 1) : numbers).map((v) => (typeof v === "number" ? trim(v) : String(v))).join(", ")}`;
  });
  return bits.join(", ");
}

const trim = (value: number) => short(value).replace(/^0\./, ".");

/** What a double click brings back: the ball's own first value, or the declared one. */
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
    const write = (index: number, chosen: Preset) => {
      const row = state.slots[index] as State["slots"][number];
      const choices = { ...row.choices };
      for (const [path, value] of Object.entries(chosen.set)) {
        if (typeof value === "string" || typeof value === "boolean") choices[path] = value;
        else if (perBall(row, path))
          for (const ball of row.balls) {
            ball.set = { ...ball.set, [path]: value };
            ball.label = labelOf(ball.set);
          }
        else row.values = { ...row.values, [path]: value };
      }
      if (app.data.socket || app.shaders.find(row.material, choices)) row.choices = choices;
    };
    write(slot, preset);
    for (const other of others(app, slot)) {
      const same = app.shaders.material((state.slots[other] as State["slots"][number]).material).presets.find((p) => p.name === preset.name);
      if (same) write(other, same);
    }
  });
}

/** The preset whose values the row, or the selected ball of it, has now. */
export function currentPreset(app: PageApp, slot: number, material: Material): string {
  const values = app.valuesOf(slot, app.state.selection.slot === slot ? app.state.selection.ball : 0);
  const same = (path: string, value: Value): boolean => {
    if (typeof value === "string" || typeof value === "boolean") return currentChoice(app, slot, path) === value;
    const [x, y] = [[value].flat(), [values[path]].flat() as number[]];
    // A number stands for all where the other side has several.
    return (x.length > y.length ? x : y).every((_, i) => {
      const [a, b] = [x[i] ?? x[0], y[i] ?? y[0]] as [number, number];
      return Math.abs(a - b) <= 1e-6 * Math.max(1, Math.abs(a));
    });
  };
  return material.presets.find((preset) => Object.entries(preset.set).every(([path, value]) => same(path, value)))?.name ?? "";
}

// ------------------------------------------------------------------ choices

export function currentChoice(app: PageApp, slot: number, path: string): string | boolean | undefined {
  return app.state.slots[slot]?.choices[path] ?? variantChoice(app.shaderOf(slot).variant, path);
}

/** Values of a choice that the page holds shaders for, the other choices staying as they are. */
export function possibleChoices(app: PageApp, slot: number, parameter: Parameter): { value: string; doc: string; here: boolean }[] {
  const row = app.state.slots[slot];
  const names = parameter.kind === "flag" ? { true: "on", false: "off" } : (parameter.choices ?? {});
  return Object.entries(names).map(([value, doc]) => ({
    value,
    doc,
    here: Boolean(row && app.shaders.find(row.material, { ...row.choices, [parameter.path]: typed(parameter, value) })),
  }));
}

const typed = (parameter: Parameter, value: string): string | boolean => (parameter.kind === "flag" ? value === "true" : value);

export function setChoice(app: PageApp, slot: number, parameter: Parameter, text: string): void {
  const value = typed(parameter, text);
  app.store.update("slots", (state) => {
    const write = (index: number, path: string) => {
      const row = state.slots[index] as State["slots"][number];
      const choices: Choices = { ...row.choices, [path]: value };
      // A page without a server keeps to what it holds.
      if (app.data.socket || app.shaders.find(row.material, choices)) row.choices = choices;
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
    const row = state.slots[slot] as State["slots"][number];
    const first = app.shaders.material(id).variants[0];
    row.material = id;
    row.choices = { ...first?.choices };
    // What the old material and the new one both call by a name stays; the rest would mean nothing.
    const paths = new Map((first?.manifest.parameters ?? []).map((p) => [bare(p.path), p.path]));
    const kept = (set: Record<string, Value>) =>
      Object.fromEntries(Object.entries(set).flatMap(([path, value]) => (paths.has(bare(path)) ? [[paths.get(bare(path)) as string, value]] : [])));
    row.values = kept(row.values);
    for (const ball of row.balls) ball.set = kept(ball.set);
    row.label = app.shaders.material(id).title;
  });
}
