/** The package as others get it: packed, unpacked, used without a bundler and from another origin; and docs/web.md's example. */
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, rmSync } from "node:fs";
import { createServer } from "node:http";
import { dirname, extname, join, normalize } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { kPatience, kWork, launch, makeDataset, newPage, serve } from "./harness.mjs";

const kRoot = join(dirname(fileURLToPath(import.meta.url)), "../../..");
const kTypes = { ".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript", ".wasm": "application/wasm" };
const kPage = `<!doctype html><meta charset="utf-8"><style>body { margin: 0 } canvas { width: 480px; height: 320px; display: block }</style><canvas></canvas>
<script type="module">
import { createViewer } from "/package/dist/index.js";
const dataset = new URL(location.href).searchParams.get("dataset");
window.terraneViewer = createViewer(document.querySelector("canvas"), { dataset, settings: { samples: 1 } });
</script>`;

let browser, server, pages, address;
before(async () => {
  server = await serve(makeDataset(), { args: ["--cors"] });
  // npm's own packing says what is in it.
  const folder = join(kWork, "packed");
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(folder, { recursive: true });
  const [{ filename }] = JSON.parse(execFileSync("npm", ["pack", "--json", "--pack-destination", folder], { cwd: join(kRoot, "web/package"), encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] }));
  execFileSync("tar", ["-xzf", join(folder, filename), "-C", folder]);
  pages = createServer((request, response) => {
    const path = normalize(new URL(request.url, "http://localhost").pathname);
    response.setHeader("Content-Type", kTypes[extname(path)] ?? "text/html");
    try {
      response.end(path === "/" ? kPage : readFileSync(join(folder, path)));
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => pages.listen(0, "127.0.0.1", resolve));
  address = `http://127.0.0.1:${pages.address().port}/?dataset=${encodeURIComponent(`${server.url}d/hills/`)}`;
  browser = await launch();
});
after(async () => {
  await browser.close();
  pages.close();
  await server.stop();
});

async function openPage(url = address) {
  const page = await newPage(browser);
  page.asked = [];
  page.on("request", (request) => page.asked.push(new URL(request.url()).pathname));
  await page.goto(url);
  await page.evaluate(() => window.terraneViewer.ready);
  await page.waitForFunction(() => window.terraneViewer.isSettled, null, { timeout: kPatience });
  return page;
}

test("the packed package draws in a page of another origin, decoding in workers", async () => {
  const page = await openPage();
  const { triangles, renderer } = await page.evaluate(() => window.terraneViewer.statistics());
  assert.ok(triangles > 100 && renderer !== "");
  // It is asked for before the engine has come, and the engine takes that answer.
  const manifest = page.asked.findIndex((path) => path.endsWith("/manifest.json"));
  assert.equal(page.asked.filter((path) => path.endsWith("/manifest.json")).length, 1);
  assert.ok(manifest < page.asked.findIndex((path) => path.endsWith("/elevation.pmtiles")));
  assert.ok(page.workers().length > 0, "no worker");
  // One that is given back before its engine has come leaves no worker behind.
  const before = page.workers().length;
  await page.evaluate(async () => {
    const { createViewer } = await import("/package/dist/index.js");
    const viewer = createViewer(document.createElement("canvas"), { dataset: new URL(location.href).searchParams.get("dataset") });
    viewer.dispose();
    await viewer.ready.catch(() => {});
  });
  for (let looks = 0; page.workers().length > before && looks < 200; ++looks) await new Promise((resolve) => setTimeout(resolve, 50));
  assert.equal(page.workers().length, before);
  assert.deepEqual(page.errors, []);
  await page.evaluate(() => window.terraneViewer.dispose());
  await page.context().close();
});

test("ground that is studied becomes as exact as the dataset, though the picture needs none of it", async (t) => {
  const wide = await serve(makeDataset("wide", { imagery: false, size: 2049 }), { args: ["--cors"] });
  // note: a server that is left behind keeps node from ending.
  t.after(() => wide.stop());
  const page = await openPage(address.replace(/dataset=.*/, `dataset=${encodeURIComponent(`${wide.url}d/wide/`)}`));
  const answer = await page.evaluate(async () => {
    const { terraneViewer: viewer } = window;
    const { bounds, maxErrorMeters } = viewer.dataset;
    const at = (x, y) => ({
      easting: bounds.west + x * (bounds.east - bounds.west),
      northing: bounds.south + y * (bounds.north - bounds.south),
    });
    const line = [at(0.05, 0.9), at(0.3, 0.4), at(0.9, 0.95)];
    const worst = () => Math.max(...viewer.profile(line, 300).map((point) => point.error));
    const settled = async () => {
      do await new Promise((resolve) => setTimeout(resolve, 100));
      while (!viewer.isSettled);
    };
    const before = worst();
    viewer.studyGround("line", line);
    await settled();
    const after = worst();
    const profile = viewer.profile(line, 300).map((point) => point.height);
    viewer.studyGround("line", null);
    await settled();
    return { line, before, after, profile, maxErrorMeters };
  });
  assert.ok(answer.before > 2 * answer.maxErrorMeters, `${answer.before} m`);
  assert.ok(answer.after <= answer.maxErrorMeters + 0.01, `${answer.after} m where the dataset has ${answer.maxErrorMeters}`);
  const points = answer.line.map((place) => `${place.easting},${place.northing}`).join(";");
  const told = await wide.ask(`/d/wide/profile?points=${points}&samples=300`);
  for (let i = 0; i < 300; ++i) assert.ok(Math.abs(told.heightsMeters[i] - answer.profile[i]) < 0.01);
  await page.context().close();
});

test("engine and workers are at most 1.5 MB compressed", () => {
  const folder = join(kWork, "packed/package/dist");
  const names = ["terrane.mjs", "terrane.wasm", "terrane_worker.mjs", "terrane_worker.wasm", "worker.js", "viewer.js"];
  const bytes = names.reduce((sum, name) => sum + gzipSync(readFileSync(join(folder, name)), { level: 9 }).length, 0);
  assert.ok(bytes <= 1.5e6, `${bytes} bytes`);
});

test("docs/web.md's pass compiles, draws contours, and takes its uniforms", async () => {
  const guide = readFileSync(join(kRoot, "docs/web.md"), "utf8");
  const example = /const contours = (\{[\s\S]*?\n\});/.exec(guide)[1];
  const page = await openPage();
  const counts = await page.evaluate(async (example) => {
    const { terraneViewer: viewer } = window;
    const pixels = async () => {
      const bitmap = await createImageBitmap(await viewer.screenshot());
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
      context.drawImage(bitmap, 0, 0);
      return context.getImageData(0, 0, bitmap.width, bitmap.height).data;
    };
    const different = (a, b) => a.reduce((sum, value, i) => sum + (Math.abs(value - b[i]) > 12 ? 1 : 0), 0);
    const plain = await pixels();
    viewer.addPass((0, eval)(`(${example})`));
    const wide = await pixels();
    viewer.setPassUniforms("contours", { spacing: 250 });
    const wider = await pixels();
    viewer.removePass("contours");
    const again = await pixels();
    return { wide: different(plain, wide), wider: different(plain, wider), again: different(plain, again), all: plain.length };
  }, example);
  assert.ok(counts.wide > 0.01 * counts.all, `only ${counts.wide} of ${counts.all} values changed`);
  assert.ok(counts.wider > 0 && counts.wider < counts.wide, JSON.stringify(counts));
  assert.equal(counts.again, 0);
  await page.context().close();
});

test("a pass that does not compile is refused with the compiler's words, and nothing else changes", async () => {
  const page = await openPage();
  const message = await page.evaluate(() => {
    try {
      window.terraneViewer.addPass({ name: "wrong", fragment: "vec3 apply(Ground ground) { return ground.colour; }" });
      return "taken";
    } catch (error) {
      return error.message;
    }
  });
  assert.match(message, /"wrong" does not compile[\s\S]*colour/);
  const triangles = await page.evaluate(async () => (await window.terraneViewer.screenshot(), window.terraneViewer.statistics().triangles));
  assert.ok(triangles > 100);
  await page.context().close();
});

test("the manifest is asked for early where the engine will look for it", async () => {
  const { manifestUrl } = await import(join(kRoot, "web/package/dist/early.js"));
  for (const [dataset, url] of [
    ["https://host/alps.terrane", "https://host/alps.terrane/manifest.json"],
    ["https://host/alps.terrane//", "https://host/alps.terrane/manifest.json"],
    ["https://host/alps.terrane/manifest.json", "https://host/alps.terrane/manifest.json"],
    ["https://host/alps.terrane/?key=a/b#here", "https://host/alps.terrane/manifest.json?key=a/b"],
  ]) {
    assert.equal(manifestUrl(dataset), url);
  }
});

test("many lines are prepared aside, and look as they would at once", async () => {
  const page = await openPage();
  const { many, few, waited } = await page.evaluate(async () => {
    const { terraneViewer: viewer } = window;
    const settled = async () => {
      let steps = 0;
      for (; steps === 0 || !viewer.isSettled; ++steps) await new Promise((resolve) => setTimeout(resolve, 50));
      return steps;
    };
    const red = async () => {
      const bitmap = await createImageBitmap(await viewer.screenshot());
      const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
      context.drawImage(bitmap, 0, 0);
      const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
      let count = 0;
      for (let i = 0; i < data.length; i += 4) count += data[i] > 240 && data[i + 1] < 20 && data[i + 2] < 20 ? 1 : 0;
      return count;
    };
    const { west, south, east, north } = viewer.dataset.bounds;
    // A straight line, which is the same with however many corners.
    const line = (corners) => ({
      points: Array.from({ length: corners }, (_, i) => {
        const share = 0.1 + (0.8 * i) / (corners - 1);
        return { easting: west + share * (east - west), northing: south + share * (north - south) };
      }),
      color: "#ff0000",
      widthPixels: 6,
    });
    viewer.setLine("line", line(2));
    await settled();
    const few = await red();
    viewer.removeLine("line");
    await settled();
    viewer.setLine("line", line(20000));
    const waited = await settled();
    return { few, many: await red(), waited };
  });
  assert.ok(few > 500, `${few} pixels`);
  assert.ok(Math.abs(many - few) <= 0.01 * few, `${many} pixels instead of ${few}, after ${waited} looks`);
  assert.deepEqual(page.errors, []);
  await page.context().close();
});
