import assert from "node:assert/strict";
import { after, before, beforeEach, test } from "node:test";
import {
  clickGround,
  downloaded,
  dropFiles,
  kPatience,
  lastToast,
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
  transform,
} from "./harness.mjs";

let server, browser, page;
before(async () => {
  server = await serve(makeDataset());
  browser = await launch();
  page = await newPage(browser);
  await openViewer(page, server.url);
  await lookDown(page);
});
after(async () => {
  await browser?.close();
  await server?.stop();
});
beforeEach(async () => {
  await page.evaluate(() => window.terraneApp.panels.close());
  await page.locator(".ground").focus();
});

const pair = (place) => `${place.easting},${place.northing}`;
const lineIds = () => page.evaluate(() => [...window.terraneViewer.lines.keys()]);

test("measure: distances, height difference and area agree with the server's ground", async () => {
  await page.keyboard.press("m");
  await page.locator("#panel-measure").waitFor();
  // The panel covers the west.
  const a = await clickGround(page, 0.62, 0.3);
  const b = await clickGround(page, 0.9, 0.35);
  await page.locator(".row.result", { hasText: "Over the ground" }).waitFor();
  const flat = Math.hypot(b.easting - a.easting, b.northing - a.northing);
  const told = await server.ask(`/d/hills/profile?points=${pair(a)};${pair(b)}&samples=257`);
  const { heightsMeters: heights } = told;
  const step = flat / 256;
  const over = heights.slice(1).reduce((sum, height, i) => sum + Math.hypot(step, height - heights[i]), 0);
  const climb = heights.at(-1) - heights[0];
  assert.ok(near(await resultOf(page, "On the map"), flat, 0.004 * flat));
  assert.ok(near(await resultOf(page, "Straight"), Math.hypot(flat, climb), 0.004 * flat));
  assert.ok(
    near(await resultOf(page, "Over the ground"), over, 0.006 * over),
    `${await resultOf(page, "Over the ground")} against ${over}`,
  );
  assert.ok(near(await resultOf(page, "Height difference"), climb, 0.3), `${await resultOf(page, "Height difference")} against ${climb}`);
  assert.deepEqual(await lineIds(), ["measure"]);

  await page.locator("#panel-measure .switch", { hasText: "Area" }).click();
  const c = await clickGround(page, 0.75, 0.7);
  await page.locator(".row.result", { hasText: "Area" }).waitFor();
  const area = Math.abs((b.easting - a.easting) * (c.northing - a.northing) - (c.easting - a.easting) * (b.northing - a.northing)) / 2;
  assert.ok(near(await resultOf(page, "Area"), area, 0.01 * area));
  assert.deepEqual((await lineIds()).sort(), ["measure", "measure/closing"]);
});

test("measure: Backspace takes a point back, Enter ends, a click begins anew, Escape leaves nothing", async () => {
  await page.keyboard.press("m");
  const marks = () => page.locator(".overlay .mark").count();
  await clickGround(page, 0.62, 0.3);
  await clickGround(page, 0.8, 0.5);
  await clickGround(page, 0.7, 0.8);
  assert.equal(await marks(), 3);
  await page.keyboard.press("Backspace");
  assert.equal(await marks(), 2);
  await page.keyboard.press("Enter");
  await clickGround(page, 0.65, 0.65);
  assert.equal(await marks(), 1, "a new measurement begins");
  await page.keyboard.press("Escape");
  assert.equal(await page.locator("#panel-measure").count(), 0);
  assert.equal(await marks(), 0);
  assert.deepEqual(await lineIds(), []);
});

test("measure: the band to the pointer begins at the point that was added last", async () => {
  await page.keyboard.press("m");
  const places = [await placeAt(page, 0.62, 0.3), await placeAt(page, 0.85, 0.6)];
  for (const place of places) {
    const at = await pixelOf(page, place.easting, place.northing);
    await page.mouse.move(at.x, at.y);
    await page.mouse.click(at.x, at.y);
    // The pointer has not moved since.
    await page.waitForFunction(([x, y]) => {
      const band = document.querySelector(".band");
      return Math.hypot(Number(band.getAttribute("x1")) - x, Number(band.getAttribute("y1")) - y) < 3;
    }, [at.x, at.y]);
  }
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelector(".band").getAttribute("visibility") === "hidden");
});

test("measure: with keys alone, Space adds the middle of the picture", async () => {
  await page.keyboard.press("m");
  await page.keyboard.press("Space");
  assert.equal(await page.locator(".overlay .mark").count(), 1);
  await page.evaluate(() => window.terraneViewer.setView({ easting: window.terraneViewer.view.easting + 700 }));
  await page.keyboard.press("Space");
  assert.ok(near(await resultOf(page, "On the map"), 700, 25));
  await page.locator("#panel-measure [data-do=clear]").click();
  assert.equal(await page.locator(".overlay .mark").count(), 0);
  await lookDown(page);
});

test("a drag moves the map and adds no point; beside the ground a click says so", async () => {
  await page.keyboard.press("m");
  const at = await page.evaluate(() => ({
    x: window.terraneViewer.canvas.clientWidth * 0.6,
    y: window.terraneViewer.canvas.clientHeight * 0.5,
  }));
  const before = await page.evaluate(() => window.terraneViewer.view.easting);
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x + 80, at.y, { steps: 5 });
  await page.mouse.up();
  await page.waitForFunction((before) => window.terraneViewer.view.easting < before, before);
  assert.equal(await page.locator(".overlay .mark").count(), 0);
  await page.evaluate(() => window.terraneViewer.setView({ height: window.terraneViewer.view.height * 3 }));
  await page.mouse.click(880, 620);
  await lastToast(page, "no ground under that point");
  await lookDown(page);
});

test("profile: the plot has the server's heights, and pointing at it shows the place on the ground", async () => {
  await page.keyboard.press("p");
  await page.locator("#panel-profile").waitFor();
  // The panel covers the south.
  const a = await clickGround(page, 0.15, 0.75);
  const b = await clickGround(page, 0.85, 0.85);
  await page.locator(".profile-plot").waitFor();
  const told = await server.ask(`/d/hills/profile?points=${pair(a)};${pair(b)}&samples=512`);
  const summary = await text(page, ".profile-summary");
  const [, low, high] = /· ([\d\u202f]+) to ([\d\u202f]+) m ·/.exec(summary).map((part) => Number(part.replaceAll("\u202f", "")));
  assert.ok(near(low, Math.min(...told.heightsMeters), 1) && near(high, Math.max(...told.heightsMeters), 1), summary);

  const box = await page.locator(".profile-plot").boundingBox();
  // Three quarters along the plot's axis.
  await page.mouse.move(box.x + 48 + (box.width - 60) * 0.75, box.y + 60);
  await page.locator(".mark-hover").waitFor();
  const hovered = await text(page, ".profile-summary");
  const [, e, n] = /E ([\d\u202f]+) N ([\d\u202f]+)/.exec(hovered).map((part) => Number(part.replaceAll("\u202f", "")));
  assert.ok(near(e, a.easting + 0.75 * (b.easting - a.easting), 15) && near(n, a.northing + 0.75 * (b.northing - a.northing), 15), hovered);
  const at = await pixelOf(page, e, n);
  const mark = await page.locator(".mark-hover").getAttribute("transform");
  const [, x, y] = /translate\(([\d.]+) ([\d.]+)\)/.exec(mark).map(Number);
  assert.ok(near(x, at.x, 2) && near(y, at.y, 2), "the mark lies where the plot says");
  const height = metersOf(/: ([\d\u202f.]+ m)/.exec(hovered)[1]);
  const asked = await server.ask(`/d/hills/elevation?points=${e},${n}`);
  assert.ok(near(height, asked.heightsMeters[0], 3));
});

test("marks behind a hill are faint, those before it are not", async () => {
  await page.keyboard.press("p");
  // The panel covers the south.
  const places = [];
  for (const x of [0.2, 0.4, 0.6, 0.8]) for (const y of [0.7, 0.8, 0.9]) places.push(await clickGround(page, x, y));
  const stand = await placeAt(page, 0.1, 0.1);
  await page.evaluate(({ easting, northing }) => {
    const { terraneViewer: viewer } = window;
    viewer.setView({ easting, northing, height: viewer.elevationAt(easting, northing) + 900, heading: 45, pitch: -5, fov: 80 });
  }, stand);
  await settled(page);
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  // From the eye to half a metre above each.
  const to = places.map(pair).join(";");
  const told = await server.ask(`/d/hills/line-of-sight?from=${pair(stand)}&to=${to}&eye=900&target=0.5`);
  const marks = await page.evaluate(() =>
    [...document.querySelectorAll(".mark")].map((mark) => ({ isBehind: mark.classList.contains("is-behind"), isShown: mark.getAttribute("visibility") === "visible" })),
  );
  assert.equal(marks.length, places.length);
  let faint = 0;
  marks.forEach(({ isBehind, isShown }, i) => {
    if (!isShown) return;
    faint += isBehind ? 1 : 0;
    assert.ok(!(isBehind && told.results[i].visible && told.results[i].certain), `${i} is seen: ${JSON.stringify(told.results[i])}`);
  });
  const hidden = told.results.filter((result) => !result.visible).length;
  assert.ok(hidden > 1 && hidden < places.length && faint > 0 && faint <= hidden, `${faint} of ${marks.length} are faint, ${hidden} hidden`);
  await page.keyboard.press("Escape");
  await lookDown(page);
});

test("measure: what it tells becomes as exact as the dataset, though the picture needs less", async () => {
  const wide = await serve(makeDataset("wide", { imagery: false, size: 2049 }));
  const other = await newPage(browser);
  try {
    await openViewer(other, wide.url);
    await other.keyboard.press("m");
    await other.locator("#panel-measure").waitFor();
    await clickGround(other, 0.62, 0.4);
    await clickGround(other, 0.8, 0.5);
    await other.waitForFunction(() => /Heights exact|Heights ± 0(\.\d+)? m|Heights ± 1(\.0+)? m/.test(document.querySelector("#panel-measure").textContent), null, { timeout: 60000 });
    const { errors, bound } = await other.evaluate(() => ({
      bound: window.terraneViewer.dataset.maxErrorMeters,
      errors: window.terraneViewer.profile(window.terraneViewer.lines.get("measure").points, 200).map((point) => point.error),
    }));
    assert.ok(Math.max(...errors) <= bound + 0.01, `${Math.max(...errors)} against ${bound}`);
  } finally {
    await other.context().close();
    await wide.stop();
  }
});

test("measure and profile: a long line's climb and length over the ground leave nothing out, and agree", async () => {
  const wide = await serve(makeDataset("wide", { imagery: false, size: 2049 }));
  const other = await newPage(browser);
  try {
    await openViewer(other, wide.url);
    await lookDown(other);
    await other.keyboard.press("m");
    await other.locator("#panel-measure").waitFor();
    await clickGround(other, 0.45, 0.05);
    await clickGround(other, 0.95, 0.95);
    const corners = await other.evaluate(() => window.terraneViewer.lines.get("measure").points);
    const { heightsMeters: heights } = await wide.ask(`/d/wide/profile?points=${corners.map(pair).join(";")}&samples=20000`);
    const step = Math.hypot(corners[1].easting - corners[0].easting, corners[1].northing - corners[0].northing) / (heights.length - 1);
    const all = { up: 0, down: 0, over: 0 };
    heights.slice(1).forEach((height, i) => {
      const rise = height - heights[i];
      all[rise > 0 ? "up" : "down"] += Math.abs(rise);
      all.over += Math.hypot(step, rise);
    });
    const isLike = (shown, told) => near(shown, told, Math.max(0.03 * told, 1.5));
    const numbersIn = (words) => words.match(/[\d\u202f.]+/g).map((number) => Number(number.replaceAll("\u202f", "")));

    const climb = other.locator("#panel-measure .row.result", { hasText: "Up, down" }).locator("strong");
    await other.waitForFunction(() => !document.querySelector("#panel-measure").textContent.includes("for now"), null, { timeout: 60000 });
    await settled(other);
    const measured = numbersIn(await climb.innerText());
    assert.ok(isLike(measured[0], all.up) && isLike(measured[1], all.down), `${measured} against ${JSON.stringify(all)}`);
    assert.ok(near(await resultOf(other, "Over the ground"), all.over, 0.01 * all.over));

    await other.evaluate((corners) => window.terraneApp.lines.add("Long", [corners]), corners);
    await other.keyboard.press("b");
    await other.locator(".line-row button[title=Profile]").click();
    await other.locator(".profile-plot").waitFor();
    await other.waitForFunction(() => !document.querySelector(".profile-summary").textContent.includes("for now"), null, { timeout: 60000 });
    const [, up, down] = /· ([\d\u202f]+) m up, ([\d\u202f]+) m down/.exec(await text(other, ".profile-summary")).map((part) => numbersIn(part)[0]);
    assert.deepEqual([up, down], measured);

    // As if the ground were so fine that not all of it can be asked for.
    await other.evaluate(() => (window.terraneViewer.dataset.spacingMeters /= 1000));
    await other.evaluate(() => window.terraneApp.panels.close());
    await other.keyboard.press("b");
    await other.locator(".line-row button[title=Profile]").click();
    await other.locator(".profile-summary", { hasText: "where the ground has one every" }).waitFor();
    const [, apart] = /a height every ([\d.]+ m), where/.exec(await text(other, ".profile-summary"));
    assert.ok(near(metersOf(apart), (step * (heights.length - 1)) / 20000, 0.06), apart);
    assert.deepEqual(other.errors, []);
  } finally {
    await other.context().close();
    await wide.stop();
  }
});

test("profile: of a line in parts all are shown, one after the other", async () => {
  const parts = [];
  for (const ends of [
    [
      [0.1, 0.7],
      [0.3, 0.8],
    ],
    [
      [0.5, 0.9],
      [0.9, 0.7],
    ],
  ])
    parts.push([await placeAt(page, ...ends[0]), await placeAt(page, ...ends[1])]);
  await page.evaluate((parts) => window.terraneApp.lines.add("Twice", parts), parts);
  await page.keyboard.press("b");
  await page.locator(".line-row button[title=Profile]").click();
  await page.locator(".profile-plot").waitFor();
  const summary = await text(page, ".profile-summary");
  assert.match(summary, /2 parts, one after the other/);
  const length = parts.reduce((sum, [a, b]) => sum + Math.hypot(b.easting - a.easting, b.northing - a.northing), 0);
  assert.ok(near(metersOf(summary), length, 0.004 * length), `${summary}: ${length}`);
  const up = [];
  for (const part of parts) {
    const { heightsMeters: heights } = await server.ask(`/d/hills/profile?points=${part.map(pair).join(";")}&samples=2000`);
    up.push(heights.slice(1).reduce((sum, height, i) => sum + Math.max(0, height - heights[i]), 0));
  }
  const told = Number(/([\d\u202f]+) m up/.exec(summary)[1].replaceAll("\u202f", ""));
  assert.ok(near(told, up[0] + up[1], 0.03 * told + 1.5), `${told} against ${up}`);
  // As a table, too.
  const { name, bytes } = await downloaded(page, () => page.locator("#panel-profile [data-do=save]").click());
  assert.equal(name, "hills-profile.csv");
  const [head, ...rows] = bytes.toString().trim().split("\r\n");
  assert.equal(head, "part,distance_m,height_m,error_m,easting,northing");
  assert.ok(rows.length >= 512, `${rows.length} rows`);
  for (const part of [1, 2]) {
    const own = rows.map((row) => row.split(",").map(Number)).filter((row) => row[0] === part);
    for (const [row, place] of [
      [own[0], parts[part - 1][0]],
      [own.at(-1), parts[part - 1][1]],
    ]) {
      assert.ok(Math.hypot(row[4] - place.easting, row[5] - place.northing) < 0.01, `${row}`);
      const { heightsMeters } = await server.ask(`/d/hills/elevation?points=${pair(place)}`);
      assert.ok(near(row[2], heightsMeters[0], Math.max(row[3], 0.1)), `${row} against ${heightsMeters}`);
    }
  }
  // The end of the plot is the end of the last part.
  await page.locator(".profile-plot").focus();
  await page.keyboard.press("PageUp");
  for (let i = 0; i < 3; ++i) await page.keyboard.press("Shift+PageDown");
  assert.match(await text(page, ".profile-summary"), new RegExp(`E ${String(Math.round(parts[1][1].easting)).slice(0, 3)}`));
  await page.keyboard.press("Escape");
  assert.ok((await lineIds()).every((id) => id.startsWith("line-")), "the profile's own lines are gone");
  await removeAll();
});

test("profile: arrow keys move along it", async () => {
  await page.keyboard.press("p");
  await clickGround(page, 0.2, 0.8);
  await clickGround(page, 0.8, 0.8);
  await page.locator(".profile-plot").focus();
  for (let i = 0; i < 3; ++i) await page.keyboard.press("ArrowRight");
  assert.match(await text(page, ".profile-summary"), /^\d+\.\d m: /);
  assert.equal(await page.locator(".mark-hover").count(), 1);
});

test("line of sight: seen and hidden as the server has it, with where the ground hides it", async () => {
  await page.keyboard.press("v");
  await page.locator("#panel-sight").waitFor();
  // A target that stands out of the ground: else the line ends with no clearance, and is never certain.
  await page.locator("[data-above=target]").fill("30");
  let [seen, hidden] = [0, 0];
  // Several pairs, so that both answers come.
  for (const [from, to] of [
    [
      [0.62, 0.2],
      [0.95, 0.8],
    ],
    [
      [0.6, 0.8],
      [0.64, 0.79],
    ],
    [
      [0.7, 0.5],
      [0.95, 0.5],
    ],
    [
      [0.8, 0.2],
      [0.84, 0.23],
    ],
    [
      [0.7, 0.6],
      [0.75, 0.6],
    ],
    [
      [0.65, 0.9],
      [0.9, 0.1],
    ],
  ]) {
    const a = await clickGround(page, ...from);
    const b = await clickGround(page, ...to);
    await page.locator(".verdict").waitFor();
    const told = await server.ask(`/d/hills/line-of-sight?from=${pair(a)}&to=${pair(b)}&eye=1.7&target=30&curvature=true&refraction=0.13`);
    const [result] = told.results;
    if (!result.certain) continue;
    const verdict = await text(page, ".verdict");
    assert.match(verdict, result.visible ? /is seen/ : /is hidden/, JSON.stringify(result));
    const lines = await page.evaluate(() => Object.fromEntries([...window.terraneViewer.lines].map(([id, line]) => [id, line.color])));
    assert.equal(lines["sight/free"], "#3ddc97");
    assert.equal(lines["sight/blocked"], result.visible ? undefined : "#ff5a3c");
    assert.ok(
      near(await resultOf(page, "Clearance"), result.clearanceMeters, 1),
      `${await resultOf(page, "Clearance")} against ${result.clearanceMeters}`,
    );
    if (result.visible) ++seen;
    else {
      ++hidden;
      const blocked = Math.hypot(result.blockedBy.point[0] - a.easting, result.blockedBy.point[1] - a.northing);
      assert.ok(near(await resultOf(page, "Hidden after"), blocked, 25));
      assert.equal(await page.locator(".mark-blocked").count(), 1);
    }
  }
  assert.ok(seen > 0 && hidden > 0, `${seen} seen, ${hidden} hidden`);
  // A tower at the target comes in sight.
  const input = page.locator("[data-above=target]");
  await input.fill("9000");
  await page.locator(".verdict.is-good").waitFor();
  // Over a flat earth the line keeps clear of the ground by more.
  const [from, to] = await page.evaluate(() => window.terraneViewer.lines.get("sight/free").points);
  const clearances = await page.evaluate(
    ([from, to]) =>
      [{}, { refraction: 0 }, { curvature: false }, { length: 0 }, { length: 1e5 }].map(
        (way) => window.terraneViewer.lineOfSight(from, to, way).clearance,
      ),
    [from, { ...to, above: 30 }],
  );
  assert.ok(clearances[1] <= clearances[0] && clearances[0] < clearances[2], clearances.join());
  // What counts is how far apart the two are on the ground.
  assert.equal(clearances[3], clearances[2]);
  assert.ok(clearances[4] < clearances[1] - 50, clearances.join());
  await page.getByLabel("Round earth").uncheck();
  await page.getByText("As if the earth were flat").waitFor();
  await page.keyboard.press("Escape");
  assert.deepEqual(await lineIds(), []);
});

test("line of sight: a height that cannot be is marked, and what is used in its place is said", async () => {
  await page.keyboard.press("v");
  await clickGround(page, 0.62, 0.2);
  await clickGround(page, 0.95, 0.8);
  await page.locator(".verdict").waitFor();
  const field = page.locator("[data-above=eye]");
  const problem = page.locator("#sight-eye-problem");
  const clearance = await resultOf(page, "Clearance");
  for (const wrong of ["-5", "", "1000000"]) {
    await field.fill(wrong);
    assert.equal(await field.getAttribute("aria-invalid"), "true", wrong);
    assert.match(await problem.innerText(), /From 0 to 100\u202f000 m: 1\.7 m is used\./, wrong);
    assert.equal(await resultOf(page, "Clearance"), clearance);
  }
  await field.fill("25");
  assert.equal(await field.getAttribute("aria-invalid"), "false");
  assert.equal(await problem.innerText(), "");
});

test("lines: drawn by clicks, coloured, widened, saved in WGS 84, removed", async () => {
  await page.keyboard.press("b");
  await page.locator("#panel-lines").waitFor();
  const corners = [await clickGround(page, 0.62, 0.2), await clickGround(page, 0.8, 0.6), await clickGround(page, 0.9, 0.25)];
  await page.keyboard.press("Enter");
  await page.locator(".line-row").waitFor();
  const line = () => page.evaluate(() => [...window.terraneViewer.lines].find(([id]) => id.startsWith("line-"))[1]);
  assert.equal((await line()).points.length, 3);
  // A double click ends one, too.
  await clickGround(page, 0.7, 0.7);
  const { easting, northing } = await placeAt(page, 0.85, 0.75);
  const at = await pixelOf(page, easting, northing);
  await page.mouse.dblclick(at.x, at.y);
  await page.waitForFunction(() => document.querySelectorAll(".line-row").length === 2);

  const row = page.locator(".line-row").first();
  await row.locator("input[type=color]").evaluate((input) => {
    input.value = "#123456";
    input.dispatchEvent(new Event("change"));
  });
  await row.locator("input[type=number]").fill("40");
  await row.locator("input[type=number]").press("Tab");
  await row.locator("select").selectOption("meters");
  const changed = await line();
  assert.deepEqual([changed.color, changed.widthMeters, changed.widthPixels], ["#123456", 40, undefined]);
  await row.locator(".line-name").fill("Ridge <b>way</b>");
  await row.locator(".line-name").press("Tab");

  const { name, bytes } = await downloaded(page, () => page.locator("#panel-lines [data-do=save]").click());
  assert.equal(name, "hills-lines.geojson");
  const saved = JSON.parse(bytes.toString());
  assert.equal(saved.crs, undefined);
  assert.equal(saved.features.length, 2);
  assert.equal(saved.features[0].properties.name, "Ridge <b>way</b>");
  // As the command line's --lines reads it.
  assert.deepEqual(saved.features[0].properties, { name: "Ridge <b>way</b>", stroke: "#123456", "stroke-meters": 40 });
  const degrees = transform(
    "EPSG:32632",
    "EPSG:4326",
    corners.map((corner) => [corner.easting, corner.northing]),
  );
  saved.features[0].geometry.coordinates.forEach(([longitude, latitude], i) => {
    const [x, y] = degrees[i];
    assert.ok(near(longitude, x, 2e-7) && near(latitude, y, 2e-7), `${longitude}, ${latitude} against ${degrees[i]}`);
  });

  await row
    .locator("button", { has: page.locator("svg") })
    .last()
    .click();
  await page.waitForFunction(() => document.querySelectorAll(".line-row").length === 1);
  await page.locator(".line-row button[title=Delete]").click();
  await page.waitForFunction(() => window.terraneViewer.lines.size === 0);
});

test("lines: one that was not ended stays when the panel closes; each has a profile", async () => {
  await page.keyboard.press("b");
  const a = await clickGround(page, 0.62, 0.6);
  const b = await clickGround(page, 0.9, 0.8);
  await page.keyboard.press("Escape");
  assert.equal(await page.evaluate(() => window.terraneApp.lines.lines.length), 1);
  await page.keyboard.press("b");
  await page.locator(".line-row button[title=Profile]").click();
  await page.locator(".profile-plot").waitFor();
  assert.match(await text(page, "#panel-profile h2"), /^Profile of Line \d+$/);
  const told = await server.ask(`/d/hills/profile?points=${pair(a)};${pair(b)}&samples=512`);
  const [, low, high] = /· ([\d\u202f]+) to ([\d\u202f]+) m ·/
    .exec(await text(page, ".profile-summary"))
    .map((part) => Number(part.replaceAll("\u202f", "")));
  assert.ok(near(low, Math.min(...told.heightsMeters), 1) && near(high, Math.max(...told.heightsMeters), 1));
  await removeAll();
});

test("the middle of the picture, which Space adds, is covered by no tool, however large the window is", async () => {
  const points = [await placeAt(page, 0.2, 0.3), await placeAt(page, 0.8, 0.7)];
  const before = page.viewportSize();
  try {
    for (const [width, height] of [
      [1280, 720],
      [1000, 700],
      [900, 640],
      [768, 1024],
      [844, 390],
      [667, 375],
    ]) {
      await page.setViewportSize({ width, height });
      for (const key of ["m", "v", "b", "p"]) {
        await page.locator(".ground").focus();
        await page.keyboard.press(key);
        await page.locator(".panel").waitFor();
        if (key === "p") await page.evaluate((points) => points.forEach((point) => window.terraneApp.pointing.tool.click(point)), points);
        const seen = await page.evaluate(() => document.elementFromPoint(innerWidth / 2, innerHeight / 2).className);
        assert.match(seen, /ground/, `${key} at ${width} x ${height}`);
        const box = await page.locator(".panel").boundingBox();
        assert.ok(box.y >= 0 && box.y + box.height <= height && box.x + box.width <= width, `${key} at ${width} x ${height}`);
        const overflow = await page.locator(".panel").evaluate((element) => element.scrollWidth - element.clientWidth);
        assert.ok(overflow <= 0, `${key} at ${width} x ${height} is ${overflow} pixels too wide`);
        await page.keyboard.press("Escape");
        await page.evaluate(() => window.terraneApp.panels.close());
      }
    }
  } finally {
    await page.setViewportSize(before);
  }
  await lookDown(page);
});

const removeAll = () => page.evaluate(() => window.terraneApp.lines.lines.forEach((line) => window.terraneApp.lines.remove(line.id)));
const storedParts = () => page.evaluate(() => window.terraneApp.lines.lines.flatMap((line) => line.parts));

test("files: GPX tracks and routes lie where GDAL puts them", async () => {
  // The panel covers the south.
  const places = [];
  for (const [x, y] of [
    [0.2, 0.2],
    [0.5, 0.4],
    [0.8, 0.3],
  ])
    places.push(await placeAt(page, x, y));
  const degrees = transform(
    "EPSG:32632",
    "EPSG:4326",
    places.map((place) => [place.easting, place.northing]),
  );
  const points = (tag) => degrees.map(([x, y]) => `<${tag} lat="${y}" lon="${x}"><ele>1</ele></${tag}>`).join("");
  const gpx = `<?xml version="1.0"?><gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1"><wpt lat="${degrees[0][1]}" lon="${degrees[0][0]}"><name>Hut</name></wpt><trk><name>Walk &amp; rest</name><trkseg>${points("trkpt")}</trkseg><trkseg>${points("trkpt")}</trkseg></trk><rte><name>Way</name>${points("rtept")}</rte></gpx>`;
  await dropFiles(page, [{ name: "walk.gpx", text: gpx }]);
  await lastToast(page, "2 lines and 1 point from “walk.gpx”");
  const parts = await storedParts();
  assert.deepEqual(parts.map((part) => part.length), [3, 3, 3, 1]);
  for (const part of parts)
    part.forEach((point, i) => assert.ok(Math.hypot(point.easting - places[i].easting, point.northing - places[i].northing) < 0.05));
  assert.deepEqual(await page.evaluate(() => window.terraneApp.lines.lines.map((line) => line.name)), ["Walk & rest", "Way", "Hut"]);

  // A point is a dot in the picture, a row without a profile, and a point again when saved.
  await page.keyboard.press("b");
  assert.deepEqual(await page.locator(".line-row button[title=Profile]").evaluateAll((all) => all.map((button) => button.hidden)), [false, false, true]);
  assert.match(await page.locator(".line-foot .number").last().innerText(), /^1 point$/);
  const { bytes } = await downloaded(page, () => page.locator("#panel-lines [data-do=save]").click());
  assert.deepEqual(JSON.parse(bytes.toString()).features.map(({ geometry }) => geometry.type), ["MultiLineString", "LineString", "Point"]);
  await page.keyboard.press("Escape");
  await page.evaluate(() => window.terraneApp.panels.close());
  await removeAll();
  await lookDown(page);
});

test("files: GeoJSON in WGS 84, in the dataset's CRS by its member or by its numbers, in web Mercator", async () => {
  // The panel covers the south.
  const places = [];
  for (const [x, y] of [
    [0.3, 0.3],
    [0.6, 0.6],
  ])
    places.push(await placeAt(page, x, y));
  const own = places.map((place) => [place.easting, place.northing]);
  const degrees = transform("EPSG:32632", "EPSG:4326", own);
  const mercator = transform("EPSG:32632", "EPSG:3857", own);
  const crs = (name) => ({ crs: { type: "name", properties: { name } } });
  const documents = [
    {
      type: "FeatureCollection",
      features: [{ type: "Feature", properties: { name: "a" }, geometry: { type: "LineString", coordinates: degrees } }],
    },
    { type: "LineString", coordinates: own },
    { type: "Feature", ...crs("urn:ogc:def:crs:EPSG::32632"), properties: null, geometry: { type: "MultiLineString", coordinates: [own] } },
    {
      type: "Feature",
      ...crs("urn:ogc:def:crs:OGC:1.3:CRS84"),
      properties: {},
      geometry: {
        type: "GeometryCollection",
        geometries: [
          { type: "Point", coordinates: [1, 2] },
          { type: "LineString", coordinates: degrees },
        ],
      },
    },
    { type: "Feature", ...crs("EPSG:3857"), properties: {}, geometry: { type: "LineString", coordinates: mercator } },
  ];
  await dropFiles(
    page,
    documents.map((document, i) => ({ name: `lines${i}.geojson`, text: JSON.stringify(document) })),
  );
  await lastToast(page, "lines4.geojson");
  const parts = (await storedParts()).filter((part) => part.length > 1);
  assert.equal(parts.length, documents.length);
  parts.forEach((part, i) =>
    part.forEach((point, k) =>
      assert.ok(Math.hypot(point.easting - places[k].easting, point.northing - places[k].northing) < 0.05, `document ${i}`),
    ),
  );
  await removeAll();
  await lookDown(page);
});

test("files: colours and widths are those of the file, by any of their names, and come back as they were saved", async () => {
  const ends = [await placeAt(page, 0.3, 0.7), await placeAt(page, 0.6, 0.8)].map((place) => [place.easting, place.northing]);
  const styles = [
    [{ stroke: "#f00", "stroke-width": 5 }, ["#ff0000", 5, undefined]],
    [{ stroke: "rebeccapurple", "stroke-width": "2.5" }, ["#663399", 2.5, undefined]],
    [{ stroke: "#12345680", "stroke-meters": 12 }, ["#123456", undefined, 12]],
    // As earlier versions saved it.
    [{ stroke: "#00ff00", "stroke-width": 12, "stroke-width-unit": "m" }, ["#00ff00", undefined, 12]],
    [{ color: "rgb(1 2 3)", "stroke-width": -1 }, ["#010203", 3, undefined]],
    [{ stroke: "url(#a)", "stroke-width": 1e9 }, [undefined, 3, undefined]],
  ];
  const features = styles.map(([properties]) => ({
    type: "Feature",
    properties: { name: "", ...properties },
    geometry: { type: "LineString", coordinates: ends },
  }));
  const drawn = () =>
    page.evaluate(() => [...window.terraneViewer.lines.values()].map(({ color, widthPixels, widthMeters }) => [color, widthPixels, widthMeters]));
  await page.keyboard.press("b");
  await dropFiles(page, [{ name: "styles.geojson", text: JSON.stringify({ type: "FeatureCollection", features }) }]);
  await lastToast(page, "6 lines from “styles.geojson”");
  const before = await drawn();
  before.forEach(([color, ...widths], i) => {
    const [wanted, ...wantedWidths] = styles[i][1];
    if (wanted) assert.equal(color, wanted);
    assert.match(color, /^#[0-9a-f]{6}$/);
    assert.deepEqual(widths, wantedWidths, `${i}`);
  });
  const { bytes } = await downloaded(page, () => page.locator("#panel-lines [data-do=save]").click());
  await removeAll();
  await dropFiles(page, [{ name: "again.geojson", text: bytes.toString() }]);
  await lastToast(page, "6 lines from “again.geojson”");
  assert.deepEqual(await drawn(), before);
  await removeAll();
  await lookDown(page);
});

test("on the Moon: degrees are the Moon's, lines are saved in its CRS, and places on the Earth are refused", async () => {
  const moon = await serve(makeDataset("moon", { imagery: false, onMoon: true }));
  const other = await newPage(browser);
  try {
    await openViewer(other, moon.url);
    await other.locator(".readout").click();
    await other.waitForFunction(() => /on the Moon/.test(document.querySelector(".readout").textContent));
    // A sphere's equator, counted in degrees.
    const [, latitude, longitude] = /([\d.]+)° N\s+([\d.]+)° E/.exec(await text(other, ".readout"));
    const perDegree = (1737400 * Math.PI) / 180;
    assert.ok(Number(longitude) * perDegree > 1.5e6 && Number(longitude) * perDegree < 1.51e6, longitude);
    assert.ok(Number(latitude) * perDegree > 6e4 && Number(latitude) * perDegree < 7e4, latitude);

    const points = [await placeAt(other, 0.3, 0.4), await placeAt(other, 0.6, 0.7)];
    await other.evaluate((points) => window.terraneApp.lines.add("Rille", [points]), points);
    await other.keyboard.press("b");
    const { bytes } = await downloaded(other, () => other.locator("#panel-lines [data-do=save]").click());
    await lastToast(other, "WGS 84 is the Earth’s, and this is the Moon");
    const saved = JSON.parse(bytes.toString());
    assert.equal(saved.crs.properties.name, await other.evaluate(() => window.terraneViewer.dataset.crsName));
    const parts = () => other.evaluate(() => window.terraneApp.lines.lines.flatMap((line) => line.parts));
    await dropFiles(other, [{ name: "again.geojson", text: bytes.toString() }]);
    await lastToast(other, "1 line from “again.geojson”");
    const degrees = points.map((point) => [point.easting / perDegree, point.northing / perDegree]);
    await dropFiles(other, [{ name: "degrees.geojson", text: JSON.stringify({ type: "LineString", coordinates: degrees }) }]);
    await lastToast(other, "1 line from “degrees.geojson”");
    const lines = await parts();
    assert.equal(lines.length, 3);
    for (const line of lines)
      line.forEach((point, i) => assert.ok(Math.hypot(point.easting - points[i].easting, point.northing - points[i].northing) < 0.01));

    const point = '<trkpt lat="2" lon="50"/>';
    await dropFiles(other, [
      { name: "walk.gpx", text: `<gpx><trk><trkseg>${point}${point}</trkseg></trk></gpx>` },
      {
        name: "utm.geojson",
        text: '{"type":"LineString","crs":{"type":"name","properties":{"name":"EPSG:32632"}},"coordinates":[[500000,1],[500001,1]]}',
      },
    ]);
    for (const name of ["walk.gpx", "utm.geojson"])
      await lastToast(other, `“${name}” was not opened: it has places on the Earth, and this ground is on the Moon.`);
    assert.equal((await parts()).length, 3);
    assert.deepEqual(other.errors, []);
  } finally {
    await other.context().close();
    await moon.stop();
  }
});

test("measure: lengths and areas are those on the ground, whatever the projection makes of them", async () => {
  // Web Mercator shows them twice as long here, Lambert's conic a little shorter.
  for (const [name, crs] of [["mercator", 3857], ["lambert", 3034]]) {
    const stretched = await serve(makeDataset(name, { crs }));
    const other = await newPage(browser);
    try {
      await openViewer(other, stretched.url);
      await lookDown(other);
      await other.keyboard.press("m");
      await other.locator("#panel-measure").waitFor();
      await other.locator("#panel-measure .switch", { hasText: "Area" }).click();
      const corners = [];
      for (const [x, y] of [[0.62, 0.3], [0.88, 0.35], [0.75, 0.7]]) corners.push(await clickGround(other, x, y));
      await other.locator(".row.result", { hasText: /^Area(?! on)/ }).waitFor();
      // As they lie around their own middle.
      const degrees = transform(`EPSG:${crs}`, "EPSG:4326", corners.map((corner) => [corner.easting, corner.northing]));
      const [longitude, latitude] = degrees[1];
      const around = `+proj=tmerc +lat_0=${latitude} +lon_0=${longitude} +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m`;
      const [a, b, c] = transform("EPSG:4326", around, degrees);
      const flat = Math.hypot(b[0] - a[0], b[1] - a[1]) + Math.hypot(c[0] - b[0], c[1] - b[1]);
      const onMap = Math.hypot(corners[1].easting - corners[0].easting, corners[1].northing - corners[0].northing) +
        Math.hypot(corners[2].easting - corners[1].easting, corners[2].northing - corners[1].northing);
      if (crs === 3857) assert.ok(onMap > 1.9 * flat, `${onMap} against ${flat}`);
      const straight = await resultOf(other, "Straight");
      assert.ok(straight > 0.995 * flat && straight < 1.05 * flat, `${name}: ${straight} against ${flat}`);
      assert.ok(near(await resultOf(other, "On the map"), onMap, 0.004 * onMap));
      const area = Math.abs((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2;
      const shown = await resultOf(other, "Area");
      assert.ok(near(shown, area, 0.01 * area), `${name}: ${shown} against ${area}`);
      // The bar in the corner, which lies across the middle of the picture.
      await other.waitForTimeout(3500);
      const bar = await other.evaluate(() => {
        const element = document.querySelector(".scale-bar");
        const { clientWidth: width, clientHeight: height } = window.terraneViewer.canvas;
        const half = element.getBoundingClientRect().width / 2;
        const [left, right] = [-half, half].map((x) => window.terraneViewer.pick(width / 2 + x, height / 2));
        return { label: element.textContent, left, right };
      });
      const [number, unit] = bar.label.split(/\s/);
      const barDegrees = transform(`EPSG:${crs}`, "EPSG:4326", [bar.left, bar.right].map(({ easting, northing }) => [easting, northing]));
      const [left, right] = transform("EPSG:4326", around, barDegrees);
      const barMeters = Math.hypot(right[0] - left[0], right[1] - left[1]);
      const saidMeters = Number(number) * (unit === "km" ? 1000 : 1);
      assert.ok(near(saidMeters, barMeters, 0.03 * barMeters), `${name}: a bar of ${bar.label} is ${barMeters} m long`);
      // The server's library measures on the ellipsoid by other means.
      await other.keyboard.press("v");
      await other.locator("#panel-sight").waitFor();
      const from = await clickGround(other, 0.62, 0.3);
      const to = await clickGround(other, 0.88, 0.7);
      await other.locator(".verdict").waitFor();
      const told = await stretched.ask(`/d/${name}/line-of-sight?from=${pair(from)}&to=${pair(to)}`);
      const { distanceMeters, measuredOn } = told.results[0];
      assert.equal(measuredOn, "ellipsoid");
      const distance = await resultOf(other, "Distance");
      assert.ok(near(distance, distanceMeters, 0.003 * distanceMeters), `${name}: ${distance} against ${distanceMeters}`);
      assert.deepEqual(other.errors, []);
    } finally {
      await other.context().close();
      await stretched.stop();
    }
  }
});

test("files: in a dataset of another projection, too", async () => {
  // Lambert's conic: the CRS comes as WKT2 alone, with no zone in its name.
  const lambert = await serve(makeDataset("lambert", { crs: 3034 }));
  const other = await newPage(browser);
  try {
    await openViewer(other, lambert.url);
    const place = await placeAt(other, 0.4, 0.6);
    const [[longitude, latitude]] = transform("EPSG:3034", "EPSG:4326", [[place.easting, place.northing]]);
    await dropFiles(other, [
      {
        name: "one.geojson",
        text: JSON.stringify({
          type: "LineString",
          coordinates: [
            [longitude, latitude],
            [longitude + 0.01, latitude],
          ],
        }),
      },
    ]);
    await lastToast(other, "1 line from");
    const point = await other.evaluate(() => window.terraneApp.lines.lines[0].parts[0][0]);
    assert.ok(
      Math.hypot(point.easting - place.easting, point.northing - place.northing) < 0.1,
      `${JSON.stringify(point)} against ${JSON.stringify(place)}`,
    );
    assert.deepEqual(other.errors, []);
  } finally {
    await other.context().close();
    await lambert.stop();
  }
});

test("files: what cannot be used is said, and nothing breaks", async () => {
  const deep = `${'{"type":"GeometryCollection","geometries":['.repeat(40)}{"type":"Point","coordinates":[1,1]}${"]}".repeat(40)}`;
  const bad = [
    ["text.txt", "hello", /neither GeoJSON, GPX nor a flight/],
    ["empty.gpx", "", /empty/],
    ["list.json", "[1,2]", /not GeoJSON/],
    ["topo.json", '{"type":"Topology"}', /unknown type/],
    ["far.geojson", '{"type":"LineString","coordinates":[[1,2],[1,"x"]]}', /no pair of numbers/],
    ["null.geojson", '{"type":"FeatureCollection","features":null}', /no list/],
    ["points.geojson", '{"type":"MultiPoint","coordinates":[[1,2],[3]]}', /no pair of numbers/],
    ["none.geojson", '{"type":"FeatureCollection","features":[]}', /no lines, areas or points/],
    ["space.geojson", '{"type":"LineString","coordinates":[[1e300,2],[3,4]]}', /the place 1e\+300, 2 has none in/],
    ["deep.geojson", deep, /too deep/],
    [
      "crs.geojson",
      '{"type":"LineString","crs":{"type":"name","properties":{"name":"EPSG:2056"}},"coordinates":[[2600000,1200000],[2600100,1200100]]}',
      /EPSG:2056/,
    ],
    ["cut.gpx", "<gpx><trk><trkseg><trkpt lat='1'", /well-formed/],
    ["other.gpx", "<kml></kml>", /not GPX/],
    ["bomb.gpx", '<!DOCTYPE g [<!ENTITY a "aaaa">]><gpx>&a;</gpx>', /DOCTYPE/],
    ["nowhere.gpx", '<gpx><trk><trkseg><trkpt lat="91" lon="3"/><trkpt lat="x" lon="3"/></trkseg></trk></gpx>', /latitude and longitude/],
    ["html.gpx", "<gpx><trk><name><![CDATA[<img src=x onerror=alert(1)>]]></name></trk></gpx>", /no lines/],
  ];
  for (const [name, content, words] of bad) {
    await dropFiles(page, [{ name, text: content }]);
    const toast = page.locator(".toast", { hasText: name });
    await toast.waitFor();
    assert.match(await toast.innerText(), words, name);
  }
  // A line on the other side of the world is taken, and said to be beside the ground.
  await dropFiles(page, [{ name: "beside.geojson", text: '{"type":"LineString","coordinates":[[20,10],[21,11]]}' }]);
  await lastToast(page, "lies beside this dataset’s ground");
  await removeAll();
  assert.deepEqual(page.errors, []);
});

test("lines are there again when the page is opened again, and only over their dataset", async () => {
  const place = await placeAt(page, 0.5, 0.3);
  await page.evaluate(({ easting, northing }) => {
    const { lines } = window.terraneApp;
    lines.add("Kept", [[{ easting, northing }, { easting: easting + 1000.1234, northing }], [{ easting, northing }]], { color: "#102030" });
    const gone = lines.add("Gone", [[{ easting, northing }, { easting, northing: northing + 500 }]]);
    lines.change(lines.lines[0].id, { name: "Renamed <b>", width: 40, widthUnit: "meters" });
    lines.remove(gone.id);
  }, place);
  // One that is too large is not kept, and takes nothing else with it.
  await page.evaluate(({ easting, northing }) => {
    window.terraneApp.lines.add("Large", [Array.from({ length: 80_000 }, (_, i) => ({ easting: easting + i / 7, northing }))]);
  }, place);
  // Left at once: what was just drawn is kept as well.
  await page.reload();
  await page.waitForFunction(() => window.terraneApp !== undefined, undefined, { timeout: kPatience });
  const kept = await page.evaluate(() => window.terraneApp.lines.lines);
  assert.equal(kept.length, 1);
  assert.deepEqual([kept[0].name, kept[0].color, kept[0].width, kept[0].widthUnit], ["Renamed <b>", "#102030", 40, "meters"]);
  assert.deepEqual(kept[0].parts.map((part) => part.length), [2, 1]);
  assert.ok(near(kept[0].parts[0][1].easting, place.easting + 1000.1234, 1e-3));
  assert.equal(await page.evaluate(() => window.terraneViewer.lines.size), 2);

  // What somebody else wrote there is no reason not to open.
  await page.evaluate(() => {
    for (const key of Object.keys(localStorage)) localStorage.setItem(key, '[{"name": 3}, {"name": "x", "parts": [[]]}, null]');
  });
  await page.reload();
  await page.waitForFunction(() => window.terraneApp !== undefined, undefined, { timeout: kPatience });
  assert.equal(await page.evaluate(() => window.terraneApp.lines.lines.length), 0);
  await lookDown(page);
});

test("files: thousands of segments in one file are one row, and are drawn", async () => {
  const { west, east, south, north } = await page.evaluate(() => window.terraneViewer.dataset.bounds);
  const features = Array.from({ length: 200 }, (_, i) => ({
    type: "Feature",
    properties: { stroke: "#102030", "stroke-width": i < 100 ? 2 : 3 },
    geometry: {
      type: "LineString",
      coordinates: Array.from({ length: 40 }, (_, k) => [
        west + ((east - west) * k) / 39,
        south + ((north - south) * (i + Math.sin(k))) / 200,
      ]),
    },
  }));
  await page.keyboard.press("b");
  await dropFiles(page, [{ name: "contours.geojson", text: JSON.stringify({ type: "FeatureCollection", features }) }]);
  await lastToast(page, "200 lines from");
  assert.equal(await page.locator(".line-row").count(), 1);
  assert.equal(await page.evaluate(() => window.terraneViewer.lines.size), 200);
  // What all of them have is kept.
  assert.deepEqual(await page.evaluate(() => [...window.terraneViewer.lines.values()].map((line) => line.color).filter((color) => color !== "#102030")), []);
  await removeAll();
});

test("nothing went wrong on the way", () => assert.deepEqual(page.errors, []));
