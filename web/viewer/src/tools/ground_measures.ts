import type { DatasetInfo, Place, ProfilePoint } from "terrane";
import type { GroundScale } from "../geo/ground_scale.js";

type Spot = Pick<Place, "easting" | "northing">;
/** Metres from one place to another, level. */
export type Distance = (a: Spot, b: Spot) => number;

/** As the map shows it. */
export function mapDistance(metersPerUnit: number): Distance {
  return (a, b) => Math.hypot(b.easting - a.easting, b.northing - a.northing) * metersPerUnit;
}
/** As it is on the ground, where that is known. */
export function distanceIn(dataset: DatasetInfo, scale: GroundScale | null): Distance {
  return scale ? (a, b) => scale.distance(a, b) : mapDistance(dataset.metersPerUnit);
}

/** Metres along a profile over the ground; where there is none, straight across. */
export function lengthOverGround(points: readonly ProfilePoint[]): number {
  let length = 0;
  let last: ProfilePoint | null = null;
  for (const point of points) {
    if (!Number.isFinite(point.height)) continue;
    if (last) length += Math.hypot(point.distance - last.distance, point.height - last.height);
    last = point;
  }
  return length;
}

/** Metres from corner to corner, level. */
export function lengthOfCorners(corners: readonly Spot[], distance: Distance): number {
  return sumOver(corners, distance);
}
/** Metres from corner to corner through the air. */
export function straightLength(corners: readonly Place[], distance: Distance): number {
  return sumOver(corners, (a, b) => Math.hypot(distance(a, b), b.height - a.height));
}
function sumOver<P>(corners: readonly P[], distance: (a: P, b: P) => number): number {
  let length = 0;
  for (let i = 1; i < corners.length; ++i) {
    const [a, b] = [corners[i - 1], corners[i]];
    if (a && b) length += distance(a, b);
  }
  return length;
}

/** Square metres on the map that a line encloses when its ends are joined. */
export function areaOf(corners: readonly Place[], metersPerUnit: number): number {
  const first = corners[0];
  if (!first || corners.length < 3) return 0;
  let twice = 0;
  for (let i = 0; i < corners.length; ++i) {
    const [a, b] = [corners[i], corners[(i + 1) % corners.length]];
    // Counted from the first corner: eastings and northings are large numbers.
    if (a && b)
      twice += (a.easting - first.easting) * (b.northing - first.northing) - (b.easting - first.easting) * (a.northing - first.northing);
  }
  return Math.abs(twice / 2) * metersPerUnit ** 2;
}

export interface Climb {
  up: number;
  down: number;
  lowest: ProfilePoint | null;
  highest: ProfilePoint | null;
  /** Degrees. */
  steepest: number;
  /** The largest bound of a height's error. */
  error: number;
}

export function climbOf(points: readonly ProfilePoint[]): Climb {
  const out: Climb = { up: 0, down: 0, lowest: null, highest: null, steepest: 0, error: 0 };
  let last: ProfilePoint | null = null;
  for (const point of points) {
    if (!Number.isFinite(point.height)) {
      last = null;
      continue;
    }
    if (Number.isFinite(point.error)) out.error = Math.max(out.error, point.error);
    if (!out.lowest || point.height < out.lowest.height) out.lowest = point;
    if (!out.highest || point.height > out.highest.height) out.highest = point;
    if (last) {
      const rise = point.height - last.height;
      if (rise > 0) out.up += rise;
      else out.down -= rise;
      const run = point.distance - last.distance;
      if (run > 0) out.steepest = Math.max(out.steepest, (Math.atan2(Math.abs(rise), run) * 180) / Math.PI);
    }
    last = point;
  }
  return out;
}
