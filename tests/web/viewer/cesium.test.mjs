/** Terrain for CesiumJS, read by CesiumJS: it draws it, and finds the heights that the server tells. */
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { dirname, extname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { kPatience, kWork, launch, makeDataset, newPage, serve } from "./harness.mjs";

const kLibrary = join(dirname(fileURLToPath(import.meta.url)), "node_modules/cesium/Build/Cesium");
const kTypes = { ".js": "text/javascript", ".css": "text/css", ".json": "application/json", ".wasm": "application/wasm" };
const kPage = `<!doctype html><meta charset="utf-8"><title>globe</title>
<script>window.CESIUM_BASE_URL = "/cesium/"</script><script src="/cesium/Cesium.js"></script>
<style>html, body, #globe, .cesium-widget, canvas { margin: 0; width: 100%; height: 100% }</style><div id="globe"></div>`;

let server, browser, page;
before(async () => {
  server = await serve(makeDataset());
  browser = await launch();
  page = await newPage(browser);
  // A page of the server's own origin that the server does not have: what an application beside it would be.
  await page.route(new URL("globe.html", server.url).href, (route) => route.fulfill({ contentType: "text/html", body: kPage }));
  await page.route(
    (url) => url.pathname.startsWith("/cesium/"),
    async (route) => {
      const path = new URL(route.request().url()).pathname.slice("/cesium/".length);
      const body = await readFile(join(kLibrary, path)).catch(() => undefined);
      await (body ? route.fulfill({ contentType: kTypes[extname(path)] ?? "image/png", body }) : route.fulfill({ status: 404 }));
    },
  );
  await page.goto(new URL("globe.html", server.url).href);
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

test("CesiumJS finds the heights of the dataset", async () => {
  const { attribution, bounds } = await server.ask("/d/hills/quantized-mesh/layer.json");
  assert.equal(attribution, "Heights of nobody");
  const [west, south, east, north] = bounds;
  const places = [];
  for (let i = 0; i < 64; ++i)
    places.push([west + (east - west) * (0.1 + 0.113 * (i % 8)), south + (north - south) * (0.1 + 0.113 * Math.floor(i / 8))]);
  const found = await page.evaluate(async (places) => {
    const Cesium = window.Cesium;
    window.provider = await Cesium.CesiumTerrainProvider.fromUrl("/d/hills/quantized-mesh", { requestVertexNormals: true });
    const positions = places.map(([longitude, latitude]) => Cesium.Cartographic.fromDegrees(longitude, latitude));
    await Cesium.sampleTerrainMostDetailed(window.provider, positions);
    return { heights: positions.map(({ height }) => height), hasNormals: window.provider.hasVertexNormals};
  }, places);
  assert.ok(found.hasNormals);
  const answer = await fetch(new URL("/d/hills/elevation", server.url), {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify({ points: places, crs: "EPSG:4326" }),
  });
  const { heightsMeters } = await answer.json();
  const off = found.heights.map((height, i) => Math.abs(height - heightsMeters[i])).sort((a, b) => a - b);
  // Its samples lie between ours, and its triangles lie otherwise.
  assert.ok(off[32] < 0.5, `half of the heights are off by ${off[32]} m and more`);
  assert.ok(off[63] < 5, `a height is off by ${off[63]} m`);
  const spread = Math.max(...heightsMeters) - Math.min(...heightsMeters);
  assert.ok(spread > 50, `heights that are all the same would prove nothing (${spread} m)`);
});

test("CesiumJS draws it, lit by its normals, with the pictures over it", async () => {
  const { bounds } = await server.ask("/d/hills/quantized-mesh/layer.json");
  const pictures = await server.ask("/d/hills/xyz/imagery/pictures.json");
  await page.evaluate(
    async ({ bounds, pictures }) => {
      const Cesium = window.Cesium;
      const widget = new Cesium.CesiumWidget("globe", {
        terrainProvider: window.provider,
        baseLayer: new Cesium.ImageryLayer(
          new Cesium.UrlTemplateImageryProvider({
            url: pictures.tiles[0],
            maximumLevel: pictures.maxzoom,
            rectangle: Cesium.Rectangle.fromDegrees(...pictures.bounds),
          }),
        ),
        skyBox: false,
      });
      window.widget = widget;
      widget.scene.globe.enableLighting = true;
      widget.clock.currentTime = Cesium.JulianDate.fromIso8601("2026-06-21T07:00:00Z");
      widget.clock.shouldAnimate = false;
      widget.camera.lookAt(
        Cesium.Cartesian3.fromDegrees((bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2, 300),
        new Cesium.HeadingPitchRange(0.5, -0.45, 6000),
      );
      await new Promise((resolve) => {
        let still = 0;
        widget.scene.postRender.addEventListener(() => {
          still = widget.scene.globe.tilesLoaded ? still + 1 : 0;
          if (still === 10) resolve();
        });
      });
    },
    { bounds, pictures },
  );
  const shown = await page.evaluate(() => {
    const { scene } = window.widget;
    const { width, height } = scene.canvas;
    const middle = scene.globe.pick(scene.camera.getPickRay(new window.Cesium.Cartesian2(width / 2, height / 2)), scene);
    const { _tilesToRender: tiles } = scene.globe._surface;
    return { height: window.Cesium.Cartographic.fromCartesian(middle).height, deepest: Math.max(...tiles.map((tile) => tile.level)) };
  });
  assert.ok(shown.height > 1, `there is ground in the middle (${shown.height} m)`);
  assert.ok(shown.deepest >= 11, `tiles down to level ${shown.deepest} are drawn`);
  await page.screenshot({ path: join(kWork, "cesium.png"), timeout: kPatience });
  assert.deepEqual(page.errors, []);
});
