/** The server goes off in the middle of a flight, and comes back: never a hole, and then all that was missing. */
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { kPatience, launch, makeDataset, newPage, openViewer, serve } from "./harness.mjs";

const kSteps = 36;
const kStopsAt = 8;
const kComesBackAt = 24;

let browser, dataset;
before(async () => {
  dataset = makeDataset("country", { size: 2049 });
  browser = await launch();
});
after(() => browser.close());

/** Paints what is no ground, and counts it in a picture. */
async function markHoles(page) {
  await page.evaluate(() => {
    const { terraneViewer: viewer } = window;
    viewer.controls = "none";
    viewer.addPass({ name: "holes", fragment: "vec3 apply(Ground ground) { return ground.isGround ? ground.color * vec3(0.5, 1.0, 0.5) : vec3(1.0, 0.0, 1.0); }" });
    window.holesAt = async (view) => {
      viewer.setView(view);
      await new Promise((resolve) => requestAnimationFrame(resolve));
      const bitmap = await createImageBitmap(await viewer.screenshot());
      const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
      const context = canvas.getContext("2d");
      context.drawImage(bitmap, 0, 0);
      const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
      let holes = 0;
      for (let i = 0; i < data.length; i += 4) holes += data[i] > 200 && data[i + 1] < 60 && data[i + 2] > 200 ? 1 : 0;
      return holes;
    };
    // Low, and looking down so steeply that nothing but ground can be seen; across the dataset, from its middle's left to its right.
    window.viewAt = (share) => {
      const { west, east, south, north } = viewer.dataset.bounds;
      const easting = west + (0.3 + 0.4 * share) * (east - west);
      const northing = south + 0.45 * (north - south);
      return { easting, northing, height: viewer.dataset.maxHeight + 300, heading: 20, pitch: -60, fov: 40 };
    };
  });
}

for (const surface of ["meshes", "patches"]) {
  test(`a server that goes off and comes back leaves no hole in ${surface}`, { timeout: 6 * kPatience }, async () => {
    let server = await serve(dataset);
    const page = await newPage(browser, { viewport: { width: 480, height: 320 } });
    try {
      await openViewer(page, server.url);
      await page.evaluate((surface) => window.terraneViewer.set({ surface }), surface);
      await markHoles(page);
      // What counts holes does see them: the sky is none.
      assert.ok((await page.evaluate(() => window.holesAt({ ...window.viewAt(0), pitch: 0 }))) > 1000, "the sky is not counted");

      const holes = [];
      let offline = false;
      let missing = 0;
      for (let step = 0; step <= kSteps; ++step) {
        if (step === kStopsAt) await server.stop();
        if (step === kComesBackAt) server = await serve(dataset, { port: server.port });
        holes.push(await page.evaluate((share) => window.holesAt(window.viewAt(share)), step / kSteps));
        const { wishes, isOffline, code } = await page.evaluate(() => {
          const { terraneViewer: viewer } = window;
          return { ...viewer.statistics(), code: viewer.problem?.code };
        });
        if (step >= kStopsAt && step < kComesBackAt) {
          missing = Math.max(missing, wishes);
          offline ||= isOffline && code === "offline";
        }
      }
      assert.deepEqual(holes, holes.map(() => 0), "pixels without ground");
      assert.ok(missing > 0, "all had come before the server went off: this shows nothing");
      assert.ok(offline, "the viewer did not say that the server is gone");

      await page.waitForFunction(() => window.terraneViewer.isSettled && window.terraneViewer.problem === null, null, { timeout: kPatience });
      const after = await page.evaluate(() => window.terraneViewer.statistics());
      assert.equal(after.wishes, 0);
      assert.ok(after.errorPixels <= after.tau * 1.001, `an error of ${after.errorPixels} pixels with tau ${after.tau}`);
      assert.deepEqual(page.errors, []);
    } finally {
      await page.context().close();
      await server.stop();
    }
  });
}
