/** The panels of the dock, in the order of their tabs; `install` puts up what works without an open tab. */
import "./panels.css";
import type { App, Panel } from "../panel";
import { albedoPanel } from "./albedo";
import { comparePanel } from "./compare";
import { comparisonOf } from "./comparison";
import { halfDifferencePanel } from "./half_difference";
import { lobePanel } from "./lobe";
import { installMarker } from "./marker";
import { probePanel } from "./probe";
import { slicesPanel } from "./slices";
import { tablesPanel } from "./tables";

export const panels: Panel[] = [lobePanel, slicesPanel, halfDifferencePanel, albedoPanel, tablesPanel, comparePanel, probePanel];

/** The page calls it once, when the app stands: a link may open a page that already compares. */
export function install(app: App): void {
  comparisonOf(app);
  installMarker(app);
}

export { testHooks } from "./hooks";
