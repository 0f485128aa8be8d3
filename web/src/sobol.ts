/**
 * The first three dimensions of Sobol's sequence as 32-bit integers, for textures: 4 numbers per point, the last unused.
 *
 * Direction numbers of Joe and Kuo, "Constructing Sobol sequences with better two-dimensional projections", 2008,
 * table new-joe-kuo-6: degree s, polynomial a, first m; the first dimension is the radical inverse in base 2.
 */
const DIMENSIONS = [
  { s: 1, a: 0, m: [1] },
  { s: 2, a: 1, m: [1, 3] },
];
export const SOBOL_WIDTH = 256;
/** Number of points available: the most that one shift of an albedo estimate uses. */
export const SOBOL_POINTS = 4096;

function directionNumbers(): Uint32Array[] {
  const first = Uint32Array.from({ length: 32 }, (_, i) => (1 << (31 - i)) >>> 0);
  const others = DIMENSIONS.map(({ s, a, m }) => {
    const v = new Uint32Array(32);
    for (let i = 0; i < 32; i++) {
      if (i < s) {
        v[i] = ((m[i] as number) << (31 - i)) >>> 0;
        continue;
      }
      let x = (v[i - s] as number) ^ ((v[i - s] as number) >>> s);
      for (let k = 1; k < s; k++) if ((a >> (s - 1 - k)) & 1) x ^= v[i - k] as number;
      v[i] = x >>> 0;
    }
    return v;
  });
  return [first, ...others];
}

export function sobolTexels(points = SOBOL_POINTS): Uint32Array<ArrayBuffer> {
  const numbers = directionNumbers();
  const texels = new Uint32Array(4 * points);
  for (let n = 0; n < points; n++)
    numbers.forEach((v, dimension) => {
      let x = 0;
      for (let bit = 0; bit < 32; bit++) if ((n >>> bit) & 1) x ^= v[bit] as number;
      texels[4 * n + dimension] = x >>> 0;
    });
  return texels;
}
