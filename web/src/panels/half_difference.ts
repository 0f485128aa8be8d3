/**
 * The BSDF in half and difference angles: curves over theta_h or theta_d, and the image slice theta_h x theta_d at one
 * phi_d, the usual view of measured BRDFs: highlight along the left edge, Fresnel's rise along the top, retro-reflection
 * along the bottom.
 */
import type { App, Panel } from "../panel";
import type { Change } from "../state";
import { type Channel, CHANNELS, channelOf, check, type Control, element, exact, latest, legend, type Model, overlaid, range, select, short, Sketch } from "../plots/base";
import { Curves } from "../plots/curves";
import { fromHalf, RADIANS } from "../plots/directions";
import { paint } from "../plots/colormaps";
import { quantile } from "../plots/metrics";
import { channelIn } from "../plots/viewing";

const DEFAULTS = { show: "image" as Show, thetaH: 0, thetaD: 0, phiD: 90, log: false, exposure: 0, falseColor: false, model: 0 };
type Show = "image" | "half" | "difference";
const SHOW: Record<Show, string> = { image: "image slice", half: "curve over θh", difference: "curve over θd" };
const SIDE = 180;
/** The largest range of the scale. */
const DECADES = 5;

interface Image {
  model: Model;
  rgb: Float32Array;
}

class HalfDifferencePanel implements Panel {
  readonly id = "half-difference";
  readonly title = "θh θd";
  readonly order = 3;
  readonly doc = "Curves and the image slice over half angle and difference angle";
  private app!: App;
  private controls!: Record<"thetaH" | "thetaD" | "phiD" | "exposure", Control<number>>;
  private show!: Control<Show>;
  private log!: Control<boolean>;
  private falseColor!: Control<boolean>;
  private channel!: Control<Channel>;
  private curvesHost!: HTMLElement;
  private curves!: Curves;
  private imagesHost!: HTMLElement;
  private key!: HTMLElement;
  private note!: HTMLElement;
  private ask!: () => void;
  private readonly figures: Figure[] = [];
  private span: [number, number] = [0, 1];

  mount(host: HTMLElement, app: App): void {
    this.app = app;
    host.classList.add("p-panel");
    const set = (values: Partial<typeof DEFAULTS>) => app.store.setPanel(this.id, values);
    const bar = element("div", "p-bar");
    this.show = select(bar, "show", "An image over both angles, or a curve over one", SHOW, (show) => set({ show }));
    this.controls = {
      thetaH: range(bar, "θh", "Angle between half vector and normal", [0, 89, 0.5], "°", (thetaH) => set({ thetaH })),
      thetaD: range(bar, "θd", "Angle between half vector and ωi: the angle of the Fresnel term", [0, 89, 0.5], "°", (thetaD) => set({ thetaD })),
      phiD: range(bar, "φd", "Azimuth of ωi about the half vector", [0, 180, 1], "°", (phiD) => set({ phiD })),
      exposure: range(bar, "exposure", "Brightness of the image slice, in stops", [-10, 10, 0.1], "", (exposure) => set({ exposure })),
    };
    this.log = check(bar, "log", "Logarithmic values of the curves", (log) => set({ log }));
    this.falseColor = check(bar, "false color", `The selected channel in viridis, logarithmic`, (falseColor) => set({ falseColor }));
    this.channel = select(bar, "channel", "Channel of the RGB value to draw", CHANNELS, (channel) => app.store.setPanel("viewing", { channel }));
    const body = element("div", "p-body");
    this.curvesHost = element("div", "p-cell p-wide");
    this.imagesHost = element("div", "p-images");
    body.append(this.curvesHost, this.imagesHost);
    this.key = element("div", "p-legend");
    this.note = element("div", "p-note");
    const foot = element("div", "p-foot");
    foot.append(this.key, this.note);
    host.append(bar, body, foot);
    this.curves = new Curves(this.curvesHost, app);
    this.ask = latest(app, () => this.compute());
    this.ask();
  }

  update(change: Change): void {
    if (change.touches("slots", "solo", "selection", `panels.${this.id}`, "panels.viewing", "display.theme")) this.ask();
  }

  refresh(what: string): void {
    if (what === "theme") this.ask();
  }

  private async compute(): Promise<void> {
    const { app } = this;
    const settings = app.store.panel(this.id, DEFAULTS);
    for (const [name, control] of Object.entries(this.controls)) control.show(settings[name as keyof typeof this.controls]);
    this.show.show(settings.show);
    this.log.show(settings.log);
    this.falseColor.show(settings.falseColor);
    this.channel.show(channelIn(app));
    const image = settings.show === "image";
    this.controls.thetaH.hide(settings.show !== "difference");
    this.controls.thetaD.hide(settings.show !== "half");
    this.controls.exposure.hide(!image || settings.falseColor);
    this.falseColor.hide(!image);
    this.log.hide(image);
    this.channel.hide(image && !settings.falseColor);
    this.curvesHost.hidden = settings.show === "image";
    this.imagesHost.hidden = settings.show !== "image";
    if (settings.show === "image") await this.images(settings);
    else await this.curve(settings);
  }

  private async curve(settings: typeof DEFAULTS): Promise<void> {
    const { app } = this;
    const models = overlaid(app);
    const overHalf = settings.show === "half";
    // Uniform, and denser at 0, where lobes are narrow.
    const angles = [...Array.from({ length: 360 }, (_, i) => 0.25 * i), ...Array.from({ length: 240 }, (_, i) => 0.005 * 2000 ** (i / 239))].sort((a, b) => a - b);
    const pairs = angles.map((a) => ({ a, ...fromHalf((overHalf ? a : settings.thetaH) * RADIANS, (overHalf ? settings.thetaD : a) * RADIANS, settings.phiD * RADIANS) }));
    const above = pairs.filter(({ wo, wi }) => wo[2] > 0 && wi[2] > 0);
    const channel = channelIn(app);
    const series = [];
    for (const model of models) {
      if (!above.length) break;
      const { value } = await app.evaluator.evaluate(model.shader, model.values, above.flatMap((p) => p.wo), above.flatMap((p) => p.wi));
      const values = above.map(({ wi }, i) => channelOf(value, i, channel) / wi[2]);
      series.push({ label: model.letter, color: model.color, values: settings.log ? values.map((v) => (v > 0 ? v : null)) : values });
    }
    this.curves.show({
      x: above.map((p) => p.a),
      series,
      xTitle: overHalf ? "θh (degrees)" : "θd (degrees)",
      yTitle: "f (1/sr)",
      log: settings.log,
      xRange: [0, 90],
    });
    legend(this.key, models);
    const fixed = overHalf ? `θd ${short(settings.thetaD)}°` : `θh ${short(settings.thetaH)}°`;
    this.note.textContent = `f at ${fixed}, φd ${settings.phiD}°; ${channel}. The curve ends where ωo or ωi is below the surface.`;
  }

  private async images(settings: typeof DEFAULTS): Promise<void> {
    const { app } = this;
    const models = overlaid(app);
    const wo: number[] = [];
    const wi: number[] = [];
    const up = new Uint8Array(SIDE * SIDE);
    for (let row = 0; row < SIDE; row++)
      for (let column = 0; column < SIDE; column++) {
        const pair = fromHalf(angleAt(column), angleAt(SIDE - 1 - row), settings.phiD * RADIANS);
        up[row * SIDE + column] = pair.wo[2] > 0 && pair.wi[2] > 0 ? 1 : 0;
        wo.push(...pair.wo);
        wi.push(...pair.wi);
      }
    const images: Image[] = [];
    for (const model of models) {
      const { value } = await app.evaluator.evaluate(model.shader, model.values, wo, wi);
      for (let i = 0; i < up.length; i++) {
        const cos = wi[3 * i + 2] as number;
        for (let c = 0; c < 3; c++) value[3 * i + c] = up[i] ? (value[3 * i + c] as number) / cos : Number.NaN;
      }
      images.push({ model, rgb: value });
    }
    const channel = channelIn(app);
    // At grazing angles f is unbounded: the scale ends at the 99th percentile.
    const all = Float32Array.from(images.flatMap(({ rgb }) => Array.from({ length: SIDE * SIDE }, (_, i) => channelOf(rgb, i, channel)))).filter((v) => v > 0);
    const high = quantile(all, 0.99) || 1;
    this.span = [Math.min(Math.max(quantile(all, 0.01), high / 10 ** DECADES), high / 10), high];
    while (this.figures.length < images.length) this.figures.push(new Figure(app));
    while (this.imagesHost.children.length > images.length) this.imagesHost.lastElementChild?.remove();
    images.forEach((image, i) => {
      const figure = this.figures[i] as Figure;
      if (!figure.host.isConnected) this.imagesHost.append(figure.host);
      figure.show(image, settings, this.span);
    });
    legend(this.key, models);
    const scale = settings.falseColor
      ? `${channel}, viridis from ${short(this.span[0])} or less to ${short(this.span[1])} 1/sr or more (log)`
      : `f · 2^${short(settings.exposure)} shown as sRGB; values of 1 and above are white`;
    this.note.textContent = `f(θh, θd) at φd ${settings.phiD}°; ${scale}. Hatched: ωo or ωi below the surface.`;
  }
}

/** One model's image slice, with its axes and the values under the pointer. */
class Figure {
  readonly host = element("figure", "p-figure");
  private readonly read = element("figcaption", "p-read");
  private readonly bitmap = Object.assign(element("canvas"), { width: SIDE, height: SIDE });
  private readonly sketch: Sketch;
  private image: Image | null = null;

  constructor(private readonly app: App) {
    this.sketch = new Sketch(this.host, (context, width, height) => {
      const box = plotBox(width, height);
      hatch(context, box, app.cssColor("--line"));
      context.imageSmoothingEnabled = false;
      context.drawImage(this.bitmap, box.x, box.y, box.size, box.size);
      frame(context, box, app.cssColor("--text"), this.image?.model.color ?? "");
    });
    this.host.append(this.read);
    const point = (event: PointerEvent) => this.point(event);
    this.sketch.canvas.addEventListener("pointermove", point);
    this.sketch.canvas.addEventListener("pointerdown", point);
    this.sketch.canvas.addEventListener("pointerleave", () => (this.read.textContent = this.image?.model.label ?? ""));
  }

  show(image: Image, settings: typeof DEFAULTS, span: [number, number]): void {
    this.image = image;
    this.read.textContent = image.model.label;
    const channel = channelIn(this.app);
    const pixels = settings.falseColor
      ? paint(Float32Array.from({ length: SIDE * SIDE }, (_, i) => channelOf(image.rgb, i, channel)), SIDE, SIDE, "viridis", ...span, true)
      : srgbImage(image.rgb, 2 ** settings.exposure);
    (this.bitmap.getContext("2d") as CanvasRenderingContext2D).putImageData(pixels, 0, 0);
    this.sketch.redraw();
  }

  private point(event: PointerEvent): void {
    if (!this.image) return;
    const { model, rgb } = this.image;
    const bounds = this.sketch.canvas.getBoundingClientRect();
    const box = plotBox(bounds.width, bounds.height);
    const [x, y] = [(event.clientX - bounds.left - box.x) / box.size, (event.clientY - bounds.top - box.y) / box.size];
    if (x < 0 || y < 0 || x >= 1 || y >= 1) return;
    const [column, row] = [Math.floor(x * SIDE), Math.floor(y * SIDE)];
    const numbers = [0, 1, 2].map((c) => rgb[3 * (row * SIDE + column) + c] as number);
    const angles = `θh ${short(angleAt(column) / RADIANS)}° θd ${short(angleAt(SIDE - 1 - row) / RADIANS)}°`;
    this.read.textContent = `${model.letter}  ${angles}: ${Number.isNaN(numbers[0]) ? "below the surface" : `${numbers.map(exact).join("  ")} 1/sr`}`;
  }
}

/** Center of a pixel: 0 to 90 degrees in SIDE steps. */
const angleAt = (pixel: number) => ((pixel + 0.5) / SIDE) * (Math.PI / 2);

interface Box {
  x: number;
  y: number;
  size: number;
}

function plotBox(width: number, height: number): Box {
  const size = Math.max(20, Math.min(width - 60, height - 44));
  return { x: 44 + Math.max(0, (width - 60 - size) / 2), y: 8, size };
}

function frame(context: CanvasRenderingContext2D, { x, y, size }: Box, text: string, color: string): void {
  context.strokeStyle = color;
  context.lineWidth = 2;
  context.strokeRect(x, y, size, size);
  context.fillStyle = text;
  context.font = "11px system-ui, sans-serif";
  for (const degrees of [0, 30, 60, 90]) {
    context.textAlign = "center";
    context.textBaseline = "top";
    context.fillText(`${degrees}°`, x + (degrees / 90) * size, y + size + 4);
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.fillText(`${degrees}°`, x - 5, y + size - (degrees / 90) * size);
  }
  context.textAlign = "center";
  context.textBaseline = "top";
  context.fillText("θh", x + size / 2, y + size + 18);
  context.save();
  context.translate(x - 40, y + size / 2);
  context.rotate(-Math.PI / 2);
  context.fillText("θd", 0, 0);
  context.restore();
}

function hatch(context: CanvasRenderingContext2D, { x, y, size }: Box, color: string): void {
  context.save();
  context.beginPath();
  context.rect(x, y, size, size);
  context.clip();
  context.strokeStyle = color;
  context.lineWidth = 1;
  context.beginPath();
  for (let i = -size; i < size; i += 7) {
    context.moveTo(x + i, y + size);
    context.lineTo(x + i + size, y);
  }
  context.stroke();
  context.restore();
}

/** Linear RGB to display bytes by the sRGB curve; NaN stays transparent. */
function srgbImage(rgb: Float32Array, scale: number): ImageData {
  const image = new ImageData(SIDE, SIDE);
  for (let i = 0; i < SIDE * SIDE; i++) {
    if (Number.isNaN(rgb[3 * i] as number)) continue;
    for (let c = 0; c < 3; c++) {
      const v = Math.min(1, Math.max(0, (rgb[3 * i + c] as number) * scale));
      image.data[4 * i + c] = 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
    }
    image.data[4 * i + 3] = 255;
  }
  return image;
}

export default new HalfDifferencePanel();
