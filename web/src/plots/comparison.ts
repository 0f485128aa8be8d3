/**
 * Updates the comparison with the reference: the view over the canvas, its handle and scale, the figures.
 * One per page, created at its start, since a link may open a page in which it is on; the panel only shows and sets it.
 */
import type { App } from "../panel";
import type { Change } from "../state";
import { element, latest, short } from "./base";
import { colorTable, css } from "./colormaps";
import { CompareView } from "./compare_view";
import { flipMap } from "./flip";
import { counted, differenceMap, measure, type Measures, meanOf, type Pair, type Pixels, PIXELS, quantile, withoutBroken } from "./metrics";

export type Kind = "absolute" | "relative" | "flip";
export const KINDS: Record<Kind, string> = { absolute: "|x − r|", relative: "(x − r)² / (r² + 0.01)", flip: "FLIP" };
export const COMPARISON = "compare";
export const SETTINGS = { kind: "absolute" as Kind, pixels: "inside" as Pixels, range: "auto" };

export interface Figures extends Measures {
  /** Pixels that are not finite; only FLIP includes them. */
  broken: number;
  flip: number | null;
  samples: [number, number];
}

/** Twice a second at most: reading the raster picture back blocks the GPU. */
const PAUSE = 500;

export class Comparison {
  readonly view: CompareView;
  figures: Figures | null = null;
  /** Why there are no figures, for the panel to show. */
  lack = "";
  pair: Pair | null = null;
  private listeners = new Set<() => void>();
  private lastInputs = "";
  private flipOf = "";
  private flip: { map: Float32Array; mean: number } | null = null;
  private timer = 0;
  private decorated = "";
  private readonly handle = element("button", "p-handle");
  private readonly tags = [element("span", "p-tag"), element("span", "p-tag")] as const;
  private readonly scale = element("div", "p-scale");
  private readonly ask: () => void;

  constructor(private readonly app: App) {
    this.view = new CompareView(app, () => this.presented());
    app.presenter = this.view;
    this.ask = latest(app, () => this.compute());
    this.handle.setAttribute("aria-label", "Wipe: raster left, reference right; arrow keys move the boundary");
    app.overlay.append(this.handle, ...this.tags, this.scale);
    this.listen();
    app.store.subscribe((change) => this.update(change));
    this.decorate();
  }

  settings(): typeof SETTINGS {
    const settings = this.app.store.panel(COMPARISON, SETTINGS);
    return { ...settings, kind: settings.kind in KINDS ? settings.kind : "absolute", pixels: settings.pixels in PIXELS ? settings.pixels : "inside" };
  }

  subscribe(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Whether the figures or the differences are visible. */
  private wanted(): boolean {
    return this.app.state.compare.mode === "difference" || this.app.state.dock.open === COMPARISON;
  }

  private update(change: Change): void {
    if (change.touches("compare", "display.theme")) {
      this.decorate();
      this.app.redraw();
    }
    if (change.touches(`panels.${COMPARISON}`, "dock", "display", "compare")) {
      this.lastInputs = "";
      this.presented();
    }
  }

  private presented(): void {
    this.decorate();
    if (this.figures && this.app.referencePicture()?.stale) this.wait();
    if (!this.wanted() || this.timer) return;
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      this.ask();
    }, PAUSE);
  }

  private async compute(): Promise<void> {
    const { app } = this;
    const reference = app.referencePicture();
    if (!reference || reference.samples === 0) {
      this.figures = this.pair = null;
      this.lack =
        app.data.mode === "live"
          ? app.state.view.mesh === "sphere"
            ? "The reference has not sent its first frame yet."
            : "The reference renders spheres only: select the sphere as the shape to compare."
          : "This page has no server, and thus no path tracer to compare with. Start `gonio view` for a live reference.";
      for (const listener of this.listeners) listener();
      return;
    }
    if (reference.stale) return this.wait();
    const { term } = app.state.view;
    if (term !== "full" && term !== "compensated") {
      this.figures = this.pair = null;
      this.lack = "The picture shows one term; the reference shows the whole material. Select Full to compare.";
      for (const listener of this.listeners) listener();
      return;
    }
    const pair = this.view.pair();
    if (!pair) {
      this.figures = this.pair = null;
      this.lack = `The reference has ${reference.width} × ${reference.height} pixels, and the size of the raster picture is not a multiple of this size.`;
      for (const listener of this.listeners) listener();
      return;
    }
    const { kind, pixels, range } = this.settings();
    const { samples } = pair;
    const { exposure, tone, theme } = app.state.display;
    const inputs = [samples, kind, pixels, range, exposure, tone, theme, pair.width, pair.height].join();
    if (inputs === this.lastInputs) return;
    this.lastInputs = inputs;
    this.pair = pair;
    this.lack = "";
    const mask = counted(pair, pixels);
    // Values that are not finite have no distance; on the screen they are a pattern, which FLIP compares like any other.
    const { finite, broken } = withoutBroken(pair, mask);
    const figures = { ...measure(pair, finite), broken };
    this.figures = { ...figures, flip: this.flip?.mean ?? null, samples };
    if (kind !== "flip") this.paint(differenceMap(pair, finite, kind), pair);
    for (const listener of this.listeners) listener();
    const screen = [samples, exposure, tone, theme, pair.width, pair.height].join();
    if (screen !== this.flipOf) {
      const screens = this.view.screens(pair);
      const map = await flipMap(screens.test, screens.reference, pair.width, pair.height);
      this.flip = { map, mean: Number.NaN };
      this.flipOf = screen;
      if (app.referencePicture()?.stale) return this.wait();
    }
    if (this.flip) {
      this.flip.mean = meanOf(this.flip.map, mask);
      this.figures = { ...figures, flip: this.flip.mean, samples };
      if (kind === "flip") this.paint(this.flip.map.map((v, i) => (mask[i] ? v : Number.NaN)), pair);
    }
    for (const listener of this.listeners) listener();
  }

  /** The picture and the reference show two scenes: there are no figures. */
  private wait(): void {
    this.figures = this.pair = null;
    this.lastInputs = "";
    this.lack = "Waiting for the reference of the current state.";
    for (const listener of this.listeners) listener();
  }

  private paint(map: Float32Array, { width, height }: Pair): void {
    const { kind, range } = this.settings();
    const fixed = Number(range);
    this.view.high = range !== "auto" && fixed > 0 ? fixed : kind === "flip" ? 1 : roundUp(quantile(map, 0.995));
    this.view.setMap(map, width, height);
    this.decorate();
    this.app.redraw();
  }

  // ------------------------------------------------------------------ over the canvas

  private decorate(): void {
    const { mode, wipe } = this.app.state.compare;
    const reference = this.app.referencePicture();
    const ready = reference !== null && reference.samples > 0;
    const decorated = JSON.stringify([mode, wipe, reference?.samples, reference?.done, reference?.stale, this.view.high, this.settings(), this.app.canvas.clientWidth, this.app.canvas.clientHeight]);
    if (decorated === this.decorated) return; // called after every frame
    this.decorated = decorated;
    const two = ready && (mode === "wipe" || mode === "side");
    this.handle.hidden = !(ready && mode === "wipe");
    this.handle.style.left = `${100 * wipe}%`;
    const tall = this.app.canvas.clientHeight > this.app.canvas.clientWidth;
    const [left, right] = this.tags;
    left.hidden = right.hidden = !two;
    left.textContent = "raster";
    right.textContent = ready ? (reference.stale ? "previous reference …" : `reference, ${reference.samples} spp${reference.done ? "" : " …"}`) : "";
    const stacked = tall && mode === "side";
    // In the wipe the labels move with the boundary; they are always below the page's bar of terms.
    const bar = `${100 * wipe}%`;
    Object.assign(left.style, mode === "wipe" ? { left: "auto", right: `calc(100% - ${bar} + 18px)` } : { left: "8px", right: "auto" });
    Object.assign(right.style, mode === "wipe" ? { left: `calc(${bar} + 18px)`, top: "" } : stacked ? { left: "8px", top: "50%" } : { left: "50%", top: "" });
    this.scale.hidden = !(ready && mode === "difference");
    if (!this.scale.hidden) this.drawScale();
  }

  private drawScale(): void {
    const { kind, range, pixels } = this.settings();
    const table = colorTable("magma");
    const bar = element("i");
    const how = kind !== "flip" && range === "auto" ? "; 99.5 % of the pixels are within the scale" : "";
    this.scale.title = `${KINDS[kind]}, ${PIXELS[pixels]}${how}`;
    bar.style.background = `linear-gradient(to right, ${Array.from({ length: 17 }, (_, i) => css(table, i / 16)).join(", ")})`;
    const high = `${short(this.view.high)}${kind === "flip" && this.view.high === 1 ? "" : " or more"}`;
    this.scale.replaceChildren(element("span", "", `${KINDS[kind]}${this.app.referencePicture()?.stale ? ", previous state" : ""}`), element("b", "", "0"), bar, element("b", "", high));
  }

  private listen(): void {
    const { handle, app } = this;
    const set = (wipe: number) => app.store.set("compare.wipe", Math.min(1, Math.max(0, wipe)));
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      event.stopPropagation();
    });
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const { left, width } = app.canvas.getBoundingClientRect();
      set((event.clientX - left) / width);
    });
    handle.addEventListener("dblclick", (event) => {
      event.stopPropagation();
      set(0.5);
    });
    handle.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      set(app.state.compare.wipe + step);
    });
  }
}

/** The next of 1, 2, 5 times a power of ten: the scale is constant while the pictures converge. */
function roundUp(value: number): number {
  if (!(value > 0)) return 1e-6;
  const decade = 10 ** Math.floor(Math.log10(value));
  return ([1, 2, 5].find((step) => step * decade >= value) ?? 10) * decade;
}

const made = new WeakMap<App, Comparison>();

/** The page's comparison; called once at its start. */
export function comparisonOf(app: App): Comparison {
  let known = made.get(app);
  if (!known) {
    known = new Comparison(app);
    made.set(app, known);
  }
  return known;
}
