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
  D: ["D", "Distribution of microfacet normals at the half vector, in 1/sr, of the first light. Mind the exposure."],
  G: ["G", "Masking and shadowing for the first light."],
  F: ["F", "Fresnel reflectance at the half vector of the first light."],
  single: ["Single", "Light that bounced once between facets: the base alone."],
  multi: ["Multi", "Light that bounced more than once: what compensation adds."],
  compensated: ["Compensated", "Single and multi together. A row without compensation shows what it has."],
  difference: ["Full − single", "What compensation adds: orange above zero, blue below, black none."],
  split: ["Split sum", "As engines do: albedo times the blurred environment. Full is the truth."],
  "split-error": ["Split − full", "Error of the split sum: orange too bright, blue too dark, black none."],
  rows: ["Row A − row", "The first row minus each other row: orange above zero, blue below, black none."],
};

/** The bar above the picture that picks a term, and a line that says what is seen where that is not plain. */
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
      const said = term === "full" ? unseen(app, slots) : TERM_LABELS[term][1];
      if (note.textContent !== said) note.textContent = note.title = said;
    },
  };
}

/** Why a row is black, where the lights are to blame. */
function unseen(app: PageApp, slots: number[]): string {
  const lights = actingLights(app.state);
  if (lights.length === 0) return "No light is on.";
  if (lights.some((light) => light.type === "environment")) return "";
  const mirrors = slots.filter((slot) => app.shaderOf(slot).manifest.delta === "always").map((slot) => String.fromCharCode(65 + slot));
  return mirrors.length ? `${mirrors.join(", ")}: a mirror shows an environment only; its one direction never meets these lights.` : "";
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
        doc: "What carries the material; a dropped .glb, .gltf or .obj takes its place.",
        get: () => app.state.view.mesh,
        set: (mesh) => (mesh === "file" && !app.hasMeshFile() ? openFile("mesh") : store.set("view.mesh", mesh as State["view"]["mesh"])),
        initial: () => store.initial.view.mesh,
      },
      () => [
        { value: "sphere", label: "sphere, exact" },
        { value: "shaderball", label: "shader ball" },
        { value: "torus", label: "torus" },
        { value: "file", label: app.hasMeshFile() ? "own file" : "own file…" },
      ],
    );
    new ChoiceControl(
      gui,
      {
        label: "Behind",
        doc: "What is seen behind the balls.",
        get: () => (app.state.furnace ? "environment" : app.state.view.background),
        set: (value) => store.set("view.background", value === "environment" ? "environment" : "theme"),
        initial: () => "theme",
      },
      () => [
        { value: "theme", label: "paper" },
        { value: "environment", label: "environment" },
      ],
    );
    new RangeControl(gui, { label: "Exposure", doc: "Doublings of the light before the tone curve.", unit: "stops", get: () => app.state.display.exposure, set: (v) => store.set("display.exposure", v), initial: () => store.initial.display.exposure }, { low: -8, high: 8, open: false });
    new ChoiceControl(
      gui,
      { label: "Tone curve", doc: "From radiance to the screen; sRGB comes after it.", get: () => app.state.display.tone, set: (tone) => store.set("display.tone", tone as State["display"]["tone"]), initial: () => store.initial.display.tone },
      () => Object.entries(TONES).map(([value, { doc }]) => ({ value, label: value, doc })),
    );
    new TickControl(gui, { label: "Labels", doc: "Names under the balls and beside the rows. Key: L", get: () => app.state.view.labels, set: (on) => store.set("view.labels", on), initial: () => true });
    addRow(gui, element("div", { class: "buttons" }, button("Reset camera", "Back to the first view (double click on the picture)", () => resetCamera(store))));
  }

  update(): void {
    for (const controller of this.gui.controllers) controller.updateDisplay();
    void this.app;
  }
}
