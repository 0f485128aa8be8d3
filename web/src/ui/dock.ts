/** The tabs under the picture: panels are mounted when first opened and notified of changes while they are open. */
import type { Refresh, PageApp } from "../app";
import type { Panel } from "../panel";
import { Change } from "../state";
import { button, element } from "./dom";

export class Dock {
  readonly host = element("section", { class: "dock" });
  private readonly tabs = element("div", { class: "tabs" });
  private readonly bodies = new Map<string, HTMLElement>();
  private open: string | null = null;

  readonly panels: Panel[] = [];

  constructor(private readonly app: PageApp) {
    this.tabs.setAttribute("role", "tablist");
    const grip = element("div", { class: "grip", title: "Drag to resize" });
    grip.addEventListener("pointerdown", (event) => {
      grip.setPointerCapture(event.pointerId);
      const from = event.clientY + (this.host.querySelector<HTMLElement>(".bodies")?.clientHeight ?? 0);
      const move = (e: PointerEvent) => app.store.set("dock.height", Math.round(Math.max(140, Math.min(innerHeight - 200, from - e.clientY))));
      grip.addEventListener("pointermove", move);
      grip.addEventListener("lostpointercapture", () => grip.removeEventListener("pointermove", move), { once: true });
    });
    this.host.append(grip, this.tabs, element("div", { class: "bodies" }));
  }

  add(panel: Panel): void {
    const { app, panels } = this;
    if (!panel?.id || !panel.title || typeof panel.mount !== "function") throw new Error("A panel needs an id, a title and mount(host, app).");
    if (panels.some(({ id }) => id === panel.id)) throw new Error(`A panel '${panel.id}' already exists.`);
    const tab = button(panel.title, panel.doc ?? panel.title, () => app.store.set("dock.open", app.state.dock.open === panel.id ? null : panel.id));
    tab.setAttribute("role", "tab");
    tab.dataset["panel"] = panel.id;
    const place = (one: Panel) => one.order ?? Infinity;
    const next = panels.findIndex((one) => place(one) > place(panel) || (place(one) === place(panel) && one.title > panel.title));
    this.tabs.insertBefore(tab, next < 0 ? null : (this.tabs.children[next] ?? null));
    panels.splice(next < 0 ? panels.length : next, 0, panel);
    this.guard(() => panel.install?.(app));
    this.update(new Change(new Set([""]))); // a link may open it
  }

  update(change: Change): void {
    const { dock } = this.app.state;
    const panel = this.panels.find((p) => p.id === dock.open);
    const id = panel?.id ?? null;
    const bodies = this.host.querySelector(".bodies") as HTMLElement;
    bodies.style.height = id ? `${dock.height}px` : "0";
    this.host.toggleAttribute("data-open", id !== null);
    for (const tab of this.tabs.querySelectorAll("button")) tab.setAttribute("aria-selected", String(tab.dataset["panel"] === id));
    const fresh = id !== this.open;
    this.open = id;
    for (const [key, body] of this.bodies) body.hidden = key !== id;
    if (!panel || !id) return;
    let body = this.bodies.get(id);
    if (!body) {
      body = element("div", { class: "panel-body" });
      body.dataset["panel"] = id;
      this.bodies.set(id, body);
      bodies.append(body);
      this.guard(() => panel.mount(body as HTMLElement, this.app));
    }
    this.guard(() => panel.update?.(fresh ? new Change(new Set([""])) : change));
  }

  refresh(what: Refresh): void {
    const panel = this.panels.find((p) => p.id === this.open);
    if (panel && this.bodies.has(panel.id)) this.guard(() => panel.refresh?.(what));
  }

  /** A panel that fails shows the error and does not affect the page. */
  private guard(act: () => void): void {
    try {
      act();
    } catch (error) {
      this.app.say(error instanceof Error ? error.message : String(error), "error");
    }
  }
}
