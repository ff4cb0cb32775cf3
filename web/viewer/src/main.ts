import { type Settings, type Viewer, ViewerError, createViewer } from "terrane";
import { applyAddress, keepAddress, readAddress } from "./address.js";
import type { App } from "./app.js";
import { type DatasetChoice, findDataset } from "./datasets.js";
import { el } from "./parts/dom.js";
import { showChooser, showFatal, showNoDataset } from "./parts/full_page.js";
import { makeLoading } from "./parts/loading.js";
import { Messages } from "./parts/messages.js";
import { makeShell } from "./shell.js";
import "./style.css";

declare global {
  interface Window {
    /** For tests, and for people who open the console. */
    terraneViewer?: Viewer;
    terraneApp?: App;
  }
}

async function start(): Promise<void> {
  const found = await findDataset(new URL(location.href));
  if (found.kind === "none") showNoDataset(found.reason);
  else if (found.kind === "several") showChooser(found.datasets);
  else await show(found.dataset);
}

async function show(choice: DatasetChoice): Promise<void> {
  const asked = readAddress(location.hash);
  const canvas = el("canvas", {
    class: "ground",
    tabindex: 0,
    "aria-label": `Terrain of ${choice.name}. Arrow keys move, question mark lists all keys.`,
  });
  const messages = new Messages();
  document.title = `${choice.name} · Terrane`;
  document.body.prepend(canvas);

  const viewer = createViewer(canvas, {
    dataset: choice.url,
    ...(asked.view.easting === undefined ? {} : { view: asked.view }),
  });
  window.terraneViewer = viewer;
  // What the device chose is what an address need not say.
  const defaults: Settings = { ...viewer.settings };
  viewer.set(asked.settings);
  document.body.append(makeLoading(viewer, choice.name), messages.element);
  viewer.on("problem", (problem) => {
    if (problem?.isFatal) showFatal(problem);
    else messages.showProblem(problem, viewer.dataset !== null);
  });

  const dataset = await viewer.ready;
  applyAddress(viewer, asked, defaults);
  const writeAddress = keepAddress(viewer, defaults);
  window.terraneApp = makeShell(viewer, dataset, choice, messages, writeAddress);
  canvas.focus({ preventScroll: true });
}

start().catch((error: unknown) => {
  const problem =
    error instanceof ViewerError
      ? error.problem
      : { code: "engine" as const, message: error instanceof Error ? error.message : String(error), isFatal: true };
  showFatal(problem);
  if (!(error instanceof ViewerError)) reportError(error);
});
