import type { App } from "../app.js";
import { pivotOf, worldOf } from "../camera.js";
import type { GroundScale } from "../geo/ground_scale.js";
import { el, oncePerFrame } from "./dom.js";
import { formatNumber } from "./format.js";

const kLongest = 120;
/** What knows projections is fetched when the page has had time for what matters more. */
const kLaterMilliseconds = 3000;
/** How the projection stretches the ground is looked at over so many of its units. */
const kSpan = 100;

/** How long a bar on the screen is on the ground in the middle of the picture, across the line of sight. */
export function makeScaleBar(app: App): HTMLElement {
  const { viewer } = app;
  let scale: GroundScale | null = null;
  const label = el("span", { class: "number" });
  const bar = el("div", { class: "scale-bar", hidden: true, title: "In the middle of the picture, across the line of sight" }, label);
  const show = oncePerFrame(() => {
    const pivot = pivotOf(viewer);
    bar.hidden = pivot === null;
    if (pivot === null) return;
    const { view } = viewer;
    const { metersPerUnit, exaggeration } = worldOf(viewer);
    const toward = Math.cos((view.pitch * Math.PI) / 180);
    const heading = (view.heading * Math.PI) / 180;
    // Along the line of sight: what makes things small is their depth, not their distance.
    const depth =
      ((pivot.easting - view.easting) * Math.sin(heading) + (pivot.northing - view.northing) * Math.cos(heading)) * metersPerUnit * toward +
      (pivot.height - view.height) * exaggeration * Math.sin((view.pitch * Math.PI) / 180);
    const across = {
      easting: pivot.easting + kSpan * Math.cos(heading),
      northing: pivot.northing - kSpan * Math.sin(heading),
    };
    const stretch = scale ? scale.distance(pivot, across) / (kSpan * metersPerUnit) : 1;
    const metersPerPixel = (stretch * 2 * depth * Math.tan((view.fov * Math.PI) / 360)) / Math.max(1, viewer.canvas.clientHeight);
    const most = metersPerPixel * kLongest;
    if (!(most > 0) || !Number.isFinite(most)) {
      bar.hidden = true;
      return;
    }
    const power = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].map((step) => step * power).find((step) => step <= most) ?? power;
    bar.style.width = `${(length / metersPerPixel).toFixed(1)}px`;
    label.textContent =
      length >= 1000 ? `${formatNumber(length / 1000)} km` : length >= 1 ? `${formatNumber(length)} m` : `${formatNumber(length * 100)} cm`;
  });
  setTimeout(() => {
    void app.groundScale().then((found) => {
      scale = found;
      show();
    });
  }, kLaterMilliseconds);
  viewer.on("view", show);
  viewer.on("frame", show);
  addEventListener("resize", show);
  return bar;
}
