import type { App } from "../app.js";
import { type LineStyle, type Point, boundsOf } from "../line_store.js";
import { bodyName } from "./body.js";
import { FileError, type ForeignLines, cleanName, kMostBytes } from "./foreign_lines.js";
import { readGeoJson } from "./geojson.js";
import { readGpx } from "./gpx.js";
import { degreesFrom, epsgOf } from "./projection.js";

/** More features than a list can show go into it as one line. */
const kMostRows = 60;
/** No CRS counts further, on bodies that have ground. */
const kFurthestMeters = 1e8;

/** Takes files as they were dropped: GeoJSON and GPX become lines, a flight is flown. Says what came of each. */
export async function openFiles(app: App, files: Iterable<File>): Promise<void> {
  for (const file of files) {
    try {
      await openFile(app, file);
    } catch (error) {
      if (!(error instanceof FileError)) reportError(error);
      const why = error instanceof FileError ? error.message : "something unexpected went wrong";
      app.say(`“${file.name.slice(0, 60)}” was not opened: ${why}.`, "warning");
    }
  }
}

async function openFile(app: App, file: File): Promise<void> {
  if (file.size > kMostBytes) throw new FileError(`it is larger than ${kMostBytes / 2 ** 20} MB`);
  if (file.size === 0) throw new FileError("it is empty");
  const text = (await file.text()).replace(/^\ufeff/, "");
  const isXml = text.trimStart().startsWith("<");
  if (isXml) return showLines(app, file.name, readGpx(text));
  let document: unknown;
  try {
    document = JSON.parse(text);
  } catch {
    throw new FileError("it is neither GeoJSON, GPX nor a flight");
  }
  if (typeof document === "object" && document !== null && "terraneFlight" in document) {
    const problem = app.flights.load(text, file.name);
    if (problem !== "") throw new FileError(problem);
    app.flights.replay();
    return;
  }
  await showLines(app, file.name, readGeoJson(document));
}

async function showLines(app: App, fileName: string, foreign: ForeignLines): Promise<void> {
  const single = foreign.pointsLeftOut === 1 ? "1 single point" : `${foreign.pointsLeftOut} single points`;
  const leftOut = foreign.pointsLeftOut > 0 ? `${single} left out` : "";
  if (foreign.lines.length === 0) throw new FileError(leftOut ? `it has no lines, only ${single}` : "it has no lines");
  const convert = await converterFor(app, foreign);
  const placed = foreign.lines.map(({ name, style, parts }) => ({
    name,
    style,
    parts: parts.map((part) =>
      part.map(([x, y]): Point => {
        const [easting, northing] = convert(x, y);
        if (!(Math.max(Math.abs(easting), Math.abs(northing)) * app.dataset.metersPerUnit <= kFurthestMeters))
          throw new FileError(`the place ${x}, ${y} has none in ${app.dataset.crsName}`);
        return { easting, northing };
      }),
    ),
  }));
  const plainName = fileName.replace(/\.[^.]*$/, "").slice(0, 60);
  if (placed.length > kMostRows)
    app.lines.add(
      plainName,
      placed.flatMap((line) => line.parts),
      commonStyle(placed.map((line) => line.style)),
    );
  else for (const line of placed) app.lines.add(line.name || plainName, line.parts, line.style);
  const count = placed.length;
  const bounds = boundsOf(placed.flatMap((line) => line.parts));
  const ground = app.dataset.bounds;
  const isBeside =
    bounds === null || bounds.east < ground.west || bounds.west > ground.east || bounds.north < ground.south || bounds.south > ground.north;
  const what = `${count} ${count === 1 ? "line" : "lines"} from “${fileName.slice(0, 60)}”${leftOut ? `, ${leftOut}` : ""}`;
  if (isBeside) {
    app.say(`${what}: all of it lies beside this dataset’s ground.`, "warning");
    return;
  }
  app.say(`${what}.`);
  void app.viewer.flyTo(app.viewer.overview(padded(bounds)));
}

/** What all of them have. */
function commonStyle(styles: Partial<LineStyle>[]): Partial<LineStyle> {
  const first = styles[0] ?? {};
  const isCommon = (name: keyof LineStyle): boolean => styles.every((style) => style[name] === first[name]);
  return {
    ...(isCommon("color") && first.color !== undefined ? { color: first.color } : {}),
    ...(isCommon("width") && isCommon("widthUnit") && first.width !== undefined ? { width: first.width, widthUnit: first.widthUnit ?? "pixels" } : {}),
  };
}

/** From the file's places to the dataset's. */
async function converterFor(app: App, foreign: ForeignLines): Promise<(x: number, y: number) => readonly [number, number]> {
  const own = epsgOf(app.dataset);
  const asItIs = (x: number, y: number): readonly [number, number] => [x, y];
  const { dataset } = app;
  if (foreign.crsName === dataset.crsName || (foreign.epsg !== undefined && foreign.epsg === own)) return asItIs;
  if (foreign.crsName !== undefined && foreign.epsg === undefined)
    throw new FileError(`its CRS “${cleanName(foreign.crsName)}” is not understood`);
  // EPSG's numbers are of the Earth.
  if (foreign.epsg !== undefined && !dataset.ellipsoid.isEarth)
    throw new FileError(`it has places on the Earth, and this ground is on ${bodyName(dataset)}`);
  const bounds = boundsOf(
    foreign.lines.flatMap((line) => line.parts.map((part) => part.map(([easting, northing]) => ({ easting, northing })))),
  );
  const areDegrees = bounds !== null && bounds.west >= -360 && bounds.east <= 360 && bounds.south >= -90 && bounds.north <= 90;
  // Numbers that are no degrees, in a file that names no CRS, can only be meant in the dataset's.
  if (foreign.epsg === undefined && !areDegrees) return asItIs;

  const projection = await app.projection();
  if (projection === null)
    throw new FileError(`it is in longitude and latitude, and the dataset's CRS “${app.dataset.crsName}” is not understood`);
  if (foreign.epsg === undefined || foreign.epsg === 4326) {
    if (!areDegrees) throw new FileError("it says that it is in longitude and latitude, and has numbers that are neither");
    return projection.fromDegrees;
  }
  const toDegrees = await degreesFrom(foreign.epsg);
  if (toDegrees === null)
    throw new FileError(`its CRS EPSG:${foreign.epsg} is neither the dataset's nor one that is known here. Save it in WGS 84`);
  return (x, y) => projection.fromDegrees(...toDegrees(x, y));
}

/** A tenth more on each side, and never nothing. */
function padded(bounds: { west: number; south: number; east: number; north: number }): typeof bounds {
  const pad = Math.max(0.1 * (bounds.east - bounds.west), 0.1 * (bounds.north - bounds.south), 50);
  return { west: bounds.west - pad, south: bounds.south - pad, east: bounds.east + pad, north: bounds.north + pad };
}
