import { defineConfig } from "vite";

// One script and one style sheet, without names that change: page.py writes both into one html file. The script is an
// IIFE since a page opened from disk may not load modules.
export default defineConfig({
  build: {
    outDir: "../src/gonio/viewer/static",
    emptyOutDir: false,
    target: "es2022",
    lib: { entry: "src/main.ts", formats: ["iife"], name: "gonioPage", fileName: () => "app.js", cssFileName: "app" },
    reportCompressedSize: false,
  },
});
