/** The page's layout: bar on top, picture with its labels, panel at the side, dock below. */
import { GUI } from "lil-gui";
import type { Fault, PageApp } from "../app";
import type { Live } from "../live";
import type { Change } from "../state";
import { Dock } from "./dock";
import { button, element } from "./dom";
import { attachDrop, openFile } from "./files";
import { type Actions, attachKeys, helpCard } from "./keys";
import { Busy } from "./busy";
import { Labels } from "./labels";
import { LightSection } from "./light_section";
import { ModelsSection } from "./models";
import { ViewSection, termBar } from "./view_section";

export interface Frame {
  root: HTMLElement;
  stage: HTMLElement;
  canvas: HTMLCanvasElement;
  overlay: HTMLElement;
}

/** Elements that the app needs at its start: a canvas with a size, and a container for labels. */
export function frame(host: HTMLElement): Frame {
  const canvas = element("canvas", { class: "picture", tabIndex: 0 });
  canvas.setAttribute("aria-label", "Shading balls. Drag to rotate, click a ball to edit it, press ? for keys.");
  const overlay = element("div", { class: "overlay" });
  const stage = element("main", { class: "stage" }, canvas, overlay);
  const root = element("div", { class: "page" }, stage);
  host.replaceChildren(root);
  return { root, stage, canvas, overlay };
}

export class Layout {
  private readonly models: ModelsSection;
  private readonly lights: LightSection;
  private readonly view: ViewSection;
  private readonly terms: ReturnType<typeof termBar>;
  private readonly labels: Labels;
  readonly dock: Dock;
  private readonly status = element("div", { class: "status" });
  private readonly fault = element("div", { class: "fault", hidden: true });
  private readonly furnace: HTMLButtonElement;
  private readonly solo: HTMLButtonElement;
  live: Live | null = null;

  constructor(
    private readonly app: PageApp,
    private readonly parts: Frame,
  ) {
    const actions: Actions = { copyLink: () => void this.copyLink(), screenshot: () => void this.screenshot(), theme: () => this.theme() };
    const notes = app.data.notes ?? [];
    const help = helpCard(notes);
    this.furnace = button("Furnace", "White furnace: a radiance of 1 from all directions (F)", () => app.store.set("furnace", !app.state.furnace));
    this.furnace.dataset["act"] = "furnace";
    this.solo = button("All rows", "Show all rows again (Esc)", () => app.store.set("solo", null), "solo-note");
    const bar = element(
      "header",
      { class: "bar" },
      element("h1", {}, "Gonio"),
      element("span", { class: "title", title: app.data.title }, app.data.title),
      ...(notes.length ? [button(notes.length === 1 ? "1 note" : `${notes.length} notes`, notes.join("\n"), () => help.showModal(), "notes")] : []),
      element("span", { class: "spacer" }),
      this.furnace,
      button("Link", "Copy a link to this view that contains all settings (C)", actions.copyLink),
      button("PNG", "Save the picture (S)", actions.screenshot),
      button("Reset", "Restore the page's initial state", () => app.store.reset()),
      button("◐", "Light or dark theme (T)", actions.theme, "icon"),
      button("?", "Keys and gestures (?)", () => help.showModal(), "icon"),
    );
    const side = element("aside", { class: "side" });
    const gui = new GUI({ container: side, title: "", injectStyles: false, autoPlace: false, width: 0 } as ConstructorParameters<typeof GUI>[0]);
    gui.domElement.style.removeProperty("--width");
    this.models = new ModelsSection(app, gui.addFolder("Material"));
    const lights = gui.addFolder("Lights");
    this.lights = new LightSection(app, lights, (kind) => openFile(app, kind));
    this.view = new ViewSection(app, gui.addFolder("View"), (kind) => openFile(app, kind));
    this.terms = termBar(app);
    this.fault.setAttribute("role", "alert");
    const busy = new Busy();
    app.onBusy = (what, text) => busy.set(what, text);
    const flaws = element("div", { class: "flaws", hidden: true });
    flaws.setAttribute("role", "alert");
    app.onFlaws = (text) => {
      flaws.hidden = text === "";
      flaws.textContent = text ? `${text} (checkered)` : "";
    };
    parts.stage.append(this.status, busy.host, flaws, this.fault);
    this.dock = new Dock(app);
    // Above the picture, not over it: three rows of balls fill its height.
    const top = element("div", { class: "top" }, this.terms.host, this.solo, this.terms.note);
    const center = element("div", { class: "center" }, element("div", { class: "view" }, top, parts.stage), this.dock.host);
    parts.root.replaceChildren(bar, center, side, help);
    this.labels = new Labels(app);
    attachKeys(app, actions, help);
    attachDrop(app, parts.stage);
    app.onSay = (text, kind) => this.say(text, kind);
    app.onFault = (fault) => this.showFault(fault);
  }

  update(change: Change): void {
    const { app } = this;
    if (change.touches("slots", "solo", "selection", "linked")) this.models.update();
    if (change.touches("lights", "furnace", "environment")) this.lights.update();
    this.view.update();
    this.terms.update();
    this.furnace.setAttribute("aria-pressed", String(app.state.furnace));
    this.solo.hidden = app.state.solo === null;
    this.labels.update();
    this.dock.update(change);
  }

  refresh(what: Parameters<Dock["refresh"]>[0]): void {
    if (what === "picture") this.labels.update();
    this.dock.refresh(what);
    this.showStatus();
  }

  showStatus(): void {
    const { renderer } = this.app;
    const parts = [`raster ${renderer.samples} spp${renderer.earlyShare > 0 ? " + split sum" : ""}`];
    const live = this.live?.status;
    if (live) {
      if (!live.connected || live.message) parts.push(`reference: ${live.message}`);
      else parts.push(`reference ${live.samples} / ${live.target} spp${live.device ? ` · ${live.device}` : ""}${live.done ? " · done" : ""}`);
    }
    const text = parts.join("   ");
    if (this.status.textContent !== text) this.status.textContent = text;
  }

  /** Shown over the last valid picture until the file is corrected. */
  private showFault(fault: Fault | null): void {
    this.fault.hidden = fault === null;
    this.fault.replaceChildren(
      ...(fault ? [element("b", {}, fault.where), element("span", {}, fault.what), element("span", { class: "remedy" }, fault.hint)] : []),
    );
  }

  private async copyLink(): Promise<void> {
    const link = this.app.link();
    try {
      await navigator.clipboard.writeText(link);
      this.say("Link copied: it contains all settings of this view.");
    } catch {
      // Pages from disk and frames may not write to the clipboard: the older API needs no permission.
      const area = element("textarea", { value: link });
      document.body.append(area);
      area.select();
      const copied = document.execCommand("copy");
      area.remove();
      this.say(copied ? "Link copied: it contains all settings of this view." : "The browser does not allow this page to copy; copy the link from the address bar.", copied ? "info" : "error");
    }
  }

  private async screenshot(): Promise<void> {
    const blob = await this.app.screenshot();
    const anchor = element("a", { href: URL.createObjectURL(blob), download: "gonio.png" });
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 10_000);
  }

  private theme(): void {
    this.app.store.set("display.theme", this.app.theme() === "dark" ? "light" : "dark");
  }

  private say(text: string, kind: "info" | "error" = "info"): void {
    const line = element("div", { class: `toast ${kind}` }, text);
    line.setAttribute("role", kind === "error" ? "alert" : "status");
    for (const old of this.parts.stage.querySelectorAll(".toast")) old.remove();
    this.parts.stage.append(line);
    setTimeout(() => line.remove(), kind === "error" ? 12_000 : 3000);
  }
}
