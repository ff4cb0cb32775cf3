/** The main ones again in Firefox, which draws WebGL2 only on a screen: Xvfb's. */
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { after, before, test } from "node:test";
import puppeteer from "puppeteer-core";
import { kPatience, makeDataset, near, serve } from "./harness.mjs";

let screen, server, browser, page;
before(async () => {
  screen = spawn("Xvfb", ["-displayfd", "1", "-screen", "0", "1024x720x24", "+extension", "GLX", "-nolisten", "tcp"], {
    stdio: ["ignore", "pipe", "ignore"],
  });
  const display = await new Promise((resolve, reject) => {
    screen.stdout.once("data", (text) => resolve(`:${String(text).trim()}`));
    screen.once("error", reject);
    screen.once("exit", (code) => reject(new Error(`Xvfb ended with ${code}`)));
  });
  server = await serve(makeDataset());
  browser = await puppeteer.launch({
    browser: "firefox",
    executablePath: process.env.FIREFOX ?? "/usr/bin/firefox-esr",
    headless: false,
    protocol: "webDriverBiDi",
    env: { ...process.env, DISPLAY: display, MOZ_DISABLE_CONTENT_SANDBOX: "1" },
    defaultViewport: { width: 900, height: 620 },
    extraPrefsFirefox: { "webgl.force-enabled": true, "webgl.disable-fail-if-major-performance-caveat": true },
  });
  page = await browser.newPage();
  page.setDefaultTimeout(kPatience);
  page.errors = [];
  page.on("pageerror", (error) => page.errors.push(error.message));
});
after(async () => {
  await browser?.close();
  await server?.stop();
  screen?.kill();
});

const settled = () =>
  page.waitForFunction(
    () => window.terraneApp !== undefined && window.terraneViewer.isSettled && document.querySelector(".splash") === null,
  );
const text = (selector) => page.$eval(selector, (element) => element.innerText);

async function lookDown() {
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
  await settled();
}

async function clickGround(x, y) {
  const [place, at] = await page.evaluate(
    (x, y) => {
      const { terraneViewer: viewer } = window;
      const { west, east, south, north } = viewer.dataset.bounds;
      const [easting, northing] = [west + (east - west) * x, south + (north - south) * y];
      const at = viewer.project({ easting, northing, height: viewer.elevationAt(easting, northing) });
      return [viewer.pick(Math.round(at.x), Math.round(at.y)), { x: Math.round(at.x), y: Math.round(at.y) }];
    },
    x,
    y,
  );
  await page.mouse.click(at.x, at.y);
  return place;
}

test("Firefox: the demo's ground stands, with its name", async () => {
  await page.goto(server.url);
  await settled();
  assert.equal(await text(".title h1"), "hills");
  assert.ok((await page.evaluate(async () => (await window.terraneViewer.screenshot()).size)) > 20_000);
});

test("Firefox: a drag moves the map, the wheel comes nearer", async () => {
  const before = await page.evaluate(() => window.terraneViewer.view);
  await page.mouse.move(450, 340);
  await page.mouse.down();
  for (let i = 1; i <= 5; ++i) await page.mouse.move(450, 340 + 12 * i);
  await page.mouse.up();
  await page.waitForFunction((northing) => window.terraneViewer.view.northing > northing + 20, {}, before.northing);
  const height = await page.evaluate(() => window.terraneViewer.view.height);
  await page.mouse.wheel({ deltaY: -400 });
  await page.waitForFunction((height) => window.terraneViewer.view.height < 0.9 * height, {}, height);
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
});

test("Firefox: modes and the address", async () => {
  await page.keyboard.press("l");
  await page.waitForSelector("#panel-layers");
  await page.click("#panel-layers input[value=slope]");
  await page.waitForFunction(() => location.hash.includes("mode=slope"));
  await page.click("#panel-layers input[value=shaded]");
  await page.waitForFunction(() => /^#[\d.]+,[\d.]+,/.test(location.hash) && !location.hash.includes("mode"));
  await page.keyboard.press("Escape");
});

test("Firefox: measure", async () => {
  await lookDown();
  await page.focus(".ground");
  await page.keyboard.press("m");
  const a = await clickGround(0.62, 0.3);
  const b = await clickGround(0.9, 0.5);
  await page.waitForFunction(() => /On the map/.test(document.querySelector("#panel-measure").innerText));
  const flat = Math.hypot(b.easting - a.easting, b.northing - a.northing);
  const shown = parseFloat(/On the map\s+([\d.]+) km/.exec(await text("#panel-measure"))[1]) * 1000;
  assert.ok(near(shown, flat, 0.005 * flat + 5), `${shown} against ${flat}`);
  await page.keyboard.press("Escape");
});

test("Firefox: profile with its plot", async () => {
  await page.focus(".ground");
  await page.keyboard.press("p");
  const a = await clickGround(0.15, 0.8);
  const b = await clickGround(0.85, 0.85);
  await page.waitForSelector(".profile-plot:not([hidden])");
  const told = await server.ask(`/d/hills/profile?points=${a.easting},${a.northing};${b.easting},${b.northing}&samples=512`);
  const [, low, high] = /· ([\d\u202f]+) to ([\d\u202f]+) m ·/
    .exec(await text(".profile-summary"))
    .map((part) => Number(part.replaceAll("\u202f", "")));
  assert.ok(near(low, Math.min(...told.heightsMeters), 1) && near(high, Math.max(...told.heightsMeters), 1));
  const box = await (await page.$(".profile-plot")).boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + 50);
  await page.waitForSelector(".mark-hover");
  await page.keyboard.press("Escape");
});

test("Firefox: line of sight", async () => {
  await page.focus(".ground");
  await page.keyboard.press("v");
  await clickGround(0.62, 0.2);
  await clickGround(0.95, 0.8);
  await page.waitForSelector(".verdict");
  assert.match(await text(".verdict"), /is seen|is hidden/);
  await page.keyboard.press("Escape");
});

test("Firefox: lines are drawn, and files dropped", async () => {
  await page.focus(".ground");
  await page.keyboard.press("b");
  await clickGround(0.62, 0.2);
  await clickGround(0.8, 0.6);
  await page.keyboard.press("Enter");
  await page.waitForSelector(".line-row");
  await page.evaluate(() => {
    const transfer = new DataTransfer();
    const { west, south } = window.terraneViewer.dataset.bounds;
    transfer.items.add(
      new File(
        [
          JSON.stringify({
            type: "LineString",
            coordinates: [
              [west + 100, south + 100],
              [west + 900, south + 900],
            ],
          }),
        ],
        "one.geojson",
      ),
    );
    document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
  });
  await page.waitForFunction(() => window.terraneApp.lines.lines.length === 2);
  await page.keyboard.press("Escape");
});

test("Firefox: a flight is recorded and flown again", async () => {
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
  await page.focus(".ground");
  await page.keyboard.press("c");
  await page.click("#flight-record");
  await page.evaluate(() => window.terraneViewer.flyTo({ heading: 30 }, { seconds: 0.8 }));
  await page.click("#flight-record");
  await page.evaluate(() => window.terraneViewer.setView({ heading: 0 }));
  await page.click("#flight-replay");
  await page.waitForFunction(() => window.terraneApp.flights.state === "idle" && Math.abs(window.terraneViewer.view.heading - 30) < 1);
  await page.keyboard.press("Escape");
});

test("Firefox: the server goes and comes back: a banner meanwhile, the ground stays", async () => {
  const dataset = makeDataset("large", { size: 4097, imagery: false });
  const mortal = await serve(dataset);
  let reborn;
  try {
    await page.goto(mortal.url);
    await settled();
    await mortal.stop();
    await page.evaluate(() => {
      const { terraneViewer: viewer } = window;
      const { west, east, south, north } = viewer.dataset.bounds;
      const [easting, northing] = [(west + east) / 2, (south + north) / 2];
      viewer.setView({ easting, northing, height: viewer.elevationAt(easting, northing) + 150, heading: 0, pitch: -20 });
    });
    await page.waitForSelector(".banner[data-code=offline]", { visible: true });
    assert.ok(await page.evaluate(() => window.terraneViewer.statistics().triangles > 0));
    reborn = await serve(dataset, { port: mortal.port });
    await page.waitForSelector(".banner", { hidden: true });
    await settled();
    assert.equal(await page.evaluate(() => window.terraneViewer.problem), null);
  } finally {
    await mortal.stop();
    await reborn?.stop();
  }
});

test("Firefox: nothing went wrong on the way", () => assert.deepEqual(page.errors, []));
