/**
 * What a panel of the dock is, and what the page gives it.
 *
 * A panel lives in one tab. `mount` runs once, when its tab is first opened; `update` runs after every change of the
 * state while it is open, and when it opens again.
 *
 * A panel that comes from outside calls `gonio.addPanel` with such an object; docs/viewer.md shows one.
 */
import type { PageData, Values, Vec3 } from "./data";
import type { Evaluator } from "./evaluator";
import type { Change, State, Store } from "./state";
import type { Shader, ShaderLibrary } from "./shaders";

export interface Panel {
  /** Key in `state.panels` and `state.dock.open`. */
  readonly id: string;
  readonly title: string;
  /** One line for the tab's tooltip. */
  readonly doc?: string;
  /** Tabs stand in this order; those that give none come last, by title. */
  readonly order?: number;
  /** Whether it speaks of the clicked point, which is then marked on its ball. */
  readonly marksPoint?: boolean;
  /** Runs once when the page stands, though the tab may never be opened. */
  install?(app: App): void;
  mount(host: HTMLElement, app: App): void;
  update?(change: Change): void;
  /** After a new raster picture, reference picture or picked point, while the tab is open. */
  refresh?(what: "picture" | "reference" | "picked" | "theme"): void;
}

/** Linear radiance, RGBA float32, top row first; alpha is the coverage by balls, colour is premultiplied by it. */
export interface Picture {
  width: number;
  height: number;
  data: Float32Array;
  /** Samples per pixel so far. */
  samples: number;
  done: boolean;
  /** A reference of what was shown before: the newer one is on its way. */
  stale?: boolean;
}

export interface Picked {
  slot: number;
  ball: number;
  shader: Shader;
  /** Values of every field of the shader's struct, by path, as the ball has them. */
  values: Values;
  /** Toward the camera, local frame. */
  wo: Vec3;
  /** World space: point, shading normal, tangent. */
  position: Vec3;
  normal: Vec3;
  tangent: Vec3;
  uv: [number, number];
}

/** Draws over the canvas in the place of the page's own tone mapping (wipe, difference). */
export interface Presenter {
  /** Returns false to let the page draw its own picture. `raster` is a texture of sums: divide by `samples`. */
  present(gl: WebGL2RenderingContext, raster: WebGLTexture, samples: number, width: number, height: number): boolean;
}

export interface App {
  readonly data: PageData;
  readonly store: Store;
  readonly state: State;
  /** One context for all. Who uses it binds what it needs and leaves no VAO, framebuffer or scissor bound. */
  readonly gl: WebGL2RenderingContext;
  readonly shaders: ShaderLibrary;
  /** What the materials' own shaders say: eval, pdf, samples, terms, albedo, as arrays of float32. */
  readonly evaluator: Evaluator;
  readonly canvas: HTMLCanvasElement;
  /** The element over the canvas for handles, marks and labels (pointer-events: none; children may switch it on). */
  readonly overlay: HTMLElement;
  /** The shader that draws a ball; without one, the selected ball of the slot, or its first. */
  shaderOf(slot: number, ball?: number): Shader;
  /** Every field's value of one ball, as its shader draws it: declared, then the row's, then the ball's own. */
  valuesOf(slot: number, ball: number): Values;
  /** Slots that are shown now: all, or the solo one. */
  visibleSlots(): number[];
  picture(): Picture;
  /** The path-traced picture of the server, or null in a page without one. */
  referencePicture(): Picture | null;
  readonly picked: Picked;
  presenter: Presenter | null;
  /** Draws again without starting the accumulation anew. */
  redraw(): void;
  theme(): "light" | "dark";
  /** A colour of the theme by its CSS variable, e.g. cssColor("--accent"). */
  cssColor(name: string): string;
  /** The fixed colour of slot A, B, C... */
  slotColor(slot: number): string;
  /** A line for the user that goes away by itself. */
  say(text: string, kind?: "info" | "error"): void;
}
