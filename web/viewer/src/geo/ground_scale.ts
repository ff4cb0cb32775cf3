import type { DatasetInfo, ProfilePoint } from "terrane";
import type { Projection } from "./projection.js";

interface Spot {
  easting: number;
  northing: number;
}
/** What a step of one unit in easting and in northing is on the ground, in metres to the east and to the north. */
interface Stretch {
  eastOfEasting: number;
  northOfEasting: number;
  eastOfNorthing: number;
  northOfNorthing: number;
}

const kEarth = { radius: 6378137, flattening: 1 / 298.257223563 };
const kRadians = Math.PI / 180;
/** Lines longer than that are looked at in parts. */
const kPartMeters = 20e3;
/** So many points one after the other are stretched alike at least, so that no line needs more stretches than that. */
const kLeastAlike = 16;
const kMostStretches = 256;

/** Lengths and areas as they are on the ellipsoid: no projection shows all of them as they are, web Mercator at 60 degrees twice
 * as long. Heights above it would make them longer by a part in 6,400 for each kilometre; that is left out. */
export class GroundScale {
  constructor(
    private readonly projection: Projection,
    private readonly body: { radius: number; flattening: number },
    private readonly metersPerUnit: number,
  ) {}

  /** Metres along a line that is straight in the dataset's CRS. */
  distance(a: Spot, b: Spot): number {
    const flat = Math.hypot(b.easting - a.easting, b.northing - a.northing) * this.metersPerUnit;
    const parts = Math.max(1, Math.ceil(flat / kPartMeters));
    const step = { easting: (b.easting - a.easting) / parts, northing: (b.northing - a.northing) / parts };
    let length = 0;
    for (let i = 0; i < parts; ++i) {
      const middle = { easting: a.easting + (i + 0.5) * step.easting, northing: a.northing + (i + 0.5) * step.northing };
      length += lengthOf(this.stretchAt(middle), step.easting, step.northing);
    }
    return length;
  }

  /** A profile whose distances are metres on the ground. */
  along(points: readonly ProfilePoint[]): ProfilePoint[] {
    const distances = this.distances(points);
    return points.map((point, i) => ({ ...point, distance: distances[i] ?? NaN }));
  }

  /** Metres along a line of many points that lie close together. */
  length(points: readonly Spot[]): number {
    return this.distances(points).at(-1) ?? 0;
  }

  private distances(points: readonly Spot[]): number[] {
    const alike = Math.max(kLeastAlike, Math.ceil(points.length / kMostStretches));
    let stretch: Stretch | null = null;
    let distance = 0;
    return points.map((point, i) => {
      const before = points[i - 1];
      if (!before) return 0;
      if (stretch === null || i % alike === 0) stretch = this.stretchAt(points[Math.min(i + (alike >> 1), points.length - 1)] ?? point);
      return (distance += lengthOf(stretch, point.easting - before.easting, point.northing - before.northing));
    });
  }

  /** Square metres that a line encloses when its ends are joined. */
  area(corners: readonly Spot[]): number {
    const first = corners[0];
    let twice = 0;
    for (let i = 1; first && i + 1 < corners.length; ++i) {
      const [a, b] = [corners[i], corners[i + 1]];
      if (!a || !b) continue;
      const across =
        (a.easting - first.easting) * (b.northing - first.northing) - (b.easting - first.easting) * (a.northing - first.northing);
      const s = this.stretchAt({
        easting: (first.easting + a.easting + b.easting) / 3,
        northing: (first.northing + a.northing + b.northing) / 3,
      });
      twice += across * Math.abs(s.eastOfEasting * s.northOfNorthing - s.northOfEasting * s.eastOfNorthing);
    }
    return Math.abs(twice / 2);
  }

  private stretchAt({ easting, northing }: Spot): Stretch {
    const reach = 5 / this.metersPerUnit;
    const [lon, lat] = this.projection.toDegrees(easting, northing);
    const [lonWest, latWest] = this.projection.toDegrees(easting - reach, northing);
    const [lonEast, latEast] = this.projection.toDegrees(easting + reach, northing);
    const [lonSouth, latSouth] = this.projection.toDegrees(easting, northing - reach);
    const [lonNorth, latNorth] = this.projection.toDegrees(easting, northing + reach);
    if (!Number.isFinite(lon)) return plain(this.metersPerUnit);
    // Radii of curvature along the parallel and along the meridian.
    const { radius, flattening } = this.body;
    const e2 = flattening * (2 - flattening);
    const w = 1 - e2 * Math.sin(lat * kRadians) ** 2;
    const east = ((radius / Math.sqrt(w)) * Math.cos(lat * kRadians) * kRadians) / (2 * reach);
    const north = ((radius * (1 - e2)) / w ** 1.5 / (2 * reach)) * kRadians;
    const out = {
      eastOfEasting: east * turn(lonEast - lonWest),
      northOfEasting: north * (latEast - latWest),
      eastOfNorthing: east * turn(lonNorth - lonSouth),
      northOfNorthing: north * (latNorth - latSouth),
    };
    return Object.values(out).every(Number.isFinite) ? out : plain(this.metersPerUnit);
  }
}

/** Null where the way from the dataset's CRS to degrees is not known. */
export function groundScaleOf(dataset: DatasetInfo, projection: Projection | null): GroundScale | null {
  if (projection === null) return null;
  // Degrees are WGS 84's whatever ellipsoid of the earth the CRS has; other bodies are as they say.
  const { ellipsoid, metersPerUnit } = dataset;
  const body = ellipsoid.isEarth ? kEarth : { radius: ellipsoid.semiMajorMeters, flattening: ellipsoid.flattening };
  return new GroundScale(projection, body, metersPerUnit);
}

function lengthOf(s: Stretch, easting: number, northing: number): number {
  return Math.hypot(s.eastOfEasting * easting + s.eastOfNorthing * northing, s.northOfEasting * easting + s.northOfNorthing * northing);
}
function plain(metersPerUnit: number): Stretch {
  return { eastOfEasting: metersPerUnit, northOfEasting: 0, eastOfNorthing: 0, northOfNorthing: metersPerUnit };
}
/** A difference of longitudes, the short way round. */
function turn(degrees: number): number {
  return degrees - 360 * Math.round(degrees / 360);
}
