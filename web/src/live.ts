/**
 * The live reference: sends the server what is shown, receives its frames, and requests shaders that the page lacks.
 *
 * One frame is in flight: the next is sent after the ack of the last. A newer scene ends the older one; frames of older
 * scenes that still arrive are dropped. A lost connection is retried at growing intervals.
 */
import type { Fault, PageApp } from "./app";
import type { PageData, SplitSum, Variant } from "./data";
import { actingLights } from "./lights";
import { halfToFloat } from "./targets";
import { fitted } from "./vectors";

export interface LiveState {
  connected: boolean;
  device: string;
  samples: number;
  target: number;
  done: boolean;
  seconds: number;
  message: string;
}

interface FrameHeader {
  id: number;
  frame: number;
  spp: number;
  width: number;
  height: number;
  seconds: number;
  format: string;
  done: boolean;
}

const QUIET = 40; // ms without a change before the scene is sent: a slider causes sixty changes per second
const TARGET = 1024;
const MAX_PIXELS = 1_000_000;
const MAX_REQUESTS = 8; // shaders at a time, since a server may have other pages

export class Live {
  readonly status: LiveState = { connected: false, device: "", samples: 0, target: TARGET, done: false, seconds: 0, message: "connecting" };
  onStatus: () => void = () => {};
  private socket: WebSocket | null = null;
  private id = 0;
  private wishes = 0;
  private sent = "";
  private awaited = -1;
  private timer = 0;
  private wait = 500;
  private uploaded = new Set<string>();
  private requests = new Map<number, { wish: string; place: string; title: string }>();
  private waiting = new Set<string>();

  constructor(
    private readonly app: PageApp,
    private readonly address: string,
  ) {
    app.store.subscribe((change) => {
      if (change.touches("slots", "solo", "lights", "furnace", "camera", "view")) this.later();
    });
    new ResizeObserver(() => this.later()).observe(app.canvas);
    app.onMissingVariant = (slot) => this.ask(slot);
    this.connect();
  }

  private connect(): void {
    const url = new URL(this.address, location.href);
    url.searchParams.set("revision", String(this.app.data.revision));
    url.protocol = url.protocol.replace("http", "ws");
    const socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.addEventListener("open", () => {
      this.wait = 500;
      this.sent = "";
      this.uploaded.clear();
      this.forget();
      Object.assign(this.status, { connected: true, message: "" });
      this.onStatus();
      this.send();
      this.app.state.slots.forEach((_, index) => this.ask(index));
    });
    socket.addEventListener("message", (event) => {
      if (typeof event.data === "string") this.read(event.data);
      else this.frame(event.data as ArrayBuffer);
    });
    socket.addEventListener("close", () => {
      if (this.socket !== socket) return;
      Object.assign(this.status, { connected: false, message: "connection to the server lost; reconnecting" });
      this.onStatus();
      setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(this.wait * 2, 15_000);
    });
  }

  private text(message: object): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private later(): void {
    // Immediately: frames on their way belong to the new scene, the one on the screen to the old scene.
    const { reference } = this.app;
    if (reference && !reference.stale && this.sent && this.scene() !== this.sent) this.app.setReference({ ...reference, stale: true });
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.send(), QUIET);
  }

  /** The canvas's size over an integer, so that a pixel of the reference is a block of pixels of the raster picture. */
  private size(): [number, number] {
    const [width, height] = this.app.size();
    const factor = [1, 2, 4].find((k) => (width / k) * (height / k) <= MAX_PIXELS) ?? 4;
    return [width / factor, height / factor];
  }

  private send(): void {
    const { app } = this;
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    if (app.frames === this.awaited) return this.later();
    const { state } = app;
    // The server renders whole materials on balls: its picture would not match a single term or another shape.
    const supported = ["full", "compensated", "split"].includes(state.view.term);
    this.status.message = !supported ? "available only for complete materials" : state.view.mesh !== "sphere" ? "available only for spheres" : "";
    if (this.status.message) {
      this.sent = "";
      this.id += 1; // frames of older scenes that still arrive are dropped
      if (app.reference) app.setReference(null);
      return this.onStatus();
    }
    const text = this.scene();
    if (text === this.sent) {
      // Changed back within the delay: the picture is again of what is shown.
      if (app.reference?.stale && this.status.samples > 0) app.setReference({ ...app.reference, stale: false });
      return;
    }
    this.sent = text;
    this.id += 1;
    if (app.reference && !app.reference.stale) app.setReference({ ...app.reference, stale: true });
    Object.assign(this.status, { samples: 0, done: false, target: TARGET });
    this.text({ type: "scene", id: this.id, revision: app.data.revision, ...(JSON.parse(text) as object) });
    this.onStatus();
  }

  /** What the server receives of the state, as text. */
  private scene(): string {
    const { app } = this;
    const { state } = app;
    const rows = app.visibleSlots().flatMap((slot) => {
      const row = state.slots[slot];
      if (!row) return [];
      const balls = row.balls.map((_, ball) => ({ ...row.values, ...row.balls[ball]?.set }));
      return [{ material: row.material, choices: row.choices, balls }];
    });
    const lights = actingLights(state).map(({ on: _on, name: _name, ...light }) => {
      if (light.type !== "environment") return light;
      const key = light.image ? this.upload() : null;
      return { ...light, image: key ? { key } : null };
    });
    const [width, height] = this.size();
    const half = fitted(Math.tan((state.camera.fov * Math.PI) / 360), width / height);
    const camera = { ...state.camera, fov: (Math.atan(half) * 360) / Math.PI };
    return JSON.stringify({ state: { rows, lights, camera, spacing: state.view.spacing }, width, height, spp: TARGET });
  }

  /** Sends the environment picture once; lights refer to it by its key. */
  private upload(): string | null {
    const picture = this.app.environment;
    if (!picture) return null;
    if (!this.uploaded.has(picture.key)) {
      this.uploaded.add(picture.key);
      this.text({ type: "environment", key: picture.key, width: picture.width, height: picture.height });
      this.socket?.send(picture.half as Uint16Array<ArrayBuffer>);
    }
    return picture.key;
  }

  /**
   * Requests the shaders that the balls of a row lack. The arrival of one leads to the next call, which requests what is
   * needed by then: while a slider moves, not every value is requested.
   */
  private ask(slot: number): void {
    const { app } = this;
    const row = app.slot(slot);
    const on = app.switchedOn(row);
    for (const ball of app.lacking(row)) {
      const place = `${slot} ${ball}`;
      const values = app.wantedValues(row, ball);
      const paths = app.shaders.material(row.material).variants[0]?.manifest.parameters.filter((p) => p.fixed).map((p) => p.path) ?? [];
      const fixed = Object.fromEntries(paths.map((path) => [path, values[path]]));
      const wish = JSON.stringify([row.material, row.choices, on, fixed]);
      const busy = [...this.requests.values()].some((one) => one.place === place);
      if (this.waiting.has(wish) || busy || this.requests.size >= MAX_REQUESTS) continue;
      this.waiting.add(wish);
      this.wishes += 1;
      this.requests.set(this.wishes, { wish, place, title: app.shaders.material(row.material).title });
      this.text({ type: "choice", id: this.wishes, revision: app.data.revision, material: row.material, choices: row.choices, on, fixed });
    }
    this.showWaiting();
  }

  /** A layer or a choice whose shader the server is writing: the picture is the earlier one until it arrives. */
  private showWaiting(): void {
    const titles = new Set([...this.requests.values()].map(({ title }) => title));
    this.app.onBusy("server", titles.size ? `Waiting for the server to generate the shader of ${[...titles].join(", ")}` : null);
  }

  /** Drops all requests, which will not be answered. */
  private forget(): void {
    this.waiting.clear();
    this.requests.clear();
    this.showWaiting();
  }

  private read(text: string): void {
    const message = JSON.parse(text) as { type: string; [key: string]: unknown };
    if (message.type === "ready") {
      this.status.device = String(message["device"] ?? "");
    } else if (message.type === "error") {
      this.status.message = String(message["what"]);
      if (this.requests.delete(Number(message["id"]))) this.showWaiting(); // no retry: the answer would be the same
      this.app.say([message["what"], message["where"], message["hint"]].filter(Boolean).join(" — "), "error");
    } else if (message.type === "stage") {
      this.renew(message as unknown as Pick<PageData, "revision" | "materials" | "scene" | "dfg">);
    } else if (message.type === "fault") {
      this.app.onFault(message as unknown as Fault);
    } else if (message.type === "variant" && message["revision"] === this.app.data.revision) {
      const material = this.app.shaders.material(String(message["material"]));
      material.variants.push(message["variant"] as Variant);
      const dfg = message["dfg"] as SplitSum | null;
      if (dfg && !this.app.data.dfg.some(({ facets }) => facets.join() === dfg.facets.join())) this.app.data.dfg.push(dfg);
      const request = this.requests.get(Number(message["id"]));
      if (request) this.waiting.delete(request.wish);
      this.requests.delete(Number(message["id"]));
      this.showWaiting();
      this.app.store.update("slots", () => {});
    }
    this.onStatus();
  }

  /** After the file was saved, everything that was requested is requested again. */
  private renew(made: Pick<PageData, "revision" | "materials" | "scene" | "dfg">): void {
    const { app } = this;
    this.sent = "";
    this.id += 1;
    this.forget();
    this.awaited = app.frames; // the page's own picture first: both would compete for the processor
    if (app.reference) app.setReference({ ...app.reference, stale: true });
    app.renew(made);
    app.onFault(null);
  }

  private frame(buffer: ArrayBuffer): void {
    const length = new DataView(buffer).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length))) as FrameHeader;
    if (header.id === this.id) {
      const data = halfToFloat(new Uint16Array(buffer, 4 + length, 4 * header.width * header.height));
      Object.assign(this.status, { samples: header.spp, done: header.done, seconds: header.seconds });
      this.app.setReference({ width: header.width, height: header.height, data, samples: header.spp, done: header.done });
      this.onStatus();
    }
    // After the next picture, not before: a slow page is not sent more.
    requestAnimationFrame(() => this.text({ type: "ack", frame: header.frame }));
  }
}
