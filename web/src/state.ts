/**
 * The whole state of the page as one plain object: the contents of the URL, of undo steps and of tests.
 *
 * `Store.set` and `Store.update` are the only writers. All other code reads `store.state` and is notified of changes
 * through `subscribe`, which runs once per frame with the paths that changed since.
 */
import type { Camera, Choices, PageData, SceneLight, Tone, Values } from "./data";

export type Light = SceneLight & { on: boolean; name: string };

export interface Slot {
  /** Row label. The slots are A, B, C... from the top. */
  label: string;
  material: string;
  choices: Choices;
  /** Values that differ from the declared ones, for the whole row. */
  values: Values;
  balls: { label: string; set: Values }[];
  visible: boolean;
}

export const TERMS = ["full", "D", "G", "F", "single", "multi", "compensated", "difference", "split", "split-error", "rows"] as const;
export type Term = (typeof TERMS)[number];
export type MeshName = "sphere" | "shaderball" | "torus" | "file";
/** Brute force; the blurred picture times the material's own albedo; times the two-number table. */
export type EnvironmentMethod = "sampled" | "split-sum" | "dfg";
export type Background = "theme" | "environment";
export type CompareMode = "off" | "side" | "wipe" | "difference";
export type Theme = "auto" | "light" | "dark";

export interface State {
  slots: Slot[];
  /** Index of the only slot shown, or null for all. */
  solo: number | null;
  selection: { slot: number; ball: number };
  /** An edit of one row also applies to the same parameter of the others. */
  linked: boolean;
  lights: Light[];
  /** White furnace: all lights replaced by one constant environment of radiance 1. */
  furnace: boolean;
  environment: EnvironmentMethod;
  camera: Camera;
  view: { mesh: MeshName; term: Term; background: Background; labels: boolean; spacing: number };
  display: { tone: Tone; exposure: number; theme: Theme };
  compare: { mode: CompareMode; wipe: number };
  /** State of the panels, by panel id, and the open tab. */
  dock: { open: string | null; height: number };
  panels: Record<string, Record<string, unknown>>;
}

type Primitive = string | number | boolean | null | undefined;
type Join<K, P> = K extends string | number ? (P extends string | number ? `${K}.${P}` : never) : never;
/** Dotted paths of an object, at most four levels deep; array elements by index. */
export type Path<T, Depth extends unknown[] = []> = Depth["length"] extends 4
  ? never
  : T extends Primitive
    ? never
    : T extends readonly (infer U)[]
      ? `${number}` | Join<number, Path<U, [...Depth, 0]>>
      : { [K in keyof T & string]: K | Join<K, Path<T[K], [...Depth, 0]>> }[keyof T & string];
export type At<T, P extends string> = P extends `${infer K}.${infer Rest}`
  ? K extends keyof T
    ? At<T[K], Rest>
    : T extends readonly (infer U)[]
      ? At<U, Rest>
      : never
  : P extends keyof T
    ? T[P]
    : T extends readonly (infer U)[]
      ? U
      : never;

export class Change {
  constructor(readonly paths: ReadonlySet<string>) {}
  /** True if something at, above or below one of the paths changed. */
  touches(...paths: string[]): boolean {
    for (const changed of this.paths)
      for (const path of paths)
        if (changed === path || changed === "" || changed.startsWith(`${path}.`) || path.startsWith(`${changed}.`)) return true;
    return false;
  }
}

export type Listener = (change: Change) => void;

export class Store {
  state: State;
  /** The state of the page data: the target of reset, and the base of the URL's patch. */
  initial: State;
  private listeners = new Set<Listener>();
  private pending = new Set<string>();
  private scheduled = false;

  constructor(data: PageData) {
    this.initial = initialState(data);
    this.state = structuredClone(this.initial);
  }

  subscribe(listener: Listener): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  set<P extends Path<State>>(path: P, value: At<State, P>): void {
    const keys = path.split(".");
    const last = keys.pop() as string;
    let holder = this.state as unknown as Record<string, unknown>;
    for (const key of keys) holder = holder[key] as Record<string, unknown>;
    if (Object.is(holder[last], value)) return;
    holder[last] = value;
    this.notify(path);
  }

  /** Several writes at once; `paths` names the changed parts ("" for everything). */
  update(paths: string | string[], write: (state: State) => void): void {
    write(this.state);
    for (const path of [paths].flat()) this.notify(path);
  }

  replace(state: State): void {
    this.state = state;
    this.notify("");
  }

  reset(): void {
    this.replace(structuredClone(this.initial));
  }

  /** State of one panel, created from `defaults` on first use. Write through `setPanel`. */
  panel<T extends Record<string, unknown>>(id: string, defaults: T): T {
    return { ...defaults, ...(this.state.panels[id] as Partial<T> | undefined) };
  }

  setPanel(id: string, values: Record<string, unknown>): void {
    this.state.panels[id] = { ...this.state.panels[id], ...values };
    this.notify(`panels.${id}`);
  }

  private notify(path: string): void {
    this.pending.add(path);
    if (this.scheduled) return;
    this.scheduled = true;
    // A microtask: several writes in one event make one change, delivered before the next frame.
    queueMicrotask(() => {
      this.scheduled = false;
      const change = new Change(new Set(this.pending));
      this.pending.clear();
      for (const listener of [...this.listeners]) listener(change);
    });
  }
}

const LIGHT_NAMES = { directional: "Directional", point: "Point", area: "Area", environment: "Environment" } as const;

export function initialState(data: PageData): State {
  const { scene, display } = data;
  const slots = scene.rows.map((row): Slot => {
    const material = data.materials.find((m) => m.id === row.material);
    return {
      label: row.label,
      material: row.material,
      choices: { ...material?.variants[0]?.choices },
      values: {},
      balls: structuredClone(row.balls),
      visible: true,
    };
  });
  const lights = scene.lights.map((light): Light => {
    // The picture of an environment stays in the page data: it is too large for the URL.
    const stored = light.type === "environment" ? { ...light, image: light.image ? { ...light.image, data: null } : null } : light;
    return { ...structuredClone(stored), on: true, name: LIGHT_NAMES[light.type] };
  });
  return {
    slots,
    solo: null,
    selection: { slot: 0, ball: Math.floor(((slots[0]?.balls.length ?? 1) - 1) / 2) },
    linked: true,
    lights,
    furnace: false,
    environment: "sampled",
    camera: structuredClone(scene.camera),
    view: { mesh: meshName(scene.mesh), term: "full", background: "theme", labels: true, spacing: scene.spacing },
    display: { tone: display.tone, exposure: display.exposure, theme: "auto" },
    compare: { mode: "off", wipe: 0.5 },
    dock: { open: null, height: Math.round(Math.min(440, Math.max(260, 0.38 * innerHeight))) },
    panels: {},
  };
}

function meshName(name: string): MeshName {
  return name === "shaderball" || name === "torus" ? name : "sphere";
}
