import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import {
  kPatience,
  launch,
  lookDown,
  makeDataset,
  metersOf,
  near,
  newPage,
  openViewer,
  pixelOf,
  placeAt,
  resultOf,
  serve,
  settled,
  text,
} from "./harness.mjs";

let server, browser, page, touch;
before(async () => {
  server = await serve(makeDataset());
  browser = await launch();
  page = await newPage(browser, { viewport: { width: 390, height: 844 }, deviceScaleFactor: 3, isMobile: true, hasTouch: true });
  touch = await page.context().newCDPSession(page);
  await touch.send("Emulation.setCPUThrottlingRate", { rate: 4 });
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

const isWhole = (box, width = 390, height = 844) =>
  box !== null && box.x >= 0 && box.y >= 0 && box.x + box.width <= width + 0.5 && box.y + box.height <= height + 0.5;

/** Fingers at these places, from now on. */
const fingers = (type, places) => touch.send("Input.dispatchTouchEvent", { type, touchPoints: places.map(([x, y], id) => ({ x, y, id })) });

async function gesture(steps) {
  await fingers("touchStart", steps[0]);
  for (const step of steps.slice(1)) await fingers("touchMove", step);
  await fingers("touchEnd", []);
}

async function tapGround(x, y) {
  // A sheet that has come moves the ground a frame later.
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  const { easting, northing } = await placeAt(page, x, y);
  const at = await pixelOf(page, easting, northing);
  await page.touchscreen.tap(at.x, at.y);
  return { easting, northing };
}

test("opens with the phone's profile; bar, readout, compass and title are whole on the screen", async () => {
  await openViewer(page, server.url);
  const { samples, pixelRatio } = await page.evaluate(() => window.terraneViewer.settings);
  assert.equal(samples, 1);
  assert.ok(pixelRatio <= 1.5, `${pixelRatio} pixels a pixel`);
  for (const selector of [".toolbar", ".title", ".compass", ".readout", ".scale-bar"])
    assert.ok(isWhole(await page.locator(selector).boundingBox()), selector);
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390, "the page is wider than the screen");
  assert.equal(await page.evaluate(() => document.querySelector(".readout").dataset.where), "middle");
  assert.match(await text(page, ".readout"), /E [\d\u202f]+\s+N [\d\u202f]+[\s\S]*m/);
});

test("everything that is touched is at least 40 pixels high", async () => {
  const sizes = await page.evaluate(() =>
    [...document.querySelectorAll("button")]
      .filter((button) => button.offsetParent !== null && button.getClientRects().length > 0)
      .map((button) => [button.getAttribute("aria-label") ?? button.textContent, button.offsetWidth, button.offsetHeight]),
  );
  for (const [name, width, height] of sizes) assert.ok(width >= 40 && height >= 32, `${name}: ${width} x ${height}`);
});

test("one finger moves the map, two come nearer and turn", async () => {
  const view = () => page.evaluate(() => window.terraneViewer.view);
  const before = await view();
  await gesture([[[195, 420]], [[195, 440]], [[195, 470]], [[195, 500]]]);
  await page.waitForFunction((northing) => window.terraneViewer.view.northing > northing + 50, before.northing);
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
  const overview = await view();
  await gesture([
    [
      [170, 420],
      [220, 420],
    ],
    [
      [150, 420],
      [240, 420],
    ],
    [
      [130, 420],
      [260, 420],
    ],
    [
      [100, 420],
      [290, 420],
    ],
  ]);
  await page.waitForFunction((height) => window.terraneViewer.view.height < 0.7 * height, overview.height);
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
  await gesture([
    [
      [120, 420],
      [270, 420],
    ],
    [
      [122, 400],
      [268, 440],
    ],
    [
      [128, 380],
      [262, 460],
    ],
    [
      [138, 360],
      [252, 480],
    ],
  ]);
  await page.waitForFunction(() => {
    const { heading } = window.terraneViewer.view;
    return heading > 8 && heading < 352;
  });
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
});

test("two fingers beside the ground turn and come nearer around the middle of the picture", async () => {
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
  await settled(page);
  const middle = () =>
    page.evaluate(() => {
      const { canvas } = window.terraneViewer;
      return window.terraneViewer.pick(canvas.clientWidth / 2, canvas.clientHeight / 2);
    });
  const before = await middle();
  assert.equal(await page.evaluate(() => window.terraneViewer.pick(195, 160)), null, "no sky");
  const arms = [0, 15, 30, 45, 60].map((degrees) => [Math.cos((degrees * Math.PI) / 180) * 70, Math.sin((degrees * Math.PI) / 180) * 70]);
  await gesture(
    arms.map(([x, y]) => [
      [195 - x, 160 - y],
      [195 + x, 160 + y],
    ]),
  );
  await page.waitForFunction(() => {
    const { heading } = window.terraneViewer.view;
    return heading > 40 && heading < 320;
  });
  const turned = await middle();
  assert.ok(turned !== null && Math.hypot(turned.easting - before.easting, turned.northing - before.northing) < 80, "the ground was lost");
  await gesture(
    [40, 60, 80, 100].map((x) => [
      [195 - x, 160],
      [195 + x, 160],
    ]),
  );
  await page.waitForFunction((distance) => {
    const { terraneViewer: viewer } = window;
    return viewer.pick(viewer.canvas.clientWidth / 2, viewer.canvas.clientHeight / 2).distance < 0.6 * distance;
  }, before.distance);
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
});

test("a panel is a sheet at the bottom; the ground stays above it", async () => {
  const { height } = await page.locator(".ground").boundingBox();
  await page.locator(".toolbar [data-tool=layers]").tap();
  const sheet = await page.locator("#panel-layers").boundingBox();
  assert.ok(isWhole(sheet) && sheet.x === 0 && sheet.width === 390, JSON.stringify(sheet));
  // Its middle stands in the middle of what the sheet leaves, as large as before.
  await page.waitForFunction(
    ([top, height]) => {
      const box = document.querySelector(".ground").getBoundingClientRect();
      return Math.abs(box.top + box.height / 2 - top / 2) < 12 && box.height === height && box.bottom >= top;
    },
    [sheet.y, height],
  );
  await page.locator("#panel-layers .choice", { hasText: "Slope" }).tap();
  assert.equal(await page.evaluate(() => window.terraneViewer.settings.mode), "slope");
  await page.evaluate(() => window.terraneViewer.set({ mode: "shaded" }));
  await page.locator("#panel-layers [aria-label='Close Layers']").tap();
  assert.equal(await page.locator("#panel-layers").count(), 0);
});

test("a sheet is closed by a swipe down, or a tap on its handle", async () => {
  const sheet = page.locator("#panel-layers");
  const open = async () => {
    // note: a tap so soon after another at the same place is a double tap to the browser.
    await page.keyboard.press("l");
    await sheet.waitFor();
    await page.waitForFunction(() => document.querySelector("#panel-layers").getAnimations().length === 0);
    const { y } = await sheet.boundingBox();
    return y;
  };
  const swipe = (y, far) => gesture([0, 0.5, 1].map((share) => [[150, y + 16 + share * far]]));
  await swipe(await open(), 90);
  await sheet.waitFor({ state: "detached" });
  // Not far enough: it stays, where it was.
  const y = await open();
  await swipe(y, 24);
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  assert.equal((await sheet.boundingBox()).y, y);
  await page.touchscreen.tap(195, y + 8);
  await sheet.waitFor({ state: "detached" });
});

test("every tool and panel is reached by touch, and each sheet is whole", async () => {
  const hidden = ["light", "detail", "statistics", "sight", "flights"];
  for (const id of ["layers", "measure", "profile", "lines", ...hidden]) {
    if (hidden.includes(id)) await page.locator(".toolbar [data-tool=more]").tap();
    await page.locator(`${hidden.includes(id) ? ".more-sheet" : ".toolbar"} [data-tool=${id}]`).tap();
    const sheet = page.locator(`#panel-${id}`);
    await sheet.waitFor();
    assert.ok(isWhole(await sheet.boundingBox()), id);
    const overflow = await sheet.evaluate((element) => element.scrollWidth - element.clientWidth);
    assert.ok(overflow <= 0, `${id} is ${overflow} pixels too wide`);
    await sheet.locator(".panel-head button").tap();
  }
});

test("measure by taps, and by the middle of the picture", async () => {
  await lookDown(page);
  await page.locator(".toolbar [data-tool=measure]").tap();
  await settled(page);
  const a = await tapGround(0.3, 0.4);
  const b = await tapGround(0.7, 0.6);
  await page.locator(".row.result", { hasText: "On the map" }).waitFor();
  const flat = Math.hypot(b.easting - a.easting, b.northing - a.northing);
  assert.ok(near(await resultOf(page, "On the map"), flat, 0.02 * flat), `${await resultOf(page, "On the map")} against ${flat}`);
  await page.locator("[data-do=middle]").tap();
  assert.equal(await page.locator(".overlay .mark").count(), 3);
  await page.locator("[data-do=clear]").tap();
  await page.locator("#panel-measure .panel-head button").tap();
});

test("profile by taps; a finger on the plot shows the place", async () => {
  await lookDown(page);
  await page.locator(".toolbar [data-tool=profile]").tap();
  await settled(page);
  const a = await tapGround(0.2, 0.5);
  const b = await tapGround(0.8, 0.5);
  const plot = page.locator(".profile-plot");
  await plot.waitFor();
  const box = await plot.boundingBox();
  assert.ok(isWhole(box));
  await page.touchscreen.tap(box.x + 48 + (box.width - 60) / 2, box.y + 50);
  await page.locator(".mark-hover").waitFor();
  const shown = await text(page, ".profile-summary");
  const along = metersOf(/^([\d\u202f.]+ k?m)/.exec(shown)[1]);
  assert.ok(near(along, Math.hypot(b.easting - a.easting, b.northing - a.northing) / 2, 0.03 * 2 * along), shown);
  await page.locator("#panel-profile .panel-head button").tap();
});

test("lines by taps, ended by a button", async () => {
  await lookDown(page);
  await page.locator(".toolbar [data-tool=lines]").tap();
  await settled(page);
  await tapGround(0.3, 0.3);
  await tapGround(0.6, 0.5);
  await page.locator("[data-do=finish]").tap();
  await page.locator(".line-row").waitFor();
  assert.equal(await page.evaluate(() => window.terraneViewer.lines.size), 1);
  await page.locator(".line-row button[title=Delete]").tap();
  await page.locator("#panel-lines .panel-head button").tap();
});

test("flying is said in the words of fingers", async () => {
  await page.locator("[data-tool=fly]").tap();
  assert.match(await text(page, ".fly-hint"), /two fingers/);
  assert.ok(isWhole(await page.locator(".fly-hint").boundingBox()));
  await page.locator("[data-tool=fly]").tap();
  await page.locator(".fly-hint").waitFor({ state: "hidden" });
});

test("turned on its side, everything still fits", async () => {
  await page.setViewportSize({ width: 844, height: 390 });
  for (const selector of [".title", ".compass", ".readout"])
    assert.ok(isWhole(await page.locator(selector).boundingBox(), 844, 390), selector);
  const readout = await page.locator(".readout").boundingBox();
  for (const tool of [
    "layers",
    "light",
    "detail",
    "statistics",
    "measure",
    "profile",
    "sight",
    "lines",
    "flights",
    "screenshot",
    "link",
    "help",
  ]) {
    const box = await page.locator(`.toolbar [data-tool=${tool}]`).boundingBox();
    assert.ok(isWhole(box, 844, 390), tool);
    assert.ok(box.x + box.width < readout.x || box.y + box.height < readout.y, `${tool} lies under the readout`);
  }
  await page.locator(".toolbar [data-tool=layers]").tap();
  assert.ok(isWhole(await page.locator("#panel-layers").boundingBox(), 844, 390));
  await page.waitForFunction(() => window.terraneViewer.isSettled, null, { timeout: kPatience });
});

test("in a very small window every button is reached, and none lies under another", async () => {
  await page.keyboard.press("Escape");
  for (const [width, height] of [
    [320, 256],
    [568, 320],
  ]) {
    await page.setViewportSize({ width, height });
    const hidden = await page.evaluate(() =>
      [...document.querySelectorAll(".navigation button, .toolbar .is-first")].flatMap((button) => {
        const box = button.getBoundingClientRect();
        return button.contains(document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2)) ? [] : [button.title];
      }),
    );
    assert.deepEqual(hidden, [], `${width} x ${height}`);
    assert.equal(await page.locator(".scale-bar").isVisible(), false);
  }
  await page.setViewportSize({ width: 390, height: 844 });
});

test("nothing went wrong on the way", () => assert.deepEqual(page.errors, []));
