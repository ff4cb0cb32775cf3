import type { DatasetInfo } from "terrane";

/** Between WGS 84 and a dataset's CRS. */
export interface Projection {
  /** Easting and northing of a longitude and latitude in degrees; NaN where the projection has no place for it. */
  fromDegrees(longitude: number, latitude: number): readonly [number, number];
  toDegrees(easting: number, northing: number): readonly [number, number];
}

type Proj4 = (typeof import("./proj4_core.js"))["default"];

/** Loads what knows projections; null where it does not understand the dataset's. */
export async function projectionOf(dataset: DatasetInfo): Promise<Projection | null> {
  const proj4 = (await import("./proj4_core.js")).default;
  for (const definition of definitionsOf(dataset)) {
    const found = tryDefinition(proj4, definition, dataset);
    if (found !== null) return found;
  }
  return null;
}

/** Another CRS's places in degrees, by its EPSG number; null where that is not one of those known. */
export async function degreesFrom(epsg: number): Promise<((x: number, y: number) => readonly [number, number]) | null> {
  const definition = definitionOfEpsg(epsg);
  if (definition === null) return null;
  const proj4 = (await import("./proj4_core.js")).default;
  const converter = proj4(definition, "WGS84");
  return (x, y) => pairOf(() => converter.forward([x, y]));
}

/** WGS 84 in UTM zones, ETRS89 in UTM zones, and the web's Mercator: what needs no list. */
function definitionOfEpsg(epsg: number): string | null {
  const zone = epsg % 100;
  const isZone = zone >= 1 && zone <= 60;
  if (epsg === 3857) return "+proj=merc +a=6378137 +b=6378137 +lat_ts=0 +lon_0=0 +x_0=0 +y_0=0 +k=1 +units=m +nadgrids=@null +no_defs";
  if (epsg >= 32601 && epsg <= 32660) return `+proj=utm +zone=${zone} +datum=WGS84 +units=m +no_defs`;
  if (epsg >= 32701 && epsg <= 32760) return `+proj=utm +zone=${zone} +south +datum=WGS84 +units=m +no_defs`;
  if (epsg >= 25828 && epsg <= 25838 && isZone) return `+proj=utm +zone=${zone} +ellps=GRS80 +towgs84=0,0,0 +units=m +no_defs`;
  return null;
}

function definitionsOf(dataset: DatasetInfo): string[] {
  const out: string[] = [];
  const projected = /PROJCRS|PROJCS|PROJECTEDCRS/.exec(dataset.crsWkt);
  if (projected) out.push(balanced(dataset.crsWkt.slice(projected.index)));
  const epsg = epsgOf(dataset);
  const byNumber = epsg === null ? null : definitionOfEpsg(epsg);
  if (byNumber) out.push(byNumber);
  const zone = /UTM zone (\d{1,2})\s*([NS])/i.exec(dataset.crsName);
  if (zone) out.push(`+proj=utm +zone=${zone[1]} ${/s/i.test(zone[2] ?? "") ? "+south " : ""}+datum=WGS84 +units=m +no_defs`);
  return out;
}

/** Of a compound CRS only what lies flat: from its first bracket to the one that closes it. */
function balanced(wkt: string): string {
  let depth = 0;
  let isQuoted = false;
  for (let i = 0; i < wkt.length; ++i) {
    const letter = wkt[i];
    if (letter === '"') isQuoted = !isQuoted;
    if (isQuoted) continue;
    if (letter === "[" || letter === "(") ++depth;
    if ((letter === "]" || letter === ")") && --depth === 0) return wkt.slice(0, i + 1);
  }
  return wkt;
}

/** The number of the dataset's CRS, if it has one: the last identifier of its WKT is that of the whole. */
export function epsgOf(dataset: DatasetInfo): number | null {
  const projected = /PROJCRS|PROJCS|PROJECTEDCRS/.exec(dataset.crsWkt);
  const wkt = projected ? balanced(dataset.crsWkt.slice(projected.index)) : dataset.crsWkt;
  const found = /(?:ID|AUTHORITY)\["EPSG",\s*"?(\d+)"?\]\s*\]\s*$/.exec(wkt) ?? /EPSG:(\d+)/.exec(dataset.crsName);
  return found ? Number(found[1]) : null;
}

function tryDefinition(proj4: Proj4, definition: string, dataset: DatasetInfo): Projection | null {
  try {
    const converter = proj4("WGS84", definition);
    const projection: Projection = {
      fromDegrees: (longitude, latitude) => pairOf(() => converter.forward([longitude, latitude])),
      toDegrees: (easting, northing) => pairOf(() => converter.inverse([easting, northing])),
    };
    // It is believed when the dataset's middle comes back from there and from here.
    const { west, east, south, north } = dataset.bounds;
    const [x, y] = [(west + east) / 2, (south + north) / 2];
    const [longitude, latitude] = projection.toDegrees(x, y);
    const [backX, backY] = projection.fromDegrees(longitude, latitude);
    const isRight = Math.abs(longitude) <= 180 && Math.abs(latitude) <= 90 && Math.hypot(backX - x, backY - y) * dataset.metersPerUnit < 1;
    return isRight ? projection : null;
  } catch {
    return null;
  }
}

function pairOf(convert: () => number[]): readonly [number, number] {
  try {
    const [x = NaN, y = NaN] = convert();
    return [x, y];
  } catch {
    return [NaN, NaN];
  }
}
