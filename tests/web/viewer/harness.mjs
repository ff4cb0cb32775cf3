/** What all tests of the viewer need: datasets, servers, browsers, and ways to wait for what is to come. */
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const kRoot = join(dirname(fileURLToPath(import.meta.url)), "../../..");
export const kTerrane = process.env.TERRANE ?? join(kRoot, "build/release/bin/terrane");
export const kViewer = process.env.TERRANE_VIEWER ?? join(kRoot, "build/viewer");
export const kWork = process.env.TERRANE_TEST_FOLDER ?? join(kRoot, "build/tests/viewer");
/** Pictures are made by the processor here, and other work goes on beside. */
export const kPatience = 90_000;

const kFlags = [
  "--no-sandbox",
  "--no-first-run",
  "--disable-quic",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--disable-dev-shm-usage",
  "--use-gl=angle",
  "--use-angle=gl-egl",
  "--ignore-gpu-blocklist",
];

const run = (...args) => execFileSync(kTerrane, args, { stdio: ["ignore", "pipe", "pipe"] });

/** A dataset with imagery, of `size` samples a side; made once. `crs`: an EPSG number, for one that is not as it was made;
 * `onMoon`: its heights lie there. */
export function makeDataset(name = "hills", { crs, imagery = true, onMoon = false, seed = 1, size = 513 } = {}) {
  mkdirSync(kWork, { recursive: true });
  const dataset = join(kWork, `${name}.terrane`);
  if (existsSync(join(dataset, "manifest.json"))) return dataset;
  const [heights, color] = [join(kWork, `${name}.tif`), join(kWork, `${name}-color.tif`)];
  run("synth", "-o", heights, "--color", color, "--size", String(size), "--seed", String(seed), "--overwrite", "-q");
  const placed = onMoon ? join(kWork, `${name}-moon.tif`) : heights;
  // Ten kilometres a side, 2 degrees north of its equator: there its projection shows lengths as they are.
  const [corner, system] = [["1500000", "70000", "1510000", "60000"], "+proj=eqc +R=1737400 +units=m"];
  if (onMoon) execFileSync("gdal_translate", ["-q", "-a_srs", system, "-a_ullr", ...corner, heights, placed]);
  run(
    "build",
    placed,
    "-o",
    dataset,
    "--overwrite",
    "-q",
    "--attribution",
    "Heights of nobody",
    ...(crs ? ["--crs", `EPSG:${crs}`] : []),
    ...(imagery ? ["--imagery", `pictures=${color}`, "--imagery-attribution", "pictures=Pictures of no place"] : []),
  );
  return dataset;
}

/** `terrane serve` of these datasets, with the viewer. */
export async function serve(datasets, { port = 0, args = [] } = {}) {
  const child = spawn(
    kTerrane,
    ["serve", ...[datasets].flat(), "--port", String(port), "-q", "--grace", "0", "--viewer", kViewer, ...args],
    { stdio: ["ignore", "pipe", "inherit"] },
  );
  const url = await new Promise((resolve, reject) => {
    child.stdout.once("data", (text) => resolve(String(text).trim()));
    child.once("exit", (code) => reject(new Error(`terrane serve ended with ${code}`)));
  });
  const ended = new Promise((resolve) => child.once("exit", resolve));
  return {
    url,
    port: Number(new URL(url).port),
    /** As if the machine went off. */
    async stop() {
      child.kill("SIGKILL");
      await ended;
    },
    async ask(path) {
      const answer = await fetch(new URL(path, url));
      if (!answer.ok) throw new Error(`${path}: ${answer.status} ${await answer.text()}`);
      return answer.json();
    },
  };
}

export function launch(flags = []) {
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", headless: true, args: [...kFlags, ...flags] });
}

/** A page that remembers what went wrong on it. */
export async function newPage(browser, options = {}) {
  const context = await browser.newContext({ viewport: { width: 900, height: 640 }, acceptDownloads: true, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(kPatience);
  page.errors = [];
  page.on("pageerror", (error) => page.errors.push(error.message));
  return page;
}

/** Waits until the dataset is open and all that the camera needs is drawn. */
export async function settled(page) {
  await page.waitForFunction(() => window.terraneApp !== undefined && window.terraneViewer.isSettled, null, { timeout: kPatience });
  await page.waitForFunction(() => document.querySelector(".splash") === null);
}

export async function openViewer(page, url) {
  await page.goto(url);
  await settled(page);
}

/** Where a place of the ground is on the page. */
export function pixelOf(page, easting, northing) {
  return page.evaluate(
    ([easting, northing]) => {
      const { terraneViewer: viewer } = window;
      const at = viewer.project({ easting, northing, height: viewer.elevationAt(easting, northing) });
      const box = viewer.canvas.getBoundingClientRect();
      return { x: at.x + box.left, y: at.y + box.top };
    },
    [easting, northing],
  );
}

/** Looks at the ground from straight above, so that every place of it can be clicked on. */
export async function lookDown(page) {
  await page.evaluate(() => {
    const { terraneViewer: viewer } = window;
    const { west, east, south, north } = viewer.dataset.bounds;
    viewer.setView({
      easting: (west + east) / 2,
      northing: (south + north) / 2,
      height: 1.6 * (north - south) + viewer.dataset.maxHeight,
      heading: 0,
      pitch: -89.9,
      fov: 45,
    });
  });
  await settled(page);
}

/** A place within the dataset: 0, 0 its south-west corner, 1, 1 its north-east one. */
export function placeAt(page, x, y) {
  return page.evaluate(
    ([x, y]) => {
      const { west, east, south, north } = window.terraneViewer.dataset.bounds;
      return { easting: west + (east - west) * x, northing: south + (north - south) * y };
    },
    [x, y],
  );
}

/** Clicks on the ground at a place of the dataset, and returns what the viewer sees there. */
export async function clickGround(page, x, y) {
  const { easting, northing } = await placeAt(page, x, y);
  const at = await pixelOf(page, easting, northing);
  const place = await page.evaluate(({ x, y }) => window.terraneViewer.pick(Math.round(x), Math.round(y)), at);
  await page.mouse.click(Math.round(at.x), Math.round(at.y));
  return place;
}

export const text = (page, selector) => page.locator(selector).innerText();

/** The number that a row of results shows: `1.23 km` is 1230. */
export async function resultOf(page, label) {
  const shown = await page.locator(".row.result", { hasText: label }).locator("strong").innerText();
  return metersOf(shown);
}
export function metersOf(shown) {
  const [, sign, digits, unit] = /([−+-]?)([\d\u202f.]+)\s*(km²|m²|ha|km|m)?/.exec(shown) ?? [];
  const value =
    Number(digits?.replaceAll("\u202f", "")) * { km: 1000, "km²": 1e6, ha: 1e4 }[unit] || Number(digits?.replaceAll("\u202f", ""));
  return sign === "−" || sign === "-" ? -value : value;
}

/** Drops files on the page, as a person drags them there. */
export function dropFiles(page, files) {
  return page.evaluate((files) => {
    const transfer = new DataTransfer();
    for (const { name, text } of files) transfer.items.add(new File([text], name));
    for (const type of ["dragenter", "dragover", "drop"])
      document.body.dispatchEvent(new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true }));
  }, files);
}

export const lastToast = (page, words) => page.locator(".toast", { hasText: words }).last().waitFor();

/** Coordinates of another CRS, by GDAL: east or longitude first, whatever the CRS says. */
export function transform(from, to, points) {
  const input = points.map((point) => point.join(" ")).join("\n");
  const lines = execFileSync("gdaltransform", ["-s_srs", from, "-t_srs", to, "-output_xy"], { input, encoding: "utf8" }).trim().split("\n");
  return lines.map((line) => line.split(" ").map(Number));
}

/** What a download holds. */
export async function downloaded(page, action) {
  const [download] = await Promise.all([page.waitForEvent("download"), action()]);
  const stream = await download.createReadStream();
  const chunks = [];
  for await (const chunk of stream) chunks.push(chunk);
  return { name: download.suggestedFilename(), bytes: Buffer.concat(chunks) };
}

export const near = (a, b, tolerance) => Math.abs(a - b) <= tolerance;
