import type { Place } from "terrane";
import type { App } from "../app.js";
import { degreesName } from "../geo/body.js";
import { el, fill, oncePerFrame } from "./dom.js";
import { formatError, formatHeight, formatNumber } from "./format.js";

/** Coordinates and height under the pointer, or in the middle where there is none; a click changes between CRS and degrees. */
export function makeReadout(app: App): HTMLElement {
  const { viewer, dataset } = app;
  const { canvas } = viewer;
  const place = el("span", { class: "number readout-place" });
  const height = el("strong", { class: "number readout-height" });
  const error = el("span", { class: "number faint readout-error" });
  const system = el("span", { class: "faint readout-crs" });
  const element = el("button", { class: "readout", type: "button" }, place, height, error, system);

  let pointer: { x: number; y: number } | null = null;
  let isGeographic = false;
  let toDegrees: ((easting: number, northing: number) => readonly [number, number]) | null = null;

  const show = oncePerFrame(() => {
    const at = pointer ?? { x: canvas.clientWidth / 2, y: canvas.clientHeight / 2 };
    const found = viewer.pick(at.x, at.y);
    element.dataset["where"] = pointer ? "pointer" : "middle";
    system.textContent = isGeographic ? degreesName(dataset) : dataset.crsName;
    if (found === null) {
      fill(place, pointer ? "Beyond the ground" : "No ground in the middle");
      fill(height);
      fill(error);
      return;
    }
    fill(
      place,
      isGeographic && toDegrees
        ? degreesText(toDegrees(found.easting, found.northing))
        : `E ${coordinate(found.easting)}  N ${coordinate(found.northing)}`,
    );
    const bound = errorAt(found);
    fill(height, formatHeight(viewer.elevationAt(found.easting, found.northing) ?? found.height, bound));
    fill(error, formatError(bound));
  });
  const coordinate = (value: number): string => formatNumber(value, dataset.spacingMeters < 5 ? 1 : 0);

  /** The bound of the height's error there: more than the dataset's own where finer ground has not come. */
  const errorAt = ({ easting, northing }: Place): number => {
    const step = dataset.spacingMeters / dataset.metersPerUnit / 100;
    const [first] = viewer.profile(
      [
        { easting, northing },
        { easting: easting + step, northing },
      ],
      2,
    );
    return first && Number.isFinite(first.error) ? first.error : dataset.maxErrorMeters;
  };

  canvas.addEventListener("pointermove", (event) => {
    pointer = event.pointerType === "touch" ? null : { x: event.offsetX, y: event.offsetY };
    show();
  });
  canvas.addEventListener("pointerleave", () => {
    pointer = null;
    show();
  });
  viewer.on("view", show);
  viewer.on("frame", show);
  element.addEventListener("click", () => {
    void app.projection().then((projection) => {
      if (projection === null) {
        app.say(`Longitude and latitude are not known here: the CRS “${dataset.crsName}” is not understood.`, "warning");
        return;
      }
      toDegrees = projection.toDegrees;
      isGeographic = !isGeographic;
      show();
    });
  });
  const datum = dataset.verticalDatum ? ` Heights: ${dataset.verticalDatum}.` : "";
  element.title = `The ground under the pointer, with the bound of its height’s error.${datum}\nClick: coordinates in ${dataset.crsName} or longitude and latitude (${degreesName(dataset)}).`;
  show();
  return element;
}

function degreesText([longitude, latitude]: readonly [number, number]): string {
  const part = (value: number, plus: string, minus: string): string => `${formatNumber(Math.abs(value), 5)}° ${value < 0 ? minus : plus}`;
  return `${part(latitude, "N", "S")}  ${part(longitude, "E", "W")}`;
}
