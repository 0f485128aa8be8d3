/** The tables that the shaders read, as images, with the float32 value of the texel under the pointer. */
import { type SplitSum, decodeFloats } from "../data";
import type { App, Panel } from "../panel";
import type { Change } from "../state";
import { check, element, exact, range, select, short, Sketch } from "../plots/base";
import { colorTable, css, paint } from "../plots/colormaps";

interface Table {
  label: string;
  size: number[];
  channels: number;
  /** Quantities along x, y and z, the quantity in a texel, and its channels' names, where known. */
  axes: string[];
  doc: string;
  components: string[];
  floats: Float32Array;
}

const DEFAULTS = { table: "", channel: -1, layer: 0, fixed: false };

class TablesPanel implements Panel {
  readonly id = "tables";
  readonly title = "Tables";
  readonly order = 5;
  readonly doc = "The precomputed tables as images, with a readout of float values";
  private app!: App;
  private which!: ReturnType<typeof select<string>>;
  private channel!: ReturnType<typeof select<string>>;
  private layer!: ReturnType<typeof range>;
  private fixed!: ReturnType<typeof check>;
  private sketch!: Sketch;
  private read!: HTMLElement;
  private note!: HTMLElement;
  private tables = new Map<string, Table>();
  private bitmap = document.createElement("canvas");
  private span: [number, number] = [0, 1];
  private current: { table: Table; channel: number; layer: number } | null = null;
  private pointed: [number, number] | null = null;

  mount(host: HTMLElement, app: App): void {
    this.app = app;
    host.classList.add("p-panel");
    const set = (values: Partial<typeof DEFAULTS>) => app.store.setPanel(this.id, values);
    const bar = element("div", "p-bar");
    this.which = select<string>(bar, "table", "The textures that the page's shaders read", {}, (table) => set({ table, channel: -1, layer: 0 }));
    this.channel = select<string>(bar, "component", "Component of the texels, if there are several", { "0": "0" }, (channel) => set({ channel: Number(channel) }));
    this.layer = range(bar, "layer", "Slice of a three-dimensional table", [0, 0, 1], "", (layer) => set({ layer }));
    this.fixed = check(bar, "0 to 1", "Color scale from 0 to 1, instead of from the smallest to the largest value", (fixed) => set({ fixed }));
    const body = element("div", "p-body");
    const cell = element("div", "p-cell p-wide");
    body.append(cell);
    this.read = element("div", "p-read");
    this.note = element("div", "p-note");
    host.append(bar, body, this.read, this.note);
    this.sketch = new Sketch(cell, (context, width, height) => this.draw(context, width, height));
    const point = (event: PointerEvent) => this.point(event);
    this.sketch.canvas.addEventListener("pointermove", point);
    this.sketch.canvas.addEventListener("pointerdown", point);
    this.sketch.canvas.addEventListener("pointerleave", () => {
      this.pointed = null;
      this.show();
    });
    this.show();
  }

  update(change: Change): void {
    if (change.touches("slots", "solo", `panels.${this.id}`, "display.theme")) this.show();
  }

  refresh(what: string): void {
    if (what === "theme") this.show();
  }

  /** The albedo of the microfacet models first, then all tables of the shown models. */
  private collect(): void {
    const wanted = new Map<string, () => Table>();
    for (const slot of this.app.visibleSlots()) {
      const dfg = this.app.shaders.splitSum(this.app.shaderOf(slot));
      if (dfg) wanted.set(`dfg ${dfg.facets.join(" ")}`, () => splitSum(dfg));
    }
    for (const slot of this.app.visibleSlots()) {
      const { key, manifest, variant, material } = this.app.shaderOf(slot);
      for (const texture of manifest.textures) {
        const data = variant.tables[texture.uniform];
        if (data === undefined) continue;
        wanted.set(`${key}/${texture.uniform}`, () => ({
          label: `${material.title}: ${texture.uniform.replace(/^table_/, "")}`,
          size: texture.size,
          channels: texture.channels,
          axes: texture.axes ?? [],
          doc: texture.doc ?? "",
          components: [],
          floats: decodeFloats(data),
        }));
      }
    }
    this.tables = new Map([...wanted].map(([key, make]) => [key, this.tables.get(key) ?? make()]));
  }

  private show(): void {
    this.collect();
    const settings = this.app.store.panel(this.id, DEFAULTS);
    const key = this.tables.has(settings.table) ? settings.table : ([...this.tables.keys()][0] ?? "");
    const table = this.tables.get(key);
    this.which.options(Object.fromEntries([...this.tables].map(([k, t]) => [k, t.label])));
    this.which.show(key);
    this.fixed.show(settings.fixed);
    if (!table) {
      this.current = null;
      this.read.textContent = "";
      this.note.textContent = "The shown models read no tables: they compute all values directly.";
      this.layer.hide(true);
      this.sketch.redraw();
      return;
    }
    const [width, height = 1, depth = 1] = table.size as [number, number?, number?];
    const index = (value: unknown, most: number) => Math.min(most, Math.max(0, Math.round(Number(value)) || 0));
    // Of the split sum the albedo, its last component, first.
    const channel = settings.channel === -1 ? (table.components.length ? table.channels - 1 : 0) : index(settings.channel, table.channels - 1);
    const layer = index(settings.layer, depth - 1);
    this.channel.options(Object.fromEntries(Array.from({ length: table.channels }, (_, i) => [String(i), table.components[i] ?? String(i)])));
    this.channel.show(String(channel));
    this.channel.enable(table.channels > 1);
    this.layer.hide(depth === 1);
    this.layer.limits(0, depth - 1);
    this.layer.show(layer);
    const plane = Float32Array.from({ length: width * height }, (_, i) => table.floats[(layer * width * height + i) * table.channels + channel] as number);
    const [low, high] = plane.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity] as [number, number]);
    this.span = settings.fixed ? [0, 1] : low === high ? [low - 0.5, high + 0.5] : [low, high];
    // Row 0 of a texture is its smallest y: shown at the bottom, as on a vertical axis.
    const flipped = new Float32Array(plane.length);
    for (let y = 0; y < height; y++) flipped.set(plane.subarray(y * width, (y + 1) * width), (height - 1 - y) * width);
    Object.assign(this.bitmap, { width, height });
    (this.bitmap.getContext("2d") as CanvasRenderingContext2D).putImageData(paint(flipped, width, height, "viridis", ...this.span), 0, 0);
    this.current = { table, channel, layer };
    this.note.textContent = `${table.doc ? `${table.doc}. ` : ""}${table.size.join(" × ")} texels of ${table.channels} float32; values of this image: ${exact(low)} to ${exact(high)}. Axes: texel centers, from 0 to 1.`;
    this.write();
    this.sketch.redraw();
  }

  private box(width: number, height: number): { x: number; y: number; w: number; h: number } {
    const [columns, lines = 1] = (this.current as NonNullable<typeof this.current>).table.size as [number, number?];
    const room = { w: Math.max(20, width - 150), h: Math.max(16, height - 46) };
    // Texels are square if that gives an image of useful size; the rows of a small table are drawn as bars.
    const scale = Math.min(room.w / columns, room.h / lines);
    const [w, h] = [Math.max(columns * scale, Math.min(room.w, 120)), Math.max(lines * scale, Math.min(room.h, 45 * lines, 0.5 * room.w))];
    return { x: 56 + (room.w - w) / 2, y: 8, w, h };
  }

  private draw(context: CanvasRenderingContext2D, width: number, height: number): void {
    if (!this.current) return;
    const { table } = this.current;
    const { x, y, w, h } = this.box(width, height);
    const text = this.app.cssColor("--text");
    context.imageSmoothingEnabled = false;
    context.drawImage(this.bitmap, x, y, w, h);
    context.strokeStyle = this.app.cssColor("--line");
    context.strokeRect(x, y, w, h);
    context.fillStyle = text;
    context.font = "11px system-ui, sans-serif";
    const [columns, lines = 1] = table.size as [number, number?];
    for (const t of [0, 0.5, 1]) {
      context.textBaseline = "top";
      context.textAlign = "center";
      context.fillText(short(t), x + t * w, y + h + 4);
      if (lines > 1) {
        context.textBaseline = "middle";
        context.textAlign = "right";
        context.fillText(short(t), x - 5, y + h - t * h);
      }
    }
    context.textBaseline = "top";
    context.textAlign = "center";
    context.fillText(`${table.axes[0] ?? "x"} (${columns})`, x + w / 2, y + h + 19);
    if (lines > 1) {
      context.save();
      context.translate(x - 44, y + h / 2);
      context.rotate(-Math.PI / 2);
      context.fillText(`${table.axes[1] ?? "y"} (${lines})`, 0, 0);
      context.restore();
    }
    colorBar(context, x + w + 14, y, Math.max(h, 60), this.span, text);
    if (this.pointed) {
      const [i, j] = this.pointed;
      context.strokeStyle = this.app.cssColor("--accent");
      context.lineWidth = 2;
      context.strokeRect(x + (i / columns) * w - 1, y + h - ((j + 1) / lines) * h - 1, w / columns + 2, h / lines + 2);
    }
  }

  private point(event: PointerEvent): void {
    if (!this.current) return;
    const bounds = this.sketch.canvas.getBoundingClientRect();
    const { x, y, w, h } = this.box(bounds.width, bounds.height);
    const [columns, lines = 1] = this.current.table.size as [number, number?];
    const i = Math.floor(((event.clientX - bounds.left - x) / w) * columns);
    const j = Math.floor((1 - (event.clientY - bounds.top - y) / h) * lines);
    this.pointed = i >= 0 && j >= 0 && i < columns && j < lines ? [i, j] : null;
    this.write();
    this.sketch.redraw();
  }

  private write(): void {
    if (!this.current || !this.pointed) {
      this.read.textContent = "Move the pointer over the image to read a texel.";
      return;
    }
    const { table, layer } = this.current;
    const [i, j] = this.pointed;
    const [columns, lines = 1, depth = 1] = table.size as [number, number?, number?];
    const at = ((layer * lines + j) * columns + i) * table.channels;
    const numbers = Array.from(table.floats.subarray(at, at + table.channels), (v, c) => (table.components[c] ? `${table.components[c]} = ${exact(v)}` : exact(v)));
    const place = [`${table.axes[0] ?? "x"} ${short((i + 0.5) / columns)}`, ...(lines > 1 ? [`${table.axes[1] ?? "y"} ${short((j + 0.5) / lines)}`] : [])];
    this.read.textContent = `texel (${[i, j, ...(depth > 1 ? [layer] : [])].join(", ")}), ${place.join(", ")}: ${numbers.join("  ")}`;
  }
}

/** A and B of the split sum, and their sum: the albedo of the lobe without absorption. */
function splitSum({ facets: [distribution, masking], size, data }: SplitSum): Table {
  const ab = decodeFloats(data);
  const floats = new Float32Array((ab.length / 2) * 3);
  for (let i = 0; i < ab.length / 2; i++) {
    const [a, b] = [ab[2 * i] as number, ab[2 * i + 1] as number];
    floats.set([a, b, a + b], 3 * i);
  }
  return {
    label: `${distribution === "ggx" ? "GGX" : distribution}, ${masking}: albedo, and A and B of the split sum`,
    size,
    channels: 3,
    axes: ["μ", "roughness"],
    doc: "Albedo: F0 A + B for reflectance F0 at normal incidence, A + B = E(μ) for F = 1",
    components: ["A", "B", "A + B = E"],
    floats,
  };
}

/** A vertical viridis bar, labeled at both ends. */
export function colorBar(context: CanvasRenderingContext2D, x: number, y: number, height: number, [low, high]: [number, number], text: string): void {
  const table = colorTable("viridis");
  const gradient = context.createLinearGradient(0, y + height, 0, y);
  for (let i = 0; i <= 16; i++) gradient.addColorStop(i / 16, css(table, i / 16));
  context.fillStyle = gradient;
  context.fillRect(x, y, 12, height);
  context.fillStyle = text;
  context.textAlign = "left";
  context.textBaseline = "top";
  context.fillText(short(high), x + 17, y);
  context.textBaseline = "bottom";
  context.fillText(short(low), x + 17, y + height);
}

export default new TablesPanel();
