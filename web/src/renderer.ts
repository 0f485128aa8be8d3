/**
 * Renders the balls into a float picture of sums, one sample per pixel at a time, and that picture to the screen.
 *
 * A sample's position in the pixel and its random numbers come from low-discrepancy sequences, so that the sum converges
 * to the box-filtered picture of a path tracer. Only the pixels that a ball may cover are drawn.
 */
import type { Values, Vec3 } from "./data";
import { MAX_BLACK, TONES, displayProgram } from "./display";
import { AlbedoTables, type EnvironmentPicture, type PrefilteredLevel, PrefilteredEnvironments, alphaOf, roughnessOf } from "./environment";
import { type Box, type Flaw, boxOf, count } from "./flaws";
import { DEPTH_FRAGMENT, DEPTH_VERTEX, type EnvironmentUse, type ShadingKey, copies, fragmentText, hasTerm, isFactor, isSigned, isWhole, splits, vertexText } from "./glsl";
import { actingLights, bindLights, environmentOf, localLights } from "./lights";
import type { MeshBuffers } from "./meshes";
import type { Picture, Presenter } from "./panel";
import type { Program, Source } from "./programs";
import type { Shader, ShaderLibrary } from "./shaders";
import { isLong } from "./size";
import type { State } from "./state";
import { type Target, areaSequence, createTarget, deleteTarget, floatBlending, readTarget, sequence } from "./targets";
import { type Frame, cameraFrame, fitted, length, sphereBounds, sub } from "./vectors";

export interface DrawnBall {
  slot: number;
  ball: number;
  shader: Shader;
  values: Values;
  center: Vec3;
}

/** What the page shows now, resolved: the renderer is independent of rows and links. */
export interface Scene {
  state: State;
  balls: DrawnBall[];
  /** Balls of the row that the others are subtracted from; empty for any other term. */
  minuend: DrawnBall[];
  environment: EnvironmentPicture | null;
  mesh: MeshBuffers | null;
  /** sRGB of the page behind the balls. */
  paper: Vec3;
  /** Faults found in the last picture of them. */
  flaws: readonly Flaw[];
}

interface Draw extends DrawnBall {
  gain: number;
  cover: number;
  nearer: number;
}

/** A sum over positions in the pixel converges sooner than one over directions. */
const SAMPLES_STILL = 256;
const SAMPLES_RANDOM = 4096;
const SAMPLES_HALF = 64; // float16 sums: at 64, one sample is still 16 units in the last place

/** From this number of samples on, the split sum no longer contributes: docs/viewer.md, "Light of an environment". */
const EARLY_END = 64;

/** How an environment is integrated, and which integral is subtracted. */
type Uses = Pick<ShadingKey, "environment" | "minus">;
const SPLIT_SUM: Uses = { environment: "split-sum", minus: "none" };

interface Prepared {
  draw: Draw;
  program: Program;
  row: number;
  level: PrefilteredLevel | null;
  /** Whether its tables are complete, and whether they have just become so. */
  complete: boolean;
  finished: boolean;
}

export class Renderer {
  samples = 0;
  /** Draw calls and pictures since the page was loaded, for tests and the status line. */
  frames = 0;
  private target: Target | null = null;
  /** The weighted split sum, shown while the sum in `target` is still noisy. */
  private early: Target | null = null;
  private hasEarly = false;
  private readonly full: boolean;
  private readonly albedo: AlbedoTables;
  private readonly prefiltered: PrefilteredEnvironments;
  private readonly empty: WebGLVertexArrayObject;
  private black: WebGLTexture;
  /** False while tables that the picture depends on are still being refined. */
  settled = true;

  constructor(
    readonly gl: WebGL2RenderingContext,
    readonly shaders: ShaderLibrary,
  ) {
    this.full = floatBlending(gl);
    this.albedo = new AlbedoTables(gl, shaders, this.full);
    this.prefiltered = new PrefilteredEnvironments(gl, shaders, this.full);
    // Vertex shaders that count vertices need no buffers; the default VAO may have been changed by others.
    this.empty = gl.createVertexArray();
    this.black = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.black);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  get width(): number {
    return this.target?.width ?? 0;
  }
  get height(): number {
    return this.target?.height ?? 0;
  }

  hasSize(width: number, height: number): boolean {
    return this.target?.width === width && this.target.height === height;
  }

  resize(width: number, height: number): void {
    if (this.hasSize(width, height)) return;
    deleteTarget(this.gl, this.target);
    deleteTarget(this.gl, this.early);
    this.early = null;
    this.target = createTarget(this.gl, width, height, this.full, true);
    this.samples = 0;
  }

  invalidate(): void {
    this.samples = 0;
  }

  limit(scene: Scene): number {
    const lights = actingLights(scene.state);
    const random =
      lights.some((l) => l.type === "area") ||
      (environmentOf(lights) !== null && scene.balls.some((b) => Object.values(this.environmentUse(scene, b.shader)).includes("sampled")));
    const wanted = random && !isFactor(scene.state.view.term) ? SAMPLES_RANDOM : SAMPLES_STILL;
    return this.full ? wanted : Math.min(wanted, SAMPLES_HALF);
  }

  done(scene: Scene): boolean {
    return this.samples >= this.limit(scene);
  }

  /** Adds one sample to every pixel. `hurry` postpones tables that are refined over time. */
  step(scene: Scene, hurry: boolean): void {
    const { target } = this;
    if (!target) return;
    const frame = cameraFrame(scene.state.camera);
    const draws = this.draws(scene, frame);
    // Tables first: they are drawn into framebuffers of their own.
    const prepared = draws.map((draw) => this.prepare(scene, draw, this.uses(scene, draw.shader), hurry));
    this.settled = prepared.every(({ complete }) => complete);
    if (prepared.some(({ finished }) => finished)) this.samples = 0;
    if (this.samples === 0) this.hasEarly = false;
    if (!this.hasEarly && this.samples < EARLY_END) this.drawEarly(scene, frame, prepared, hurry);
    this.sum(scene, frame, target, prepared, this.samples === 0);
    this.samples += 1;
    this.frames += 1;
  }

  /** The split sum instead of the sampled integral, as soon as its tables are available. */
  private drawEarly(scene: Scene, frame: Frame, prepared: Prepared[], hurry: boolean): void {
    const { state, environment } = scene;
    if (!environment || state.environment !== "sampled" || !["full", "compensated"].includes(state.view.term)) return;
    const target = this.target as Target;
    const draws: Prepared[] = [];
    for (const { draw, ...rest } of prepared) {
      const roughness = roughnessOf(draw.shader, draw.values);
      const sampled = this.uses(scene, draw.shader).environment === "mapped";
      if (!sampled || roughness === null || !splits(draw.shader.manifest)) {
        draws.push({ draw: { ...draw, gain: 0, cover: 0 }, ...rest });
        continue;
      }
      if (!this.shaders.programs.ready(this.sources(scene, draw.shader, SPLIT_SUM))) return;
      if (!this.prefiltered.of(draw.shader, draw.values, environment, !hurry)?.complete) return;
      // Samples that it is equivalent to: its error is smaller on smoother balls. The mean is closer to the truth for any number.
      const weight = 4 / Math.max(roughness, 0.25) ** 2;
      draws.push(this.prepare(scene, { ...draw, gain: weight, cover: weight }, SPLIT_SUM, true));
    }
    if (draws.every(({ draw }) => draw.gain === 0)) return;
    this.hasEarly = true;
    this.early ??= createTarget(this.gl, target.width, target.height, this.full, true);
    this.sum(scene, frame, this.early, draws, true);
  }

  private sum(scene: Scene, frame: Frame, target: Target, prepared: Prepared[], restart: boolean): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
    gl.viewport(0, 0, target.width, target.height);
    gl.disable(gl.SCISSOR_TEST);
    gl.disable(gl.CULL_FACE);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.depthFunc(gl.LEQUAL);
    gl.clearColor(0, 0, 0, 0);
    gl.clearDepth(1);
    gl.clear(gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT | (restart ? gl.COLOR_BUFFER_BIT : 0));
    if (scene.mesh) {
      this.depthPass(scene.mesh, prepared.map(({ draw }) => draw), frame);
      // Two triangles at one depth would both add their light: only the first is drawn.
      gl.enable(gl.STENCIL_TEST);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    }
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.FUNC_ADD);
    gl.blendFunc(gl.ONE, gl.ONE);
    for (const one of prepared) this.draw(scene, frame, one);
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.STENCIL_TEST);
    gl.bindVertexArray(null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** Front to back, since a sum cannot remove what a nearer ball hides. */
  private draws(scene: Scene, frame: Frame): Draw[] {
    const sorted = [...scene.balls].sort((a, b) => length(sub(a.center, frame.eye)) - length(sub(b.center, frame.eye)));
    const plain = (ball: DrawnBall): Draw => ({ ...ball, gain: 1, cover: 1, nearer: 0 });
    return sorted.flatMap((ball) => {
      const above = scene.minuend.find((b) => b.ball === ball.ball);
      if (!above) return [plain(ball)];
      // Rounding must not make the second draw of one ball fail the depth test against the first.
      return [plain({ ...above, center: ball.center }), { ...ball, gain: -1, cover: 0, nearer: 1e-5 }];
    });
  }

  /** How the environment is integrated, and which integral is subtracted. */
  environmentUse(scene: Scene, shader: Shader): Uses {
    const { view } = scene.state;
    const splitting = view.term === "split" || view.term === "split-error";
    const environment = this.integral(scene, shader, splitting);
    if (view.term !== "split-error") return { environment, minus: "none" };
    // Without a split sum there is no difference.
    return environment === "sampled" ? { environment: "none", minus: "none" } : { environment, minus: environment === "none" ? "none" : "sampled" };
  }

  private integral(scene: Scene, shader: Shader, splitting: boolean): EnvironmentUse {
    const { state } = scene;
    const { manifest } = shader;
    const light = environmentOf(actingLights(state));
    if (!light) return "none";
    // If the albedo depends on the angle to the normal alone, no sum over directions is needed per pixel.
    if (!manifest.isotropic || manifest.stochastic || !isWhole(state.view.term)) return "sampled";
    if (!light.image || !scene.environment) return "albedo";
    const method = splitting && state.environment === "sampled" ? "split-sum" : state.environment;
    if (method !== "dfg") return splits(manifest) ? method : "sampled";
    // The two numbers describe single scattering and multiply a reflectance at normal incidence: a compensated material,
    // or one without Fresnel's term, takes its own albedo instead.
    const single = hasTerm(manifest, "F") && !hasTerm(manifest, "multi");
    return !splits(manifest) ? "sampled" : this.shaders.splitSum(shader) && single && alphaOf(shader) ? "dfg" : "split-sum";
  }

  /** `environmentUse`, including importance sampling of a picture if there is one. */
  private uses(scene: Scene, shader: Shader): Uses {
    if (isFactor(scene.state.view.term)) return { environment: "none", minus: "none" };
    const { environment, minus } = this.environmentUse(scene, shader);
    const pictured = scene.environment && environmentOf(actingLights(scene.state))?.image;
    const way = (use: EnvironmentUse) => (use === "sampled" && pictured ? "mapped" : use);
    return { environment: way(environment), minus: way(minus) };
  }

  /** Whether the next picture can be drawn without waiting for a program; starts compiling those that are missing. */
  ready(scene: Scene): boolean {
    const shown = [...scene.balls, ...scene.minuend].map(({ shader }) => shader);
    return this.shaders.programs.ready([...new Set(shown)].flatMap((shader) => this.sources(scene, shader, this.uses(scene, shader))));
  }

  private sources(scene: Scene, shader: Shader, uses: Uses): Source[] {
    const { environment: use } = uses;
    const tables = [
      ...(use === "albedo" || use === "split-sum" ? [this.albedo.source(shader)] : []),
      ...((use === "split-sum" || use === "dfg") && scene.environment ? [this.prefiltered.source(shader)] : []),
    ];
    return [...this.shaders.derivingSources(shader), ...tables, this.shading(scene, shader, uses)];
  }

  /** The program that draws a ball. */
  private shading(scene: Scene, shader: Shader, uses: Uses): Source {
    const { term } = scene.state.view;
    // Lights other than environments are summed exactly: they cancel in the difference of two integrals of an environment.
    const lights = term === "split-error" ? 0 : copies(shader, localLights(actingLights(scene.state)).length);
    const key: ShadingKey = { geometry: scene.mesh ? "mesh" : "sphere", lights, ...uses, term };
    return {
      key: `${shader.code} ${key.geometry} ${key.lights} ${key.environment} ${key.minus} ${key.term}`,
      title: shader.material.title,
      long: isLong(shader),
      vertex: () => vertexText(shader, key.geometry),
      fragment: () => fragmentText(shader, key),
    };
  }

  /** Prepares a ball's draw apart from its program: tables are drawn into framebuffers of their own. */
  private prepare(scene: Scene, draw: Draw, uses: Uses, hurry: boolean): Prepared {
    const { gl } = this;
    const { environment: use } = uses;
    let row = 0;
    let level: PrefilteredLevel | null = null;
    const tables: { complete: boolean; finished: boolean }[] = [];
    this.shaders.derive(draw.shader, draw.values);
    gl.bindVertexArray(this.empty);
    if (use === "albedo" || use === "split-sum") {
      const made = this.albedo.row(draw.shader, draw.values, hurry ? 1 : 4);
      row = made.row;
      tables.push(made);
    }
    if ((use === "split-sum" || use === "dfg") && scene.environment) {
      level = this.prefiltered.of(draw.shader, draw.values, scene.environment);
      if (level) tables.push(level);
    }
    const [complete, finished] = [tables.every((table) => table.complete), tables.some((table) => table.finished)];
    return { draw, program: this.shaders.program(this.shading(scene, draw.shader, uses)), row, level, complete, finished };
  }

  private camera(program: Program, frame: Frame): void {
    const { gl } = this;
    const target = this.target as Target;
    gl.uniform3fv(program.uniform("eye"), frame.eye);
    gl.uniform3fv(program.uniform("right"), frame.right);
    gl.uniform3fv(program.uniform("up"), frame.up);
    gl.uniform3fv(program.uniform("back"), frame.back);
    const half = fitted(frame.half, target.width / target.height);
    gl.uniform2f(program.uniform("half_size"), (half * target.width) / target.height, half);
    const [x, y] = sequence(2, this.samples) as [number, number];
    gl.uniform2f(program.uniform("jitter"), (2 * x - 1) / target.width, (2 * y - 1) / target.height);
  }

  private depthPass(mesh: MeshBuffers, draws: Draw[], frame: Frame): void {
    const { gl } = this;
    const program = this.shaders.program({ key: "depth", title: "depth", long: false, vertex: () => DEPTH_VERTEX, fragment: () => DEPTH_FRAGMENT });
    gl.useProgram(program.handle);
    this.camera(program, frame);
    gl.colorMask(false, false, false, false);
    gl.bindVertexArray(mesh.array);
    for (const draw of draws) {
      gl.uniform3fv(program.uniform("ball_center"), draw.center);
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
    }
    gl.colorMask(true, true, true, true);
  }

  private draw(scene: Scene, frame: Frame, { draw, program, row, level }: Prepared): void {
    const { gl } = this;
    const target = this.target as Target;
    const bounds = scene.mesh ? null : sphereBounds(frame, draw.center, 1, target.width / target.height);
    if (!scene.mesh && !bounds) return;
    gl.useProgram(program.handle);
    this.camera(program, frame);
    let unit = this.shaders.bind(program, draw.shader, draw.values, 0);
    const texture = (name: string, value: WebGLTexture | null) => {
      const location = program.uniform(name);
      if (!location) return;
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, value ?? this.black);
      gl.uniform1i(location, unit);
      unit += 1;
    };
    const lights = actingLights(scene.state);
    bindLights(gl, program, localLights(lights));
    const environment = environmentOf(lights);
    if (environment) this.environmentUniforms(program, scene, texture);
    texture("albedo_table", this.albedo.texture);
    gl.uniform1f(program.uniform("albedo_row"), row);
    texture("prefiltered", level?.texture ?? null);
    gl.uniform1f(program.uniform("prefiltered_level"), level?.level ?? 0);
    gl.activeTexture(gl.TEXTURE0 + unit); // the unit to which a new table may be bound
    if (program.uniform("dfg_table")) texture("dfg_table", this.shaders.splitSumTexture(draw.shader));
    const width = alphaOf(draw.shader);
    if (width) gl.uniform1f(program.uniform("dfg_roughness"), Math.sqrt(([draw.values[width]].flat() as number[])[0] ?? 0));
    gl.uniform3fv(program.uniform("random_point"), sequence(3, this.samples));
    gl.uniform2fv(program.uniform("area_point"), areaSequence(this.samples));
    gl.uniform3fv(program.uniform("ball_center"), draw.center);
    gl.uniform1f(program.uniform("draw_gain"), draw.gain);
    gl.uniform1f(program.uniform("draw_cover"), draw.cover);
    gl.uniform1f(program.uniform("nearer"), draw.nearer);
    if (scene.mesh) {
      gl.stencilFunc(gl.EQUAL, draw.cover > 0 ? 0 : 1, 255);
      gl.bindVertexArray(scene.mesh.array);
      gl.drawElements(gl.TRIANGLES, scene.mesh.count, gl.UNSIGNED_INT, 0);
      return;
    }
    // One more pixel on each side: its center may be outside although a jittered ray still hits.
    const [x0, y0, x1, y1] = bounds as [number, number, number, number];
    const [dx, dy] = [2 / target.width, 2 / target.height];
    gl.uniform4f(program.uniform("bounds"), x0 - dx, y0 - dy, x1 + dx, y1 + dy);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  private environmentUniforms(program: Program, scene: Scene, texture: (name: string, value: WebGLTexture | null) => void): void {
    const { gl } = this;
    const light = environmentOf(actingLights(scene.state));
    const mapped = Boolean(light?.image && scene.environment);
    texture("environment_map", mapped ? (scene.environment?.texture ?? null) : null);
    if (program.uniform("environment_sums")) texture("environment_sums", scene.environment?.sums ?? null);
    gl.uniform1f(program.uniform("has_map"), mapped ? 1 : 0);
    gl.uniform3fv(program.uniform("environment_constant"), light?.constant ?? [0, 0, 0]);
    gl.uniform1f(program.uniform("environment_scale"), light?.scale ?? 0);
    gl.uniform1f(program.uniform("environment_rotation"), light?.rotation ?? 0);
  }

  /** Weight of `early` now. */
  get earlyShare(): number {
    return this.hasEarly ? Math.max(0, 1 - this.samples / EARLY_END) / Math.sqrt(this.samples) : 0;
  }

  /** Statistics of the sum per ball; waits for the GPU. Null if floats cannot be read back, or if a mesh replaces the balls. */
  inspect(scene: Scene): ReturnType<typeof count> | null {
    const { gl, target } = this;
    if (!target || this.samples === 0 || !gl.getExtension("EXT_color_buffer_float")) return null;
    gl.bindVertexArray(this.empty);
    const counts = count(gl, this.shaders, target, this.boxes(scene));
    gl.bindVertexArray(null);
    return counts;
  }

  private boxes(scene: Scene): (Box | null)[] {
    const { width, height } = this;
    const frame = cameraFrame(scene.state.camera);
    return scene.balls.map(({ center }) => boxOf(frame, center, width / height));
  }

  /** Draws the sum to the canvas, or lets a panel draw it. */
  present(scene: Scene, presenter: Presenter | null, width: number, height: number): void {
    const { gl, target } = this;
    if (!target || this.samples === 0) return;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.empty);
    if (presenter?.present(gl, target.texture, this.samples, width, height)) {
      gl.bindVertexArray(null);
      return;
    }
    const { state } = scene;
    const program = displayProgram(gl);
    gl.useProgram(program.handle);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, target.texture);
    gl.uniform1i(program.uniform("picture"), 0);
    gl.uniform1f(program.uniform("samples"), this.samples);
    gl.uniform1f(program.uniform("early_share"), this.earlyShare);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.earlyShare > 0 && this.early ? this.early.texture : this.black);
    gl.uniform1i(program.uniform("early"), 1);
    gl.uniform1f(program.uniform("exposure"), 2 ** state.display.exposure);
    gl.uniform1i(program.uniform("curve"), TONES[state.display.tone].index);
    gl.uniform1i(program.uniform("has_sign"), scene.minuend.length > 0 || isSigned(state.view.term) ? 1 : 0);
    gl.uniform3fv(program.uniform("theme"), scene.paper);
    const shown = environmentOf(actingLights(state)) !== null && (state.furnace || state.view.background === "environment");
    const boxes = scene.flaws.length ? this.boxes(scene) : [];
    const black = scene.balls.flatMap(({ slot, ball }, i) => (boxes[i] && scene.flaws.some((f) => f.kind === "black" && f.slot === slot && f.ball === ball) ? [boxes[i]] : [])).slice(0, MAX_BLACK);
    gl.uniform1i(program.uniform("has_broken"), scene.flaws.some((flaw) => flaw.kind === "no number") ? 1 : 0);
    gl.uniform1i(program.uniform("black_count"), black.length);
    if (black.length) gl.uniform4fv(program.uniform("black_boxes"), black.flat());
    gl.uniform1i(program.uniform("in_environment"), shown && !isFactor(state.view.term) ? 1 : 0);
    let unit = 2;
    this.environmentUniforms(program, scene, (name, value) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, value ?? this.black);
      gl.uniform1i(program.uniform(name), unit++);
    });
    const frame = cameraFrame(state.camera);
    gl.uniform3fv(program.uniform("right"), frame.right);
    gl.uniform3fv(program.uniform("up"), frame.up);
    gl.uniform3fv(program.uniform("back"), frame.back);
    const half = fitted(frame.half, width / height);
    gl.uniform2f(program.uniform("half_size"), (half * width) / height, half);
    gl.uniform2f(program.uniform("size"), width, height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
  }

  /** Mean radiance over the samples so far. */
  read(scene: Scene): Picture {
    const target = this.target as Target;
    const data = readTarget(this.gl, target);
    const n = Math.max(this.samples, 1);
    for (let i = 0; i < data.length; i++) data[i] = (data[i] as number) / n;
    return { width: target.width, height: target.height, data, samples: this.samples, done: this.done(scene) };
  }
}
