/** The active lights, and how they are passed to the shaders. */
import type { AreaLight, DirectionalLight, EnvironmentLight, PointLight, Vec3 } from "./data";
import { MAX_LIGHTS } from "./glsl";
import type { Program } from "./programs";
import type { Light, State } from "./state";
import { normalize } from "./vectors";

export const FURNACE: Light = {
  type: "environment",
  image: null,
  constant: [1, 1, 1],
  rotation: 0,
  scale: 1,
  on: true,
  name: "White furnace",
};

/** Every active light, in the order of the list; the furnace replaces them all. */
export function actingLights(state: State): Light[] {
  return state.furnace ? [FURNACE] : state.lights.filter((light) => light.on);
}

export type LocalLight = (DirectionalLight | PointLight | AreaLight) & { on: boolean; name: string };

export const localLights = (lights: Light[]): LocalLight[] =>
  lights.filter((l): l is LocalLight => l.type !== "environment").slice(0, MAX_LIGHTS);

export const environmentOf = (lights: Light[]): (EnvironmentLight & { on: boolean; name: string }) | null =>
  lights.find((l): l is EnvironmentLight & { on: boolean; name: string } => l.type === "environment") ?? null;

export function bindLights(gl: WebGL2RenderingContext, program: Program, lights: LocalLight[]): void {
  // Shaders without a loop over lights have no count; drivers ignore uniforms that a program lacks.
  gl.uniform1i(program.uniform("light_count"), lights.length);
  const kinds = new Int32Array(4 * MAX_LIGHTS);
  const [place, power, u, v] = [0, 0, 0, 0].map(() => new Float32Array(3 * MAX_LIGHTS)) as [Float32Array, Float32Array, Float32Array, Float32Array];
  lights.forEach((light, i) => {
    if (light.type === "directional") {
      place.set(normalize(light.direction), 3 * i);
      power.set(light.irradiance, 3 * i);
    } else if (light.type === "point") {
      kinds[4 * i] = 1;
      place.set(light.position, 3 * i);
      power.set(light.intensity, 3 * i);
    } else {
      kinds[4 * i] = 2;
      place.set(light.center, 3 * i);
      power.set(light.radiance, 3 * i);
      u.set(light.u, 3 * i);
      v.set(light.v, 3 * i);
    }
  });
  gl.uniform4iv(program.uniform("light_kind"), kinds);
  gl.uniform3fv(program.uniform("light_place"), place);
  gl.uniform3fv(program.uniform("light_power"), power);
  gl.uniform3fv(program.uniform("light_u"), u);
  gl.uniform3fv(program.uniform("light_v"), v);
}

/** A new light of a kind, with values that light the balls about as the default sun does. */
export function newLight(type: Light["type"]): Light {
  const direction: Vec3 = [0.4364358, 0.4364358, 0.7867958];
  const common = { on: true };
  if (type === "directional") return { ...common, name: "Directional", type, direction, irradiance: [Math.PI, Math.PI, Math.PI] };
  if (type === "point") return { ...common, name: "Point", type, position: [4, 5, 6], intensity: [200, 200, 200] };
  if (type === "area") return { ...common, name: "Area", type, center: [-3, 5, 5], u: [1.5, 0, 0], v: [0, 1.06, -1.06], radiance: [18, 18, 18] };
  return { ...common, name: "Environment", type, image: null, constant: [0.5, 0.5, 0.5], rotation: 0, scale: 1 };
}
