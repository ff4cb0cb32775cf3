import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import {
  downloaded,
  dropFiles,
  kPatience,
  lastToast,
  launch,
  makeDataset,
  near,
  newPage,
  openViewer,
  serve,
  settled,
  text,
} from "./harness.mjs";

let server, browser, page;
before(async () => {
  server = await serve(makeDataset());
  browser = await launch();
  page = await newPage(browser);
  await openViewer(page, server.url);
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

const settings = () => page.evaluate(() => ({ ...window.terraneViewer.settings }));
/** How many colours the picture has, and its mean: enough to see that another one is drawn. */
const picture = () =>
  page.evaluate(async () => {
    const bitmap = await createImageBitmap(await window.terraneViewer.screenshot());
    const canvas = new OffscreenCanvas(90, 64);
    const context = canvas.getContext("2d");
    context.drawImage(bitmap, 0, 0, 90, 64);
    const { data } = context.getImageData(0, 0, 90, 64);
    const sum = [0, 0, 0];
    for (let i = 0; i < data.length; i += 4) for (let c = 0; c < 3; ++c) sum[c] += data[i + c];
    return sum.map((value) => value / (90 * 64));
  });
const differs = (a, b) => Math.max(...a.map((value, i) => Math.abs(value - b[i]))) > 1;

test("layers: each mode draws another picture and tells what its colours mean", async () => {
  await page.keyboard.press("l");
  await page.locator("#panel-layers").waitFor();
  let before = await picture();
  const legends = { Height: /m$/, Slope: /60 °/, Normals: /east/, Tiles: /tile/, Error: /τ = 1\.0/ };
  for (const [label, legend] of Object.entries(legends)) {
    await page.locator("#panel-layers .choice", { hasText: label }).click();
    await page.waitForFunction((mode) => window.terraneViewer.settings.mode === mode, label.toLowerCase());
    assert.match((await text(page, ".legend")).trim(), legend);
    const after = await picture();
    assert.ok(differs(before, after), `${label} looks as the one before`);
    before = after;
  }
  // The legend of heights goes from the lowest to the highest ground.
  await page.locator("#panel-layers .choice", { hasText: "Height" }).click();
  const [low, high] = await page.evaluate(() => [window.terraneViewer.dataset.minHeight, window.terraneViewer.dataset.maxHeight]);
  const labels = (await page.locator(".color-labels span").allInnerTexts()).map((label) => Number(label.replace(/[^\d]/g, "")));
  assert.deepEqual([labels[0], labels.at(-1)], [Math.round(low), Math.round(high)]);
  await page.locator("#panel-layers .choice", { hasText: "Natural" }).click();
});

test("layers: imagery by name, outlines, haze and water are switched", async () => {
  await settled(page);
  const before = await picture();
  await page.locator("#panel-layers .switch", { hasText: "pictures" }).click();
  assert.equal(await page.evaluate(() => window.terraneViewer.layers[0].visible), false);
  await settled(page);
  assert.ok(differs(before, await picture()), "without imagery the picture is the same");
  await page.locator("#panel-layers .switch", { hasText: "pictures" }).click();
  for (const [label, outline] of [
    ["Triangles", "wireframe"],
    ["Patches", "patches"],
    ["None", "none"],
  ]) {
    await page.locator("#panel-layers .choice", { hasText: label }).click();
    assert.equal((await settings()).outline, outline);
  }
  await page.locator("#panel-layers .switch", { hasText: "Haze" }).click();
  await page.locator("#panel-layers .switch", { hasText: "Water" }).click();
  const now = await settings();
  assert.equal(now.haze, false);
  assert.equal(now.water, false);
  // What is changed elsewhere is shown.
  await page.evaluate(() => window.terraneViewer.set({ haze: true, mode: "slope" }));
  assert.equal(await page.locator("#panel-layers .switch", { hasText: "Haze" }).locator("input").isChecked(), true);
  assert.equal(await page.locator("#panel-layers input[value=slope]").isChecked(), true);
  await page.evaluate(() => window.terraneViewer.set({ mode: "shaded" }));
});

test("layers: sliders go by keys, too", async () => {
  const slider = page.getByLabel("Brightness of pictures");
  await slider.focus();
  await page.keyboard.press("End");
  assert.equal((await settings()).imageryBrightness, 2);
  assert.equal(await slider.getAttribute("aria-valuetext"), "200 %");
  await page.evaluate(() => window.terraneViewer.set({ imageryBrightness: 1 }));
  assert.equal(await slider.getAttribute("aria-valuetext"), "100 %");
});

test("sun and relief: dial, sliders, exaggeration, reset", async () => {
  await page.locator(".ground").focus();
  await page.keyboard.press("u");
  await page.locator("#panel-light").waitFor();
  assert.equal(await page.locator("#panel-layers").count(), 0, "one panel at a time");
  const box = await page.locator(".dial").boundingBox();
  const [x, y, perUnit] = [box.x + box.width / 2, box.y + box.height / 2, box.width / 136];
  // Due east, half way up.
  await page.mouse.click(x + 25 * perUnit, y);
  let now = await settings();
  assert.ok(near(now.sunAzimuth, 90, 3) && near(now.sunAltitude, 45, 3), JSON.stringify(now));
  const before = await picture();
  await page.getByLabel("Exaggeration of heights").focus();
  await page.keyboard.press("End");
  now = await settings();
  assert.equal(now.exaggeration, 8);
  await settled(page);
  assert.ok(differs(before, await picture()));
  await page.getByRole("button", { name: "Reset" }).click();
  now = await settings();
  assert.deepEqual([now.sunAzimuth, now.sunAltitude, now.exaggeration], [315, 38, 1]);
});

test("detail: a larger tau needs fewer triangles; surfaces, samples, freeze", async () => {
  await page.locator(".ground").focus();
  await page.keyboard.press("t");
  await page.locator("#panel-detail").waitFor();
  await settled(page);
  const triangles = () => page.evaluate(() => window.terraneViewer.statistics().triangles);
  const before = await triangles();
  const tau = page.getByLabel("Error allowed on screen");
  await tau.focus();
  await page.keyboard.press("End");
  assert.equal((await settings()).tau, 16);
  await page.waitForFunction((before) => window.terraneViewer.statistics().triangles < before / 2, before, { timeout: kPatience });
  await page.evaluate(() => window.terraneViewer.set({ tau: 1 }));
  await page.locator("#panel-detail .choice", { hasText: "Patches" }).click();
  assert.equal((await settings()).surface, "patches");
  await settled(page);
  await page.locator("#panel-detail .choice", { hasText: "Meshes" }).click();
  await page.locator("#panel-detail .choice", { hasText: "4, smoother" }).click();
  assert.equal((await settings()).samples, 4);
  await page.locator("#panel-detail .choice", { hasText: "1, faster" }).click();
  await settled(page);
  await page.locator("#panel-detail .switch", { hasText: "Freeze" }).click();
  assert.equal((await settings()).frozen, true);
  const frame = () => page.evaluate(() => new Promise((done) => window.terraneViewer.on("frame", done)));
  await frame();
  const frozen = await triangles();
  await page.evaluate(() => window.terraneViewer.setView({ height: window.terraneViewer.view.height / 2 }));
  await frame();
  assert.equal(await triangles(), frozen, "what is frozen changes");
  await page.locator("#panel-detail .switch", { hasText: "Freeze" }).click();
  await page.keyboard.press("Escape");
});

test("statistics: plots move on, and tell what the viewer tells", async () => {
  await page.locator(".ground").focus();
  await page.keyboard.press("i");
  await page.locator("#panel-statistics").waitFor();
  const ink = (plot) =>
    page.evaluate((plot) => {
      const canvas = document.querySelector(`[data-plot=${plot}] canvas`);
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let count = 0;
      for (let i = 3; i < data.length; i += 4) count += data[i] > 0;
      return count;
    }, plot);
  const before = await ink("triangles");
  await page.evaluate(() => window.terraneViewer.flyTo(window.terraneViewer.overview(), { seconds: 0.3 }));
  await page.waitForFunction(
    () => {
      const shown = document.querySelector("[data-plot=frame] strong").textContent;
      return shown !== "0.0 ms" && shown !== "";
    },
    null,
    { polling: 30 },
  );
  for (const plot of ["frame", "triangles", "error", "bytes", "requests"]) assert.ok((await ink(plot)) > 0, plot);
  assert.ok((await ink("triangles")) > before, "the plot of triangles stands still");
  await settled(page);
  await page.waitForFunction(() => {
    const bars = [...document.querySelectorAll(".level")].map((level) => Number(level.querySelector(".level-count").textContent || 0));
    return JSON.stringify(bars) === JSON.stringify(window.terraneViewer.statistics().tilesByLevel);
  });
  assert.match(await text(page, "#panel-statistics"), /Requests|llvmpipe|ANGLE/);
  await page.keyboard.press("Escape");
});

test("flights: recorded, flown again, saved, opened by dropping", async () => {
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
  await page.keyboard.press("c");
  await page.locator("#panel-flights").waitFor();
  assert.equal(await page.locator("#flight-replay").isDisabled(), true);
  await page.locator("#flight-record").click();
  await page.evaluate(() => window.terraneViewer.flyTo({ height: window.terraneViewer.view.height * 0.7, heading: 25 }, { seconds: 1 }));
  await page.locator("#flight-record").click();
  const end = await page.evaluate(() => window.terraneViewer.view);
  const { name, bytes } = await downloaded(page, () => page.locator("#flight-save").click());
  assert.equal(name, "hills-flight.json");
  const flight = JSON.parse(bytes.toString());
  assert.equal(flight.terraneFlight, 1);
  assert.equal(flight.coordinates, "crs");
  assert.ok(flight.keys.length >= 2 && flight.keys.at(-1).time >= 0.9, `${flight.keys.length} keys`);

  const isAtEnd = (end) =>
    Math.abs(window.terraneViewer.view.height - end.height) < 0.01 * end.height &&
    Math.abs(window.terraneViewer.view.heading - end.heading) < 0.5;
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
  await page.locator("#flight-replay").click();
  await page.waitForFunction(() => window.terraneApp.flights.state === "flying");
  await page.waitForFunction(() => window.terraneApp.flights.state === "idle");
  assert.ok(await page.evaluate(isAtEnd, end), "the flight ends where it was recorded to end");

  // A dropped file flies at once; a move of one's own ends it.
  const long = JSON.stringify({ ...flight, keys: flight.keys.map((key) => ({ ...key, time: key.time * 60 })) });
  await dropFiles(page, [{ name: "long.json", text: long }]);
  await page.waitForFunction(() => window.terraneApp.flights.state === "flying");
  await page.locator("#flight-replay", { hasText: "Stop" }).waitFor();
  await page.keyboard.press("Escape");
  await page.waitForFunction(() => window.terraneApp.flights.state === "idle");
});

test("flights: a recording is to be seen without its panel, and a slip of the hand keeps the flight before it", async () => {
  const before = await page.evaluate(() => window.terraneApp.flights.flight.json);
  await page.locator("#flight-record").dblclick();
  await lastToast(page, "too short");
  assert.equal(await page.evaluate(() => window.terraneApp.flights.state), "idle");
  assert.equal(await page.evaluate(() => window.terraneApp.flights.flight.json), before);
  await page.locator("#flight-record").click();
  await page.keyboard.press("Escape");
  const button = page.locator(".toolbar [data-tool=flights]");
  assert.equal(await button.getAttribute("title"), "Recording (C)");
  assert.ok(await button.evaluate((element) => getComputedStyle(element, "::after").backgroundColor !== "rgba(0, 0, 0, 0)"), "no mark");
  await page.keyboard.press("c");
  await page.evaluate(() => window.terraneViewer.flyTo({ heading: 90 }, { seconds: 0.8 }));
  await page.locator("#flight-record", { hasText: "Stop" }).click();
  assert.equal(await button.getAttribute("title"), "Flights (C)");
  assert.notEqual(await page.evaluate(() => window.terraneApp.flights.flight.json), before);
});

test("flights: a file that is none is said to be none", async () => {
  await dropFiles(page, [
    { name: "bad.json", text: '{"terraneFlight":1,"keys":[{"time":0,"eye":[0,0,0],"wrong":1},{"time":1,"eye":[0,0,0]}]}' },
  ]);
  await lastToast(page, "bad.json");
  await dropFiles(page, [{ name: "worse.json", text: '{"terraneFlight":1}' }]);
  await lastToast(page, "worse.json");
  assert.equal(await page.evaluate(() => window.terraneApp.flights.state), "idle");
});

test("nothing went wrong on the way", () => assert.deepEqual(page.errors, []));
