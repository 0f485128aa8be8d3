/** What is shown and how: term, mesh, background; tone curve, exposure, theme. */
import type { GUI } from "lil-gui";
import type { PageApp } from "../app";
import { resetCamera } from "../camera";
import { TONES } from "../display";
import { hasTerm } from "../glsl";
import { actingLights, environmentOf } from "../lights";
import type { State, Term } from "../state";
import { ChoiceControl, RangeControl, TickControl, addRow } from "./controls";
import { button, element, segmented } from "./dom";

const TERM_LABELS: Record<Term, [string, string]> = {
  full: ["Full", "The whole material under all lights."],
  D: ["D", "Distribution of microfacet normals at the half vector of the first light, in 1/sr. A lower exposure may be necessary."],
  G: ["G", "Masking and shadowing for the first light."],
  F: ["F", "Fresnel reflectance at the half vector of the first light."],
  single: ["Single", "Light scattered once by the facets: the base material without compensation."],
  multi: ["Multi", "Light scattered more than once: the term added by the compensation."],
  compensated: ["Compensated", "Single and multiple scattering together. A row without compensation shows its single scattering."],
  difference: ["Full − single", "The term added by the compensation: positive values are orange, negative values are blue, and zero is black."],
  split: ["Split sum", "The approximation of game engines: albedo times the blurred environment. Full is the reference."],
  "split-error": ["Split − full", "Error of the split sum: orange where it is too bright, blue where it is too dark, and black where there is no error."],
  rows: ["Row A − row", "The first row minus each of the other rows: positive values are orange, negative values are blue, and zero is black."],
};

/** The bar above the picture that selects a term, and a line that explains the picture where necessary. */
export function termBar(app: PageApp): { host: HTMLElement; note: HTMLElement; update(): void } {
  const bar = segmented(
    (Object.keys(TERM_LABELS) as Term[]).map((value) => ({ value, label: TERM_LABELS[value][0], title: TERM_LABELS[value][1] })),
    (term) => app.store.set("view.term", term),
  );
  bar.host.classList.add("terms");
  bar.host.setAttribute("aria-label", "Term shown");
  const note = element("p", { class: "term-note" });
  return {
    host: bar.host,
    note,
    update() {
      const slots = app.visibleSlots();
      const possible = (term: Term) => {
        if (term === "rows") return slots.length > 1;
        if (term.startsWith("split") && !environmentOf(actingLights(app.state))) return false;
        if (term === "compensated") return slots.some((slot) => hasTerm(app.shaderOf(slot).manifest, "multi"));
        return slots.some((slot) => hasTerm(app.shaderOf(slot).manifest, term));
      };
      bar.show(app.state.view.term, possible);
      const { term } = app.state.view;
      const text = term === "full" ? unseen(app, slots) : TERM_LABELS[term][1];
      if (note.textContent !== text) note.textContent = note.title = text;
    },
  };
}

/** Why a row is black, if the lights are the cause. */
function unseen(app: PageApp, slots: number[]): string {
  const lights = actingLights(app.state);
  if (lights.length === 0) return "No light is on.";
  if (lights.some((light) => light.type === "environment")) return "";
  const mirrors = slots.filter((slot) => app.shaderOf(slot).manifest.delta === "always").map((slot) => String.fromCharCode(65 + slot));
  return mirrors.length ? `${mirrors.join(", ")}: a mirror reflects an environment only; these lights are not sampled in its single direction of reflection.` : "";
}

export class ViewSection {
  constructor(
    private readonly app: PageApp,
    private readonly gui: GUI,
    openFile: (kind: "mesh") => void,
  ) {
    const { store } = app;
    new ChoiceControl(
      gui,
      {
        label: "Shape",
        doc: "The shape of the material samples; a dropped .glb, .gltf or .obj replaces it.",
        get: () => app.state.view.mesh,
        set: (mesh) => (mesh === "file" && !app.hasMeshFile() ? openFile("mesh") : store.set("view.mesh", mesh as State["view"]["mesh"])),
        initial: () => store.initial.view.mesh,
      },
      () => [
        { value: "sphere", label: "sphere, exact" },
        { value: "shaderball", label: "shader ball" },
        { value: "torus", label: "torus" },
        { value: "file", label: app.hasMeshFile() ? "custom mesh" : "custom mesh…" },
      ],
    );
    new ChoiceControl(
      gui,
      {
        label: "Background",
        doc: "What is visible behind the balls.",
        get: () => (app.state.furnace ? "environment" : app.state.view.background),
        set: (value) => store.set("view.background", value === "environment" ? "environment" : "theme"),
        initial: () => "theme",
      },
      () => [
        { value: "theme", label: "plain" },
        { value: "environment", label: "environment" },
      ],
    );
    new RangeControl(gui, { label: "Exposure", doc: "Exposure in stops, applied before the tone curve.", unit: "stops", get: () => app.state.display.exposure, set: (v) => store.set("display.exposure", v), initial: () => store.initial.display.exposure }, { low: -8, high: 8, open: false });
    new ChoiceControl(
      gui,
      { label: "Tone curve", doc: "Mapping of radiance to the display range, before sRGB encoding.", get: () => app.state.display.tone, set: (tone) => store.set("display.tone", tone as State["display"]["tone"]), initial: () => store.initial.display.tone },
      () => Object.entries(TONES).map(([value, { doc }]) => ({ value, label: value, doc })),
    );
    new TickControl(gui, { label: "Labels", doc: "Labels of the balls and of the rows. Key: L", get: () => app.state.view.labels, set: (on) => store.set("view.labels", on), initial: () => true });
    addRow(gui, element("div", { class: "buttons" }, button("Reset camera", "Restore the initial view (double-click the picture)", () => resetCamera(store))));
  }

  update(): void {
    for (const controller of this.gui.controllers) controller.updateDisplay();
    void this.app;
  }
}
