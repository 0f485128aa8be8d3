/**
 * Radiance pictures (.hdr): header lines, then rows of RGBE, plain or run-length coded (Ward 1991). Files are
 * untrusted: sizes are bounded before anything is allocated, and every row must be complete.
 */

export interface RadiancePicture {
  width: number;
  height: number;
  /** Linear RGB, top row first. */
  data: Float32Array;
}

const LARGEST = 8192;

export function readRadiance(bytes: Uint8Array, name: string): RadiancePicture {
  const fail = (what: string): never => {
    throw new Error(`${name}: ${what}`);
  };
  let at = 0;
  const line = (): string => {
    let text = "";
    while (at < bytes.length && text.length < 4096) {
      const c = bytes[at++] as number;
      if (c === 10) return text;
      text += String.fromCharCode(c);
    }
    return fail("not a Radiance picture (its header has no end).");
  };
  if (!line().startsWith("#?")) fail("not a Radiance picture (#?RADIANCE is missing).");
  for (let header = line(); header !== ""; header = line())
    if (header.startsWith("FORMAT=") && !header.includes("32-bit_rle_rgbe")) fail(`${header.slice(7)} is not supported, only 32-bit_rle_rgbe.`);
  const size = /^-Y (\d+) \+X (\d+)\s*$/.exec(line()) ?? fail("only pictures with rows from top to bottom (-Y N +X M) are supported.");
  const [height, width] = [Number(size[1]), Number(size[2])];
  if (!(width > 0 && height > 0 && width <= LARGEST && height <= LARGEST)) fail(`${width} x ${height} pixels; the limit is ${LARGEST} x ${LARGEST}.`);
  // Runs of 127 are the best possible compression: a shorter file cannot contain that many rows.
  if ((bytes.length - at) * 64 < width * height * 2) fail("the file is truncated.");
  const data = new Float32Array(3 * width * height);
  const row = new Uint8Array(4 * width);
  for (let y = 0; y < height; y++) {
    const coded = width >= 8 && width < 32768 && bytes[at] === 2 && bytes[at + 1] === 2 && (((bytes[at + 2] as number) << 8) | (bytes[at + 3] as number)) === width;
    if (coded) {
      at += 4;
      for (let channel = 0; channel < 4; channel++)
        for (let x = 0; x < width; ) {
          if (at + 1 >= bytes.length) fail("the file is truncated.");
          let count = bytes[at++] as number;
          const run = count > 128;
          if (run) count -= 128;
          if (count === 0 || x + count > width || (!run && at + count > bytes.length)) fail("a row is damaged.");
          for (let i = 0; i < count; i++, x++) row[4 * x + channel] = bytes[run ? at : at + i] as number;
          at += run ? 1 : count;
        }
    } else {
      if (at + 4 * width > bytes.length) fail("the file is truncated.");
      row.set(bytes.subarray(at, at + 4 * width));
      at += 4 * width;
    }
    for (let x = 0; x < width; x++) {
      const exponent = row[4 * x + 3] as number;
      if (exponent === 0) continue;
      const factor = 2 ** (exponent - 136);
      for (let c = 0; c < 3; c++) data[3 * (y * width + x) + c] = (row[4 * x + c] as number) * factor;
    }
  }
  return { width, height, data };
}
