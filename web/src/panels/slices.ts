/** The BSDF in one plane through the normal: polar and Cartesian, with wo marked. */
import type { App, Panel } from "../panel";
import type { Change } from "../state";
import { channelOf, check, element, latest, legend, limitsOf, type Model, overlaid, range, select, short, Sketch } from "../plots/base";
import { Curves } from "../plots/curves";
import { phiOf, polar, RADIANS, thetaOf } from "../plots/directions";
import { radius } from "../plots/lobe_mesh";
import { channelIn, viewingTouched, ViewingControls, woOf } from "../plots/viewing";

type Quantity = "eval" | "f" | "pdf";
const QUANTITIES: Record<Quantity, string> = { eval: "f |cos θi|", f: "f", pdf: "pdf of sample" };
const DEFAULTS = { quantity: "eval" as Quantity, log: false, turn: 0 };
const DECADES = 4;

interface Slice {
  model: Model;
  values: number[];
}

class SlicesPanel implements Panel {
  readonly id = "slices";
  readonly title = "Slices";
  readonly order = 2;
  readonly marksPoint = true;
  readonly doc = "Polar and Cartesian slices in the plane of incidence, or rotated out of it";
  private app!: App;
  private viewing!: ViewingControls;
  private quantity!: { show(value: Quantity): void };
  private log!: { show(on: boolean): void };
  private turn!: { show(value: number): void };
  private key!: HTMLElement;
  private note!: HTMLElement;
  private curves!: Curves;
  private sketch!: Sketch;
  private drawn: { angles: number[]; slices: Slice[]; wo: number; half: number; unit: string } | null = null;
  private ask!: () => void;

  mount(host: HTMLElement, app: App): void {
    this.app = app;
    host.classList.add("p-panel");
    const set = (values: Partial<typeof DEFAULTS>) => app.store.setPanel(this.id, values);
    const bar = element("div", "p-bar");
    this.quantity = select(bar, "show", "f |cos θi| is the integrand of the reflection integral, f is the BSDF itself, and pdf is the density of sample()", QUANTITIES, (quantity) => set({ quantity }));
    this.log = check(bar, "log", "Logarithmic values", (log) => set({ log }));
    this.turn = range(bar, "turn", "Angle between the plane of the slice and the plane of incidence", [-90, 90, 1], "°", (turn) => set({ turn }));
    this.viewing = new ViewingControls(bar, app);
    const body = element("div", "p-body p-two");
    const left = element("div", "p-cell");
    const right = element("div", "p-cell p-wide");
    body.append(left, right);
    this.key = element("div", "p-legend");
    this.note = element("div", "p-note");
    const foot = element("div", "p-foot");
    foot.append(this.key, this.note);
    host.append(bar, body, foot);
    this.sketch = new Sketch(left, (context, width, height) => this.drawPolar(context, width, height));
    this.curves = new Curves(right, app);
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
    const { quantity, log, turn } = app.store.panel(this.id, DEFAULTS);
    const wo = woOf(app);
    const channel = channelIn(app);
    const models = overlaid(app);
    const transmits = models.some((m) => m.shader.manifest.transmits);
    const half = transmits ? 180 : 90;
    this.viewing.show(transmits);
    this.quantity.show(quantity);
    this.log.show(log);
    this.turn.show(turn);
    // Positive angles are on the side of the mirror direction: azimuth phi_o + 180 degrees.
    const azimuth = phiOf(wo) + Math.PI + turn * RADIANS;
    const read = async (model: Model, angles: number[]): Promise<number[]> => {
      const wi = angles.flatMap((a) => polar(a * RADIANS, azimuth));
      const { value, pdf } = await app.evaluator.evaluate(model.shader, model.values, wo, wi);
      return angles.map((angle, i) => {
        if (quantity === "pdf") return pdf[i] as number;
        const cos = Math.abs(Math.cos(angle * RADIANS));
        return channelOf(value, i, channel) / (quantity === "f" ? Math.max(cos, 1e-6) : 1);
      });
    };
    const even = Array.from({ length: 721 }, (_, i) => -half + ((i + 0.5) * 2 * half) / 721);
    const angles = [...even, thetaOf(wo) / RADIANS];
    const coarse = angles.slice();
    // Angles are denser near the largest value of each model and side, so that a narrow lobe has its true height.
    for (const values of await Promise.all(models.map((model) => read(model, coarse)))) {
      for (const side of [(a: number) => Math.abs(a) < 90, (a: number) => Math.abs(a) > 90]) {
        let best = -1;
        values.forEach((v, i) => {
          if (side(coarse[i] as number) && (best < 0 || v > (values[best] as number))) best = i;
        });
        const peak = best < 0 ? null : (coarse[best] as number);
        if (peak !== null) for (let k = -40; k <= 40; k++) if (k) angles.push(peak + Math.sign(k) * 10 ** (-3.5 + (4 * Math.abs(k)) / 40));
      }
    }
    const sorted = [...new Set(angles)].filter((a) => Math.abs(a) < half).sort((a, b) => a - b);
    const slices: Slice[] = await Promise.all(models.map(async (model) => ({ model, values: await read(model, sorted) })));
    const unit = `${QUANTITIES[quantity]} (1/sr)`;
    this.drawn = { angles: sorted, slices, wo: -thetaOf(wo) / RADIANS, half, unit };
    this.sketch.redraw();
    this.curves.show({
      x: sorted,
      series: slices.map(({ model, values }) => ({ label: model.letter, color: model.color, values: log ? values.map((v) => (v > 0 ? v : null)) : values })),
      xTitle: "θi (degrees; + is the mirror side)",
      yTitle: unit,
      log,
      xRange: [-half, half],
      marks: turn === 0 ? [{ x: -thetaOf(wo) / RADIANS, label: "ωo" }, { x: thetaOf(wo) / RADIANS, label: "mirror" }] : [],
    });
    legend(this.key, models);
    this.note.textContent = `${turn === 0 ? "Plane of incidence" : `Plane ${turn}° out of the plane of incidence`}; θo ${short(thetaOf(wo) / RADIANS)}°; ${
      quantity === "pdf" ? "density over solid angle" : channel
    }.${limitsOf(models)}`;
  }

  private drawPolar(context: CanvasRenderingContext2D, width: number, height: number): void {
    const { drawn, app } = this;
    if (!drawn) return;
    const { log } = app.store.panel(this.id, DEFAULTS);
    const full = drawn.half > 90;
    const size = Math.min(width / 2 - 26, full ? height / 2 - 20 : height - 40);
    if (size < 20) return;
    const [cx, cy] = [width / 2, full ? height / 2 : height - 18];
    const peak = Math.max(...drawn.slices.flatMap((s) => s.values.filter(Number.isFinite)), 0);
    const at = (degrees: number, r: number): [number, number] => [cx + r * size * Math.sin(degrees * RADIANS), cy - r * size * Math.cos(degrees * RADIANS)];
    const [text, line] = [app.cssColor("--text"), app.cssColor("--line")];
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "middle";
    context.lineWidth = 1;
    context.strokeStyle = line;
    for (const r of [0.25, 0.5, 0.75, 1]) {
      context.beginPath();
      context.arc(cx, cy, r * size, full ? 0 : Math.PI, 2 * Math.PI);
      context.stroke();
    }
    for (let degrees = -drawn.half; degrees <= drawn.half; degrees += 30) {
      context.beginPath();
      context.moveTo(cx, cy);
      context.lineTo(...at(degrees, 1));
      context.stroke();
      context.fillStyle = text;
      context.textAlign = degrees === 0 || Math.abs(degrees) === 180 ? "center" : degrees > 0 ? "left" : "right";
      const [x, y] = at(degrees, 1);
      if (degrees !== -180) context.fillText(`${Math.abs(degrees)}°`, x + (degrees === 0 || degrees === 180 ? 0 : 4 * Math.sign(degrees)), y - (Math.abs(degrees) === 180 ? -9 : 7));
    }
    for (const { model, values } of drawn.slices) {
      context.strokeStyle = model.color;
      context.lineWidth = 2;
      context.beginPath();
      drawn.angles.forEach((angle, i) => {
        const [x, y] = at(angle, radius(values[i] as number, peak, log ? DECADES : null));
        if (i === 0) context.moveTo(x, y);
        else context.lineTo(x, y);
      });
      context.stroke();
    }
    if (this.app.store.panel(this.id, DEFAULTS).turn === 0) this.arrow(context, [cx, cy], at(drawn.wo, 1));
    context.fillStyle = text;
    for (const r of [0.5, 1]) {
      const value = log ? peak * 10 ** (-DECADES * (1 - r)) : peak * r;
      context.textAlign = "center";
      this.plate(context, short(value), cx, cy - r * size + (r === 1 ? 9 : 0));
    }
  }

  private arrow(context: CanvasRenderingContext2D, from: [number, number], to: [number, number]): void {
    const angle = Math.atan2(to[1] - from[1], to[0] - from[0]);
    context.strokeStyle = context.fillStyle = this.app.cssColor("--text");
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(...from);
    context.lineTo(...to);
    for (const turn of [2.7, -2.7]) {
      context.moveTo(...to);
      context.lineTo(to[0] + 8 * Math.cos(angle + turn), to[1] + 8 * Math.sin(angle + turn));
    }
    context.stroke();
    context.textAlign = "center";
    context.fillText("ωo", from[0] + 0.8 * (to[0] - from[0]) - 14 * Math.sin(angle), from[1] + 0.8 * (to[1] - from[1]) + 14 * Math.cos(angle));
  }

  /** A label that is readable over a curve. */
  private plate(context: CanvasRenderingContext2D, text: string, x: number, y: number): void {
    const { width } = context.measureText(text);
    context.save();
    context.fillStyle = this.app.cssColor("--panel");
    context.globalAlpha = 0.8;
    context.fillRect(x - width / 2 - 2, y - 7, width + 4, 14);
    context.restore();
    context.fillText(text, x, y);
  }
}

export default new SlicesPanel();
