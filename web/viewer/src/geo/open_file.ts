import type { App } from "../app.js";
import { type LineStyle, type Point, boundsOf, padded } from "../line_store.js";
import { bodyName } from "./body.js";
import { FileError, type ForeignLines, cleanName, isOfPoints, kMostBytes } from "./foreign_lines.js";
import { readGeoJson } from "./geojson.js";
import { readGpx } from "./gpx.js";
import { degreesFrom, epsgOf } from "./projection.js";

/** More features than a list can show go into it as one line. */
const kMostRows = 60;
const kDotPixels = 9;
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
  if (foreign.lines.length === 0) throw new FileError("it has no lines, areas or points");
  const convert = await converterFor(app, foreign);
  const placed = foreign.lines.map(({ name, style, parts }) => ({
    name,
    style: isOfPoints({ parts }) ? { width: kDotPixels, widthUnit: "pixels" as const, ...style } : style,
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
  const points = placed.filter(isOfPoints).flatMap(({ parts }) => parts).length;
  const lines = placed.filter((line) => !isOfPoints(line)).length;
  const bounds = boundsOf(placed.flatMap((line) => line.parts));
  const ground = app.dataset.bounds;
  const isBeside =
    bounds === null || bounds.east < ground.west || bounds.west > ground.east || bounds.north < ground.south || bounds.south > ground.north;
  const counts = [counted(lines, "line"), counted(points, "point")].filter((text) => text !== "").join(" and ");
  const what = `${counts} from “${fileName.slice(0, 60)}”`;
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

function counted(count: number, what: string): string {
  return count === 0 ? "" : `${count} ${what}${count === 1 ? "" : "s"}`;
}
