import { type Plugin, defineConfig } from "vite";

/** Where `npm run dev` finds datasets: a `terrane serve` of one's own. */
const kServer = process.env["TERRANE_SERVER"] ?? "http://127.0.0.1:8080";

/** The engine comes with the page's scripts, not after them. */
const preloadEngine: Plugin = {
  name: "preload-engine",
  transformIndexHtml: {
    order: "post",
    handler: (_html, { bundle }) =>
      Object.keys(bundle ?? {})
        .filter((file) => /\/terrane-[^/]*\.wasm$/.test(file))
        .map((file) => ({ tag: "link", attrs: { rel: "preload", href: `./${file}`, as: "fetch", crossorigin: true }, injectTo: "head" as const })),
  },
};

export default defineConfig({
  plugins: [preloadEngine],
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
