// What both packages share goes into each before it is packed; npm runs this in the package's folder.
import { copyFileSync } from "node:fs";

const from = (path) => new URL(path, import.meta.url);
copyFileSync(from("bundle.js"), "bundle.js");
copyFileSync(from("../../LICENSE"), "LICENSE");
