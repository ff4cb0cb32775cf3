import type { LineStyle } from "../line_store.js";
import { FileError, type ForeignLine, type ForeignLines, PointBudget, cleanName } from "./foreign_lines.js";
import { readStyle, writeStyle } from "./line_style.js";

const kDeepest = 16;

/** The lines, outlines and points in a GeoJSON document (RFC 7946, and the `crs` member of the one before it). */
export function readGeoJson(document: unknown): ForeignLines {
  if (!isObject(document) || typeof document["type"] !== "string") throw new FileError("it is JSON, but not GeoJSON: there is no “type”");
  const out: ForeignLines = { lines: [] };
  Object.assign(out, crsOf(document["crs"]));
  const budget = new PointBudget();
  const features = document["type"] === "FeatureCollection" ? document["features"] : [document];
  if (!Array.isArray(features)) throw new FileError("its “features” are no list");
  for (const feature of features) {
    if (!isObject(feature)) continue;
    const isFeature = feature["type"] === "Feature";
    const properties = isFeature && isObject(feature["properties"]) ? feature["properties"] : {};
    const line: ForeignLine = { name: cleanName(properties["name"] ?? properties["title"]), style: readStyle(properties), parts: [] };
    collect(isFeature ? feature["geometry"] : feature, line, budget, 0);
    if (line.parts.length > 0) out.lines.push(line);
  }
  return out;
}

function collect(geometry: unknown, line: ForeignLine, budget: PointBudget, depth: number): void {
  if (geometry === null || geometry === undefined) return;
  if (!isObject(geometry)) throw new FileError("a geometry in it is no object");
  if (depth > kDeepest) throw new FileError("its geometries are nested too deep");
  const coordinates = geometry["coordinates"];
  const addPart = (value: unknown): void => {
    const points = pointsOf(value);
    budget.spend(points.length);
    if (points.length > 0) line.parts.push(points);
  };
  switch (geometry["type"]) {
    case "LineString":
      return addPart(coordinates);
    case "MultiLineString":
    case "Polygon":
      return listOf(coordinates).forEach(addPart);
    case "MultiPolygon":
      return listOf(coordinates).forEach((polygon) => listOf(polygon).forEach(addPart));
    case "GeometryCollection":
      return listOf(geometry["geometries"]).forEach((each) => collect(each, line, budget, depth + 1));
    case "Point":
      return addPart([coordinates]);
    case "MultiPoint":
      return listOf(coordinates).forEach((point) => addPart([point]));
    default:
      throw new FileError(`it has a geometry of the unknown type “${cleanName(String(geometry["type"]))}”`);
  }
}

function pointsOf(value: unknown): [number, number][] {
  return listOf(value).map((position): [number, number] => {
    const [x, y] = Array.isArray(position) ? (position as unknown[]) : [];
    if (typeof x !== "number" || typeof y !== "number" || !Number.isFinite(x) || !Number.isFinite(y))
      throw new FileError("a position in it is no pair of numbers");
    return [x, y];
  });
}

function listOf(value: unknown): unknown[] {
  if (!Array.isArray(value)) throw new FileError("the coordinates of a geometry are no list");
  return value;
}

/** The CRS that a `crs` member names, and its EPSG number if it has one: 4326 for WGS 84 by any of its names. */
function crsOf(crs: unknown): Pick<ForeignLines, "crsName" | "epsg"> {
  if (crs === undefined || crs === null) return {};
  const crsName = isObject(crs) && isObject(crs["properties"]) ? crs["properties"]["name"] : undefined;
  if (typeof crsName !== "string") throw new FileError("its “crs” has no name");
  if (/CRS84|WGS ?84$/i.test(crsName)) return { crsName, epsg: 4326 };
  const found = /EPSG:+(?:[\d.]*:)?(\d+)$/i.exec(crsName);
  return found ? { crsName, epsg: Number(found[1]) } : { crsName };
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

export interface OutgoingLine extends LineStyle {
  name: string;
  parts: (readonly [number, number])[][];
}

function geometryOf(parts: OutgoingLine["parts"]): object {
  const points = parts.filter((part) => part.length === 1).map(([point]) => point);
  const lines = parts.filter((part) => part.length > 1);
  const ofPoints = points.length === 1 ? { type: "Point", coordinates: points[0] } : { type: "MultiPoint", coordinates: points };
  const ofLines = lines.length === 1 ? { type: "LineString", coordinates: lines[0] } : { type: "MultiLineString", coordinates: lines };
  if (points.length === 0) return ofLines;
  return lines.length === 0 ? ofPoints : { type: "GeometryCollection", geometries: [ofLines, ofPoints] };
}

/** A GeoJSON document of lines; with the name of their CRS unless they are in WGS 84. */
export function writeGeoJson(lines: OutgoingLine[], crsName: string | null): string {
  const features = lines.map(({ name, parts, ...style }) => ({
    type: "Feature",
    properties: { name, ...writeStyle(style) },
    geometry: geometryOf(parts),
  }));
  const crs = crsName === null ? {} : { crs: { type: "name", properties: { name: crsName } } };
  return JSON.stringify({ type: "FeatureCollection", ...crs, features }, null, 1) + "\n";
}
