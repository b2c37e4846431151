import { defineConfig } from "vite";

/** Builds the pages (mode production), or the offline page as one classic script (mode replay), into built/. */
export default defineConfig(({ mode }) =>
  mode === "replay"
    ? {
        build: {
          outDir: "built", emptyOutDir: false, target: "es2022", license: { fileName: "licences_replay.txt" },
          lib: { entry: "src/replay.ts", formats: ["iife"], name: "vrs", fileName: () => "replay.js", cssFileName: "replay" },
        },
      }
    : {
        base: "/",
        build: {
          outDir: "built", emptyOutDir: true, target: "es2022", assetsInlineLimit: 0, license: { fileName: "licences.txt" },
          rolldownOptions: { input: ["index.html", "wall.html"] },
        },
      },
);
