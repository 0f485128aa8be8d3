/** Indicator of long work, with its duration: it shows that a page without a new picture is not broken. */
import { element } from "./dom";

export class Busy {
  readonly host = element("div", { class: "busy", hidden: true });
  private readonly line = element("span");
  private readonly waits = new Map<string, { text: string; since: number }>();
  private timer = 0;

  constructor() {
    this.host.setAttribute("role", "status");
    this.host.append(element("i"), this.line);
  }

  /** What the page is waiting for, per cause; null: no longer waiting. */
  set(what: string, text: string | null): void {
    const known = this.waits.get(what);
    if (text === null ? !known : known?.text === text) return;
    if (text === null) this.waits.delete(what);
    else this.waits.set(what, { text, since: known?.since ?? performance.now() });
    this.host.hidden = this.waits.size === 0;
    clearInterval(this.timer);
    if (!this.host.hidden) this.timer = window.setInterval(() => this.show(), 500);
    this.show();
  }

  private show(): void {
    const now = performance.now();
    this.line.textContent = [...this.waits.values()].map(({ text, since }) => `${text} · ${Math.round((now - since) / 1000)} s`).join("   ");
  }
}
