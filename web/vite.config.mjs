import { readFileSync } from "node:fs";
import { defineConfig } from "vite";

// The packages whose code ends up in the script ask that their notice goes with it.
const notices = ["three/LICENSE", "lil-gui/LICENSE.md", "uplot/LICENSE"].map((file) => {
  const text = readFileSync(new URL(`node_modules/${file}`, import.meta.url), "utf8");
  return `${file.split("/")[0]}\n\n${text.replaceAll("\r\n", "\n").trim()}`;
});

// One script and one style sheet, without names that change: page.py writes both into one html file. The script is an
// IIFE since a page opened from disk may not load modules.
export default defineConfig({
  build: {
    outDir: "../src/gonio/viewer/static",
    emptyOutDir: false,
    target: "es2022",
    lib: { entry: "src/main.ts", formats: ["iife"], name: "gonioPage", fileName: () => "app.js", cssFileName: "app" },
    rolldownOptions: { output: { postBanner: `/*!\n${notices.join("\n\n----\n\n")}\n*/` } },
    reportCompressedSize: false,
  },
});
