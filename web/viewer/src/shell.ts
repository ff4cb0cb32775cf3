import type { DatasetInfo, Viewer } from "terrane";
import type { App } from "./app.js";
import type { DatasetChoice } from "./datasets.js";
import { FlightDeck } from "./flight_deck.js";
import { groundScaleOf } from "./geo/ground_scale.js";
import { openFiles } from "./geo/open_file.js";
import { type Projection, projectionOf } from "./geo/projection.js";
import { listenToKeys } from "./keys.js";
import { keepLines } from "./line_keeper.js";
import { LineStore } from "./line_store.js";
import { el } from "./parts/dom.js";
import { askForFiles, listenToDrops } from "./parts/drop.js";
import { makeHelp } from "./parts/help.js";
import type { Messages } from "./parts/messages.js";
import { Overlay } from "./parts/overlay.js";
import { Panels } from "./parts/panels.js";
import { Pointing } from "./parts/pointing.js";
import { makeReadout } from "./parts/readout.js";
import { makeScaleBar } from "./parts/scale_bar.js";
import { makeTitle } from "./parts/title.js";
import { makeNavigation, makeToolbar } from "./parts/toolbar.js";

/** Everything around the ground, once it is known what the dataset is. `writeAddress`: brings the page's address up to date. */
export function makeShell(
  viewer: Viewer,
  dataset: DatasetInfo,
  choice: DatasetChoice,
  messages: Messages,
  writeAddress: () => void,
): App {
  let projection: Promise<Projection | null> | null = null;
  let fly: HTMLButtonElement | null = null;
  const say = (message: string, kind?: "info" | "warning"): void => messages.say(message, kind);
  const flyHint = el("div", { class: "fly-hint", hidden: true, role: "status" });
  const take = (files: File[]): void => void openFiles(app, files);

  const app: App = {
    viewer,
    dataset,
    overlay: new Overlay(viewer),
    pointing: new Pointing(viewer, () => say("There is no ground under that point.")),
    panels: new Panels(),
    lines: new LineStore(viewer),
    flights: new FlightDeck(viewer, say),
    projection: () =>
      (projection ??= projectionOf(dataset).catch(() => {
        projection = null;
        return null;
      })),
    groundScale: async () => groundScaleOf(dataset, await app.projection()),
    say,
    openFiles: () => askForFiles(take),
    copyLink: () => {
      writeAddress();
      copyLink(say);
    },
    setFlying(on) {
      viewer.controls = on ? "fly" : "map";
      fly?.setAttribute("aria-pressed", String(on));
      flyHint.hidden = !on;
      if (!on) return;
      const isTouched = matchMedia("(pointer: coarse)").matches;
      flyHint.textContent = isTouched
        ? "Flying: drag to look, two fingers fly ahead"
        : "Flying: W A S D move, Q E sink and rise, drag to look, wheel for speed, Esc ends";
      viewer.canvas.focus({ preventScroll: true });
    },
  };

  keepLines(app.lines, dataset, choice.url);
  const help = makeHelp();
  app.panels.use(app);
  const navigation = makeNavigation(app);
  fly = navigation.fly;
  const credits = [dataset.attribution, ...dataset.layers.map((layer) => layer.attribution)].filter(
    (text, i, all) => text !== "" && all.indexOf(text) === i,
  );
  document.body.append(
    app.overlay.element,
    el("div", { class: "crosshair", "aria-hidden": "true" }),
    makeToolbar(app, help.toggle),
    makeTitle(dataset, choice),
    app.panels.element,
    navigation.element,
    el("footer", { class: "foot" }, makeReadout(app), makeScaleBar(app), el("div", { class: "credits faint" }, credits.join(" · "))),
    flyHint,
    help.element,
    listenToDrops(take),
  );
  listenToKeys(app, help.toggle);
  document.title = `${dataset.name} · Terrane`;
  return app;
}

function copyLink(say: App["say"]): void {
  const address = location.href;
  const byHand = (): void => {
    const field = el("input", { type: "text", value: address, readonly: true, "aria-label": "Link to this view" });
    const dialog = el(
      "dialog",
      { class: "link-dialog" },
      el("p", {}, "The browser does not let the page copy. Here it is:"),
      field,
      el("form", { method: "dialog" }, el("button", { class: "primary" }, "Close")),
    );
    dialog.addEventListener("close", () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
    field.select();
  };
  if (navigator.clipboard === undefined) byHand();
  else navigator.clipboard.writeText(address).then(() => say("The link is copied."), byHand);
}
