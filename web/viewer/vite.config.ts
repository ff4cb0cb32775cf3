import { defineConfig } from "vite";

/** Where `npm run dev` finds datasets: a `terrane serve` of one's own. */
const kServer = process.env["TERRANE_SERVER"] ?? "http://127.0.0.1:8080";

export default defineConfig({
  // Addresses are relative: the built application works under any path of any host.
  base: "./",
  build: {
    target: "es2022",
    // The engine is fetched from beside the scripts; data URLs would only make it larger.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
  },
  server: { proxy: { "/datasets.json": kServer, "/d/": kServer } },
});
