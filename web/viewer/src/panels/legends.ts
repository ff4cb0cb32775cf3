import type { DatasetInfo, Mode, Settings } from "terrane";
import { el } from "../parts/dom.js";
import { formatNumber } from "../parts/format.js";

/** The engine's colours, as its shaders have them: position from 0 to 1, and sRGB. */
const kEven = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];
const kSlope: [number, string][] = [
  [0, "#f7f7ed"],
  [0.17, "#fae699"],
  [0.33, "#faad5c"],
  [0.5, "#e06147"],
  [0.67, "#942b5c"],
  [1, "#33124d"],
];
const kError: [number, string][] = [
  [0, "#29549e"],
  [0.25, "#8cc2db"],
  [0.42, "#f2f5e0"],
  [0.5, "#fcd44d"],
  [1, "#bf0f1f"],
];

const kWords: Record<Mode, string> = {
  shaded: "Imagery in the sun; where there is none, colours of the height.",
  height: "Height above the vertical datum.",
  slope: "How steep the ground is.",
  normals: "Where the ground faces: red east, green north, blue up.",
  tiles: "A colour of its own for each tile that heights are read from.",
  error: "How far the picture may be off, on the screen: nowhere more than the bound τ once all has come.",
};

/** What the colours of a mode mean. */
export function makeLegend(dataset: DatasetInfo, settings: Readonly<Settings>): HTMLElement {
  const words = el("p", { class: "faint" }, kWords[settings.mode]);
  const bar = barFor(dataset, settings);
  return el("div", { class: "legend" }, words, bar);
}

function barFor(dataset: DatasetInfo, settings: Readonly<Settings>): HTMLElement | null {
  switch (settings.mode) {
    case "height": {
      const { minHeight: low, maxHeight: high } = dataset;
      return colorBar(
        kEven.map((color, i): [number, string] => [i / (kEven.length - 1), color]),
        [0, 0.25, 0.5, 0.75, 1].map((share) => formatNumber(low + (high - low) * share)),
        "m",
      );
    }
    case "slope":
      return colorBar(kSlope, ["0", "15", "30", "45", "60"], "°");
    case "error":
      return colorBar(
        kError,
        ["0", `${formatNumber(settings.tau / 2, 1)}`, `τ = ${formatNumber(settings.tau, 1)}`, "", `${formatNumber(settings.tau * 2, 1)}`],
        "px",
      );
    default:
      return null;
  }
}

function colorBar(stops: [number, string][], labels: string[], unit: string): HTMLElement {
  const gradient = stops.map(([at, color]) => `${color} ${(at * 100).toFixed(1)}%`).join(", ");
  return el(
    "div",
    { class: "color-bar" },
    el("div", { class: "color-ramp", style: `background: linear-gradient(90deg, ${gradient})` }),
    el(
      "div",
      { class: "color-labels number" },
      ...labels.map((label, i) => el("span", {}, i === labels.length - 1 ? `${label} ${unit}` : label)),
    ),
  );
}
