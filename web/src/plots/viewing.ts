/** The viewing direction of the plots: wo of the clicked point, or of two sliders. One setting for all panels. */
import type { Vec3 } from "../data";
import type { App } from "../panel";
import type { Change } from "../state";
import { type Channel, CHANNELS, check, range, select } from "./base";
import { phiOf, polar, RADIANS, thetaOf } from "./directions";

const ID = "viewing";
const DEFAULTS = { clicked: true, theta: 45, phi: 0, channel: "luminance" as Channel };

const settings = (app: App) => app.store.panel(ID, DEFAULTS);

export const channelIn = (app: App): Channel => (settings(app).channel in CHANNELS ? settings(app).channel : "luminance");

export function woOf(app: App): Vec3 {
  const { clicked, theta, phi } = settings(app);
  return clicked ? app.picked.wo : polar(theta * RADIANS, phi * RADIANS);
}

/** Dependencies of a plot of wo. */
export const viewingTouched = (change: Change) => change.touches("slots", "solo", "selection", `panels.${ID}`, "camera", "view.mesh");

export class ViewingControls {
  private readonly clicked;
  private readonly theta;
  private readonly phi;
  private readonly channel;

  constructor(
    host: HTMLElement,
    private readonly app: App,
  ) {
    const set = (values: Partial<typeof DEFAULTS>) => app.store.setPanel(ID, values);
    this.clicked = check(host, "ωo of the clicked point", "The direction to the camera at the point clicked in the picture; otherwise the two sliders", (on) =>
      set(on ? { clicked: true } : { clicked: false, ...this.angles() }),
    );
    this.theta = range(host, "θo", "Angle between ωo and the normal", [0, 180, 0.1], "°", (theta) => set({ ...this.angles(), clicked: false, theta }));
    this.phi = range(host, "φo", "Azimuth of ωo from the tangent", [-180, 180, 1], "°", (phi) => set({ ...this.angles(), clicked: false, phi }));
    this.channel = select(host, "channel", "Channel of the RGB value to draw", CHANNELS, (channel) => set({ channel }));
  }

  private angles(): { theta: number; phi: number } {
    const wo = woOf(this.app);
    return { theta: thetaOf(wo) / RADIANS, phi: phiOf(wo) / RADIANS };
  }

  /** `inside`: whether some model transmits, so that wo below the surface is valid. */
  show(inside: boolean): void {
    const { theta, phi } = this.angles();
    this.theta.limits(0, inside ? 180 : 90);
    this.theta.show(Number(theta.toFixed(1)));
    this.phi.show(Math.round(phi));
    this.clicked.show(settings(this.app).clicked);
    this.channel.show(channelIn(this.app));
  }
}
