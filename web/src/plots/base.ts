/** Helpers of all panels: the models to overlay, small controls, and work of which the newest request wins. */
import type { Values, Vec3 } from "../data";
import type { App } from "../panel";
import type { Shader } from "../shaders";

/** One curve or surface of a plot: a slot's material with the values of the picked ball in that row. */
export interface Model {
  slot: number;
  /** "A", "B", ...: identifies a curve without relying on its color. */
  letter: string;
  label: string;
  color: string;
  shader: Shader;
  values: Values;
}

export const letterOf = (slot: number) => String.fromCharCode(65 + (slot % 26));

export function overlaid(app: App): Model[] {
  return app.visibleSlots().map((slot) => {
    const { label, balls } = app.state.slots[slot] as App["state"]["slots"][number];
    const ball = Math.min(app.picked.ball, balls.length - 1);
    const name = balls[ball]?.label;
    return {
      slot,
      letter: letterOf(slot),
      label: `${letterOf(slot)}  ${label}${name ? `, ${name}` : ""}`,
      color: app.slotColor(slot),
      shader: app.shaderOf(slot, ball),
      values: app.valuesOf(slot, ball),
    };
  });
}

/** Limits of a plot of eval for these models, as sentences that follow its note; "" if there are none. */
export function limitsOf(models: readonly Model[]): string {
  const letters = (which: (model: Model) => boolean) => models.filter(which).map((m) => m.letter).join(", ");
  const delta = letters((m) => m.shader.manifest.delta !== "never");
  const noisy = letters((m) => m.shader.manifest.stochastic);
  return (
    (delta ? ` ${delta}: the light of a mirror or of smooth glass leaves in single directions, has no finite value and is not drawn.` : "") +
    (noisy ? ` ${noisy}: values are random, correct only on average.` : "")
  );
}

/** Calls `work` at most once at a time; requests made meanwhile become one further run with the newest state. */
export function latest(app: App, work: () => Promise<void>): () => void {
  let running = false;
  let again = false;
  return async () => {
    again = true;
    if (running) return;
    running = true;
    try {
      while (again) {
        again = false;
        await work();
      }
    } catch (error) {
      app.say(error instanceof Error ? error.message : String(error), "error");
    } finally {
      running = false;
    }
  };
}

// ------------------------------------------------------------------ channels

export type Channel = "luminance" | "red" | "green" | "blue";
export const CHANNELS: Record<Channel, string> = { luminance: "luminance", red: "red", green: "green", blue: "blue" };
/** Rec. 709 luminance of linear RGB: the weights of the sRGB primaries. */
const WEIGHTS: Record<Channel, Vec3> = { luminance: [0.2126, 0.7152, 0.0722], red: [1, 0, 0], green: [0, 1, 0], blue: [0, 0, 1] };

export function channelOf(rgb: ArrayLike<number>, index: number, channel: Channel): number {
  const [r, g, b] = WEIGHTS[channel];
  const at = 3 * index;
  return r * (rgb[at] as number) + g * (rgb[at + 1] as number) + b * (rgb[at + 2] as number);
}

// ------------------------------------------------------------------ numbers

/** Short for axes and labels: 0.25, 12, 3e-5. */
export function short(value: number): string {
  if (value === 0 || !Number.isFinite(value)) return String(value);
  const size = Math.abs(value);
  if (size >= 1e4 || size < 1e-3) return value.toExponential(1).replace(/\.0e/, "e").replace("e+", "e");
  return String(Number(value.toPrecision(3)));
}

/** Nine digits distinguish any two float32 values. */
export const exact = (value: number) => (Number.isFinite(value) ? String(Number(value.toPrecision(9))) : String(value));

// ------------------------------------------------------------------ elements

/** An element by its class and text. */
export function element<K extends keyof HTMLElementTagNameMap>(tag: K, className = "", text = ""): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text) made.textContent = text;
  return made;
}

function labelled(host: HTMLElement, label: string, control: HTMLElement, doc: string): HTMLElement {
  const wrap = element("label", "p-control");
  wrap.title = doc;
  wrap.append(element("span", "", label), control);
  host.append(wrap);
  return wrap;
}

export interface Control<T> {
  show(value: T): void;
  enable(on: boolean): void;
  hide(on: boolean): void;
}

export function select<T extends string>(
  host: HTMLElement,
  label: string,
  doc: string,
  options: Record<T, string>,
  change: (value: T) => void,
): Control<T> & { options(options: Record<string, string>): void } {
  const input = element("select");
  const fill = (all: Record<string, string>) => {
    const value = input.value;
    input.replaceChildren(...Object.entries(all).map(([value, text]) => new Option(text, value)));
    if (value in all) input.value = value;
  };
  fill(options);
  input.addEventListener("change", () => change(input.value as T));
  const wrap = labelled(host, label, input, doc);
  return {
    show: (value) => (input.value = value),
    enable: (on) => (input.disabled = !on),
    hide: (on) => (wrap.hidden = on),
    options: fill,
  };
}

export function check(host: HTMLElement, label: string, doc: string, change: (on: boolean) => void): Control<boolean> {
  const input = element("input");
  input.type = "checkbox";
  input.addEventListener("change", () => change(input.checked));
  const wrap = element("label", "p-control p-check");
  wrap.title = doc;
  wrap.append(input, element("span", "", label));
  host.append(wrap);
  return { show: (on) => (input.checked = on), enable: (on) => (input.disabled = !on), hide: (on) => (wrap.hidden = on) };
}

/** A slider with its value; `unit` follows the value. */
export function range(
  host: HTMLElement,
  label: string,
  doc: string,
  [low, high, step]: [number, number, number],
  unit: string,
  change: (value: number) => void,
): Control<number> & { limits(low: number, high: number): void } {
  const input = element("input");
  Object.assign(input, { type: "range", min: String(low), max: String(high), step: String(step) });
  const read = element("output");
  const write = () => (read.textContent = `${short(input.valueAsNumber)}${unit}`);
  input.addEventListener("input", () => {
    write();
    change(input.valueAsNumber);
  });
  const wrap = element("label", "p-control p-range");
  wrap.title = doc;
  wrap.append(element("span", "", label), input, read);
  host.append(wrap);
  return {
    show: (value) => {
      input.value = String(value);
      write();
    },
    enable: (on) => (input.disabled = !on),
    hide: (on) => (wrap.hidden = on),
    limits: (a, b) => {
      input.min = String(a);
      input.max = String(b);
    },
  };
}

/** A canvas in device pixels; `draw` gets a context scaled to CSS pixels. It is redrawn when its box changes. */
export class Sketch {
  readonly canvas = element("canvas", "p-canvas");
  constructor(
    host: HTMLElement,
    private readonly draw: (context: CanvasRenderingContext2D, width: number, height: number) => void,
  ) {
    host.append(this.canvas);
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
  }

  redraw(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    const scale = window.devicePixelRatio || 1;
    const [w, h] = [Math.round(width * scale), Math.round(height * scale)];
    if (this.canvas.width !== w || this.canvas.height !== h) Object.assign(this.canvas, { width: w, height: h });
    const context = this.canvas.getContext("2d") as CanvasRenderingContext2D;
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, width, height);
    this.draw(context, width, height);
  }
}

/** The legend of a plot: letter, color, name. */
export function legend(host: HTMLElement, models: readonly Model[], extra: (model: Model) => string = () => ""): void {
  host.replaceChildren(
    ...models.map((model) => {
      const item = element("span", "p-legend-item");
      const swatch = element("i");
      swatch.style.background = model.color;
      item.append(swatch, element("span", "", `${model.label}${extra(model)}`));
      return item;
    }),
  );
}
