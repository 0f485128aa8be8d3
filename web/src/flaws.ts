/**
 * Detects faults in a picture, so that they are reported instead of displayed as light: values that are not finite,
 * and balls that are black although light that their material scatters falls on them.
 *
 * Otherwise a shader with an error, of a driver or of the user, would look like a dark material.
 */
import type { Vec3 } from "./data";
import { BROKEN_GLSL, FULLSCREEN_VERTEX } from "./display";
import type { Evaluator } from "./evaluator";
import { actingLights, environmentOf, localLights } from "./lights";
import { HEADER } from "./programs";
import type { DrawnBall } from "./renderer";
import type { ShaderLibrary } from "./shaders";
import type { State } from "./state";
import { type Target, createTarget, deleteTarget } from "./targets";
import { type Frame, add, cross, dot, length, normalize, scale, sphereBounds, sub } from "./vectors";

export interface Flaw {
  slot: number;
  ball: number;
  kind: "no number" | "black";
  pixels: number;
}

/** Of the pixels that a ball may cover: the number without a finite value, the number covered, the largest value. */
interface Counted {
  broken: number;
  covered: number;
  largest: number;
}

/** Left, bottom, right, top of a ball in the picture, device coordinates. */
export type Box = [number, number, number, number];
export const boxOf = (frame: Frame, center: Vec3, aspect: number): Box | null => sphereBounds(frame, center, 1, aspect);

const COLUMNS = 64;
const COUNT = `${HEADER}${BROKEN_GLSL}
uniform sampler2D picture;
uniform ivec4 box;   // in pixels
layout(location = 0) out vec4 color;
void main() {
  vec3 counts = vec3(0.0);
  for (int x = box.x + int(gl_FragCoord.x); x < box.z; x += ${COLUMNS})
    for (int y = box.y; y < box.w; y++) {
      vec4 sum = texelFetch(picture, ivec2(x, y), 0);
      bool broken = page_broken(sum.rgb);
      counts.x += broken ? 1.0 : 0.0;
      counts.y += sum.a > 0.0 ? 1.0 : 0.0;
      counts.z = max(counts.z, broken ? 0.0 : max(abs(sum.r), max(abs(sum.g), abs(sum.b))));
    }
  color = vec4(counts, 1.0);
}
`;

/** Statistics of each box of a picture of sums; waits for the GPU. */
export function count(gl: WebGL2RenderingContext, shaders: ShaderLibrary, picture: Target, boxes: (Box | null)[]): Counted[] {
  const { width, height } = picture;
  const program = shaders.program({ key: "count", title: "count", long: false, vertex: () => FULLSCREEN_VERTEX, fragment: () => COUNT });
  const target = createTarget(gl, COLUMNS, Math.max(boxes.length, 1), true, false);
  const floats = new Float32Array(4 * COLUMNS * target.height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
  for (const state of [gl.BLEND, gl.DEPTH_TEST, gl.SCISSOR_TEST, gl.STENCIL_TEST, gl.CULL_FACE]) gl.disable(state);
  gl.useProgram(program.handle);
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, picture.texture);
  gl.uniform1i(program.uniform("picture"), 0);
  boxes.forEach((box, row) => {
    const [x0, y0, x1, y1] = box ?? [0, 0, 0, 0];
    const pixels = (at: number, size: number) => Math.round(((at + 1) / 2) * size);
    gl.viewport(0, row, COLUMNS, 1);
    gl.uniform4i(program.uniform("box"), pixels(x0, width), pixels(y0, height), pixels(x1, width), pixels(y1, height));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  });
  gl.readPixels(0, 0, COLUMNS, target.height, gl.RGBA, gl.FLOAT, floats);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  deleteTarget(gl, target);
  return boxes.map((_, row) => {
    const counts = { broken: 0, covered: 0, largest: 0 };
    for (let i = 4 * COLUMNS * row; i < 4 * COLUMNS * (row + 1); i += 4) {
      counts.broken += floats[i] as number;
      counts.covered += floats[i + 1] as number;
      counts.largest = Math.max(counts.largest, floats[i + 2] as number);
    }
    return counts;
  });
}

/** Points of the visible half of a ball, as many across as up. */
const ACROSS = 8;
/** Less than this fraction of a lamp's irradiance may appear black in a picture. */
const FAINT = 1e-6;

/** Whether a ball scatters light to the camera, by calls of its material's functions outside any picture. */
export async function shines(evaluator: Evaluator, state: State, frame: Frame, { shader, values, center }: DrawnBall): Promise<boolean> {
  const lights = actingLights(state);
  const [outward, inward]: [number[], number[]] = [[], []];
  const toward = normalize(sub(frame.eye, center));
  const right = normalize(cross(frame.up, toward));
  const up = cross(toward, right);
  for (let i = 0; i < ACROSS * ACROSS; i++) {
    const [x, y] = [i % ACROSS, Math.floor(i / ACROSS)].map((k) => (1.8 * (k + 0.5)) / ACROSS - 0.9) as [number, number];
    const z = 1 - x * x - y * y;
    if (z <= 0) continue;
    const n = normalize(add(add(scale(right, x), scale(up, y)), scale(toward, Math.sqrt(z))));
    const flat: Vec3 = [n[2], 0, -n[0]];
    const tangent: Vec3 = length(flat) > 1e-6 ? normalize(flat) : [1, 0, 0];
    const bitangent = cross(n, tangent);
    const local = (d: Vec3): Vec3 => [dot(d, tangent), dot(d, bitangent), dot(d, n)];
    const point = add(center, n);
    const wo = local(normalize(sub(frame.eye, point)));
    for (const light of localLights(lights)) {
      const [place, power] = light.type === "directional" ? [add(point, light.direction), light.irradiance] : light.type === "point" ? [light.position, light.intensity] : [light.center, light.radiance];
      if (wo[2] <= 0 || Math.max(...power) <= 0) continue;
      outward.push(...wo);
      inward.push(...local(normalize(sub(place, point))));
    }
  }
  if (outward.length) {
    const { value } = await evaluator.evaluate(shader, values, outward, inward);
    if (value.some((v) => v > FAINT)) return true;
  }
  const environment = environmentOf(lights);
  if (!environment || environment.scale <= 0 || (!environment.image && Math.max(...environment.constant) <= 0)) return false;
  const { weight } = await evaluator.sample(shader, values, [0.6, 0, 0.8], [0.3, 0.3, 0.3, 0.7, 0.5, 0.6, 0.95, 0.4, 0.2]);
  return weight.some((v) => v > FAINT);
}

/** As a line for the user: "A 3, 4 and B 3: 12 pixels have no finite value". */
export function described(flaws: readonly Flaw[]): string {
  const of = (kind: Flaw["kind"]) => flaws.filter((flaw) => flaw.kind === kind);
  const names = (some: Flaw[]) =>
    [...new Set(some.map(({ slot }) => slot))].map((row) => `${String.fromCharCode(65 + row)} ${some.filter(({ slot }) => slot === row).map(({ ball }) => ball + 1).join(", ")}`).join(" and ");
  const [broken, black] = [of("no number"), of("black")];
  const pixels = broken.reduce((sum, flaw) => sum + flaw.pixels, 0);
  return [
    ...(broken.length ? [`${names(broken)}: ${pixels} ${pixels === 1 ? "pixel has" : "pixels have"} no finite value`] : []),
    ...(black.length ? [`${names(black)}: black, although the material scatters the incident light`] : []),
  ].join("; ");
}
