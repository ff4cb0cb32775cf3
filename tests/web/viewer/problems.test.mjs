import assert from "node:assert/strict";
import { cpSync, openSync, closeSync, writeSync, statSync } from "node:fs";
import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { extname, join } from "node:path";
import { after, before, test } from "node:test";
import { kPatience, kViewer, kWork, launch, makeDataset, newPage, openViewer, serve, settled, text } from "./harness.mjs";

let server, browser;
before(async () => {
  server = await serve(makeDataset());
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

const kTypes = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".css": "text/css",
  ".wasm": "application/wasm",
  ".svg": "image/svg+xml",
  ".json": "application/json",
};

/** A plain web server under a path of its own: ranges, and nothing that knows terrain. */
async function staticHost(folders) {
  const host = createServer(async (request, response) => {
    const path = decodeURIComponent(new URL(request.url, "http://host").pathname);
    const [prefix, folder] = Object.entries(folders).find(([prefix]) => path.startsWith(prefix)) ?? [];
    try {
      const name = path.slice(prefix.length) || "index.html";
      const body = await readFile(join(folder, name));
      const range = /bytes=(\d+)-(\d+)/.exec(request.headers.range ?? "");
      const head = { "Content-Type": kTypes[extname(name)] ?? "application/octet-stream", "Accept-Ranges": "bytes" };
      if (range) {
        const [from, to] = [Number(range[1]), Math.min(Number(range[2]), body.length - 1)];
        response.writeHead(206, { ...head, "Content-Range": `bytes ${from}-${to}/${body.length}`, "Content-Length": to - from + 1 });
        response.end(body.subarray(from, to + 1));
      } else {
        response.writeHead(200, { ...head, "Content-Length": body.length });
        response.end(body);
      }
    } catch {
      response.writeHead(404);
      response.end();
    }
  });
  await new Promise((resolve) => host.listen(0, "127.0.0.1", resolve));
  return {
    url: `http://127.0.0.1:${host.address().port}`,
    stop: () =>
      new Promise((resolve) => {
        host.closeAllConnections();
        host.close(resolve);
      }),
  };
}

test("several datasets: a chooser, and a link to each", async () => {
  const several = await serve([makeDataset(), makeDataset("bare", { imagery: false, seed: 2 })]);
  const page = await newPage(browser);
  try {
    await page.goto(several.url);
    await page.locator("#chooser").waitFor();
    assert.match(await text(page, ".chooser"), /hills[\s\S]*UTM zone 32N[\s\S]*bare/);
    await page.locator(".chooser a", { hasText: "bare" }).click();
    await settled(page);
    assert.equal(await text(page, ".title h1"), "bare");
    await page.keyboard.press("l");
    assert.match(await text(page, "#panel-layers"), /no imagery/);
    // From one to another: the title opens the list again.
    await page.locator(".title-button").click();
    assert.match(await page.locator(".datasets [aria-current]").innerText(), /bare/);
    await page.keyboard.press("Escape");
    await page.locator(".datasets").waitFor({ state: "detached" });
    await page.locator(".title-button").click();
    await page.locator(".datasets a", { hasText: "hills" }).click();
    await page.waitForURL(/dataset=hills/);
    await settled(page);
    assert.equal(await text(page, ".title h1"), "hills");
    await page.goto(`${several.url}?dataset=nothing`);
    await page.locator("#no-dataset").waitFor();
    assert.match(await text(page, "#no-dataset"), /no dataset “nothing”.*hills, bare/);
  } finally {
    await page.context().close();
    await several.stop();
  }
});

test("one dataset alone: the title opens no list", async () => {
  const page = await newPage(browser);
  await openViewer(page, server.url);
  assert.equal(await page.locator(".title button").count(), 0);
  await page.context().close();
});

test("on a plain web server, under any path, ?dataset= opens a folder beside the viewer", async () => {
  const host = await staticHost({ "/maps/viewer/": kViewer, "/maps/data/hills.terrane/": makeDataset() });
  const page = await newPage(browser);
  try {
    await openViewer(page, `${host.url}/maps/viewer/?dataset=../data/hills.terrane/`);
    assert.equal(await text(page, ".title h1"), "hills");
    assert.deepEqual(page.errors, []);
    await page.goto(`${host.url}/maps/viewer/`);
    await page.locator("#no-dataset").waitFor();
  } finally {
    await page.context().close();
    await host.stop();
  }
});

test("no dataset at the address: says so, and takes another address", async () => {
  const page = await newPage(browser);
  await page.goto(`${server.url}?dataset=${encodeURIComponent(`${server.url}d/none/`)}`);
  await page.locator("#no-dataset").waitFor();
  assert.match(await text(page, "#no-dataset"), /404|not found|no dataset/i);
  await page.locator(".open-address input").fill("hills");
  await page.locator(".open-address button").click();
  await settled(page);
  assert.equal(await text(page, ".title h1"), "hills");
  await page.context().close();
});

test("an address that is none of a dataset is refused in words", async () => {
  const page = await newPage(browser);
  for (const address of ["javascript:alert(1)", "data:text/plain,hills", "http://[", "file:///etc/"]) {
    await page.goto(`${server.url}?dataset=${encodeURIComponent(address)}`);
    await page.locator("#no-dataset").waitFor();
    assert.match(await text(page, "#no-dataset"), /is no address of a dataset/);
  }
  assert.deepEqual(page.errors, []);
  await page.context().close();
});

test("a server that does not answer at first: says so, takes another address, and goes on asking", async () => {
  const dataset = makeDataset();
  const mortal = await serve(dataset, { args: ["--cors"] });
  await mortal.stop();
  const page = await newPage(browser);
  let reborn;
  try {
    await page.goto(`${server.url}?dataset=${encodeURIComponent(`${mortal.url}d/hills/`)}`);
    await page.locator(".banner[data-code=offline]").waitFor({ timeout: 15_000 });
    assert.equal(await text(page, ".banner"), "The server does not answer; trying again.");
    const problem = await page.evaluate(() => window.terraneViewer.problem);
    assert.equal(problem.code, "offline");
    assert.equal(problem.isFatal, false);
    assert.match(await text(page, ".splash"), /manifest\.json: no answer/);
    assert.ok(await page.locator(".splash .open-address input").isVisible());
    reborn = await serve(dataset, { port: mortal.port, args: ["--cors"] });
    await settled(page);
    await page.locator(".banner").waitFor({ state: "hidden" });
    assert.equal(await page.evaluate(() => window.terraneViewer.problem), null);
    assert.deepEqual(page.errors, []);
    // Another address in place of waiting.
    await reborn.stop();
    await page.reload();
    await page.locator(".splash .open-address input").fill("hills");
    await page.locator(".splash .open-address button").click();
    await settled(page);
  } finally {
    await page.context().close();
    await reborn?.stop();
  }
});

test("no WebGL2: says so in words", async () => {
  const page = await newPage(browser);
  await page.addInitScript(() => {
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      return kind === "webgl2" ? null : getContext.call(this, kind, ...rest);
    };
  });
  await page.goto(server.url);
  await page.locator("#no-webgl2").waitFor();
  assert.match(await text(page, "#no-webgl2"), /WebGL2/);
  assert.equal(await page.locator(".splash").count(), 0);
  await page.context().close();
});

test("a browser without WebGL2 at all is told before anything begins", async () => {
  const page = await newPage(browser);
  const fetched = [];
  page.on("request", (request) => fetched.push(request.url()));
  await page.addInitScript(() => delete window.WebGL2RenderingContext);
  await page.goto(server.url);
  await page.locator("#no-webgl2").waitFor();
  assert.equal(
    // note: the engine itself comes with the page, which cannot know.
    fetched.some((url) => /worker|\.pmtiles|manifest\.json/.test(url)),
    false,
    "workers or the dataset were loaded for nothing",
  );
  await page.context().close();
});

test("loading tells phases and bytes, and no share of a whole that nobody knows", async () => {
  const page = await newPage(browser);
  await page.addInitScript(() => {
    window.told = [];
    addEventListener("DOMContentLoaded", () => {
      new MutationObserver(() => {
        const shown = document.querySelector(".splash")?.innerText;
        if (shown && shown !== window.told.at(-1)) window.told.push(shown);
      }).observe(document.body, { subtree: true, childList: true, characterData: true });
    });
  });
  // A slow line, so that there is time to see it.
  const cdp = await page.context().newCDPSession(page);
  await cdp.send("Network.enable");
  await cdp.send("Network.emulateNetworkConditions", { offline: false, latency: 120, downloadThroughput: 1.5e6, uploadThroughput: 1e6 });
  await openViewer(page, server.url);
  const told = await page.evaluate(() => window.told.join("\n"));
  assert.match(told, /Loading the engine/);
  assert.match(told, /kB received/);
  assert.doesNotMatch(told, /%/);
  await page.context().close();
});

test("the server goes and comes back: a banner meanwhile, the ground stays, the rest comes", async () => {
  // Large enough that from far away most of it has not come.
  const dataset = makeDataset("large", { size: 4097, imagery: false });
  const mortal = await serve(dataset);
  const page = await newPage(browser);
  let reborn;
  try {
    await openViewer(page, mortal.url);
    await page.evaluate(() => window.terraneViewer.set({ tau: 16 }));
    const counts = () => page.evaluate(() => ({ ...window.terraneViewer.statistics() }));
    await mortal.stop();
    // Close to the ground: what is needed there is not here.
    await page.evaluate(() => {
      const { terraneViewer: viewer } = window;
      const { west, east, south, north } = viewer.dataset.bounds;
      const [easting, northing] = [(west + east) / 2, (south + north) / 2];
      viewer.set({ tau: 1 });
      viewer.setView({ easting, northing, height: viewer.elevationAt(easting, northing) + 150, heading: 0, pitch: -20 });
    });
    await page.locator(".banner[data-code=offline]").waitFor();
    assert.equal(await text(page, ".banner"), "The server does not answer; what is here stays; trying again.");
    const without = await counts();
    assert.ok(without.triangles > 0 && without.wishes > 0, "the ground went with the server");
    reborn = await serve(dataset, { port: mortal.port });
    await page.locator(".banner").waitFor({ state: "hidden" });
    await settled(page);
    const again = await counts();
    assert.ok(again.bytesReceived > without.bytesReceived && again.tilesOnGpu > without.tilesOnGpu, "nothing more has come");
    assert.equal(await page.evaluate(() => window.terraneViewer.problem), null);
    assert.deepEqual(page.errors, []);
  } finally {
    await page.context().close();
    await mortal.stop();
    await reborn?.stop();
  }
});

test("the graphics are taken away and come back", async () => {
  const page = await newPage(browser);
  await openViewer(page, server.url);
  const triangles = await page.evaluate(() => window.terraneViewer.statistics().triangles);
  const asked = [];
  page.on("request", (request) => asked.push(request.url()));
  await page.evaluate(() => {
    window.lose = window.terraneViewer.canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
    window.lose.loseContext();
  });
  await page.locator(".banner[data-code=context-lost]").waitFor();
  assert.match(await text(page, ".banner"), /The graphics were taken away; coming back\./);
  await page.evaluate(() => window.lose.restoreContext());
  await page.locator(".banner").waitFor({ state: "hidden" });
  await settled(page);
  assert.equal(await page.evaluate(() => window.terraneViewer.statistics().triangles), triangles);
  // note: what knows projections comes by itself when the page has had time.
  assert.deepEqual(
    asked.filter((url) => url.includes("/d/")),
    [],
    "what is decoded stays",
  );
  assert.ok((await page.evaluate(async () => (await window.terraneViewer.screenshot()).size)) > 20_000);
  await page.context().close();
});

test("graphics that are taken away again and again come back each time", async () => {
  const page = await newPage(browser);
  await openViewer(page, server.url);
  await page.evaluate(async () => {
    const { terraneViewer: viewer } = window;
    const lose = viewer.canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
    const wait = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));
    for (let i = 0; i < 3; ++i) {
      // In the middle of a move, so that there are frames between the loss and its event.
      void viewer.flyTo({ heading: 40 * (i + 1) }, { seconds: 1 });
      await wait(200);
      lose.loseContext();
      await wait(500);
      lose.restoreContext();
      await wait(200);
    }
  });
  await page.locator(".banner").waitFor({ state: "hidden" });
  await settled(page);
  assert.deepEqual(page.errors, []);
  assert.equal(await page.evaluate(() => window.terraneViewer.problem), null);
  assert.ok((await page.evaluate(async () => (await window.terraneViewer.screenshot()).size)) > 20_000);
  await page.context().close();
});

test("damaged tiles: coarser ground stands for them, and it is said", async () => {
  const damaged = join(kWork, "damaged.terrane");
  cpSync(makeDataset(), damaged, { recursive: true });
  const archive = join(damaged, "elevation.pmtiles");
  // The end of the archive holds the finest tiles.
  const file = openSync(archive, "r+");
  const size = statSync(archive).size;
  writeSync(file, Buffer.alloc(Math.floor(size / 3), 0xa5), 0, Math.floor(size / 3), Math.floor((size * 2) / 3) - 1);
  closeSync(file);
  const sick = await serve(damaged);
  const page = await newPage(browser);
  try {
    await page.goto(sick.url);
    await page.waitForFunction(() => window.terraneApp !== undefined, null, { timeout: kPatience });
    await page.locator(".banner[data-code=damaged]").waitFor();
    assert.match(await text(page, ".banner"), /missing or damaged; coarser ground stands for them/);
    assert.ok(await page.evaluate(() => window.terraneViewer.statistics().triangles > 0));
    assert.deepEqual(page.errors, []);
  } finally {
    await page.context().close();
    await sick.stop();
  }
});
