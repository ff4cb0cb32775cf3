import type { Panel } from "../app.js";
import { resultRow, switchControl } from "../parts/controls.js";
import { el, fill } from "../parts/dom.js";
import { formatArea, formatDistance, formatError, formatHeight, formatNumber, windOf } from "../parts/format.js";
import type { GroundScale } from "../geo/ground_scale.js";
import { areaOf, distanceIn, straightLength } from "./ground_measures.js";
import { ProfileKeeper, coarsenessOf } from "./ground_profile.js";
import { Path, pathButtons, whenFiner } from "./path.js";

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
      const profile = keeper.now;
      if (!first || !last || profile === null) {
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
      const straight = straightLength(corners, distanceIn(dataset, scale));
      const { climb } = profile;
      const coarseness = coarsenessOf(profile);
      const bearing = ((Math.atan2(last.easting - first.easting, last.northing - first.northing) * 180) / Math.PI + 360) % 360;
      fill(
        results,
        resultRow("Over the ground", formatDistance(profile.lengthOverGround)),
        resultRow("Straight", formatDistance(straight), "From corner to corner through the air"),
        resultRow("On the map", formatDistance(profile.lengthOnMap), `As ${dataset.crsName} shows it`),
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
          `Heights ${formatError(climb.error)}${coarseness && `, ${coarseness}`}. ${scale ? `Lengths are those on the ellipsoid, on the map those of ${dataset.crsName}.` : `Lengths are those of ${dataset.crsName}.`}`,
        ),
      );
    };
    const renew = (): void => {
      keeper.renew();
      show();
    };
    const path = new Path(app, "measure", { color: "#ffd23f", widthPixels: 3 }, renew);
    const keeper = new ProfileKeeper(
      app,
      () => path.parts,
      () => scale,
      show,
    );
    const area = switchControl(
      "Area",
      isArea,
      (on) => {
        isArea = on;
        show();
      },
      "As if the last point were joined to the first",
    );
    const stop = whenFiner(app, renew);
    renew();
    void app.groundScale().then((found) => {
      scale = found;
      renew();
    });
    return {
      body: el("div", {}, results, area.element, pathButtons(app, path)),
      close: () => {
        stop();
        keeper.close();
        path.close();
        viewer.removeLine("measure/closing");
      },
    };
  },
};
