/** Keyboard shortcuts, and the card that lists them. */
import type { PageApp } from "../app";
import { orbit, resetCamera, zoom } from "../camera";
import type { MeshName } from "../state";
import { button, element } from "./dom";

export interface Actions {
  copyLink(): void;
  screenshot(): void;
  theme(): void;
}

interface Key {
  keys: string[];
  name: string;
  doc: string;
  act(app: PageApp, actions: Actions, key: string): void;
}

const STEP = Math.PI / 36;
const MESHES: MeshName[] = ["sphere", "shaderball", "torus"];

const KEYS: Key[] = [
  { keys: ["ArrowLeft"], name: "← →", doc: "rotate the camera about the vertical", act: (app) => orbit(app.store, STEP, 0) },
  { keys: ["ArrowRight"], name: "", doc: "", act: (app) => orbit(app.store, -STEP, 0) },
  { keys: ["ArrowUp"], name: "↑ ↓", doc: "raise and lower the camera", act: (app) => orbit(app.store, 0, STEP) },
  { keys: ["ArrowDown"], name: "", doc: "", act: (app) => orbit(app.store, 0, -STEP) },
  { keys: ["+", "="], name: "+ −", doc: "zoom in and out", act: (app) => zoom(app.store, 0.9) },
  { keys: ["-", "_"], name: "", doc: "", act: (app) => zoom(app.store, 1 / 0.9) },
  { keys: ["0", "Home"], name: "0", doc: "restore the initial view", act: (app) => resetCamera(app.store) },
  { keys: ["f"], name: "F", doc: "switch the white furnace on and off", act: (app) => app.store.set("furnace", !app.state.furnace) },
  {
    keys: ["m"],
    name: "M",
    doc: "next shape",
    act: (app) => app.store.set("view.mesh", MESHES[(MESHES.indexOf(app.state.view.mesh) + 1) % MESHES.length] as MeshName),
  },
  { keys: ["l"], name: "L", doc: "switch the labels on and off", act: (app) => app.store.set("view.labels", !app.state.view.labels) },
  { keys: ["["], name: "[ ]", doc: "decrease and increase the exposure by half a stop", act: (app) => app.store.set("display.exposure", app.state.display.exposure - 0.5) },
  { keys: ["]"], name: "", doc: "", act: (app) => app.store.set("display.exposure", app.state.display.exposure + 0.5) },
  { keys: ["t"], name: "T", doc: "switch between the light and dark theme", act: (_, actions) => actions.theme() },
  { keys: ["c"], name: "C", doc: "copy a link that contains all settings", act: (_, actions) => actions.copyLink() },
  { keys: ["s"], name: "S", doc: "save the picture as PNG", act: (_, actions) => actions.screenshot() },
  {
    keys: ["1", "2", "3", "4", "5", "6"],
    name: "1 … 6",
    doc: "show only row A … F",
    act: (app, _, key) => {
      const slot = Number(key) - 1;
      if (app.state.slots[slot]) app.store.set("solo", app.state.solo === slot ? null : slot);
    },
  },
  { keys: ["Escape"], name: "Esc", doc: "show all rows", act: (app) => app.store.set("solo", null) },
];

export function attachKeys(app: PageApp, actions: Actions, help: HTMLDialogElement): void {
  // In the capture phase: the side panel's controls stop key presses from propagating.
  const listen = (event: KeyboardEvent) => {
    if (event.ctrlKey || event.metaKey || event.altKey || help.open) return;
    const target = event.target as HTMLElement;
    // Text fields take letters; a slider, a tick or a color that was just used must not.
    if (target.matches("input:not([type=range], [type=checkbox], [type=color]), select, textarea, [contenteditable]")) return;
    if (target.matches("input") && (event.key.length > 1 || event.key === " ") && event.key !== "Escape") return;
    // In a row of tabs or a panel's own canvas the arrow keys belong to that element.
    if (event.key.startsWith("Arrow") && target.closest(".dock, .overlay, [role=radiogroup]")) return;
    if (event.key === "?" || event.key === "h") {
      help.showModal();
      return;
    }
    const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const key = KEYS.find((k) => k.keys.includes(name));
    if (!key) return;
    event.preventDefault();
    key.act(app, actions, name);
  };
  addEventListener("keydown", listen, { capture: true });
}

export function helpCard(notes: readonly string[]): HTMLDialogElement {
  const dialog = element("dialog", { class: "help" });
  const rows = KEYS.filter((k) => k.name).map((k) => element("tr", {}, element("td", {}, element("kbd", {}, k.name)), element("td", {}, k.doc)));
  dialog.append(
    element("h2", {}, "Keys and gestures"),
    element("table", {}, ...rows),
    element(
      "ul",
      {},
      element("li", {}, "Drag to rotate the view, drag with the shift key or the right button to pan, and use the wheel or two fingers to zoom."),
      element("li", {}, "Click a ball to edit its parameters; the panels below show its lobe at that point."),
      element("li", {}, "Double-click a control to restore its default."),
      element("li", {}, "Drop an .hdr file to set the environment, or a .glb, .gltf or .obj file to set the shape."),
      ...notes.map((note) => element("li", {}, note)),
    ),
    button("Close", "Close (Esc)", () => dialog.close()),
  );
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  return dialog;
}
