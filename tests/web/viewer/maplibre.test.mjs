/** Tiles for web maps, read by a web map: MapLibre draws them, and finds the heights that the server tells. */
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { kPatience, kWork, launch, makeDataset, newPage, serve } from "./harness.mjs";

const kLibrary = join(dirname(fileURLToPath(import.meta.url)), "node_modules/maplibre-gl/dist");
const kPage = `<!doctype html><meta charset="utf-8"><title>map</title>
<link rel="stylesheet" href="/maplibre-gl.css"><script src="/maplibre-gl.js"></script>
<style>html, body, #map { margin: 0; height: 100% }</style><div id="map"></div>`;

let server, browser;
before(async () => {
  server = await serve(makeDataset());
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

/** A page of the server's own origin that the server does not have: what an application beside it would be. */
async function mapPage() {
  const page = await newPage(browser);
  for (const [path, type, body] of [
    ["map.html", "text/html", kPage],
    ["maplibre-gl.js", "text/javascript", await readFile(join(kLibrary, "maplibre-gl.js"))],
    ["maplibre-gl.css", "text/css", await readFile(join(kLibrary, "maplibre-gl.css"))],
  ])
    await page.route(new URL(path, server.url).href, (route) => route.fulfill({ contentType: type, body }));
  await page.goto(new URL("map.html", server.url).href);
  return page;
}

for (const [kind, encoding] of [
  ["terrarium", "terrarium"],
  ["terrain-rgb", "mapbox"],
]) {
  test(`MapLibre finds the heights of ${kind} tiles and lays the pictures over them`, async () => {
    const page = await mapPage();
    const heights = await server.ask(`/d/hills/xyz/${kind}.json`);
    assert.equal(heights.encoding, encoding);
    const [west, south, east, north] = heights.bounds;
    const found = await page.evaluate(
      async ({ dem, pictures, encoding, bounds, zoom }) => {
        const [west, south, east, north] = bounds;
        const map = new window.maplibregl.Map({
          container: "map",
          style: {
            version: 8,
            sources: {
              dem: { type: "raster-dem", url: dem, encoding, tileSize: 256 },
              pictures: { type: "raster", url: pictures, tileSize: 256 },
            },
            layers: [
              { id: "sky", type: "background", paint: { "background-color": "#9ab" } },
              { id: "pictures", type: "raster", source: "pictures" },
            ],
            terrain: { source: "dem", exaggeration: 1 },
          },
          center: [(west + east) / 2, (south + north) / 2],
          zoom,
          pitch: 60,
          attributionControl: { compact: false },
          canvasContextAttributes: { preserveDrawingBuffer: true },
        });
        window.troubles = [];
        map.on("error", ({ error }) => window.troubles.push(String(error?.message)));
        await new Promise((resolve) => map.once("idle", resolve));
        // Places in the middle, where the finest tiles are.
        const places = [];
        for (let i = 0; i < 25; ++i)
          places.push([
            west + (east - west) * (0.47 + 0.015 * (i % 5)),
            south + (north - south) * (0.47 + 0.015 * Math.floor(i / 5)),
          ]);
        return { places, heights: places.map((place) => map.queryTerrainElevation(place)) };
      },
      {
        dem: new URL(`/d/hills/xyz/${kind}.json`, server.url).href,
        pictures: new URL("/d/hills/xyz/imagery/pictures.json", server.url).href,
        encoding,
        bounds: heights.bounds,
        zoom: heights.maxzoom + 1.5,
      },
    );
    // note: MapLibre takes a pixel's height for that of its north-western corner; tiles are pictures of their
    // pixels' middles, as GDAL and all others make and read them.
    const half = 0.5 / (256 * 2 ** heights.maxzoom);
    const middles = found.places.map(([longitude, latitude]) => {
      const y = 0.5 - Math.asinh(Math.tan((latitude * Math.PI) / 180)) / (2 * Math.PI) + half;
      return [longitude + 360 * half, (Math.atan(Math.sinh(Math.PI * (1 - 2 * y))) * 180) / Math.PI];
    });
    const answer = await fetch(new URL("/d/hills/elevation", server.url), {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ points: middles, crs: "EPSG:4326" }),
    });
    const { heightsMeters } = await answer.json();
    const off = found.heights.map((height, i) => Math.abs(height - heightsMeters[i])).sort((a, b) => a - b);
    // MapLibre goes straight from pixel to pixel; the ground between them is rough.
    assert.ok(off[12] < 1.5, `half of the heights are off by ${off[12]} m and more`);
    assert.ok(off[24] < 10, `a height is off by ${off[24]} m`);
    const spread = Math.max(...heightsMeters) - Math.min(...heightsMeters);
    assert.ok(spread > 20, `heights that are all the same would prove nothing (${spread} m)`);
    // note: beyond the data there is nothing, and the map is told so.
    const troubles = await page.evaluate(() => window.troubles);
    assert.deepEqual(troubles.filter((words) => !/404|Not Found/.test(words)), []);
    assert.match(await page.locator(".maplibregl-ctrl-attrib").innerText(), /Pictures of no place/);
    await page.screenshot({ path: join(kWork, `maplibre-${kind}.png`), timeout: kPatience });
    assert.deepEqual(page.errors, []);
    await page.context().close();
  });
}
