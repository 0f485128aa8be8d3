/** Shapes that replace the balls: a torus, a shader ball, or a dropped file, scaled to the unit sphere. */
import type { BufferGeometry } from "three";

export interface Mesh {
  positions: Float32Array;
  normals: Float32Array;
  tangents: Float32Array;
  uvs: Float32Array;
  indices: Uint32Array;
}

export interface MeshBuffers {
  array: WebGLVertexArrayObject;
  count: number;
  mesh: Mesh;
}

export function upload(gl: WebGL2RenderingContext, mesh: Mesh): MeshBuffers {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  [mesh.positions, mesh.normals, mesh.tangents].forEach((values, location) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 0, 0);
  });
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.indices, gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return { array, count: mesh.indices.length, mesh };
}

interface Grid {
  positions: number[];
  normals: number[];
  tangents: number[];
  uvs: number[];
  indices: number[];
}

/** A surface over (u, v) in the unit square: the tangent is dp/du, the normal dp/du x dp/dv, by central differences. */
function addGrid(out: Grid, columns: number, rows: number, point: (u: number, v: number) => [number, number, number], flip = false): void {
  const first = out.positions.length / 3;
  const step = 1e-4;
  for (let j = 0; j <= rows; j++)
    for (let i = 0; i <= columns; i++) {
      const [u, v] = [i / columns, j / rows];
      const difference = (a: [number, number, number], b: [number, number, number]) => [b[0] - a[0], b[1] - a[1], b[2] - a[2]] as const;
      const du = difference(point(u - step, v), point(u + step, v));
      const dv = difference(point(u, Math.max(v - step, 1e-5)), point(u, Math.min(v + step, 1 - 1e-5)));
      const n = [du[1] * dv[2] - du[2] * dv[1], du[2] * dv[0] - du[0] * dv[2], du[0] * dv[1] - du[1] * dv[0]] as const;
      const sign = (flip ? -1 : 1) / (Math.hypot(...n) || 1);
      const size = Math.hypot(...du) || 1;
      out.positions.push(...point(u, v));
      out.normals.push(n[0] * sign, n[1] * sign, n[2] * sign);
      out.tangents.push(du[0] / size, du[1] / size, du[2] / size);
      out.uvs.push(u, v);
    }
  for (let j = 0; j < rows; j++)
    for (let i = 0; i < columns; i++) {
      const a = first + j * (columns + 1) + i;
      out.indices.push(a, a + 1, a + columns + 1, a + 1, a + columns + 2, a + columns + 1);
    }
}

const empty = (): Grid => ({ positions: [], normals: [], tangents: [], uvs: [], indices: [] });

const finish = (grid: Grid): Mesh => ({
  positions: new Float32Array(grid.positions),
  normals: new Float32Array(grid.normals),
  tangents: new Float32Array(grid.tangents),
  uvs: new Float32Array(grid.uvs),
  indices: new Uint32Array(grid.indices),
});

export function torus(): Mesh {
  const grid = empty();
  const [large, small] = [0.68, 0.32];
  const tilt = 0.9; // the front view shows the hole of the torus and its inner side
  addGrid(grid, 96, 48, (u, v) => {
    const [a, b] = [2 * Math.PI * u, 2 * Math.PI * v];
    const r = large + small * Math.cos(b);
    const [x, y, z] = [r * Math.sin(a), small * Math.sin(b), r * Math.cos(a)];
    return [x, y * Math.cos(tilt) - z * Math.sin(tilt), y * Math.sin(tilt) + z * Math.cos(tilt)];
  });
  return finish(grid);
}

/** A ball on a foot, with a groove that shows concave edges, and a rounded collar. */
export function shaderBall(): Mesh {
  const grid = empty();
  const revolve = (profile: (v: number) => [number, number], rows: number) =>
    addGrid(grid, 96, rows, (u, v) => {
      const [r, y] = profile(v);
      const a = 2 * Math.PI * u;
      return [r * Math.sin(a), y, r * Math.cos(a)];
    });
  const radius = 0.74;
  const middle = 0.24;
  // From the foot's pole upward, so that dp/du x dp/dv points out.
  revolve((v) => {
    const polar = Math.PI * (1 - Math.min(Math.max(v, 1e-3), 1 - 1e-3));
    const groove = 0.07 * Math.exp(-(((polar - 1.15) / 0.055) ** 2));
    const r = radius - groove;
    return [r * Math.sin(polar), middle + r * Math.cos(polar)];
  }, 120);
  const collar: [number, number][] = [[0.001, -0.84], [0.46, -0.84], [0.5, -0.82], [0.5, -0.76], [0.46, -0.73], [0.34, -0.71], [0.27, -0.64], [0.25, -0.52], [0.25, -0.4]];
  revolve((v) => smooth(collar, v), 64);
  return finish(grid);
}

/** Catmull-Rom through the points. */
function smooth(points: [number, number][], v: number): [number, number] {
  const x = Math.min(Math.max(v, 0), 1) * (points.length - 1);
  const i = Math.min(Math.floor(x), points.length - 2);
  const t = x - i;
  const at = (k: number) => points[Math.min(Math.max(k, 0), points.length - 1)] as [number, number];
  const [a, b, c, d] = [at(i - 1), at(i), at(i + 1), at(i + 2)];
  const blend = (k: 0 | 1) =>
    b[k] + 0.5 * t * (c[k] - a[k] + t * (2 * a[k] - 5 * b[k] + 4 * c[k] - d[k] + t * (3 * (b[k] - c[k]) + d[k] - a[k])));
  return [Math.max(blend(0), 1e-3), blend(1)];
}

const LARGEST_FILE = 64 * 1024 * 1024;

/** A dropped .glb, .gltf (with its .bin `companions` it, if it has one) or .obj. */
export async function readMesh(file: File, companions: readonly File[] = []): Promise<Mesh> {
  for (const each of [file, ...companions]) if (each.size > LARGEST_FILE) throw new Error(`${each.name} is larger than 64 MB.`);
  const { parseMesh } = await import("./mesh-files");
  return fromGeometry(await parseMesh(file, companions));
}

/** Centered and scaled to the unit sphere; tangents along u if there are texture coordinates. */
export function fromGeometry(geometry: BufferGeometry): Mesh {
  const position = geometry.getAttribute("position");
  const count = position.count;
  if (!geometry.getAttribute("normal")) geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  const sphere = geometry.boundingSphere;
  const radius = sphere && sphere.radius > 0 ? sphere.radius : 1;
  const normal = geometry.getAttribute("normal");
  const uv = geometry.getAttribute("uv");
  const index = geometry.getIndex();
  const positions = new Float32Array(3 * count);
  const normals = new Float32Array(3 * count);
  const uvs = new Float32Array(2 * count);
  for (let i = 0; i < count; i++) {
    positions[3 * i] = (position.getX(i) - (sphere?.center.x ?? 0)) / radius;
    positions[3 * i + 1] = (position.getY(i) - (sphere?.center.y ?? 0)) / radius;
    positions[3 * i + 2] = (position.getZ(i) - (sphere?.center.z ?? 0)) / radius;
    normals.set([normal.getX(i), normal.getY(i), normal.getZ(i)], 3 * i);
    if (uv) uvs.set([uv.getX(i), uv.getY(i)], 2 * i);
  }
  if (positions.some((x) => !Number.isFinite(x)) || count === 0) throw new Error("The mesh is empty or has vertices that are not finite.");
  const indices = index ? Uint32Array.from(index.array) : Uint32Array.from({ length: count }, (_, i) => i);
  const tangents = new Float32Array(3 * count);
  if (uv) tangentsAlongU(positions, uvs, indices, tangents);
  return { positions, normals, tangents, uvs, indices };
}

/** Sums dp/du of every triangle at its vertices; where the sum is zero the shader takes the sphere's tangent. */
function tangentsAlongU(positions: Float32Array, uvs: Float32Array, indices: Uint32Array, out: Float32Array): void {
  const at = (array: Float32Array, i: number) => array[i] as number;
  for (let t = 0; t + 2 < indices.length; t += 3) {
    const [a, b, c] = [indices[t] as number, indices[t + 1] as number, indices[t + 2] as number];
    const [u1, v1] = [at(uvs, 2 * b) - at(uvs, 2 * a), at(uvs, 2 * b + 1) - at(uvs, 2 * a + 1)];
    const [u2, v2] = [at(uvs, 2 * c) - at(uvs, 2 * a), at(uvs, 2 * c + 1) - at(uvs, 2 * a + 1)];
    const area = u1 * v2 - u2 * v1;
    if (Math.abs(area) < 1e-12) continue;
    for (let k = 0; k < 3; k++) {
      const e1 = at(positions, 3 * b + k) - at(positions, 3 * a + k);
      const e2 = at(positions, 3 * c + k) - at(positions, 3 * a + k);
      const tangent = (e1 * v2 - e2 * v1) / area;
      for (const corner of [a, b, c]) out[3 * corner + k] = at(out, 3 * corner + k) + tangent;
    }
  }
}
