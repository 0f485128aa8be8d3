/** The panels of the dock, a file each: the default export of whatever stands in this folder. */
import "./panels.css";
import type { Panel } from "../panel";

const files = import.meta.glob<{ default: Panel }>(["./*.ts", "!./index.ts"], { eager: true });

export const panels: Panel[] = Object.values(files).map((file) => file.default);
