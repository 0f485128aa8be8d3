/**
 * Difference of the raster picture from the reference: RMSE and relMSE over a mask of pixels.
 * The same definitions as gonio.pictures.metrics, which `gonio compare` prints.
 */

/** relMSE divides by r^2 + this, so that a black reference pixel does not dominate the mean. */
export const RELATIVE_FLOOR = 0.01;
/** A pixel is inside if its coverage differs from 1 by no more than the step of half floats (2^-11). */
const INSIDE = 1 - 2 ** -11;

export type Pixels = "all" | "balls" | "inside";
export const PIXELS: Record<Pixels, string> = {
  inside: "balls, without silhouettes",
  balls: "balls",
  all: "all pixels",
};

/** RGBA pictures (alpha: coverage by balls) as floats, interleaved. */
export interface Pair {
  width: number;
  height: number;
  test: Float32Array;
  reference: Float32Array;
}

/**
 * 1 for each included pixel. "inside" excludes every pixel that is partly covered, or adjacent to one that is, in either
 * picture: the two renderers' pixel filters differ there.
 */
export function counted({ width, height, test, reference }: Pair, pixels: Pixels): Uint8Array {
  const count = width * height;
  const mask = new Uint8Array(count);
  const covered = (i: number) => Math.min(test[4 * i + 3] as number, reference[4 * i + 3] as number);
  for (let i = 0; i < count; i++) {
    if (pixels === "all") mask[i] = 1;
    else if (pixels === "balls") mask[i] = Math.max(test[4 * i + 3] as number, reference[4 * i + 3] as number) > 0 ? 1 : 0;
    else mask[i] = covered(i) >= INSIDE ? 1 : 0;
  }
  if (pixels !== "inside") return mask;
  const full = mask.slice();
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++)
      for (let dy = -1; dy <= 1; dy++)
        for (let dx = -1; dx <= 1; dx++) {
          const [u, v] = [x + dx, y + dy];
          if (u >= 0 && v >= 0 && u < width && v < height && !full[v * width + u]) mask[y * width + x] = 0;
        }
  return mask;
}

/** Excludes pixels that are not finite in either picture from a mask; returns their number. */
export function withoutBroken({ test, reference }: Pair, mask: Uint8Array): { finite: Uint8Array; broken: number } {
  const finite = mask.slice();
  let broken = 0;
  for (let i = 0; i < mask.length; i++) {
    if (!mask[i] || [0, 1, 2].every((c) => Number.isFinite(test[4 * i + c]) && Number.isFinite(reference[4 * i + c]))) continue;
    finite[i] = 0;
    broken += 1;
  }
  return { finite, broken };
}

export interface Measures {
  rmse: number;
  relmse: number;
  /** mean(x) / mean(r): 1 if no energy is lost or gained. */
  meanRatio: number;
  pixels: number;
}

export function measure(pair: Pair, mask: Uint8Array): Measures {
  let [squares, relative, sumTest, sumReference, pixels] = [0, 0, 0, 0, 0];
  for (let i = 0; i < mask.length; i++) {
    if (!mask[i]) continue;
    pixels += 1;
    for (let c = 0; c < 3; c++) {
      const [x, r] = [pair.test[4 * i + c] as number, pair.reference[4 * i + c] as number];
      const square = (x - r) ** 2;
      squares += square;
      relative += square / (r * r + RELATIVE_FLOOR);
      sumTest += x;
      sumReference += r;
    }
  }
  const n = 3 * pixels;
  return { rmse: Math.sqrt(squares / n), relmse: relative / n, meanRatio: sumTest / sumReference, pixels };
}

/** Per pixel, the mean over the channels; NaN for excluded pixels. */
export function differenceMap(pair: Pair, mask: Uint8Array, kind: "absolute" | "relative"): Float32Array {
  return Float32Array.from(mask, (used, i) => {
    if (!used) return Number.NaN;
    let sum = 0;
    for (let c = 0; c < 3; c++) {
      const [x, r] = [pair.test[4 * i + c] as number, pair.reference[4 * i + c] as number];
      sum += kind === "absolute" ? Math.abs(x - r) : (x - r) ** 2 / (r * r + RELATIVE_FLOOR);
    }
    return sum / 3;
  });
}

export function meanOf(map: Float32Array, mask: Uint8Array): number {
  let [sum, n] = [0, 0];
  for (let i = 0; i < mask.length; i++)
    if (mask[i]) {
      sum += map[i] as number;
      n += 1;
    }
  return sum / n;
}

/** The value that `share` of the included pixels do not exceed. */
export function quantile(map: Float32Array, share: number): number {
  const sorted = map.filter((v) => !Number.isNaN(v)).sort();
  return sorted.length ? (sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] as number) : 0;
}
