/** Comparison with the path-traced reference: how it is shown, and how large the difference is. */
import type { App, Panel } from "../panel";
import type { Change, CompareMode } from "../state";
import { type Control, element, select } from "../plots/base";
import { COMPARISON, type Comparison, comparisonOf, type Kind, KINDS } from "../plots/comparison";
import { type Pixels, PIXELS } from "../plots/metrics";

const MODES: Record<CompareMode, string> = { off: "raster only", side: "side by side", wipe: "wipe", difference: "difference" };
const RANGES = { auto: "automatic", "1": "0 to 1", "0.1": "0 to 0.1", "0.01": "0 to 0.01", "0.001": "0 to 0.001" };

class ComparePanel implements Panel {
  readonly id = COMPARISON;
  readonly title = "Compare";
  readonly order = 6;
  readonly doc = "The raster picture and the path-traced reference";
  private app!: App;
  private comparison!: Comparison;
  private mode!: Control<CompareMode>;
  private kind!: Control<Kind>;
  private range!: Control<string>;
  private pixels!: Control<Pixels>;
  private table!: HTMLTableElement;
  private note!: HTMLElement;

  /** Started at once: a link may open a page in which the comparison is on. */
  install(app: App): void {
    comparisonOf(app);
  }

  mount(host: HTMLElement, app: App): void {
    this.app = app;
    this.comparison = comparisonOf(app);
    host.classList.add("p-panel");
    const set = (values: Record<string, unknown>) => app.store.setPanel(COMPARISON, values);
    const bar = element("div", "p-bar");
    this.mode = select(bar, "show", "How the two pictures are laid out", MODES, (mode) => app.store.set("compare.mode", mode));
    this.kind = select(bar, "difference", "Quantity in false color", KINDS, (kind) => set({ kind }));
    this.range = select<string>(bar, "colors", "Range of the color scale", RANGES, (range) => set({ range }));
    this.pixels = select(bar, "pixels", "Pixels that the figures and the difference include", PIXELS, (pixels) => set({ pixels }));
    this.table = element("table", "p-numbers");
    const body = element("div", "p-fit");
    body.append(this.table);
    this.note = element("div", "p-note");
    host.append(bar, body, this.note);
    this.comparison.subscribe(() => this.write());
    this.show();
  }

  update(change: Change): void {
    if (change.touches("compare", `panels.${COMPARISON}`)) this.show();
  }

  private show(): void {
    const { kind, range, pixels } = this.comparison.settings();
    this.mode.show(this.app.state.compare.mode);
    this.kind.show(kind);
    this.range.show(range);
    this.pixels.show(pixels);
    this.write();
  }

  private write(): void {
    const { figures, lack } = this.comparison;
    const rows: [string, string, string][] = figures
      ? [
          ["RMSE", figures.rmse.toExponential(3), "root-mean-square difference of linear radiance"],
          ["relMSE", figures.relmse.toExponential(3), "mean of (x − r)² / (r² + 0.01), linear radiance"],
          ["mean x / mean r", figures.meanRatio.toFixed(5), "1 if no energy is lost or gained"],
          ["FLIP", figures.flip === null ? "…" : figures.flip.toFixed(5), "difference perceived when the displayed pictures alternate, from 0 (none) to 1 (largest)"],
          ["pixels", figures.pixels.toLocaleString("en"), PIXELS[this.comparison.settings().pixels]],
          ...(figures.broken ? [["not finite",  figures.broken.toLocaleString("en"), "pixels without a finite value, displayed as a checkerboard; only FLIP includes them, as displayed"] as [string, string, string]] : []),
          ["samples", `${figures.samples[0]} and ${figures.samples[1]}`, "samples per pixel of the raster picture (x) and of the reference (r)"],
        ]
      : [];
    this.table.replaceChildren(
      ...rows.map(([name, value, doc]) => {
        const row = element("tr");
        const explained = element("td", "p-explained", doc);
        row.title = doc;
        row.append(element("th", "", name), element("td", "", value), explained);
        return row;
      }),
    );
    this.note.textContent = figures ? "Without silhouettes: partly covered pixels and their neighbors are excluded, because the pixel filters differ there." : lack || "Waiting for the first pictures.";
  }
}

export default new ComparePanel();
