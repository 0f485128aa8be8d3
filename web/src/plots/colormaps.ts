/**
 * Perceptually uniform color maps, safe for color-blind readers: viridis for quantities, magma for differences.
 * Seventeen sRGB stops of matplotlib's maps (released into the public domain, CC0), interpolated linearly.
 */
const STOPS = {
  viridis: "44015448186a472d7b4240863b528b33638d2c728e26828e21918c1fa08828ae803fbc735ec96284d44baddc30d8e219fde725",
  magma: "0000040a08221d114736106b51127c6a1c818326819c2e7fb73779d0416fe75263f56b5cfc8961fea772fec488fde2a3fcfdbf",
};
export type ColorMap = keyof typeof STOPS;

/** 256 colors, RGBA bytes, alpha 255: an image row, a texture, a table. */
export function colorTable(map: ColorMap): Uint8ClampedArray<ArrayBuffer> {
  const stops = (STOPS[map].match(/../g) as string[]).map((pair) => parseInt(pair, 16));
  const last = stops.length / 3 - 1;
  const table = new Uint8ClampedArray(256 * 4);
  for (let i = 0; i < 256; i++) {
    const at = (i / 255) * last;
    const low = Math.min(Math.floor(at), last - 1);
    for (let c = 0; c < 3; c++) {
      const [a, b] = [stops[3 * low + c] as number, stops[3 * low + 3 + c] as number];
      table[4 * i + c] = a + (b - a) * (at - low);
    }
    table[4 * i + 3] = 255;
  }
  return table;
}

/** Position of a value in [low, high], 0 to 1; on a logarithmic axis if `log` (low > 0). */
export function place(value: number, low: number, high: number, log: boolean): number {
  const t = log ? Math.log(Math.max(value, low) / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.min(1, Math.max(0, Number.isFinite(t) ? t : 0));
}

/** An image of values: 256 colors from low to high; NaN is transparent. Row 0 of `values` on top. */
export function paint(values: ArrayLike<number>, width: number, height: number, map: ColorMap, low: number, high: number, log = false): ImageData {
  const table = colorTable(map);
  const image = new ImageData(width, height);
  for (let i = 0; i < width * height; i++) {
    const value = values[i] as number;
    if (Number.isNaN(value)) continue;
    const at = 4 * Math.round(255 * place(value, low, high, log));
    for (let c = 0; c < 4; c++) image.data[4 * i + c] = table[at + c] as number;
  }
  return image;
}

export const css = (table: Uint8ClampedArray, t: number): string => {
  const at = 4 * Math.round(255 * Math.min(1, Math.max(0, t)));
  return `rgb(${table[at]},${table[at + 1]},${table[at + 2]})`;
};
