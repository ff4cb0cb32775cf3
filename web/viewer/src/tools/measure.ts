import type { Panel } from "../app.js";
import { resultRow, switchControl } from "../parts/controls.js";
import { el, fill } from "../parts/dom.js";
import { formatArea, formatDistance, formatError, formatHeight, formatNumber, windOf } from "../parts/format.js";
import type { GroundScale } from "../geo/ground_scale.js";
import { areaOf, climbOf, distanceIn, lengthOfCorners, lengthOverGround, mapDistance, straightLength } from "./ground_measures.js";
import { Path, pathButtons, whenFiner } from "./path.js";

/** Samples of the ground between two corners: enough for its folds. */
const kSamplesPerSegment = 256;
const kMostSamples = 2048;

export const measureTool: Panel = {
  id: "measure",
  title: "Measure",
  icon: "measure",
  key: "m",
  purpose: "Distances over the ground and straight, height differences, areas",
  open(app) {
    const { viewer, dataset } = app;
    const results = el("div", { class: "results", "aria-live": "polite" });
    let isArea = false;
    let scale: GroundScale | null = null;
    const show = (): void => {
      const corners = path.corners.map((corner) => ({
        ...corner,
        height: viewer.elevationAt(corner.easting, corner.northing) ?? corner.height,
      }));
      const [first, last] = [corners[0], corners.at(-1)];
      // An area's last side joins its ends.
      if (isArea && corners.length >= 3 && first)
        viewer.setLine("measure/closing", { points: [corners.at(-1) ?? first, first], color: "#ffd23f", widthPixels: 1.5 });
      else viewer.removeLine("measure/closing");
      if (!first || !last || corners.length < 2) {
        fill(
          results,
          el(
            "p",
            { class: "faint" },
            corners.length === 0 ? "Click on the ground where to begin." : "Click where to go on. Enter or a double click ends.",
          ),
        );
        return;
      }
      const samples = Math.min(kMostSamples, (corners.length - 1) * kSamplesPerSegment + 1);
      const onMap = viewer.profile(corners, samples);
      const profile = scale?.along(onMap) ?? onMap;
      const flat = lengthOfCorners(corners, mapDistance(dataset.metersPerUnit));
      const straight = straightLength(corners, distanceIn(dataset, scale));
      const climb = climbOf(profile);
      const bearing = ((Math.atan2(last.easting - first.easting, last.northing - first.northing) * 180) / Math.PI + 360) % 360;
      fill(
        results,
        resultRow("Over the ground", formatDistance(lengthOverGround(profile))),
        resultRow("Straight", formatDistance(straight), "From corner to corner through the air"),
        resultRow("On the map", formatDistance(flat), `As ${dataset.crsName} shows it`),
        resultRow(
          "Height difference",
          `${last.height > first.height ? "+" : ""}${formatHeight(last.height - first.height, climb.error)}`,
          "From the first point to the last",
        ),
        resultRow("Up, down", `${formatNumber(climb.up)}, ${formatNumber(climb.down)} m`),
        corners.length === 2
          ? resultRow("Direction", `${formatNumber(bearing, 1)}° ${windOf(bearing)}`, "Clockwise from grid north")
          : null,
        isArea
          ? resultRow(
              scale ? "Area" : "Area on the map",
              corners.length < 3 ? "needs three points" : formatArea(scale?.area(corners) ?? areaOf(corners, dataset.metersPerUnit)),
              "Level, however the ground rises",
            )
          : null,
        el(
          "p",
          { class: "faint" },
          `Heights ${formatError(climb.error)}. ${scale ? `Lengths are those on the ellipsoid, on the map those of ${dataset.crsName}.` : `Lengths are those of ${dataset.crsName}.`}`,
        ),
      );
    };
    const path = new Path(app, "measure", { color: "#ffd23f", widthPixels: 3 }, () => show());
    const area = switchControl(
      "Area",
      isArea,
      (on) => {
        isArea = on;
        show();
      },
      "As if the last point were joined to the first",
    );
    const stop = whenFiner(app, show);
    show();
    void app.groundScale().then((found) => {
      scale = found;
      show();
    });
    return {
      body: el("div", {}, results, area.element, pathButtons(app, path)),
      close: () => {
        stop();
        path.close();
        viewer.removeLine("measure/closing");
      },
    };
  },
};
