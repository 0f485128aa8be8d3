/** The panels of the dock, one per file: the default export of every file in this folder. */
import "./panels.css";
import type { Panel } from "../panel";

const files = import.meta.glob<{ default: Panel }>(["./*.ts", "!./index.ts"], { eager: true });

export const panels: Panel[] = Object.values(files).map((file) => file.default);
