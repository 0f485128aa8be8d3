/** The models' part of the side panel: rows A, B, C..., presets, choices, and a control for every parameter. */
import type { GUI } from "lil-gui";
import type { PageApp } from "../app";
import type { Parameter, Value } from "../data";
import * as edits from "../edits";
import { isNumeric } from "../shaders";
import { ChoiceControl, RangeControl, TickControl, TripleControl, addRow } from "./controls";
import { button, element, short } from "./dom";

const letter = (slot: number) => String.fromCharCode(65 + slot);

interface Group {
  title: string;
  prefix: string;
  members: Parameter[];
}

/** Parameters whose names start with the same words, such as `coat_weight` and `coat_color`, under a heading each, in the order of
 * their first; those without such a name, or with one of less than three, come first. */
function grouped(parameters: Parameter[], rest: string): Group[] {
  const first = (p: Parameter) => /^([a-z\d]+)_/.exec(edits.bare(p.path))?.[1] ?? "";
  const others: Group = { title: rest, prefix: "", members: [] };
  const groups = new Map<string, Group>();
  for (const parameter of parameters) {
    const word = first(parameter);
    const family = word ? parameters.filter((p) => first(p) === word) : [];
    if (family.length < 3) others.members.push(parameter);
    else if (!groups.has(word)) {
      let prefix = `${word}_`;
      // "thin_film_weight", "thin_film_ior", ...: the common words are two.
      const second = /^[a-z\d]+_/.exec(edits.bare(parameter.path).slice(prefix.length))?.[0] ?? "";
      if (second && family.every((p) => edits.bare(p.path).startsWith(prefix + second))) prefix += second;
      groups.set(word, { title: prefix.replaceAll("_", " ").trim(), prefix, members: family });
    }
  }
  return [others, ...groups.values()].filter((group) => group.members.length);
}

export class ModelsSection {
  private built = "";
  private readonly chips = element("div", { class: "chips" });

  constructor(
    private readonly app: PageApp,
    private readonly gui: GUI,
  ) {}

  /** Controls are rebuilt when the row, its model or its variant changes; otherwise they only show new values. */
  update(): void {
    const { app } = this;
    const { selection, slots } = app.state;
    const slot = Math.min(selection.slot, slots.length - 1);
    const shader = app.shaderOf(slot);
    const row = slots[slot];
    const perBall = shader.manifest.parameters.filter((p) => row && edits.perBall(row, p.path)).map((p) => p.path);
    const key = JSON.stringify([app.data.revision, slot, shader.code, row?.material, slots.length, perBall, perBall.length ? selection.ball : 0]);
    if (key !== this.built) {
      this.built = key;
      this.build(slot);
    }
    this.showChips(slot);
    for (const controller of this.gui.controllers) controller.updateDisplay();
  }

  private build(slot: number): void {
    const { app, gui } = this;
    for (const controller of [...gui.controllers]) controller.destroy();
    gui.$children.replaceChildren();
    addRow(gui, this.chips);
    const shader = app.shaderOf(slot);
    const { material, manifest } = shader;
    if (app.data.materials.length > 1)
      new ChoiceControl(
        gui,
        { label: "Model", doc: manifest.doc.split("\n")[0] ?? "", get: () => app.state.slots[slot]?.material ?? "", set: (id) => edits.setMaterial(app, slot, id), initial: () => app.store.initial.slots[slot]?.material ?? "" },
        () => app.data.materials.map((m) => ({ value: m.id, label: m.title })),
      );
    if (material.presets.length)
      new ChoiceControl(
        gui,
        {
          label: "Preset",
          doc: "Measured indices of refraction, in linear RGB.",
          get: () => edits.currentPreset(app, slot, material),
          set: (name) => {
            const preset = material.presets.find((p) => p.name === name);
            if (preset) edits.applyPreset(app, slot, preset);
          },
          initial: () => "",
        },
        () => [
          ...(edits.currentPreset(app, slot, material) ? [] : [{ value: "", label: "custom values" }]),
          ...material.presets.map((p) => ({ value: p.name, label: p.name, disabled: !edits.possiblePreset(app, slot, p) })),
        ],
        () => material.presets.find((p) => p.name === edits.currentPreset(app, slot, material))?.f0 ?? null,
      );
    const numeric = manifest.parameters.filter(isNumeric);
    const row = app.state.slots[slot];
    const varying = numeric.filter((p) => row && edits.perBall(row, p.path));
    const groups = grouped(numeric.filter((p) => !varying.includes(p)), varying.length ? "Whole row" : "Parameters");
    if (varying.length) {
      const ball = Math.min(app.state.selection.ball, (row?.balls.length ?? 1) - 1);
      const head = element("div", { class: "subhead", title: "Click another ball to edit it." }, `Ball ${ball + 1} of ${row?.balls.length ?? 1}`);
      const step = (by: number) => () =>
        app.store.update("selection", (state) => {
          const count = row?.balls.length ?? 1;
          state.selection = { slot, ball: (ball + by + count) % count };
        });
      head.append(element("span", { class: "spacer" }), button("‹", "Ball to the left", step(-1), "mini"), button("›", "Ball to the right", step(1), "mini"));
      addRow(gui, head);
      for (const parameter of varying) this.addParameter(slot, parameter, groups.length > 1);
    }
    for (const { title, prefix, members } of groups) {
      addRow(gui, element("div", { class: "subhead" }, title));
      for (const parameter of members) this.addParameter(slot, parameter, groups.length > 1, prefix);
    }
    const choices = manifest.parameters.filter((p) => (p.kind === "choice" || p.kind === "flag") && this.isOpen(slot, p));
    if (choices.length) {
      addRow(gui, element("div", { class: "subhead", title: "Options of the shader code: each combination is a separate shader." }, "Choices"));
      for (const parameter of choices) this.addChoice(slot, parameter);
    }
    if (app.state.slots.length > 1)
      new TickControl(gui, {
        label: "Linked rows",
        doc: "An edit also changes the parameter of the same name in the other rows.",
        get: () => app.state.linked,
        set: (on) => app.store.set("linked", on),
        initial: () => true,
      });
  }

  private showChips(current: number): void {
    const { app } = this;
    this.chips.replaceChildren(
      ...app.state.slots.map((row, slot) => {
        const select = button(element("span", {}, element("b", {}, letter(slot)), ` ${row.label}`), `Edit row ${letter(slot)}: ${row.label}`, () =>
          app.store.update("selection", (state) => {
            state.selection = { slot, ball: Math.min(state.selection.ball, row.balls.length - 1) };
          }),
        );
        select.className = "chip";
        select.style.setProperty("--slot", app.slotColor(slot));
        select.setAttribute("aria-pressed", String(slot === current));
        const solo = button("solo", `Show row ${letter(slot)} alone`, () => app.store.set("solo", app.state.solo === slot ? null : slot), "mini");
        solo.setAttribute("aria-pressed", String(app.state.solo === slot));
        const eye = button(row.visible ? "●" : "○", `${row.visible ? "Hide" : "Show"} row ${letter(slot)}`, () => {
          if (row.visible && app.visibleSlots().length === 1) return app.say("At least one row has to be visible.");
          app.store.set(`slots.${slot}.visible`, !row.visible);
        }, "mini");
        return element("div", { class: "chip-row" }, select, ...(app.state.slots.length > 1 ? [solo, eye] : []));
      }),
    );
  }

  // ---------------------------------------------------------------- one parameter

  /** A choice that the page cannot change is not shown, unless a server can write the shader for it. */
  private isOpen(slot: number, parameter: Parameter): boolean {
    return Boolean(this.app.data.socket) || edits.possibleChoices(this.app, slot, parameter).filter((o) => o.here).length > 1;
  }

  private addChoice(slot: number, parameter: Parameter): void {
    const { app } = this;
    new ChoiceControl(
      this.gui,
      {
        label: edits.bare(parameter.path),
        doc: parameter.doc,
        get: () => String(edits.currentChoice(app, slot, parameter.path)),
        set: (value) => edits.setChoice(app, slot, parameter, value),
        initial: () => String(parameter.default),
      },
      () =>
        edits.possibleChoices(app, slot, parameter).map(({ value, doc, here }) => ({
          value,
          label: value,
          doc: here || app.data.socket ? doc : `${doc} (not available on this page; use gonio view)`,
          disabled: !here && !app.data.socket,
        })),
    );
  }

  /** `inWords`: labels of many long names, which wrap; `prefix` is said by the heading of the group. */
  private addParameter(slot: number, parameter: Parameter, inWords: boolean, prefix = ""): void {
    const { app, gui } = this;
    const { path, kind } = parameter;
    const declared = edits.bare(path);
    const name = inWords ? declared.slice(prefix.length).replaceAll("_", " ") : declared;
    const own = parameter.symbol === declared ? "" : parameter.symbol; // of a paper
    const field = <T extends Value>(label: string, read: (value: Value) => T, write: (value: T, old: Value) => Value, symbol = own) => ({
      label,
      doc: label === declared ? parameter.doc : `${declared}: ${parameter.doc}`,
      symbol,
      unit: parameter.unit,
      get: () => read(edits.currentValue(app, slot, parameter)),
      set: (value: T) => edits.setParameter(app, slot, path, write(value, edits.currentValue(app, slot, parameter))),
      initial: () => read(edits.initialValue(app, slot, parameter)),
    });
    const low = parameter.low ?? (kind === "angle" ? -Math.PI : 0);
    if (kind === "alpha") {
      const [first, second] = [parameter.value].flat();
      const round = second === undefined || first === second;
      const width = (value: Value, k: 0 | 1) => (Array.isArray(value) ? (value[k] as number) : (value as number));
      const hint = (roughness: number) => `α = ${short(roughness * roughness)}`;
      const dial = name === "alpha" ? "roughness" : name.replace(/alpha$/, "roughness");
      // The slider is the square root of the width, which gives perceptually equal steps.
      const top = Math.sqrt(parameter.high ?? 1);
      const clamp = (r: number) => Number((r * r).toPrecision(6));
      if (round)
        new RangeControl(gui, field(dial, (v) => Math.sqrt(width(v, 0)), (r) => [clamp(r), clamp(r)], "√α"), { low: 0, high: top, hint });
      else
        for (const k of [0, 1] as const)
          new RangeControl(
            gui,
            field(`${dial} ${"xy"[k]}`, (v) => Math.sqrt(width(v, k)), (r, old) => (k === 0 ? [clamp(r), width(old, 1)] : [width(old, 0), clamp(r)]), `√α${"xy"[k]}`),
            { low: 0, high: top, hint },
          );
    } else if (kind === "angle") {
      const degrees = 180 / Math.PI;
      new RangeControl(gui, { ...field(name, (v) => (v as number) * degrees, (d) => d / degrees), unit: "degrees" }, {
        low: low * degrees,
        high: (parameter.high ?? Math.PI) * degrees,
      });
    } else if (kind === "spectrum") {
      const triple = (v: Value) => (Array.isArray(v) ? (v as number[]) : [v as number, v as number, v as number]);
      new TripleControl(gui, field(name, triple, (v) => v), { low: parameter.low, high: parameter.high, color: parameter.high === 1 });
    } else {
      const value = [edits.currentValue(app, slot, parameter)].flat()[0] as number;
      const open = parameter.high === null;
      const high = parameter.high ?? Math.max(1, 4 * Math.abs(value || 1));
      // Ranges of several decades get a logarithmic scale, those from 0 to infinity a square.
      const scale = low > 0 && high / low >= 100 ? "log" : open && low === 0 ? "square" : "linear";
      const scalar = (v: Value) => [v].flat()[0] as number;
      new RangeControl(gui, field(name, scalar, (v) => v), { low, high, scale, open });
    }
  }
}
