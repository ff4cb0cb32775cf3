import type { App, Panel } from "../app.js";
import type { GroundScale } from "../geo/ground_scale.js";
import { bodyName } from "../geo/body.js";
import { epsgOf } from "../geo/projection.js";
import { writeGeoJson } from "../geo/geojson.js";
import { type GroundLine, boundsOf, kColors, padded } from "../line_store.js";
import { switchControl } from "../parts/controls.js";
import { download, el, fill } from "../parts/dom.js";
import { formatDistance, formatNumber } from "../parts/format.js";
import { icon } from "../parts/icons.js";
import { lengthOfCorners, mapDistance } from "./ground_measures.js";
import { Path, pathButtons } from "./path.js";
import { profileOf } from "./profile.js";

export const linesTool: Panel = {
  id: "lines",
  title: "Lines",
  icon: "lines",
  key: "b",
  purpose: "Draw lines on the ground, open and save them as GeoJSON, open GPX",
  open(app) {
    const { lines } = app;
    const list = el("ul", { class: "line-list" });
    const hint = el("p", { class: "faint" });
    const drawing = el("div");
    let path: Path | null = null;
    let scale: GroundScale | null = null;

    const setDrawing = (on: boolean): void => {
      path?.close();
      path = null;
      if (on) {
        const color = kColors[lines.lines.length % kColors.length] ?? kColors[0];
        const next: Path = (path = new Path(
          app,
          "drawing",
          { color, widthPixels: 3 },
          () => showHint(),
          () => {
            lines.add("", [next.corners.map(({ easting, northing }) => ({ easting, northing }))], { color });
            // The next click begins another one.
            setDrawing(true);
          },
        ));
        fill(
          drawing,
          pathButtons(app, next),
          el(
            "button",
            { class: "primary", type: "button", "data-do": "finish", on: { click: () => next.finish() } },
            icon("check"),
            "Finish this line",
          ),
        );
      } else {
        fill(drawing);
      }
      showHint();
    };
    const showHint = (): void => {
      const corners = path?.corners.length ?? 0;
      hint.textContent =
        path === null
          ? ""
          : corners === 0
            ? "Click on the ground where a line begins."
            : corners === 1
              ? "Click where it goes on."
              : `${corners} points. Enter or a double click ends the line.`;
      hint.hidden = path === null;
    };
    const show = (): void => {
      const all = lines.lines;
      save.disabled = all.length === 0;
      fill(
        list,
        ...(all.length > 0
          ? all.map((line) => rowFor(app, line, scale))
          : [el("li", { class: "faint" }, "No lines yet. GeoJSON and GPX files can also be dropped on the page.")]),
      );
    };
    const save = el(
      "button",
      { class: "secondary", type: "button", "data-do": "save", on: { click: () => void saveLines(app) } },
      icon("download"),
      "Save all",
    );
    const draw = switchControl("Draw", true, setDrawing, "Clicks on the ground add points; drags go on moving the map");
    const stop = lines.onChange(show);
    setDrawing(true);
    show();
    void app.groundScale().then((found) => {
      scale = found;
      show();
    });
    return {
      body: el(
        "div",
        {},
        draw.element,
        hint,
        drawing,
        el("h3", {}, "On the ground"),
        list,
        el(
          "div",
          { class: "buttons" },
          el("button", { class: "secondary", type: "button", on: { click: () => app.openFiles() } }, icon("open"), "Open"),
          save,
        ),
      ),
      close: () => {
        stop();
        // What somebody drew is not lost because they forgot to end it.
        path?.finish();
        path?.close();
      },
    };
  },
};

function rowFor(app: App, line: GroundLine, scale: GroundScale | null): HTMLElement {
  const { lines, viewer } = app;
  const color = el("input", {
    type: "color",
    value: line.color,
    "aria-label": `Colour of ${line.name}`,
    on: { change: () => lines.change(line.id, { color: color.value }) },
  });
  const width = el("input", {
    type: "number",
    min: 0.5,
    max: 1000,
    step: 0.5,
    value: line.width,
    "aria-label": `Width of ${line.name}`,
    on: {
      change: () => {
        const value = Number(width.value);
        if (value > 0 && value <= 10000) lines.change(line.id, { width: value });
        else width.value = String(line.width);
      },
    },
  });
  const unit = el(
    "select",
    {
      "aria-label": `Unit of the width of ${line.name}`,
      on: { change: () => lines.change(line.id, { widthUnit: unit.value === "meters" ? "meters" : "pixels" }) },
    },
    el("option", { value: "pixels" }, "px"),
    el("option", { value: "meters" }, "m"),
  );
  unit.value = line.widthUnit;
  const onMap = mapDistance(app.dataset.metersPerUnit);
  const length = line.parts.reduce((sum, part) => sum + (scale?.length(part) ?? lengthOfCorners(part, onMap)), 0);
  const points = line.parts.reduce((sum, part) => sum + part.length, 0);
  const hasLegs = line.parts.some((part) => part.length > 1);
  const size = `${formatNumber(points)} ${points === 1 ? "point" : "points"}`;
  const name = el("input", {
    class: "line-name",
    type: "text",
    value: line.name,
    maxlength: 80,
    "aria-label": "Name",
    on: { change: () => lines.change(line.id, { name: name.value }) },
  });
  return el(
    "li",
    { class: "line-row", "data-line": line.id },
    el(
      "div",
      { class: "line-head" },
      color,
      name,
      el(
        "button",
        {
          class: "plain",
          type: "button",
          title: "Go there",
          "aria-label": `Go to ${line.name}`,
          on: {
            click: () => {
              const bounds = boundsOf(line.parts);
              if (bounds) void viewer.flyTo(viewer.overview(padded(bounds)));
            },
          },
        },
        icon("target"),
      ),
      el(
        "button",
        {
          class: "plain",
          type: "button",
          title: "Profile",
          hidden: !hasLegs,
          "aria-label": `Profile of ${line.name}`,
          on: {
            click: () => app.panels.open(profileOf(line.name, line.parts.filter((part) => part.length > 1))),
          },
        },
        icon("profile"),
      ),
      el(
        "button",
        {
          class: "plain",
          type: "button",
          title: "Delete",
          "aria-label": `Delete ${line.name}`,
          on: { click: () => lines.remove(line.id) },
        },
        icon("trash"),
      ),
    ),
    el(
      "div",
      { class: "line-foot faint" },
      el("span", { class: "number" }, hasLegs ? `${formatDistance(length)}, ${size}` : size),
      el("span", { class: "unit" }, width, unit),
    ),
  );
}

/** In WGS 84, as GeoJSON should be, where that is known of the dataset's CRS; else in that CRS, named: on other bodies always. */
async function saveLines(app: App): Promise<void> {
  const { dataset } = app;
  const projection = dataset.ellipsoid.isEarth ? await app.projection() : null;
  const epsg = epsgOf(dataset);
  const round = (value: number, digits: number): number => Number(value.toFixed(digits));
  const outgoing = app.lines.lines.map(({ name, color, width, widthUnit, parts }) => ({
    name,
    color,
    width,
    widthUnit,
    parts: parts.map((part) =>
      part.map(({ easting, northing }) => {
        if (projection === null) return [round(easting, 3), round(northing, 3)] as const;
        const [longitude, latitude] = projection.toDegrees(easting, northing);
        return [round(longitude, 8), round(latitude, 8)] as const;
      }),
    ),
  }));
  const crsName = projection !== null ? null : epsg !== null ? `urn:ogc:def:crs:EPSG::${epsg}` : dataset.crsName;
  download(`${dataset.name}-lines.geojson`, new Blob([writeGeoJson(outgoing, crsName)], { type: "application/geo+json" }));
  const why = dataset.ellipsoid.isEarth ? "its way to WGS 84 is not known here" : `WGS 84 is the Earth’s, and this is ${bodyName(dataset)}`;
  app.say(projection !== null ? "Saved in WGS 84." : `Saved in ${dataset.crsName}: ${why}.`);
}
