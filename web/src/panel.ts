/**
 * The interface of a panel of the dock, and what the page provides to it.
 *
 * A panel is one tab. `mount` runs once, when its tab is first opened; `update` runs after every change of the
 * state while it is open, and when it opens again.
 *
 * An external panel calls `gonio.addPanel` with such an object; docs/viewer.md shows one.
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
  /** Order of the tabs; panels without a number come last, by title. */
  readonly order?: number;
  /** Whether it refers to the clicked point, which is then marked on its ball. */
  readonly marksPoint?: boolean;
  /** Runs once when the page is complete, even if the tab is never opened. */
  install?(app: App): void;
  mount(host: HTMLElement, app: App): void;
  update?(change: Change): void;
  /** After a new raster picture, reference picture or picked point, while the tab is open. */
  refresh?(what: "picture" | "reference" | "picked" | "theme"): void;
}

/** Linear radiance, RGBA float32, top row first; alpha is the coverage by balls, color is premultiplied by it. */
export interface Picture {
  width: number;
  height: number;
  data: Float32Array;
  /** Samples per pixel so far. */
  samples: number;
  done: boolean;
  /** A reference of an earlier state: the newer one is being rendered. */
  stale?: boolean;
}

export interface Picked {
  slot: number;
  ball: number;
  shader: Shader;
  /** Values of every field of the shader's struct for this ball, by path. */
  values: Values;
  /** Toward the camera, local frame. */
  wo: Vec3;
  /** World space: point, shading normal, tangent. */
  position: Vec3;
  normal: Vec3;
  tangent: Vec3;
  uv: [number, number];
}

/** Draws over the canvas instead of the page's own tone mapping (wipe, difference). */
export interface Presenter {
  /** Returns false to let the page draw its own picture. `raster` is a texture of sums: divide by `samples`. */
  present(gl: WebGL2RenderingContext, raster: WebGLTexture, samples: number, width: number, height: number): boolean;
}

export interface App {
  readonly data: PageData;
  readonly store: Store;
  readonly state: State;
  /** One context for all. Callers bind what they need and leave no VAO, framebuffer or scissor bound. */
  readonly gl: WebGL2RenderingContext;
  readonly shaders: ShaderLibrary;
  /** Results of the materials' own shaders: eval, pdf, samples, terms, albedo, as arrays of float32. */
  readonly evaluator: Evaluator;
  readonly canvas: HTMLCanvasElement;
  /** The element over the canvas for handles, marks and labels (pointer-events: none; children may switch it on). */
  readonly overlay: HTMLElement;
  /** The shader that draws a ball; if it has none, that of the selected ball of the slot, else of its first. */
  shaderOf(slot: number, ball?: number): Shader;
  /** Every field's value of one ball, as drawn: the declared one, overridden by the row's, overridden by the ball's. */
  valuesOf(slot: number, ball: number): Values;
  /** Slots that are shown now: all, or the solo one. */
  visibleSlots(): number[];
  picture(): Picture;
  /** The path-traced picture of the server, or null in a page without one. */
  referencePicture(): Picture | null;
  readonly picked: Picked;
  presenter: Presenter | null;
  /** Draws again without restarting the accumulation. */
  redraw(): void;
  theme(): "light" | "dark";
  /** A color of the theme by its CSS variable, e.g. cssColor("--accent"). */
  cssColor(name: string): string;
  /** The fixed color of slot A, B, C... */
  slotColor(slot: number): string;
  /** Shows a message to the user that disappears by itself. */
  say(text: string, kind?: "info" | "error"): void;
}
