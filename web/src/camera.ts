/** Orbit camera for mouse, touch and keys; a click without a drag picks a point. */
import type { Store } from "./state";
import { add, cameraFrame, scale } from "./vectors";

const STEEPEST = Math.PI / 2 - 0.02;

export function orbit(store: Store, by: number, up: number): void {
  store.update("camera", ({ camera }) => {
    const azimuth = camera.azimuth - by;
    camera.azimuth = Math.atan2(Math.sin(azimuth), Math.cos(azimuth));
    camera.elevation = Math.min(STEEPEST, Math.max(-STEEPEST, camera.elevation + up));
  });
}

export function zoom(store: Store, factor: number): void {
  store.update("camera", ({ camera }) => {
    camera.distance = Math.min(200, Math.max(1.3, camera.distance * factor));
  });
}

/** Moves the target in the image plane, in fractions of the picture's height. */
export function pan(store: Store, x: number, y: number): void {
  store.update("camera", ({ camera }) => {
    const frame = cameraFrame(camera);
    const size = 2 * frame.half * camera.distance;
    camera.target = add(camera.target, add(scale(frame.right, -x * size), scale(frame.up, y * size)));
  });
}

export function resetCamera(store: Store): void {
  store.update("camera", (state) => {
    state.camera = structuredClone(store.initial.camera);
  });
}

/** `pick` receives the position of a click in CSS pixels of the canvas. */
export function attachCamera(canvas: HTMLElement, store: Store, pick: (x: number, y: number) => void): void {
  const pointers = new Map<number, { x: number; y: number }>();
  let dragged = 0;
  let spread = 0;

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (pointers.size === 1) dragged = 0;
    spread = 0;
  });

  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    dragged += Math.abs(dx) + Math.abs(dy);
    if (dragged < 4) return; // tolerance for an unsteady hand
    const height = canvas.clientHeight || 1;
    if (pointers.size === 2) {
      const [a, b] = [...pointers.values()] as [{ x: number; y: number }, { x: number; y: number }];
      const distance = Math.hypot(a.x - b.x, a.y - b.y);
      if (spread > 0 && distance > 0) zoom(store, spread / distance);
      spread = distance;
      pan(store, dx / height / 2, dy / height / 2);
    } else if (event.buttons & 6 || event.shiftKey) pan(store, dx / height, dy / height);
    else orbit(store, (dx / height) * Math.PI, (dy / height) * Math.PI);
  });

  const release = (event: PointerEvent) => {
    if (!pointers.delete(event.pointerId)) return;
    spread = 0;
    if (event.type === "pointerup" && pointers.size === 0 && dragged < 4 && event.button === 0) {
      const box = canvas.getBoundingClientRect();
      pick(event.clientX - box.left, event.clientY - box.top);
    }
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => resetCamera(store));
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      zoom(store, Math.exp(Math.max(-60, Math.min(60, event.deltaY * lines)) * 0.002));
    },
    { passive: false },
  );
}
