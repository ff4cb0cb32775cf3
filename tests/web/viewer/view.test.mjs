import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import {
  downloaded,
  launch,
  lastToast,
  lookDown,
  makeDataset,
  near,
  newPage,
  openViewer,
  pixelOf,
  placeAt,
  serve,
  settled,
  text,
} from "./harness.mjs";

let server, browser, page;
before(async () => {
  server = await serve(makeDataset());
  browser = await launch();
  page = await newPage(browser);
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

test("the address of terrane serve shows the only dataset: name, CRS, attribution", async () => {
  await openViewer(page, server.url);
  assert.equal(await text(page, ".title h1"), "hills");
  assert.match(await text(page, ".title"), /UTM zone 32N/);
  assert.match(await text(page, ".credits"), /Heights of nobody · Pictures of no place/);
  assert.match(await page.title(), /hills/);
  const picture = await page.evaluate(async () => (await window.terraneViewer.screenshot()).size);
  assert.ok(picture > 20_000, "a picture of ground has many colours");
  assert.deepEqual(page.errors, []);
});

test("the readout tells what the server knows of the ground under the pointer", async () => {
  await lookDown(page);
  const { easting, northing } = await placeAt(page, 0.3, 0.6);
  const at = await pixelOf(page, easting, northing);
  await page.mouse.move(at.x, at.y, { steps: 3 });
  await page.waitForFunction(
    (e) => document.querySelector(".readout-place").textContent.replaceAll("\u202f", "").includes(`E ${e}`),
    String(Math.round((await page.evaluate(({ x, y }) => window.terraneViewer.pick(x, y), at)).easting)),
  );
  const shown = await text(page, ".readout");
  const [, e, n] = /E ([\d\u202f]+)\s+N ([\d\u202f]+)/.exec(shown).map((part) => Number(part.replaceAll("\u202f", "")));
  const height = Number(/([\d\u202f]+\.\d) m/.exec(shown)[1].replaceAll("\u202f", ""));
  const told = await server.ask(`/d/hills/elevation?points=${e},${n}`);
  // The coordinates are shown in whole metres: the ground may slope between.
  assert.ok(near(height, told.heightsMeters[0], 3), `${shown} against ${told.heightsMeters[0]}`);
  assert.match(shown, /± 0\.\d+ m/);
});

test("a click on the readout changes to longitude and latitude", async () => {
  await page.locator(".readout").click();
  await page.waitForFunction(() => /°/.test(document.querySelector(".readout-place").textContent));
  const [, latitude, longitude] = /([\d.]+)° N\s+([\d.]+)° E/.exec(await text(page, ".readout-place"));
  const pick = await page.evaluate(() => {
    const { canvas } = window.terraneViewer;
    return window.terraneViewer.pick(canvas.clientWidth / 2, canvas.clientHeight / 2);
  });
  const told = await server.ask(`/d/hills/elevation?points=${longitude},${latitude}&crs=EPSG:4326`);
  assert.ok(near(told.heightsMeters[0], pick.height, 3));
  await page.locator(".readout").click();
  await page.waitForFunction(() => /^E /.test(document.querySelector(".readout-place").textContent));
});

test("the scale bar is as long on the ground as it says", async () => {
  await lookDown(page);
  const [width, label] = await page.evaluate(() => {
    const bar = document.querySelector(".scale-bar");
    return [bar.clientWidth + 4, bar.textContent];
  });
  const meters = parseFloat(label) * (label.endsWith("km") ? 1000 : 1);
  const across = await page.evaluate((width) => {
    const { terraneViewer: viewer } = window;
    const [x, y] = [viewer.canvas.clientWidth / 2, viewer.canvas.clientHeight / 2];
    const [a, b] = [viewer.pick(x - width / 2, y), viewer.pick(x + width / 2, y)];
    return b.easting - a.easting;
  }, width);
  assert.ok(near(across, meters, 0.06 * meters), `${label} is ${across} m`);
});

test("the compass shows the heading; a click turns north up; a drag turns around the middle", async () => {
  await page.evaluate(() => window.terraneViewer.setView({ ...window.terraneViewer.overview(), heading: 0 }));
  await settled(page);
  const middle = () =>
    page.evaluate(() =>
      window.terraneViewer.pick(window.terraneViewer.canvas.clientWidth / 2, window.terraneViewer.canvas.clientHeight / 2),
    );
  const before = await middle();
  const box = await page.locator(".compass").boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x - 60, y, { steps: 4 });
  await page.mouse.up();
  const heading = await page.evaluate(() => window.terraneViewer.view.heading);
  assert.ok(near(heading, 36, 1), `60 pixels of drag turn 36 degrees, not ${heading}`);
  assert.match(await page.locator(".compass").getAttribute("aria-label"), /Heading 36 degrees, north-east/);
  const after = await middle();
  assert.ok(Math.hypot(after.easting - before.easting, after.northing - before.northing) < 60, "what was in the middle stays there");
  await page.locator(".compass").click();
  await page.waitForFunction(() => window.terraneViewer.view.heading === 0);
});

test("a drag of the compass up and down tilts", async () => {
  const before = await page.evaluate(() => window.terraneViewer.view.pitch);
  const box = await page.locator(".compass").boundingBox();
  await page.mouse.move(box.x + 36, box.y + 36);
  await page.mouse.down();
  await page.mouse.move(box.x + 36, box.y + 66, { steps: 4 });
  await page.mouse.up();
  assert.ok(near(await page.evaluate(() => window.terraneViewer.view.pitch), before - 10.8, 0.5));
});

test("zoom buttons come nearer and go away; the overview comes back", async () => {
  const height = () => page.evaluate(() => window.terraneViewer.view.height);
  const overview = await page.evaluate(() => window.terraneViewer.overview().height);
  await page.locator("[data-tool=home]").click();
  await page.waitForFunction((height) => window.terraneViewer.view.height === height, overview);
  await page.locator("[data-tool=zoom-in]").click();
  await page.waitForFunction((height) => window.terraneViewer.view.height < 0.75 * height, overview);
  const near = await height();
  await page.locator("[data-tool=zoom-out]").click();
  await page.waitForFunction((height) => window.terraneViewer.view.height > 1.2 * height, near);
  await page.keyboard.press("h");
  await page.waitForFunction((height) => window.terraneViewer.view.height === height, overview);
});

test("whoever goes away stops where all of the ground is still to be seen, and comes back", async () => {
  const share = () =>
    page.evaluate(() => {
      const { terraneViewer: viewer } = window;
      const { bounds, minHeight, maxHeight } = viewer.dataset;
      const [width, length, high] = [bounds.east - bounds.west, bounds.north - bounds.south, maxHeight - minHeight];
      const { easting, northing, height } = viewer.view;
      const away = [easting - bounds.west - width / 2, northing - bounds.south - length / 2, height - minHeight - high / 2];
      return Math.hypot(...away) / Math.hypot(width, length, high);
    });
  const { width, height } = page.viewportSize();
  await page.mouse.move(width / 2, height / 2);
  for (let i = 0; i < 40; ++i) await page.mouse.wheel(0, 400);
  await page.waitForFunction(() => window.terraneViewer.view.height > 3e4);
  await page.evaluate(() => new Promise((done) => setTimeout(done, 1000)));
  const far = await share();
  assert.ok(far > 8 && far <= 10.001, `${far} diagonals away`);
  await page.locator("[data-tool=zoom-out]").click();
  await page.evaluate(() => new Promise((done) => setTimeout(done, 600)));
  assert.ok((await share()) <= 10.001, "the button goes further");
  await page.mouse.move(width / 2, height / 2);
  for (let i = 0; i < 3; ++i) await page.mouse.wheel(0, -400);
  await page.evaluate(() => new Promise((done) => setTimeout(done, 1000)));
  assert.ok((await share()) < 0.5 * far, "it does not come back");
});

test("a turn that begins in the sky goes around the middle of the picture", async () => {
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
  await settled(page);
  const { width, height } = page.viewportSize();
  const middle = () => page.evaluate(([x, y]) => window.terraneViewer.pick(x, y), [width / 2, height / 2]);
  const before = await middle();
  assert.equal(await page.evaluate((x) => window.terraneViewer.pick(x, 20), width / 2), null, "no sky");
  await page.mouse.move(width / 2, 20);
  await page.mouse.down({ button: "right" });
  await page.mouse.move(width / 2 + 200, 20, { steps: 5 });
  await page.mouse.up({ button: "right" });
  assert.ok(near(await page.evaluate(() => window.terraneViewer.view.heading), 60, 1));
  const after = await middle();
  assert.ok(Math.hypot(after.easting - before.easting, after.northing - before.northing) < 60, "what was in the middle has gone");
  // Where no ground is in the picture, around the nearest: it comes back.
  await page.evaluate(() => {
    const { terraneViewer: viewer } = window;
    const { east, west, south, north } = viewer.dataset.bounds;
    viewer.setView({ easting: west, northing: south - (north - south), height: viewer.dataset.maxHeight, heading: 180, pitch: 0, fov: 45 });
    window.farFromCorner = () => Math.hypot(viewer.view.easting - west, viewer.view.northing - south) / (east - west);
  });
  assert.equal(await middle(), null);
  const far = await page.evaluate(() => window.farFromCorner());
  await page.mouse.move(150, 300);
  await page.mouse.down({ button: "right" });
  await page.mouse.move(750, 300, { steps: 5 });
  await page.mouse.up({ button: "right" });
  assert.ok(near(await page.evaluate(() => window.terraneViewer.view.heading), 0, 1));
  assert.ok(near(await page.evaluate(() => window.farFromCorner()), far, 0.02 * far), "it turned around something else");
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
  await settled(page);
});

test("keys turn north up and look straight down", async () => {
  await page.evaluate(() => window.terraneViewer.setView({ heading: 120 }));
  await page.keyboard.press("n");
  await page.waitForFunction(() => window.terraneViewer.view.heading === 0);
  await page.keyboard.press("j");
  await page.waitForFunction(() => window.terraneViewer.view.pitch < -89);
  await page.keyboard.press("j");
  await page.waitForFunction(() => window.terraneViewer.view.pitch > -40);
});

test("the address follows the view without a new entry in the history, and brings it back", async () => {
  const entries = await page.evaluate(() => history.length);
  await page.evaluate(() => {
    const { west, south } = window.terraneViewer.dataset.bounds;
    window.terraneViewer.setView({ easting: west + 1000, northing: south + 500, height: 3210.5, heading: 31.25, pitch: -22.5, fov: 50 });
    window.terraneViewer.set({ mode: "slope", exaggeration: 2, haze: false });
    window.terraneViewer.setLayer("pictures", false);
  });
  await page.waitForFunction(() => /,3210\.5,31\.25,-22\.5,50&/.test(location.hash));
  assert.equal(await page.evaluate(() => history.length), entries);
  const link = page.url();
  assert.match(link, /mode=slope/);
  const other = await newPage(browser);
  await openViewer(other, link);
  const [view, settings, layers] = await other.evaluate(() => [
    window.terraneViewer.view,
    window.terraneViewer.settings,
    window.terraneViewer.layers,
  ]);
  assert.ok(
    near(view.height, 3210.5, 0.06) && near(view.heading, 31.25, 0.01) && near(view.pitch, -22.5, 0.01) && view.fov === 50,
    JSON.stringify(view),
  );
  assert.equal(settings.mode, "slope");
  assert.equal(settings.exaggeration, 2);
  assert.equal(settings.haze, false);
  assert.equal(layers[0].visible, false);
  // A changed address moves the page that is open.
  await other.evaluate(() => (location.hash = location.hash.replace("31.25", "200").replace("mode=slope", "mode=height")));
  await other.waitForFunction(
    () => Math.abs(window.terraneViewer.view.heading - 200) < 0.01 && window.terraneViewer.settings.mode === "height",
  );
  await other.context().close();
});

test("a link from near the ground brings back the picture to a tenth of a pixel", async () => {
  const place = await placeAt(page, 0.437, 0.521);
  const ahead = await page.evaluate(({ easting, northing }) => {
    const { terraneViewer: viewer } = window;
    viewer.set({ exaggeration: 1 });
    const height = viewer.elevationAt(easting, northing) + 3;
    viewer.setView({ easting: easting + 0.0473, northing: northing - 0.0391, height, heading: 31.23457, pitch: -21.98765, fov: 47.12346 });
    return { easting: easting + 4, northing: northing + 6, height: height - 3 };
  }, place);
  await settled(page);
  await page.keyboard.press("k");
  const pixel = (from) => from.evaluate((ahead) => window.terraneViewer.project(ahead), ahead);
  const other = await newPage(browser);
  await openViewer(other, page.url());
  const [a, b] = [await pixel(page), await pixel(other)];
  assert.ok(Math.hypot(a.x - b.x, a.y - b.y) < 0.1, `${JSON.stringify(a)} against ${JSON.stringify(b)}`);
  await other.context().close();
});

test("while the camera moves the address waits, and says where it came to rest", async () => {
  await page.evaluate(() => {
    window.writes = 0;
    const { replaceState } = history;
    history.replaceState = (...rest) => {
      ++window.writes;
      replaceState.apply(history, rest);
    };
    return window.terraneViewer.flyTo(window.terraneViewer.overview(), { seconds: 2.5 });
  });
  // note: a frame that takes half a second looks like a rest.
  assert.ok((await page.evaluate(() => window.writes)) <= 3, "the address changes while the camera moves");
  await page.waitForFunction(() => location.hash.startsWith(`#${Number(window.terraneViewer.view.easting.toFixed(1))},`));
});

test("an exaggeration that no slider has comes to the end of the slider", async () => {
  const other = await newPage(browser);
  await openViewer(other, `${server.url}#&exaggeration=1e9&tau=1e-9`);
  const { exaggeration, tau } = await other.evaluate(() => window.terraneViewer.settings);
  assert.deepEqual([exaggeration, tau], [8, 0.25]);
  await other.context().close();
});

test("an address that makes no sense shows the overview", async () => {
  const other = await newPage(browser);
  await openViewer(other, `${server.url}#NaN,1e999,,&mode=weird&exaggeration=-3&layers=%E0%A4%A&tau=&&&=`);
  const [view, settings, overview] = await other.evaluate(() => [
    window.terraneViewer.view,
    window.terraneViewer.settings,
    window.terraneViewer.overview(),
  ]);
  assert.ok(near(view.easting, overview.easting, 1) && near(view.height, overview.height, 1));
  assert.equal(settings.mode, "shaded");
  assert.equal(settings.exaggeration, 1);
  assert.deepEqual(other.errors, []);
  await other.context().close();
});

test("a link is copied", async () => {
  await page.keyboard.press("k");
  await lastToast(page, "copied");
  assert.equal(await page.evaluate(() => navigator.clipboard.readText()), page.url());
});

test("a browser that does not let the page copy is given the link to copy by hand", async () => {
  await page.evaluate(() => {
    navigator.clipboard.writeText = () => Promise.reject(new Error("not allowed"));
  });
  await page.keyboard.press("k");
  const field = page.locator(".link-dialog input");
  await field.waitFor();
  assert.equal(await field.inputValue(), page.url());
  await page.keyboard.press("Escape");
  await field.waitFor({ state: "detached" });
});

test("the picture is saved as PNG with the canvas's pixels", async () => {
  await page.evaluate(() => window.terraneViewer.set({ mode: "shaded" }));
  const { name, bytes } = await downloaded(page, () => page.keyboard.press("x"));
  assert.match(name, /^hills-\d+-\d+\.png$/);
  assert.equal(bytes.subarray(1, 4).toString(), "PNG");
  assert.equal(bytes.readUInt32BE(16), await page.evaluate(() => window.terraneViewer.canvas.width));
  assert.ok(bytes.length > 20_000);
});

test("the help sheet lists every tool, and Escape closes it", async () => {
  await page.keyboard.press("?");
  const sheet = page.locator("dialog.help");
  await sheet.waitFor();
  const words = await sheet.innerText();
  for (const each of [
    "Layers",
    "Sun and relief",
    "Detail",
    "Statistics",
    "Measure",
    "Profile",
    "Line of sight",
    "Lines",
    "Flights",
    "Save the picture",
    "Copy a link",
    "Fly",
  ])
    assert.ok(words.includes(each), each);
  await page.keyboard.press("Escape");
  await sheet.waitFor({ state: "hidden" });
});

test("everything on the page can be reached and named without a pointer", async () => {
  await page.locator(".ground").focus();
  const seen = new Set();
  for (let i = 0; i < 40; ++i) {
    await page.keyboard.press("Tab");
    const [name, hasRing] = await page.evaluate(() => {
      const { activeElement: element } = document;
      return [element.getAttribute("aria-label") ?? element.textContent, getComputedStyle(element).outlineStyle !== "none"];
    });
    assert.ok(name.trim() !== "", "a control without a name");
    // Once around: the page itself, then the ground again.
    if (name.includes("needs JavaScript") || name.startsWith("Terrain of")) break;
    assert.ok(hasRing, `no focus ring on “${name}”`);
    seen.add(name);
  }
  for (const tool of ["Layers", "Measure", "Profile", "Line of sight", "Lines", "Flights", "Fly", "Nearer"])
    assert.ok(
      [...seen].some((name) => name.includes(tool)),
      `${tool} is not reached`,
    );
  // With Enter a panel opens and Tab goes on in it; Escape gives the focus back.
  await page.locator("[data-tool=layers]").first().focus();
  await page.keyboard.press("Enter");
  await page.locator("#panel-layers").waitFor();
  assert.equal(await page.evaluate(() => document.activeElement.id), "panel-layers");
  await page.keyboard.press("Escape");
  assert.equal(await page.evaluate(() => document.activeElement.dataset.tool), "layers");
});

test("what a pointer presses leaves the keys to the map; what Tab goes to uses its own and passes on the rest", async () => {
  await page.evaluate(() => window.terraneViewer.setView(window.terraneViewer.overview()));
  await settled(page);
  const northing = () => page.evaluate(() => window.terraneViewer.view.northing);
  const moves = async (what) => {
    const before = await northing();
    await page.keyboard.down("w");
    await page.waitForFunction((before) => window.terraneViewer.view.northing > before + 20, before, { timeout: 10_000 }).catch(() => {
      throw new Error(`W does not move the map after ${what}`);
    });
    await page.keyboard.up("w");
    const rested = await northing();
    await page.evaluate(() => new Promise((done) => setTimeout(done, 100)));
    assert.equal(await northing(), rested, `W stays down after ${what}`);
  };
  await page.locator("[data-tool=measure]").first().click();
  await moves("a click on a tool");
  await page.keyboard.press("Space");
  await page.locator(".overlay .mark").first().waitFor();
  assert.equal(await page.locator("#panel-measure").count(), 1, "Space closed the tool");
  await page.locator("#panel-measure .panel-head button").click();
  await moves("a click on a panel's close button");
  await page.locator("[data-tool=layers]").first().click();
  await page.locator("#panel-layers .choice", { hasText: "Slope" }).click();
  await moves("a choice");
  await page.locator("#panel-layers .choice", { hasText: "Natural" }).click();
  await page.keyboard.press("Escape");
  // With the keyboard: W is not the button's, Space is.
  await page.locator("[data-tool=measure]").first().focus();
  await moves("Tab to a tool");
  await page.keyboard.press("Space");
  await page.locator("#panel-measure").waitFor();
  await page.keyboard.press("Escape");
  // Sliders keep the arrows alone, fields of text all keys.
  await page.keyboard.press("u");
  const slider = page.getByLabel("Height above the horizon");
  await slider.focus();
  const before = await northing();
  await page.keyboard.press("ArrowUp");
  assert.equal(await page.evaluate(() => window.terraneViewer.settings.sunAltitude), 39);
  assert.equal(await northing(), before);
  await moves("a slider");
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Escape");
});

test("fly mode says its keys, moves with them, and Escape ends it", async () => {
  await page.keyboard.press("h");
  await settled(page);
  await page.keyboard.press("g");
  await page.locator(".fly-hint").waitFor();
  assert.match(await text(page, ".fly-hint"), /W A S D/);
  assert.equal(await page.evaluate(() => window.terraneViewer.controls), "fly");
  const before = await page.evaluate(() => window.terraneViewer.view.northing);
  await page.keyboard.down("w");
  await page.waitForFunction((before) => window.terraneViewer.view.northing > before + 50, before);
  await page.keyboard.up("w");
  await page.keyboard.press("Escape");
  await page.locator(".fly-hint").waitFor({ state: "hidden" });
  assert.equal(await page.evaluate(() => window.terraneViewer.controls), "map");
});

test("nothing went wrong on the way", () => assert.deepEqual(page.errors, []));
