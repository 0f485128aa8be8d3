/** The theme's colors as numbers. */
import type { Vec3 } from "../data";

const known = new Map<string, Vec3>();
let pixel: CanvasRenderingContext2D | null = null;

/** Any CSS color as sRGB numbers 0 to 1, as parsed by the browser. */
export function rgb(color: string): Vec3 {
  const cached = known.get(color);
  if (cached) return cached;
  const canvas = Object.assign(document.createElement("canvas"), { width: 1, height: 1 });
  pixel ??= canvas.getContext("2d", { willReadFrequently: true }) as CanvasRenderingContext2D;
  pixel.fillStyle = "#888";
  pixel.fillStyle = color;
  pixel.fillRect(0, 0, 1, 1);
  const [r, g, b] = pixel.getImageData(0, 0, 1, 1).data;
  const made: Vec3 = [(r as number) / 255, (g as number) / 255, (b as number) / 255];
  known.set(color, made);
  return made;
}
