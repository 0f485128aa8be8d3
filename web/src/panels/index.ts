/** The panels of the dock, in the order of their tabs. */
import "./panels.css";
import type { Panel } from "../panel";
import { albedoPanel } from "./albedo";
import { halfDifferencePanel } from "./half_difference";
import { lobePanel } from "./lobe";
import { slicesPanel } from "./slices";
import { tablesPanel } from "./tables";

export const panels: Panel[] = [lobePanel, slicesPanel, halfDifferencePanel, albedoPanel, tablesPanel];
