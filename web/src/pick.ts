/** Picking: the ball under a pixel, and the frame of its surface there. */
import type { Vec3 } from "./data";
import type { Mesh } from "./meshes";
import type { DrawnBall } from "./renderer";
import { add, cross, dot, normalize, scale, sphereTangent, sub } from "./vectors";

export interface Hit {
  ball: DrawnBall;
  distance: number;
  position: Vec3;
  normal: Vec3;
  tangent: Vec3;
  uv: [number, number];
}

export function hitBalls(balls: DrawnBall[], mesh: Mesh | null, eye: Vec3, ray: Vec3): Hit | null {
  let best: Hit | null = null;
  for (const ball of balls) {
    const from = sub(eye, ball.center);
    const b = dot(from, ray);
    const inside = b * b - dot(from, from) + 1;
    if (inside < 0) continue; // meshes are inside the unit sphere too
    const hit = mesh ? hitMesh(mesh, from, ray) : hitSphere(from, ray, -b - Math.sqrt(inside));
    if (hit && hit.distance > 0 && hit.distance < (best?.distance ?? Infinity)) best = { ball, ...hit, position: add(ball.center, hit.position) };
  }
  return best;
}

export function hitSphere(from: Vec3, ray: Vec3, distance: number): Omit<Hit, "ball"> {
  const normal = normalize(add(from, scale(ray, distance)));
  const turn = Math.atan2(normal[0], normal[2]) / (2 * Math.PI);
  return {
    distance,
    position: normal,
    normal,
    tangent: sphereTangent(normal),
    uv: [turn - Math.floor(turn), Math.acos(Math.max(-1, Math.min(1, normal[1]))) / Math.PI],
  };
}

/** Nearest triangle (Moeller and Trumbore 1997). */
function hitMesh(mesh: Mesh, from: Vec3, ray: Vec3): Omit<Hit, "ball"> | null {
  const { positions, normals, tangents, uvs, indices } = mesh;
  const vector = (array: Float32Array, i: number): Vec3 => [array[3 * i] as number, array[3 * i + 1] as number, array[3 * i + 2] as number];
  let nearest: { t: number; u: number; v: number; corner: number } | null = null;
  for (let corner = 0; corner + 2 < indices.length; corner += 3) {
    const a = vector(positions, indices[corner] as number);
    const e1 = sub(vector(positions, indices[corner + 1] as number), a);
    const e2 = sub(vector(positions, indices[corner + 2] as number), a);
    const p = cross(ray, e2);
    const determinant = dot(e1, p);
    if (Math.abs(determinant) < 1e-14) continue;
    const to = sub(from, a);
    const u = dot(to, p) / determinant;
    if (u < 0 || u > 1) continue;
    const q = cross(to, e1);
    const v = dot(ray, q) / determinant;
    if (v < 0 || u + v > 1) continue;
    const t = dot(e2, q) / determinant;
    if (t > 1e-6 && t < (nearest?.t ?? Infinity)) nearest = { t, u, v, corner };
  }
  if (!nearest) return null;
  const { t, u, v, corner } = nearest;
  const weights = [1 - u - v, u, v];
  const blend = (array: Float32Array): Vec3 =>
    weights.reduce<Vec3>((sum, w, k) => add(sum, scale(vector(array, indices[corner + k] as number), w)), [0, 0, 0]);
  const normal = normalize(blend(normals));
  const along = blend(tangents);
  const across = sub(along, scale(normal, dot(along, normal)));
  const at = (k: 0 | 1) => weights.reduce((sum, w, c) => sum + w * (uvs[2 * (indices[corner + c] as number) + k] as number), 0);
  return {
    distance: t,
    position: add(from, scale(ray, t)),
    normal,
    tangent: dot(across, across) > 1e-8 ? normalize(across) : sphereTangent(normal),
    uv: [at(0), at(1)],
  };
}
