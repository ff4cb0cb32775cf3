import type { Action, Panel } from "../app.js";
import { faceNorth, toggleTopDown, zoomBy } from "../camera.js";
import { download } from "../parts/dom.js";
import { linesTool } from "../tools/lines.js";
import { measureTool } from "../tools/measure.js";
import { profileTool } from "../tools/profile.js";
import { sightTool } from "../tools/sight.js";
import { detailPanel } from "./detail.js";
import { flightsPanel } from "./flights.js";
import { layersPanel } from "./layers.js";
import { lightPanel } from "./light.js";
import { statisticsPanel } from "./statistics.js";

/** The toolbar, the keys and the help are made from these lists. On a small screen the first of each group stand in the bar. */
export const panelGroups: readonly (readonly Panel[])[] = [
  [layersPanel, lightPanel, detailPanel, statisticsPanel],
  [measureTool, profileTool, sightTool, linesTool],
  [flightsPanel],
];

export const actions: readonly Action[] = [
  {
    id: "screenshot",
    title: "Save the picture",
    icon: "camera",
    key: "x",
    purpose: "The picture without the page around it, as PNG",
    run(app) {
      const { easting, northing } = app.viewer.view;
      app.viewer.screenshot().then(
        (picture) => {
          download(`${app.dataset.name}-${Math.round(easting)}-${Math.round(northing)}.png`, picture);
          app.say("The picture is saved.");
        },
        (error: unknown) => app.say(`There is no picture: ${error instanceof Error ? error.message : String(error)}`, "warning"),
      );
    },
  },
  {
    id: "link",
    title: "Copy a link to this view",
    icon: "link",
    key: "k",
    purpose: "Whoever opens it sees what you see",
    run(app) {
      app.copyLink();
    },
  },
];

/** What has its place beside the compass. */
export const viewActions: readonly Action[] = [
  {
    id: "zoom-in",
    title: "Nearer",
    icon: "plus",
    key: "+",
    purpose: "Nearer to the middle of the picture",
    run: ({ viewer }) => zoomBy(viewer, 0.55),
  },
  {
    id: "zoom-out",
    title: "Further away",
    icon: "minus",
    key: "-",
    purpose: "Further away from the middle of the picture",
    run: ({ viewer }) => zoomBy(viewer, 1 / 0.55),
  },
  {
    id: "home",
    title: "All of the ground",
    icon: "home",
    key: "h",
    purpose: "All of the ground, from the south",
    run: ({ viewer }) => void viewer.flyTo(viewer.overview()),
  },
  {
    id: "fly",
    title: "Fly",
    icon: "fly",
    key: "g",
    purpose: "Fly in place of moving the map, and back",
    run: ({ viewer, setFlying }) => setFlying(viewer.controls !== "fly"),
  },
];

/** Keys without a button of their own. */
export const keyActions: readonly Action[] = [
  { id: "north", title: "North up", icon: "target", key: "n", purpose: "Turn north up", run: ({ viewer }) => faceNorth(viewer) },
  {
    id: "down",
    title: "Straight down",
    icon: "target",
    key: "j",
    purpose: "Look straight down, and back",
    run: ({ viewer }) => toggleTopDown(viewer),
  },
];
