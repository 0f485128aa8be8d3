/** Values under the pointer: linear radiance of the raster picture and of the reference, and their difference. */
import type { App, Panel, Picture } from "../panel";
import { channelOf, element, exact } from "../plots/base";
import { comparisonOf } from "../plots/comparison";

class ProbePanel implements Panel {
  readonly id = "probe";
  readonly title = "Probe";
  readonly order = 7;
  readonly doc = "Pixel values under the pointer";
  private app!: App;
  private table!: HTMLTableElement;
  private note!: HTMLElement;
  /** 0 to 1 from the top left of the picture. */
  private at: [number, number] | null = null;
  private timer = 0;

  mount(host: HTMLElement, app: App): void {
    this.app = app;
    host.classList.add("p-panel");
    this.table = element("table", "p-numbers");
    this.note = element("div", "p-note");
    const body = element("div", "p-fit");
    body.append(this.table);
    host.append(body, this.note);
    const point = (event: PointerEvent) => {
      const { left, top, width, height } = app.canvas.getBoundingClientRect();
      const at = comparisonOf(app).view.pictureAt(width, height, (event.clientX - left) / width, (event.clientY - top) / height);
      if (!at || at.some((v) => v < 0 || v >= 1)) return;
      this.at = at;
      this.soon();
    };
    app.canvas.addEventListener("pointermove", point);
    app.canvas.addEventListener("pointerdown", point);
    this.write();
  }

  update(): void {
    this.soon();
  }

  refresh(): void {
    this.soon();
  }

  /** Reading the picture back blocks the GPU: five times a second at most. */
  private soon(): void {
    if (this.timer) return;
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      if (this.app.state.dock.open === this.id) this.write();
    }, 200);
  }

  private write(): void {
    if (!this.at) {
      this.table.replaceChildren();
      this.note.textContent = "Move the pointer over the picture.";
      return;
    }
    const raster = this.app.picture();
    const reference = this.app.referencePicture();
    const read = (picture: Picture) => {
      const [x, y] = this.pixel(picture);
      const at = 4 * (y * picture.width + x);
      return [0, 1, 2, 3].map((c) => picture.data[at + c] as number);
    };
    const x = read(raster);
    const rows: [string, number[]][] = [["raster x", x]];
    if (reference?.samples) {
      const r = read(reference);
      rows.push(["reference r", r], ["x − r", x.map((v, c) => v - (r[c] as number))], ["x / r", x.map((v, c) => v / (r[c] as number))]);
    }
    const line = (tag: "th" | "td", cells: string[]) => {
      const row = element("tr");
      row.append(...cells.map((text, i) => element(i === 0 ? "th" : tag, "", text)));
      return row;
    };
    this.table.replaceChildren(
      line("th", ["", "red", "green", "blue", "luminance", "coverage"]),
      ...rows.map(([name, v]) => line("td", [name, ...v.slice(0, 3).map(exact), exact(channelOf(v, 0, "luminance")), exact(v[3] as number)])),
    );
    const [column, row] = this.pixel(raster);
    const spp = reference?.samples ? `; ${raster.samples} and ${reference.samples} samples per pixel` : "";
    this.note.textContent = `Pixel (${column}, ${row}) of ${raster.width} × ${raster.height}, from the top left${spp}. Linear radiance times coverage, before exposure and tone curve.`;
  }

  private pixel(picture: Picture): [number, number] {
    const [u, v] = this.at as [number, number];
    return [Math.floor(u * picture.width), Math.floor(v * picture.height)];
  }
}

export default new ProbePanel();
