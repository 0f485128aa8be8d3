/** Marks the clicked point on its ball while a panel that refers to it is open: a ring, and the normal as a line. */
import type { App, Panel } from "../panel";
import { add, cameraFrame, scale, toPixel } from "../vectors";
import { element } from "./base";

/** Length of the normal's line, in radii of a ball. */
const STROKE = 0.35;

export function installMarker(app: App, panels: readonly Panel[]): void {
  const ring = element("i", "p-mark");
  const stroke = element("i", "p-mark-normal");
  app.overlay.append(stroke, ring);
  const place = () => {
    const { state, canvas } = app;
    const { position, normal } = app.picked;
    const frame = cameraFrame(state.camera);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const at = toPixel(frame, position, width, height);
    const tip = toPixel(frame, add(position, scale(normal, STROKE)), width, height);
    const shown = panels.some(({ id, marksPoint }) => marksPoint && id === state.dock.open) && (state.compare.mode === "off" || state.compare.mode === "wipe");
    ring.hidden = stroke.hidden = !shown || !at || !tip;
    if (!at || !tip) return;
    const color = app.slotColor(app.picked.slot);
    Object.assign(ring.style, { left: `${at[0]}px`, top: `${at[1]}px`, borderColor: color });
    const [dx, dy] = [tip[0] - at[0], tip[1] - at[1]];
    Object.assign(stroke.style, { left: `${at[0]}px`, top: `${at[1]}px`, width: `${Math.hypot(dx, dy)}px`, background: color, rotate: `${Math.atan2(dy, dx)}rad` });
  };
  // On a change of state the page, which subscribed first, has already picked again; on a click it picks afterwards.
  app.store.subscribe(() => queueMicrotask(place));
  new ResizeObserver(place).observe(app.canvas);
}
