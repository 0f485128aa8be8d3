/** Every active light with its values; each can be switched off. */
import { type GUI } from "lil-gui";
import type { PageApp } from "../app";
import type { Vec3 } from "../data";
import { actingLights, newLight } from "../lights";
import type { EnvironmentMethod, Light } from "../state";
import { normalize } from "../vectors";
import { ChoiceControl, type Field, RangeControl, TickControl, TripleControl, addRow } from "./controls";
import { button, element } from "./dom";
import { useStudio } from "./files";

const DEGREES = 180 / Math.PI;
const MAX_LIGHTS = 8;

export class LightSection {
  private built = "";

  constructor(
    private readonly app: PageApp,
    private readonly gui: GUI,
    private readonly openFile: (kind: "environment") => void,
  ) {}

  update(): void {
    const { state } = this.app;
    const key = JSON.stringify([state.lights.map((l) => [l.type, l.type === "environment" && Boolean(l.image)]), state.furnace]);
    if (key !== this.built) {
      this.built = key;
      this.build();
    }
    this.gui.title(`Lights · ${state.furnace ? "white furnace" : `${actingLights(state).length} of ${state.lights.length} on`}`);
    this.gui.domElement.toggleAttribute("data-furnace", state.furnace);
    for (const controller of this.gui.controllersRecursive()) controller.updateDisplay();
  }

  private build(): void {
    const { app, gui } = this;
    for (const child of [...gui.children]) child.destroy();
    gui.$children.replaceChildren();
    new TickControl(gui, {
      label: "White furnace (F)",
      doc: "Replaces all lights by a constant radiance of 1 from all directions; a surface without energy loss becomes invisible.",
      get: () => app.state.furnace,
      set: (on) => app.store.set("furnace", on),
      initial: () => false,
    });
    app.state.lights.forEach((light, index) => this.addLight(light, index));
    if (app.state.furnace) addRow(gui, element("p", { class: "note" }, "The furnace is the only light, with a radiance of 1 from all directions. The lights above are off."));
    const add = (type: Light["type"], label: string) =>
      button(`+ ${label}`, `Add a light: ${label}${type === "environment" ? " (a studio, which can be replaced by a picture)" : ""}`, () => {
        if (app.state.lights.length >= MAX_LIGHTS) return app.say(`At most ${MAX_LIGHTS} lights are possible.`);
        if (type === "environment" && app.state.lights.some((l) => l.type === "environment")) return app.say("The scene already has an environment.");
        if (type === "environment") return useStudio(app);
        app.store.update("lights", (state) => state.lights.push(newLight(type)));
      });
    addRow(gui, element("div", { class: "buttons" }, add("directional", "sun"), add("point", "point"), add("area", "area"), add("environment", "environment")));
  }

  private addLight(light: Light, index: number): void {
    const { app } = this;
    const folder = this.gui.addFolder(light.name);
    folder.domElement.classList.add("light");
    const current = () => (app.state.lights[index] ?? light) as Light;
    const first = () => (app.store.initial.lights[index]?.type === light.type ? app.store.initial.lights[index] : newLight(light.type)) as Light;
    const field = <T>(label: string, doc: string, read: (l: Light) => T, write: (l: Light, value: T) => void, unit = ""): Field<T> => ({
      label,
      doc,
      unit,
      get: () => read(current()),
      set: (value) => app.store.update(`lights.${index}`, (state) => write(state.lights[index] as Light, value)),
      initial: () => read(first()),
    });
    new TickControl(folder, field("on", "Whether the light is on.", (l) => l.on, (l, on) => void (l.on = on)));
    const vector = (label: string, doc: string, key: string) =>
      new TripleControl(
        folder,
        field(label, doc, (l) => (l as unknown as Record<string, number[]>)[key] as number[], (l, v) => Object.assign(l, { [key]: v })),
        { low: null, high: null, color: false, names: ["x", "y", "z"] },
      );
    const power = (label: string, doc: string, key: string, unit: string) =>
      new TripleControl(
        folder,
        field(label, doc, (l) => (l as unknown as Record<string, number[]>)[key] as number[], (l, v) => Object.assign(l, { [key]: v }), unit),
        { low: 0, high: null, color: false },
      );
    if (light.type === "directional") {
      const angles = (l: Light): [number, number] => {
        const d = normalize((l as unknown as { direction: Vec3 }).direction);
        return [Math.atan2(d[0], d[2]) * DEGREES, Math.asin(Math.max(-1, Math.min(1, d[1]))) * DEGREES];
      };
      const point = (l: Light, azimuth: number, elevation: number) => {
        const [a, e] = [azimuth / DEGREES, elevation / DEGREES];
        Object.assign(l, { direction: [Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)] });
      };
      new RangeControl(folder, field("azimuth", "Azimuth of the light about the vertical; 0 is behind the camera.", (l) => angles(l)[0], (l, v) => point(l, v, angles(l)[1]), "degrees"), { low: -180, high: 180 });
      new RangeControl(folder, field("elevation", "Elevation of the light above the horizon.", (l) => angles(l)[1], (l, v) => point(l, angles(l)[0], Math.min(89.9, Math.max(-89.9, v))), "degrees"), { low: -90, high: 90 });
      power("irradiance", "Irradiance on a surface that faces the light, in linear RGB.", "irradiance", "W/m²");
    } else if (light.type === "point") {
      vector("position", "World coordinates; a ball has radius 1.", "position");
      power("intensity", "Intensity of the light, in linear RGB.", "intensity", "W/sr");
    } else if (light.type === "area") {
      vector("center", "World coordinates; a ball has radius 1.", "center");
      vector("half edge u", "Vector from the center to the midpoint of one edge.", "u");
      vector("half edge v", "Vector from the center to the midpoint of an adjacent edge.", "v");
      power("radiance", "Radiance, equal on both sides, in linear RGB.", "radiance", "W/(m² sr)");
    } else this.addEnvironment(folder, index, field);
    addRow(folder, element("div", { class: "buttons" }, button("Remove", `Remove this light`, () => app.store.update("lights", (state) => state.lights.splice(index, 1)))));
  }

  private addEnvironment(folder: GUI, index: number, field: <T>(label: string, doc: string, read: (l: Light) => T, write: (l: Light, value: T) => void, unit?: string) => Field<T>): void {
    const { app } = this;
    const light = app.state.lights[index];
    const pictured = light?.type === "environment" && light.image !== null;
    if (!pictured)
      new TripleControl(folder, field("radiance", "Radiance, equal from all directions, in linear RGB.", (l) => (l as { constant: number[] }).constant ?? [], (l, v) => Object.assign(l, { constant: v }), "W/(m² sr)"), { low: 0, high: null, color: false });
    new RangeControl(folder, field("scale", "Factor by which the radiance is multiplied.", (l) => (l as { scale: number }).scale, (l, v) => Object.assign(l, { scale: v })), { low: 0.01, high: 100, scale: "log", open: true });
    if (pictured) {
      new RangeControl(folder, field("rotation", "Rotation of the environment about the vertical.", (l) => (l as { rotation: number }).rotation * DEGREES, (l, v) => Object.assign(l, { rotation: v / DEGREES }), "degrees"), { low: -180, high: 180 });
      new ChoiceControl(
        folder,
        {
          label: "integral",
          doc: "Method by which the light of the picture is integrated over directions.",
          get: () => app.state.environment,
          set: (value) => app.store.set("environment", value as EnvironmentMethod),
          initial: () => "sampled",
        },
        () => [
          { value: "sampled", label: "sampled", doc: "Multiple importance sampling by the material's own sample() and by the picture's brightness, accumulated until the result converges. At low sample counts, a fraction of the split sum is added to reduce the error." },
          ...(app.data.dfg.length ? [{ value: "dfg", label: "split sum, table", doc: "F0 A + B (Karis 2013) times the blurred picture, as in game engines. For materials with compensation, or without F, the material's own albedo is used." }] : []),
          { value: "split-sum", label: "split sum, computed albedo", doc: "Albedo times the picture blurred by the lobe, both computed by the material's own sample()." },
        ],
      );
    }
    const drop = button(pictured ? "Other picture…" : "Picture (.hdr)…", "Open a Radiance file, or drop one on the picture.", () => this.openFile("environment"));
    const clear = button("No picture", "Replace the picture by a constant radiance.", () =>
      app.store.update(`lights.${index}`, (state) => Object.assign(state.lights[index] as Light, { image: null })),
    );
    addRow(folder, element("div", { class: "buttons" }, drop, ...(pictured ? [clear] : [])));
  }
}
