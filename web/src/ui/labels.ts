/** Labels over the picture: each row's name, and under every ball the parameters in which it differs. */
import type { PageApp } from "../app";
import { cameraFrame, sphereBounds, toPixel } from "../vectors";
import { element } from "./dom";

export class Labels {
  private readonly host = element("div", { class: "labels" });
  private spans: HTMLElement[] = [];

  constructor(private readonly app: PageApp) {
    app.overlay.append(this.host);
  }

  update(): void {
    const { app } = this;
    const { state } = app;
    const side = state.compare.mode === "side";
    this.host.hidden = !state.view.labels || side;
    if (this.host.hidden) return;
    const frame = cameraFrame(state.camera);
    const [width, height] = [app.canvas.clientWidth, app.canvas.clientHeight];
    const balls = app.balls();
    const wanted: { text: string; x: number; y: number; kind: string; color?: string; pressed?: boolean; long?: number }[] = [];
    const letter = (slot: number) => String.fromCharCode(65 + slot);
    const first = app.visibleSlots()[0] ?? 0;
    const minuend = state.view.term === "rows" && !balls.some((b) => b.slot === first) ? `${letter(first)} − ` : "";
    // Over a bright environment the labels have a background of their own.
    this.host.toggleAttribute("data-pictured", state.furnace || (state.view.background === "environment" && state.lights.some((l) => l.on && l.type === "environment")));
    let gap = Infinity;
    let last: [number, number] | null = null;
    for (const { slot, ball, center } of balls) {
      const row = state.slots[slot];
      if (!row) continue;
      const middle = toPixel(frame, center, width, height);
      const bounds = sphereBounds(frame, center, 1, width / height);
      const below = middle && bounds ? [middle[0], ((1 - bounds[1]) / 2) * height + 2] as [number, number] : null;
      if (below) {
        if (ball > 0 && last) gap = Math.min(gap, Math.abs(below[0] - last[0]));
        last = below;
        const pressed = state.selection.slot === slot && state.selection.ball === ball && balls.length > 1;
        wanted.push({ text: row.balls[ball]?.label ?? "", x: below[0], y: below[1], kind: "ball", pressed });
      }
      if (ball === 0) {
        const [top, bottom] = [1, -1].map((y) => toPixel(frame, [center[0] - 1.08, center[1] + y, center[2]], width, height));
        const left = toPixel(frame, [center[0] - 1.08, center[1], center[2]], width, height);
        const name = `${minuend}${letter(slot)}  ${row.label}`;
        // Text too long for the space at the ball would run into the next row's name; the side panel shows it in full.
        const room = Math.floor(Math.max(60, top && bottom ? bottom[1] - top[1] : 0) / 6);
        if (left) wanted.push({ text: name.length > room ? `${name.slice(0, room - 1)}…` : name, x: Math.max(16, left[0]), y: left[1], kind: "rowname", color: app.slotColor(slot), long: Math.max(60, top && bottom ? bottom[1] - top[1] : 0) });
      }
    }
    while (this.spans.length < wanted.length) {
      const span = element("span");
      this.spans.push(span);
      this.host.append(span);
    }
    this.spans.forEach((span, index) => {
      const label = wanted[index];
      span.hidden = !label;
      if (!label) return;
      // If balls are close together, the word that all of them share would make the labels overlap.
      const text = label.kind === "ball" && gap < 88 ? label.text.replace(/^roughness /, "r ") : label.text;
      if (span.textContent !== text) span.textContent = text;
      span.className = label.kind;
      span.toggleAttribute("data-selected", label.pressed ?? false);
      span.style.translate = `${Math.round(label.x)}px ${Math.round(label.y)}px`;
      span.style.setProperty("--slot", label.color ?? "");
      span.style.setProperty("--long", `${Math.round(label.long ?? 0)}px`);
    });
  }
}
