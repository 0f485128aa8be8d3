/** The albedo curve E(mu): the fraction of power scattered, from the mean weight of the emitted sample(). */
import type { App, Panel } from "../panel";
import type { Change } from "../state";
import { channelOf, element, latest, legend, type Model, overlaid, range, select, short, CHANNELS, type Channel } from "../plots/base";
import { Curves, type Series } from "../plots/curves";
import { polar, RADIANS } from "../plots/directions";
import type { AlbedoEstimate } from "../evaluator";
import { channelIn } from "../plots/viewing";

const DEFAULTS = { phi: 0 };
/** Nodes of E: uniform in mu, denser at grazing angles, where the curves bend. */
export const MUS = [0.01, 0.02, 0.035, ...Array.from({ length: 39 }, (_, i) => 0.05 + (0.95 * i) / 38)];
const TARGET = 5e-4;

class AlbedoPanel implements Panel {
  readonly id = "albedo";
  readonly title = "Albedo";
  readonly order = 4;
  readonly doc = "Directional albedo E(μ), the fraction of the power that is scattered, with a line at 1 for the white furnace";
  private app!: App;
  private curves!: Curves;
  private key!: HTMLElement;
  private note!: HTMLElement;
  private phi!: { show(v: number): void };
  private channel!: { show(v: Channel): void };
  private ask!: () => void;
  private generation = 0;

  mount(host: HTMLElement, app: App): void {
    this.app = app;
    host.classList.add("p-panel");
    const bar = element("div", "p-bar");
    this.channel = select(bar, "channel", "Channel of the RGB value to draw", CHANNELS, (channel) => app.store.setPanel("viewing", { channel }));
    this.phi = range(bar, "φo", "Azimuth of ωo from the tangent: relevant for anisotropic materials", [0, 180, 1], "°", (phi) => app.store.setPanel(this.id, { phi }));
    const body = element("div", "p-body");
    const cell = element("div", "p-cell p-wide");
    body.append(cell);
    this.key = element("div", "p-legend");
    this.note = element("div", "p-note");
    const foot = element("div", "p-foot");
    foot.append(this.key, this.note);
    host.append(bar, body, foot);
    this.curves = new Curves(cell, app);
    this.ask = latest(app, () => this.compute());
    this.ask();
  }

  update(change: Change): void {
    if (!change.touches("slots", "solo", "selection", `panels.${this.id}`, "panels.viewing", "display.theme")) return;
    this.generation += 1;
    this.ask();
  }

  refresh(what: string): void {
    if (what !== "theme") return;
    this.generation += 1;
    this.ask();
  }

  private async compute(): Promise<void> {
    const { app } = this;
    const generation = this.generation;
    const { phi } = app.store.panel(this.id, DEFAULTS);
    const channel = channelIn(app);
    this.phi.show(phi);
    this.channel.show(channel);
    const models = overlaid(app);
    const wo = MUS.flatMap((mu) => polar(Math.acos(mu), phi * RADIANS));
    const estimates = new Map<Model, AlbedoEstimate>();
    let shown = 0;
    // Interleaved: every curve appears at once, and all of them converge together.
    const estimated = models.filter((model) => model.shader.manifest.functions.sample).map(async (model) => {
      const progress = (estimate: AlbedoEstimate): boolean => {
        estimates.set(model, estimate);
        if (performance.now() - shown > 150 && generation === this.generation) {
          this.draw(models, estimates, channel);
          shown = performance.now();
        }
        return generation === this.generation;
      };
      await app.evaluator.albedo(model.shader, model.values, wo, { error: TARGET, progress });
    });
    await Promise.all(estimated);
    if (generation === this.generation) this.draw(models, estimates, channel);
  }

  private draw(models: Model[], estimates: Map<Model, AlbedoEstimate>, channel: Channel): void {
    const { app } = this;
    const text = app.cssColor("--text");
    const series: Series[] = [{ label: "furnace, 1", color: text, values: MUS.map(() => 1), dashed: true, width: 1 }];
    const bands: [number, number, string][] = [];
    let highest = 1;
    for (const model of models) {
      // A model without an estimate has an empty curve, so that the plot is not rebuilt when the estimate arrives.
      const estimate = estimates.get(model);
      const mean = MUS.map((_, i) => (estimate ? channelOf(estimate.value, i, channel) : null));
      // All channels come from the same samples: the error of their weighted sum is at most the sum of their errors.
      const edge = (side: number) => mean.map((v, i) => (v === null || !estimate ? null : v + side * channelOf(estimate.error, i, channel)));
      series.push({ label: `E ${model.letter}`, color: model.color, values: mean });
      const at = series.length;
      series.push({ label: `${model.letter} +2σ`, color: "transparent", values: edge(2), width: 0, edge: true });
      series.push({ label: `${model.letter} −2σ`, color: "transparent", values: edge(-2), width: 0, edge: true });
      bands.push([at, at + 1, `color-mix(in srgb, ${model.color} 30%, transparent)`]);
      highest = Math.max(highest, ...mean.map((v) => v ?? 0));
    }
    this.curves.show({
      x: MUS,
      series,
      xTitle: "μo = cos θo",
      yTitle: "E(μo)",
      xRange: [0, 1],
      y: [0, highest * 1.05],
      bands,
    });
    legend(this.key, models, (model) => {
      const estimate = estimates.get(model);
      if (!estimate) return model.shader.manifest.functions.sample ? ": waiting for samples" : ": the page does not contain its sample()";
      const worst = estimate.error.reduce((a, b) => Math.max(a, b), 0);
      const loss = Math.max(...MUS.map((_, i) => 1 - channelOf(estimate.value, i, channel)));
      return `: standard error ≤ ${short(worst)} (${estimate.samples.toLocaleString("en")} samples per direction), largest loss ${short(Number(loss.toFixed(4)))}`;
    });
    this.note.textContent = `Mean weight of the emitted sample(), reflected and transmitted power, ${channel}; band: ± 2 standard errors. On the line, nothing is lost.`;
  }
}

export default new AlbedoPanel();
