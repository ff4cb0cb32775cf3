// The flight's page of ours.
import { EarlyWorkers, askEarly } from "./early.js";
import makeTerrane from "./terrane.mjs";

const wanted = new URL(location.href).searchParams;
const canvas = document.getElementById("view");
// As the package makes it on a desktop (web/package/src/device.ts).
const dataset = new URL(wanted.get("dataset"), location.href).href;
const workerCount = Math.max(1, Math.min(4, navigator.hardwareConcurrency - 1));
const workers = new EarlyWorkers(workerCount, () => new Worker(new URL("./worker.js", import.meta.url), { type: "module" }));
const terrane = await makeTerrane({
  early: askEarly(dataset),
  makeWorker: () => workers.take(),
  workerCount,
});
const view = new terrane.View(dataset, { compressedMegabytes: 64, decodedMegabytes: 192, pictureMegabytes: 48,
  gpuGeometryMegabytes: 128, gpuTextureMegabytes: 256, meshMegabytes: 96,
  uploadMegabytesAFrame: 4 });
await new Promise((resolve) => setTimeout(resolve));
view.open();
view.attach(canvas);
view.setSize(canvas.width, canvas.height);
view.setStyle({ surface: wanted.get("surface"), tau: 1, samples: Number(wanted.get("samples") ?? 4), mode: "shaded", outline: "none",
  exaggeration: 1, sunAzimuth: 315, sunAltitude: 38, haze: true, imageryRelief: 0.45, imageryBrightness: 1, water: true, frozen: false });

let hasGround = false, report = view.report();
window.program = {
  canvas, view,
  name: "Terrane",
  setCamera: ({ eye, target, fovy }) => view.setCamera(...eye, ...target, fovy),
  frame() {
    const isDrawn = view.frame(performance.now() / 1000);
    if (view.problem() !== "") throw new Error(view.problem());
    report = view.report();
    hasGround ||= isDrawn && report.triangles > 0;
  },
  redraw() {
    view.redraw();
    this.frame();
  },
  hasGround: () => hasGround,
  isSettled: () => view.isSettled(),
  triangles: () => report.triangles,
  about: () => ({ report, renderer: view.rendererName(), width: canvas.width, height: canvas.height }),
};
window.programReady = true;
