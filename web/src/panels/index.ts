/** The panels of the dock, in the order of their tabs. */
import type { Panel } from "../panel";

export const panels: Panel[] = [];
