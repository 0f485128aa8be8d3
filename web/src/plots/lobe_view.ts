/** Draws lobes in a WebGL view of its own: z up, orbit by dragging, the surface as a disc. */
import type { Vec3 } from "../data";
import { add, cross, dot, normalize, scale, sub } from "../vectors";
import { frameAround } from "./directions";
import { HEADER, link, type Program } from "../programs";

export interface Surface {
  /** xyz and RGB (0 to 1), interleaved. */
  vertices: Float32Array;
  /** Transparent, because it encloses another lobe. */
  glass: boolean;
  /** Sort key of nested surfaces. */
  size: number;
}

export interface Arrow {
  direction: Vec3;
  color: Vec3;
  label: string;
}

const VERTEX = `${HEADER}
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 color;
uniform mat4 projection;
out vec3 at;
out vec3 tint;
void main() { at = position; tint = color; gl_Position = projection * vec4(position, 1.0); }`;

// The normal from the derivatives of the position: the mesh needs none, and creases at the horizon stay sharp.
const FRAGMENT = `${HEADER}
in vec3 at;
in vec3 tint;
uniform float lit, glass;
uniform vec3 eye;
out vec4 result;
void main() {
  vec3 normal = normalize(cross(dFdx(at), dFdy(at)) + vec3(0.0, 0.0, 1e-12));
  float facing = abs(dot(normal, normalize(eye - at)));
  float shade = mix(1.0, 0.45 + 0.55 * facing, lit);
  // A transparent lobe is visible at its rim, at grazing angles, and does not tint the lobe inside it.
  float alpha = mix(1.0, mix(0.75, 0.07, facing), glass);
  result = vec4(tint * shade * alpha, alpha);
}`;

export class LobeView {
  readonly canvas = document.createElement("canvas");
  private readonly labels = document.createElement("div");
  private readonly gl: WebGL2RenderingContext;
  private readonly program: Program;
  private readonly buffer: WebGLBuffer;
  private readonly elements: WebGLBuffer;
  private surfaces: Surface[] = [];
  private arrows: Arrow[] = [];
  private ring: Vec3 = [0.5, 0.5, 0.5];
  private view = { ...HOME };
  private scheduled = false;

  constructor(
    host: HTMLElement,
    private readonly indices: Uint32Array,
  ) {
    const gl = this.canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("The browser provides no second WebGL 2 context for the lobe.");
    this.gl = gl;
    this.program = link(gl, "lobe", VERTEX, FRAGMENT);
    this.buffer = gl.createBuffer();
    this.elements = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.elements);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    this.canvas.className = "p-canvas p-orbit";
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("aria-label", "Lobe; drag or use arrow keys to rotate, wheel to zoom, double-click to reset");
    this.labels.className = "p-labels";
    host.append(this.canvas, this.labels);
    this.listen();
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
  }

  show(surfaces: Surface[], arrows: Arrow[], ring: Vec3): void {
    this.surfaces = [...surfaces].sort((a, b) => a.size - b.size);
    this.arrows = arrows;
    this.ring = ring;
    this.labels.replaceChildren(
      ...arrows.map((arrow) => {
        const label = document.createElement("span");
        label.textContent = arrow.label;
        return label;
      }),
    );
    this.redraw();
  }

  redraw(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      this.draw();
    });
  }

  private listen(): void {
    const canvas = this.canvas;
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (!canvas.hasPointerCapture(event.pointerId)) return;
      this.turn(-event.movementX * 0.01, event.movementY * 0.01);
    });
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.view.distance = Math.min(12, Math.max(1.2, this.view.distance * Math.exp(event.deltaY * 0.001)));
        this.redraw();
      },
      { passive: false },
    );
    canvas.addEventListener("dblclick", () => {
      this.view = { ...HOME };
      this.redraw();
    });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      this.turn(step[0] as number, step[1] as number);
    });
  }

  private turn(azimuth: number, elevation: number): void {
    this.view.azimuth += azimuth;
    this.view.elevation = Math.min(1.55, Math.max(-1.55, this.view.elevation + elevation));
    this.redraw();
  }

  private draw(): void {
    const { gl, canvas, program } = this;
    const { clientWidth, clientHeight } = canvas;
    if (!clientWidth || !clientHeight) return;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(clientWidth * ratio);
    canvas.height = Math.round(clientHeight * ratio);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const { azimuth, elevation, distance } = this.view;
    const away: Vec3 = [Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation)];
    const target: Vec3 = [0, 0, 0.3];
    const eye = away.map((v, i) => v * distance + (target[i] as number)) as Vec3;
    const matrix = viewProjection(eye, target, clientWidth / clientHeight);
    gl.useProgram(program.handle);
    gl.uniformMatrix4fv(program.uniform("projection"), false, matrix);
    gl.uniform3fv(program.uniform("eye"), eye);
    this.lines(this.scaffold());
    gl.enable(gl.CULL_FACE);
    // Nested shells: from the outside in by their far sides, then from the inside out by their near sides.
    const passes: [Surface, number][] = this.surfaces.map((s) => [s, gl.BACK]);
    for (const surface of this.surfaces) passes.unshift([surface, gl.FRONT]);
    for (const [surface, culled] of passes) {
      gl.cullFace(culled);
      gl.depthMask(!surface.glass);
      this.upload(surface.vertices);
      gl.uniform1f(program.uniform("glass"), surface.glass ? 1 : 0);
      gl.uniform1f(program.uniform("lit"), 1);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.elements);
      gl.drawElements(gl.TRIANGLES, this.indices.length, gl.UNSIGNED_INT, 0);
    }
    gl.depthMask(true);
    gl.disable(gl.CULL_FACE);
    this.placeLabels(matrix, clientWidth, clientHeight);
  }

  private upload(vertices: Float32Array): void {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STREAM_DRAW);
    for (const location of [0, 1]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 24, 12 * location);
    }
  }

  private lines(vertices: number[]): void {
    const { gl, program } = this;
    this.upload(Float32Array.from(vertices));
    gl.uniform1f(program.uniform("glass"), 0);
    gl.uniform1f(program.uniform("lit"), 0);
    gl.drawArrays(gl.LINES, 0, vertices.length / 6);
  }

  /** The surface as three rings and a cross, and the arrows. */
  private scaffold(): number[] {
    const vertices: number[] = [];
    const segment = (a: Vec3, b: Vec3, color: Vec3) => vertices.push(...a, ...color, ...b, ...color);
    for (const r of [0.25, 0.5, 0.75, 1])
      for (let i = 0; i < 96; i++) {
        const [p, q] = [i, i + 1].map((k) => [r * Math.cos((k * Math.PI) / 48), r * Math.sin((k * Math.PI) / 48), 0] as Vec3) as [Vec3, Vec3];
        segment(p, q, this.ring);
      }
    segment([-1, 0, 0], [1, 0, 0], this.ring);
    segment([0, -1, 0], [0, 1, 0], this.ring);
    for (const { direction, color } of this.arrows) {
      const tip = scale(direction, ARROW);
      segment([0, 0, 0], tip, color);
      // Four barbs, along two directions perpendicular to the arrow.
      const [x, y] = frameAround(direction);
      for (const [across, sign] of [[x, 1], [x, -1], [y, 1], [y, -1]] as const)
        segment(tip, add(tip, add(scale(direction, -0.08), scale(across, 0.03 * sign))), color);
    }
    return vertices;
  }

  private placeLabels(matrix: Float32Array, width: number, height: number): void {
    const placed: [number, number][] = [];
    this.arrows.forEach((arrow, i) => {
      const p = arrow.direction.map((v) => (ARROW + 0.08) * v);
      const [x, y, , w] = [0, 1, 2, 3].map((row) =>
        (matrix[row] as number) * (p[0] as number) + (matrix[4 + row] as number) * (p[1] as number) + (matrix[8 + row] as number) * (p[2] as number) + (matrix[12 + row] as number),
      ) as [number, number, number, number];
      const label = this.labels.children[i] as HTMLElement;
      let left = (0.5 + (0.5 * x) / w) * width;
      const top = (0.5 - (0.5 * y) / w) * height;
      // Viewed from near the normal, two letters would overlap and read as one word.
      const overlapped = placed.find(([px, py]) => Math.abs(px - left) < 18 && Math.abs(py - top) < 14);
      if (overlapped) left = overlapped[0] + (left < overlapped[0] ? -20 : 20);
      placed.push([left, top]);
      label.style.left = `${left}px`;
      label.style.top = `${top}px`;
      label.style.color = `rgb(${arrow.color.map((c) => Math.round(255 * c)).join(",")})`;
    });
  }
}

/** Arrows end outside the unit ring, where no lobe hides them. */
const ARROW = 1.12;
const HOME = { azimuth: -1.15, elevation: 0.42, distance: 2.9 };

/** Column-major, z up, a vertical field of view of 40 degrees that grows if the view is taller than wide. */
function viewProjection(eye: Vec3, target: Vec3, aspect: number): Float32Array {
  const back = normalize(sub(eye, target));
  const right = normalize(cross([0, 0, 1], back));
  const up = cross(back, right);
  const f = Math.min(1, aspect) / Math.tan((20 * Math.PI) / 180);
  const [near, far] = [0.1, 40];
  const rows = [right, up, back].map((axis) => [...axis, -dot(axis, eye)]) as [number[], number[], number[]];
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) {
    const z = rows[2][c] as number;
    out[4 * c] = ((rows[0][c] as number) * f) / aspect;
    out[4 * c + 1] = (rows[1][c] as number) * f;
    out[4 * c + 2] = ((far + near) / (near - far)) * z + (c === 3 ? (2 * far * near) / (near - far) : 0);
    out[4 * c + 3] = -z;
  }
  return out;
}
