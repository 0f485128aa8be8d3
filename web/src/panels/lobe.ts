/** The lobe in 3-D at the clicked point: distance from the center = f(wo, wi) |cos theta_i| in the direction wi. */
import type { Vec3 } from "../data";
import type { App, Panel } from "../panel";
import type { Change } from "../state";
import { channelOf, check, element, latest, legend, limitsOf, overlaid, select, short } from "../plots/base";
import { colorTable } from "../plots/colormaps";
import { type Lobe, lobeIndices, lobeOf, radius } from "../plots/lobe_mesh";
import { type Arrow, LobeView, type Surface } from "../plots/lobe_view";
import { rgb } from "../plots/theme";
import { channelIn, viewingTouched, ViewingControls, woOf } from "../plots/viewing";

const DECADES = 4;
const DEFAULTS = { log: false, color: "auto" as "auto" | "model" | "value" };

class LobePanel implements Panel {
  readonly id = "lobe";
  readonly title = "Lobe";
  readonly order = 1;
  readonly marksPoint = true;
  readonly doc = "The lobe at the selected point, in 3-D";
  private app!: App;
  private view!: LobeView;
  private viewing!: ViewingControls;
  private log!: ReturnType<typeof check>;
  private color!: { show(value: "auto" | "model" | "value"): void };
  private key!: HTMLElement;
  private note!: HTMLElement;
  private ask!: () => void;

  mount(host: HTMLElement, app: App): void {
    this.app = app;
    host.classList.add("p-panel");
    const bar = element("div", "p-bar");
    this.viewing = new ViewingControls(bar, app);
    this.log = check(bar, "log", `Logarithmic length over ${DECADES} decades below the largest value`, (log) => app.store.setPanel(this.id, { log }));
    this.color = select(bar, "color", "Color by model, or by value (viridis, with the same scale as the length)", { auto: "auto", model: "by model", value: "by value" }, (color) =>
      app.store.setPanel(this.id, { color }),
    );
    const body = element("div", "p-body p-lobe");
    this.key = element("div", "p-legend");
    this.note = element("div", "p-note");
    const foot = element("div", "p-foot");
    foot.append(this.key, this.note);
    host.append(bar, body, foot);
    this.view = new LobeView(body, lobeIndices());
    this.ask = latest(app, () => this.compute());
    this.ask();
  }

  update(change: Change): void {
    if (viewingTouched(change) || change.touches(`panels.${this.id}`, "display.theme")) this.ask();
  }

  refresh(what: string): void {
    if (what === "picked" || what === "theme") this.ask();
  }

  private async compute(): Promise<void> {
    const { app } = this;
    const { log, color } = app.store.panel(this.id, DEFAULTS);
    const wo = woOf(app);
    const channel = channelIn(app);
    const models = overlaid(app);
    this.viewing.show(models.some((m) => m.shader.manifest.transmits));
    this.log.show(log);
    this.color.show(color);
    const lobes: Lobe[] = await Promise.all(models.map((model) => lobeOf(app.evaluator, model, wo, channel)));
    const peak = Math.max(...lobes.map((l) => l.peak), 0);
    const byValue = color === "value" || (color === "auto" && lobes.length === 1);
    const surfaces = lobes.map((lobe): Surface => {
      const tint = rgb(lobe.model.color);
      const table = colorTable("viridis");
      const count = lobe.values.length / 3;
      const vertices = new Float32Array(6 * count);
      let size = 0;
      for (let i = 0; i < count; i++) {
        const r = radius(channelOf(lobe.values, i, channel), peak, log ? DECADES : null);
        size += r;
        const at = 4 * Math.round(255 * Math.min(1, r));
        for (let c = 0; c < 3; c++) {
          vertices[6 * i + c] = r * (lobe.directions[3 * i + c] as number);
          vertices[6 * i + 3 + c] = byValue ? (table[at + c] as number) / 255 : (tint[c] as number);
        }
      }
      return { vertices, glass: false, size };
    });
    const ink = rgb(app.cssColor("--text"));
    // The smallest is opaque, those outside it are transparent: colors blended evenly would match no model's color.
    const smallest = Math.min(...surfaces.map((s) => s.size));
    for (const surface of surfaces) if (surface.size > smallest) surface.glass = true;
    const arrows: Arrow[] = [
      { direction: [0, 0, 1], color: ink, label: "n" },
      { direction: [1, 0, 0], color: ink, label: "t" },
      { direction: wo, color: ink, label: "ωo" },
    ];
    this.view.show(surfaces, arrows, ink.map((v) => 0.5 * v + 0.25) as Vec3);
    legend(this.key, models, (m) => `: largest ${short(lobes.find((l) => l.model === m)?.peak ?? 0)} 1/sr`);
    const length = log ? `outer ring ${short(peak)} 1/sr, center ${short(peak / 10 ** DECADES)} 1/sr or less (log)` : `outer ring ${short(peak)} 1/sr, center 0`;
    this.note.textContent = peak > 0 ? `Length: f |cos θi|, ${channel}; ${length}.${limitsOf(models)}` : `No model scatters light from this ωo.${limitsOf(models)}`;
  }
}

export default new LobePanel();
