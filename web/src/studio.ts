/** A photographer's studio as an environment, computed: a dark room with a key light, a strip, a bank behind and a ceiling. */
import { type EnvironmentPicture, environmentFromFloats } from "./environment";

export const STUDIO = { width: 256, height: 128, data: "studio" } as const;

interface Panel {
  /** Degrees: azimuth about the vertical from the camera's side, elevation above the horizon; center and half size. */
  azimuth: [number, number];
  elevation: [number, number];
  radiance: [number, number, number];
}

const PANELS: Panel[] = [
  { azimuth: [-48, 30], elevation: [36, 20], radiance: [5.6, 5.3, 4.9] },
  { azimuth: [62, 11], elevation: [12, 44], radiance: [2.7, 2.7, 2.8] },
  { azimuth: [180, 80], elevation: [30, 9], radiance: [2.4, 2.4, 2.5] },
  { azimuth: [0, 180], elevation: [90, 16], radiance: [1.5, 1.5, 1.5] },
];
const EDGE = 4; // degrees over which a panel fades: a sharp edge would show the picture's pixels

const fade = (distance: number, half: number) => {
  const t = Math.min(1, Math.max(0, (half + EDGE / 2 - Math.abs(distance)) / EDGE));
  return t * t * (3 - 2 * t);
};

/** Radiance from a direction. */
function radiance(azimuth: number, elevation: number): [number, number, number] {
  // The floor is dark and warm, the walls brighten toward the ceiling.
  const wall = 0.5 + 0.5 * Math.sin((elevation * Math.PI) / 180);
  const color: [number, number, number] = [0.06 + 0.24 * wall, 0.055 + 0.225 * wall, 0.05 + 0.2 * wall];
  for (const panel of PANELS) {
    const turn = ((((azimuth - panel.azimuth[0]) % 360) + 540) % 360) - 180;
    const share = (panel.azimuth[1] >= 180 ? 1 : fade(turn, panel.azimuth[1])) * fade(elevation - panel.elevation[0], panel.elevation[1]);
    for (let c = 0; c < 3; c++) color[c] = (color[c] as number) * (1 - share) + (panel.radiance[c] as number) * share;
  }
  return color;
}

export function studio(gl: WebGL2RenderingContext): EnvironmentPicture {
  const { width, height } = STUDIO;
  const floats = new Float32Array(3 * width * height);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++) floats.set(radiance((360 * (x + 0.5)) / width, 90 - (180 * (y + 0.5)) / height), 3 * (y * width + x));
  return environmentFromFloats(gl, width, height, floats, 3);
}
