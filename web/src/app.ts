/** The page's application: resolves the state into what is drawn, refines the picture, and notifies the panels. */
import { attachCamera } from "./camera";
import type { PageData, Values, Vec3 } from "./data";
import { type EnvironmentPicture, environmentFromData } from "./environment";
import { STUDIO, studio } from "./studio";
import { Evaluator } from "./evaluator";
import { type Flaw, described } from "./flaws";
import { Inspector } from "./inspector";
import { type MeshBuffers, type Mesh, shaderBall, torus, upload } from "./meshes";
import type { App, Panel, Picked, Picture, Presenter } from "./panel";
import { type Hit, hitBalls, hitSphere } from "./pick";
import { type DrawnBall, Renderer, type Scene } from "./renderer";
import { type Shader, ShaderLibrary } from "./shaders";
import { Change, type Slot, type State, Store, initialState } from "./state";
import { decodeState, encodeState } from "./url";
import { cameraFrame, cross, dot, normalize, pixelRay, sub } from "./vectors";

/** The Okabe-Ito colors that are visible on light and dark backgrounds and distinct under most color deficiencies. */
const SLOT_COLORS = ["#e69f00", "#56b4e9", "#009e73", "#cc79a7", "#d55e00", "#0072b2"];
/** Duration in ms for which a change counts as motion: slow machines draw coarser pictures meanwhile. */
const MOTION = 160;
/** Time in ms without a frame after which the page counts as not shown. */
const UNSEEN = 20;
const MAX_PIXELS = 2_400_000;

/** What is wrong with the user's file, the location, and how to fix it. */
export interface Fault {
  what: string;
  where: string;
  hint: string;
}

export type Refresh = Parameters<NonNullable<Panel["refresh"]>>[0];

export class PageApp implements App {
  readonly store: Store;
  readonly gl: WebGL2RenderingContext;
  readonly shaders: ShaderLibrary;
  readonly renderer: Renderer;
  private readonly inspector: Inspector;
  private ownEvaluator: Evaluator | null = null;
  environment: EnvironmentPicture | null = null;
  presenter: Presenter | null = null;
  /** Resolves with the first picture on the canvas. */
  readonly ready: Promise<void>;
  /** Called after a new picture, reference or picked point. */
  onRefresh: (what: Refresh) => void = () => {};
  onSay: (text: string, kind: "info" | "error") => void = () => {};
  /** What the page is waiting for, per cause; null: no longer waiting. */
  onBusy: (what: "shader" | "server", text: string | null) => void = () => {};
  /** A live page asks its server for a variant that the page lacks. */
  onMissingVariant: (slot: number) => void = () => {};
  /** What is wrong with the picture, as one line; "" if nothing is. */
  onFlaws: (text: string) => void = () => {};
  /** Why the user's file cannot be shown; null once it can be again. */
  onFault: (fault: Fault | null) => void = () => {};
  reference: Picture | null = null;
  private meshes: Partial<Record<State["view"]["mesh"], MeshBuffers>> = {};
  private pickedAt: Picked | null = null;
  private lastHit: Hit | null = null;
  private lastShader = new Map<string, Shader>(); // by row and ball
  private changed = -Infinity;
  private steps = 1;
  private slow = false;
  private fence: WebGLSync | null = null;
  private submitted = 0;
  private scheduled = false;
  private dirty = false;
  private converging = false;
  private failed = false;
  private flawed = "";
  private resolveReady: () => void = () => {};
  private rejectReady: (error: unknown) => void = () => {};

  constructor(
    readonly data: PageData,
    readonly canvas: HTMLCanvasElement,
    readonly overlay: HTMLElement,
  ) {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("This browser does not support WebGL 2, which the page needs.");
    this.gl = gl;
    this.store = new Store(data);
    this.store.state = this.fromLink();
    this.shaders = new ShaderLibrary(gl, data);
    this.renderer = new Renderer(gl, this.shaders);
    this.shaders.programs.onMaking = (titles) => this.onBusy("shader", titles.length ? `Compiling the shader of ${titles.join(", ")}` : null);
    this.inspector = new Inspector(this, (flaws) => this.showFlaws(flaws));
    this.ready = new Promise((resolve, reject) => {
      this.resolveReady = resolve;
      this.rejectReady = reject;
    });
    this.ready.catch(() => {}); // reported on the page
    const pictured = data.scene.lights.find((l) => l.type === "environment" && l.image?.data);
    if (pictured?.type === "environment" && pictured.image?.data)
      this.environment = pictured.image.data === STUDIO.data ? studio(gl) : environmentFromData(gl, pictured.image.width, pictured.image.height, pictured.image.data);
    attachCamera(canvas, this.store, (x, y) => this.pick(x, y));
    this.store.subscribe((change) => this.respond(change));
    canvas.addEventListener("webglcontextlost", () => this.say("The graphics driver has reset the page's graphics context: reload the page.", "error"));
    new ResizeObserver(() => this.resized()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.themeChanged());
    addEventListener("hashchange", () => {
      if (location.hash.replace(/^#/, "") !== encodeState(this.state, this.store.initial)) this.store.replace(this.fromLink());
    });
    this.themeChanged();
    this.resized();
  }

  private fromLink(): State {
    return decodeState(location.hash, this.store.initial, this.data.materials);
  }

  get state(): State {
    return this.store.state;
  }

  /** Created on first use: a browser may lack what it needs, and the page draws without it. */
  get evaluator(): Evaluator {
    return (this.ownEvaluator ??= new Evaluator(this.shaders));
  }

  get frames(): number {
    return this.renderer.frames;
  }

  /**
   * Replaces the page's materials and rows after the user's file was saved. The user's changes on the page are kept where
   * the row or parameter they belong to still exists.
   */
  renew(made: Pick<PageData, "revision" | "materials" | "scene" | "dfg">): void {
    const { lights, view } = this.state;
    const changes = encodeState(this.state, this.store.initial);
    Object.assign(this.data, made);
    this.shaders.forget();
    this.lastShader.clear();
    this.store.initial = initialState(this.data);
    const state = decodeState(changes, this.store.initial, this.data.materials);
    // What a link cannot contain: files that were dropped on the page.
    this.store.replace({ ...state, lights, view: { ...state.view, mesh: view.mesh } });
  }

  // ---------------------------------------------------------------- resolving the state

  /** Weights that are nonzero on at least one ball of a row. */
  switchedOn({ material, values, balls }: Slot): string[] {
    const parameters = this.shaders.material(material).variants[0]?.manifest.parameters ?? [];
    return parameters
      .filter(({ path, off, value }) => off !== null && balls.some(({ set }) => (set[path] ?? values[path] ?? value) !== off))
      .map(({ path }) => path);
  }

  /** The shader that fits a ball, or null if the page has none. */
  fitting(slot: number, ball: number): Shader | null {
    return this.fit(this.slot(slot), ball);
  }

  private fit(row: Slot, ball: number): Shader | null {
    return this.shaders.find(row.material, row.choices, this.wantedValues(row, ball), this.switchedOn(row));
  }

  /** Balls of a row for which the page has no shader. */
  lacking(row: Slot): number[] {
    return row.balls.flatMap((_, ball) => (this.fit(row, ball) ? [] : [ball]));
  }

  /** Whether a row can be shown, now or once the server answers: a page without a server is limited to its shaders. */
  possible(row: Slot): boolean {
    return Boolean(this.data.socket) || this.lacking(row).length === 0;
  }

  /** The shader of a ball; if it has none, that of the selected ball if it is in this row, else that of the first. */
  shaderOf(slot: number, ball?: number): Shader {
    const { selection } = this.state;
    const { material, balls } = this.slot(slot);
    const index = ball ?? (selection.slot === slot ? Math.min(selection.ball, balls.length - 1) : 0);
    const shader = this.fitting(slot, index);
    const place = `${slot} ${index}`;
    if (shader) {
      this.lastShader.set(place, shader);
      return shader;
    }
    // The last shader that fitted, until the server has written the new one.
    const last = this.lastShader.get(place);
    return last?.material.id === material ? last : this.shaders.at(this.shaders.material(material), 0);
  }

  /** The parameters a ball is drawn with: those that tables were computed from are fixed to the shader's values. */
  valuesOf(slot: number, ball: number): Values {
    return { ...this.wantedValues(this.slot(slot), ball), ...this.shaderOf(slot, ball).variant.fixed };
  }

  /** Declared values, overridden by the row's, overridden by the ball's. */
  wantedValues({ material, values, balls }: Slot, ball: number): Values {
    return { ...this.shaders.declared(material), ...values, ...balls[ball]?.set };
  }

  visibleSlots(): number[] {
    const { slots, solo } = this.state;
    if (solo !== null && slots[solo]) return [solo];
    return slots.flatMap((slot, index) => (slot.visible ? [index] : []));
  }

  slot(index: number): Slot {
    const slot = this.state.slots[index];
    if (!slot) throw new Error(`There is no row ${index}.`);
    return slot;
  }

  /** Whether the first row serves only as the reference that the other rows are subtracted from. */
  private comparesRows(): boolean {
    return this.state.view.term === "rows" && this.visibleSlots().length > 1;
  }

  balls(): DrawnBall[] {
    const all = this.visibleSlots();
    return this.rowsOf(this.comparesRows() ? all.slice(1) : all);
  }

  private rowsOf(visible: number[]): DrawnBall[] {
    const { spacing } = this.state.view;
    return visible.flatMap((slot, row) => {
      const { balls } = this.slot(slot);
      return balls.map((_, ball): DrawnBall => {
        const shader = this.shaderOf(slot, ball);
        const center: Vec3 = [(ball - (balls.length - 1) / 2) * spacing, ((visible.length - 1) / 2 - row) * spacing, 0];
        return { slot, ball, shader, values: this.valuesOf(slot, ball), center };
      });
    });
  }

  scene(): Scene {
    const minuend = this.comparesRows() ? this.rowsOf(this.visibleSlots().slice(0, 1)) : [];
    return { state: this.state, balls: this.balls(), minuend, environment: this.environment, mesh: this.meshBuffers(), paper: this.paper(), flaws: this.inspector.flaws };
  }

  private meshBuffers(): MeshBuffers | null {
    const { mesh } = this.state.view;
    if (mesh === "torus") this.meshes.torus ??= upload(this.gl, torus());
    if (mesh === "shaderball") this.meshes.shaderball ??= upload(this.gl, shaderBall());
    return this.meshes[mesh] ?? null; // a link does not contain a dropped file: it shows spheres
  }

  useMesh(mesh: Mesh): void {
    this.meshes.file = upload(this.gl, mesh);
    this.store.set("view.mesh", "file");
    this.invalidate();
  }

  hasMeshFile(): boolean {
    return this.meshes.file !== undefined;
  }

  // ---------------------------------------------------------------- drawing

  private respond(change: Change): void {
    if (change.touches("slots", "solo", "lights", "furnace", "environment", "camera", "view.mesh", "view.term", "view.spacing")) this.invalidate();
    else if (change.touches("display", "view", "compare")) this.redraw();
    if (change.touches("display.theme")) this.themeChanged();
    if (change.touches("slots", "solo", "selection")) this.selectShown();
    if (change.touches("slots"))
      this.state.slots.forEach((_, index) => {
        if (this.lacking(this.slot(index)).length) this.onMissingVariant(index);
      });
    if (change.touches("slots", "selection", "camera", "view.mesh", "view.spacing", "solo")) this.repick();
    this.saveLink();
  }

  /** The selected row is always visible, since panels edit and plot it: a row shown alone, or the first visible one. */
  private selectShown(): void {
    const shown = this.visibleSlots();
    const { slot, ball } = this.state.selection;
    const first = shown[0];
    if (first === undefined || shown.includes(slot)) return;
    this.store.set("selection", { slot: first, ball: Math.min(ball, this.slot(first).balls.length - 1) });
  }

  invalidate(): void {
    this.changed = performance.now();
    this.dirty = true;
    this.inspector.changed();
    this.schedule();
  }

  redraw(): void {
    this.schedule();
  }

  private schedule(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    const draw = (now: number) => {
      if (!this.scheduled) return; // the other was first
      this.scheduled = false;
      cancelAnimationFrame(frame);
      clearTimeout(timer);
      this.frame(now);
    };
    const frame = requestAnimationFrame(draw);
    // A page that is not shown, such as a figure in a closed part of a document, has no frames. Its first picture, for
    // which browsers compile shaders, is made nevertheless: it is there at once when the page is opened.
    const timer = this.frames === 0 ? setTimeout(() => draw(performance.now()), UNSEEN) : 0;
  }

  /** Browsers report a resize late, under load after a picture of the new size was drawn, which is then kept. */
  private resized(): void {
    if (this.renderer.hasSize(...this.size())) this.redraw();
    else this.invalidate();
  }

  /** Backing size of the canvas: multiples of 4, so that a reference at half or a quarter of it has integer size. */
  size(): [number, number] {
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [w, h] = [this.canvas.clientWidth * ratio, this.canvas.clientHeight * ratio];
    const fit = Math.min(1, Math.sqrt(MAX_PIXELS / Math.max(w * h, 1)));
    return [Math.max(4, Math.floor((w * fit) / 4) * 4), Math.max(4, Math.floor((h * fit) / 4) * 4)];
  }

  private frame(now: number): void {
    if (this.converging) return this.schedule();
    const moving = now - this.changed < MOTION;
    // Earlier GPU work has to finish before more is submitted: a queue of samples would delay the response to a slider.
    if (this.fence && !this.dirty) {
      if (this.gl.getSyncParameter(this.fence, this.gl.SYNC_STATUS) !== this.gl.SIGNALED) return this.schedule();
      this.learn(now - this.submitted, moving);
      this.shaders.programs.drawn();
      const done = this.renderer.done(this.scene());
      if (!moving && this.inspector.due(done)) void this.inspector.look(done);
    }
    try {
      const scene = this.scene();
      // The last picture stays, and the page stays responsive, until the new one can be drawn.
      if (!this.renderer.ready(scene)) return this.schedule();
      this.resize(moving && this.slow ? 2 : 1);
      if (this.dirty) this.renderer.invalidate();
      this.dirty = false;
      const steps = moving ? 1 : this.steps;
      for (let i = 0; i < steps && !this.renderer.done(scene); i++) this.renderer.step(scene, moving);
      this.renderer.present(scene, this.presenter, this.canvas.width, this.canvas.height);
      this.submit(now);
      this.resolveReady();
      this.onRefresh("picture");
      if (moving || !this.renderer.done(scene) || this.inspector.due(true)) this.schedule();
      this.clearFault();
    } catch (error) {
      this.fail(error);
    }
  }

  /** Reports that no picture can be drawn, until one can. */
  private fail(error: unknown): void {
    const what = error instanceof Error ? error.message : String(error);
    console.error(what);
    this.failed = true;
    this.onFault({ what, where: "The picture cannot be drawn", hint: "" });
    this.shaders.programs.drawn();
    this.rejectReady(error);
  }

  private clearFault(): void {
    if (!this.failed) return;
    this.failed = false;
    this.onFault(null);
  }

  private showFlaws(flaws: readonly Flaw[]): void {
    const text = described(flaws);
    if (text && text !== this.flawed) console.warn(text);
    if (text !== this.flawed) this.redraw();
    this.flawed = text;
    this.onFlaws(text);
  }

  /** Sizes canvas and sums, the sums coarser by this factor. */
  private resize(coarse: number): void {
    const [width, height] = this.size();
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.renderer.resize(width / coarse, height / coarse);
  }

  private submit(now: number): void {
    if (this.fence) this.gl.deleteSync(this.fence);
    this.fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.submitted = now;
    this.gl.flush();
  }

  /** The last picture's time determines the resolution of the next one in motion and the samples of one at rest. */
  private learn(took: number, moving: boolean): void {
    if (this.fence) this.gl.deleteSync(this.fence);
    this.fence = null;
    if (moving) this.slow = this.slow ? took > 25 : took > 60;
    else this.steps = took < 20 ? Math.min(this.steps + 1, 8) : took > 34 ? Math.max(1, this.steps >> 1) : this.steps;
  }

  /**
   * Draws until the picture is complete or has this many samples, restarting if it already has more: one state and one
   * number of samples determine the picture bit for bit.
   */
  async converge(samples = Infinity): Promise<Picture> {
    const { renderer } = this;
    this.converging = true;
    try {
      do {
        const scene = this.scene();
        renderer.resize(...this.size());
        if (this.dirty || renderer.samples > samples) renderer.invalidate();
        this.dirty = false;
        this.changed = -Infinity;
        const wanted = () => !this.dirty && !renderer.done(scene) && (renderer.samples < samples || !renderer.settled);
        while (wanted()) {
          if (renderer.ready(scene)) for (let i = 0; i < 8 && wanted(); i++) renderer.step(scene, false);
          await new Promise((resolve) => setTimeout(resolve));
        }
      } while (this.dirty); // the state changed meanwhile
    } finally {
      this.converging = false;
    }
    this.shaders.programs.drawn();
    await this.inspector.look(false);
    renderer.present(this.scene(), this.presenter, this.canvas.width, this.canvas.height);
    return this.picture();
  }

  picture(): Picture {
    return this.renderer.read(this.scene());
  }

  referencePicture(): Picture | null {
    return this.reference;
  }

  setReference(picture: Picture | null): void {
    this.reference = picture;
    this.onRefresh("reference");
    if (this.presenter) this.redraw();
  }

  /** PNG of the canvas; drawn again first, since a canvas is empty after it was presented. */
  screenshot(): Promise<Blob> {
    this.renderer.present(this.scene(), this.presenter, this.canvas.width, this.canvas.height);
    return new Promise((resolve, reject) =>
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("The browser could not encode the picture."))), "image/png"),
    );
  }

  // ---------------------------------------------------------------- picking

  get picked(): Picked {
    if (!this.pickedAt) this.repick();
    return this.pickedAt as Picked;
  }

  private pick(x: number, y: number): void {
    const frame = cameraFrame(this.state.camera);
    const ray = pixelRay(frame, x, y, this.canvas.clientWidth, this.canvas.clientHeight);
    const hit = hitBalls(this.balls(), this.meshBuffers()?.mesh ?? null, frame.eye, ray);
    if (!hit) return;
    this.lastHit = hit;
    this.store.update("selection", (state) => {
      state.selection = { slot: hit.ball.slot, ball: hit.ball.ball };
    });
    this.repick();
  }

  /** The same point of the selected ball under the current state; the ball's default point if nothing was clicked. */
  private repick(): void {
    const { selection } = this.state;
    const balls = this.balls();
    const ball = balls.find((b) => b.slot === selection.slot && b.ball === selection.ball) ?? balls.find((b) => b.slot === selection.slot) ?? balls[0];
    if (!ball) return;
    const { eye } = cameraFrame(this.state.camera);
    let hit = this.lastHit;
    if (!hit || hit.ball.slot !== ball.slot || hit.ball.ball !== ball.ball) {
      // Halfway to the rim, where wo is oblique: at normal incidence all lobes look alike.
      const toward = normalize(sub(eye, ball.center));
      const aside = normalize(cross([0, 1, 0], toward));
      const [c, s] = [Math.cos(Math.PI / 4), Math.sin(Math.PI / 4)];
      const normal = normalize([0, 1, 2].map((k) => (toward[k] as number) * c + (aside[k] as number) * s) as Vec3);
      hit = { ball, ...hitSphere([0, 0, 0], normal, 1), position: [0, 1, 2].map((k) => (ball.center[k] as number) + (normal[k] as number)) as Vec3 };
    }
    const outward = normalize(sub(eye, hit.position));
    const bitangent = cross(hit.normal, hit.tangent);
    this.pickedAt = {
      slot: ball.slot,
      ball: ball.ball,
      shader: ball.shader,
      values: ball.values,
      wo: [dot(outward, hit.tangent), dot(outward, bitangent), dot(outward, hit.normal)],
      position: hit.position,
      normal: hit.normal,
      tangent: hit.tangent,
      uv: hit.uv,
    };
    this.onRefresh("picked");
  }

  // ---------------------------------------------------------------- theme, link, messages

  theme(): "light" | "dark" {
    const { theme } = this.state.display;
    return theme === "auto" ? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light") : theme;
  }

  private themeChanged(): void {
    document.documentElement.dataset["theme"] = this.theme();
    this.redraw();
    this.onRefresh("theme");
  }

  cssColor(name: string): string {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  }

  slotColor(slot: number): string {
    return SLOT_COLORS[slot % SLOT_COLORS.length] as string;
  }

  private paper(): Vec3 {
    const match = /^#([0-9a-f]{6})$/i.exec(this.cssColor("--paper"));
    const bits = match ? Number.parseInt(match[1] as string, 16) : 0x808080;
    return [(bits >> 16) / 255, ((bits >> 8) & 255) / 255, (bits & 255) / 255];
  }

  link(): string {
    const code = encodeState(this.state, this.store.initial);
    return location.href.replace(/#.*$/, "") + (code ? `#${code}` : "");
  }

  private linkTimer = 0;
  private saveLink(): void {
    clearTimeout(this.linkTimer);
    this.linkTimer = window.setTimeout(() => {
      try {
        history.replaceState(null, "", this.link());
      } catch {
        // A page inside another (a notebook) may not change its address; "copy link" still works.
      }
    }, 300);
  }

  say(text: string, kind: "info" | "error" = "info"): void {
    this.onSay(text, kind);
  }
}
