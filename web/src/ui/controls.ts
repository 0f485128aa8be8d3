/**
 * Controllers for lil-gui that read and write the page's state: scaled range, triple of numbers, color, choice, tick.
 * All of them show the state on `updateDisplay`, and restore the initial value on a double click.
 */
import { Controller, type GUI } from "lil-gui";
import { element, short } from "./dom";

/** Mapping from slider position to value. "square" resolves small values; "log" suits ranges of several decades. */
export type Scale = "linear" | "square" | "log";

export interface Field<T> {
  label: string;
  /** Its effect, in one line; shown as a tooltip. */
  doc: string;
  symbol?: string;
  unit?: string;
  get(): T;
  set(value: T): void;
  /** The value that a double click on the label or the slider restores. */
  initial(): T;
}

class Base<T> extends Controller {
  constructor(
    gui: GUI,
    readonly field: Field<T>,
    kind: string,
  ) {
    super(gui, { value: 0 }, "value", kind);
    this.name(field.label);
    const tip = [field.symbol ? `${field.symbol} — ` : "", field.doc, field.unit ? ` [${field.unit}]` : "", "\nDouble click: restore the default."].join("");
    this.domElement.title = tip;
    if (field.symbol && field.symbol !== field.label) this.$name.append(" ", element("i", {}, field.symbol));
    if (field.unit) this.$name.append(" ", element("small", {}, field.unit === "degrees" ? "°" : field.unit));
    this.domElement.addEventListener("dblclick", (event) => {
      if ((event.target as HTMLElement).matches("input[type=number], select, button")) return;
      field.set(field.initial());
      this.updateDisplay();
    });
  }
}

export interface RangeOptions {
  low: number;
  high: number;
  scale?: Scale;
  /** Digits of the number; the slider's own step is a thousandth of its range. */
  integer?: boolean;
  /** The number may exceed the slider's range. */
  open?: boolean;
  hint?: (value: number) => string;
}

const TRAVEL = 1000;

export class RangeControl extends Base<number> {
  private readonly slider = element("input", { type: "range", min: "0", max: String(TRAVEL), step: "1" });
  private readonly number = element("input", { type: "number" });
  private readonly hint = element("span", { class: "hint" });

  constructor(
    gui: GUI,
    field: Field<number>,
    private readonly settings: RangeOptions,
  ) {
    super(gui, field, "g-range");
    this.slider.setAttribute("aria-labelledby", this.$name.id);
    this.number.setAttribute("aria-labelledby", this.$name.id);
    this.number.step = "any";
    this.$widget.append(this.slider, this.number);
    if (settings.hint) this.$name.append(this.hint);
    this.slider.addEventListener("input", () => this.write(this.fromTravel(this.slider.valueAsNumber / TRAVEL)));
    this.number.addEventListener("change", () => {
      const value = this.number.valueAsNumber;
      if (Number.isFinite(value)) this.write(settings.open ? Math.max(settings.low, value) : Math.min(settings.high, Math.max(settings.low, value)));
      else this.updateDisplay();
    });
    this.updateDisplay();
  }

  private write(value: number): void {
    this.field.set(this.settings.integer ? Math.round(value) : Number(value.toPrecision(6)));
    this.updateDisplay();
  }

  private fromTravel(t: number): number {
    const { low, high, scale } = this.settings;
    if (scale === "square") return low + (high - low) * t * t;
    if (scale === "log") return low * (high / low) ** t;
    // Three digits of the range: 0.53249 would pretend precision that a slider lacks.
    const step = 10 ** Math.floor(Math.log10((high - low) / 200));
    return Math.min(high, Math.max(low, Math.round((low + (high - low) * t) / step) * step));
  }

  private toTravel(value: number): number {
    const { low, high, scale } = this.settings;
    if (scale === "square") return Math.sqrt(Math.max(0, (value - low) / (high - low)));
    if (scale === "log") return Math.log(Math.max(value, low) / low) / Math.log(high / low);
    return (value - low) / (high - low);
  }

  override updateDisplay(): this {
    if (!this.field) return this; // called by lil-gui's constructor, before ours has run
    const value = this.field.get();
    const travel = Math.min(1, Math.max(0, this.toTravel(value)));
    this.slider.value = String(Math.round(travel * TRAVEL));
    this.slider.style.setProperty("--at", `${travel * 100}%`);
    if (document.activeElement !== this.number) this.number.value = short(value);
    if (this.settings.hint) this.hint.textContent = this.settings.hint(value);
    return this;
  }
}

export class TripleControl extends Base<number[]> {
  private readonly inputs: HTMLInputElement[];
  private readonly swatch: HTMLInputElement | null;

  /** `color`: values 0 to 1 with a swatch as color picker; the swatch is sRGB, the numbers are linear. */
  constructor(
    gui: GUI,
    field: Field<number[]>,
    private readonly settings: { low: number | null; high: number | null; color: boolean; names?: [string, string, string] },
  ) {
    super(gui, field, "g-triple");
    const names = settings.names ?? ["red", "green", "blue"];
    this.inputs = names.map((name, k) => {
      const input = element("input", { type: "number", step: "any", class: `c${k}` });
      input.setAttribute("aria-label", `${field.label}, ${name}`);
      input.addEventListener("change", () => {
        if (!Number.isFinite(input.valueAsNumber)) return void this.updateDisplay();
        const values = [...field.get()];
        values[k] = Math.min(settings.high ?? Infinity, Math.max(settings.low ?? -Infinity, input.valueAsNumber));
        field.set(values);
        this.updateDisplay();
      });
      return input;
    });
    this.swatch = settings.color ? element("input", { type: "color" }) : null;
    if (this.swatch) {
      const swatch = this.swatch;
      swatch.setAttribute("aria-label", `${field.label}, color`);
      swatch.addEventListener("input", () => {
        field.set([1, 3, 5].map((i) => Number(toLinear(Number.parseInt(swatch.value.slice(i, i + 2), 16) / 255).toPrecision(4))));
        this.updateDisplay();
      });
      this.$widget.append(swatch);
    }
    this.$widget.append(...this.inputs);
    this.updateDisplay();
  }

  override updateDisplay(): this {
    if (!this.field || !this.inputs) return this;
    const values = this.field.get();
    this.inputs.forEach((input, k) => {
      if (document.activeElement !== input) input.value = short(values[k] ?? 0);
    });
    if (this.swatch) {
      const peak = this.settings.high === null ? Math.max(1e-9, ...values) : 1;
      this.swatch.value = hexOf(values.map((v) => v / peak));
    }
    return this;
  }
}

export class ChoiceControl extends Base<string> {
  private readonly select = element("select");
  private readonly patch = element("span", { class: "patch" });
  private readonly numbers = element("span", { class: "hint" });
  private shown = "";

  constructor(
    gui: GUI,
    field: Field<string>,
    private readonly settings: () => { value: string; label: string; doc?: string; disabled?: boolean }[],
    /** Linear RGB of the current choice, shown as a swatch. */
    private readonly color: (() => readonly number[] | null) | null = null,
  ) {
    super(gui, field, "g-choice");
    if (color) this.$widget.append(this.patch);
    this.select.setAttribute("aria-labelledby", this.$name.id);
    this.select.addEventListener("change", () => {
      field.set(this.select.value);
      this.updateDisplay();
      // After a choice by mouse, keys control the page again; after one by keyboard, they stay with the list.
      if (!this.select.matches(":focus-visible")) this.select.blur();
    });
    this.$widget.append(this.select);
    if (color) this.$name.append(this.numbers);
    this.updateDisplay();
  }

  override updateDisplay(): this {
    if (!this.field || !this.settings) return this;
    const options = this.settings();
    const listed = JSON.stringify(options);
    if (listed !== this.shown) {
      this.shown = listed;
      this.select.replaceChildren(
        ...options.map(({ value, label, doc, disabled }) => element("option", { value, title: doc ?? "", disabled: disabled ?? false }, label)),
      );
    }
    this.select.value = this.field.get();
    const shade = this.color?.();
    this.patch.hidden = !shade;
    this.numbers.hidden = !shade;
    if (shade) {
      this.patch.style.background = hexOf(shade);
      this.numbers.textContent = `F0 ${shade.map((v) => (100 * v).toFixed(0)).join(" ")} %`;
      this.numbers.title = `Reflectance at normal incidence, linear RGB: ${shade.map((v) => short(v)).join(", ")}`;
    }
    return this;
  }
}

export class TickControl extends Base<boolean> {
  private readonly box = element("input", { type: "checkbox" });

  constructor(gui: GUI, field: Field<boolean>) {
    super(gui, field, "g-tick");
    this.box.setAttribute("aria-labelledby", this.$name.id);
    this.box.addEventListener("change", () => field.set(this.box.checked));
    this.$name.addEventListener("click", () => this.box.click());
    this.$widget.append(this.box);
    this.updateDisplay();
  }

  override updateDisplay(): this {
    if (this.field && this.box) this.box.checked = this.field.get();
    return this;
  }
}

/** Any element as a row of the panel, without a value of its own. */
export function addRow(gui: GUI, ...children: (Node | string)[]): HTMLElement {
  const row = element("div", { class: "row" }, ...children);
  gui.$children.append(row);
  return row;
}

const toLinear = (s: number) => (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4);
const toSrgb = (c: number) => (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);

export function hexOf(linear: readonly number[]): string {
  return `#${linear
    .slice(0, 3)
    .map((c) => Math.round(255 * toSrgb(Math.min(1, Math.max(0, c)))).toString(16).padStart(2, "0"))
    .join("")}`;
}
