import type { Place, View, Viewer } from "terrane";

const kDegrees = Math.PI / 180;

/** Nobody gets further away from the middle of the ground than so many of its diagonals, as with the wheel. */
const kFurthestDiagonals = 10;

/** The ground in the middle of the picture, or the nearest there is below it. */
export function pivotOf(viewer: Viewer): Place | null {
  const { clientWidth: width, clientHeight: height } = viewer.canvas;
  for (const share of [0.5, 0.65, 0.8, 0.95]) {
    const found = viewer.pick(width / 2, height * share);
    if (found !== null) return found;
  }
  return null;
}

/** What the camera turns around: where no ground is in the picture, the nearest of all. */
export function turningPointOf(viewer: Viewer): Place | null {
  const found = pivotOf(viewer);
  if (found !== null || viewer.dataset === null) return found;
  const { bounds, minHeight, maxHeight } = viewer.dataset;
  const { easting, northing, height } = viewer.view;
  const clamp = (value: number, low: number, high: number): number => Math.min(Math.max(value, low), high);
  return {
    easting: clamp(easting, bounds.west, bounds.east),
    northing: clamp(northing, bounds.south, bounds.north),
    height: viewer.elevationAt(easting, northing) ?? clamp(height, minHeight, maxHeight),
  };
}

interface World {
  metersPerUnit: number;
  exaggeration: number;
}

/** The same place in the same spot of the picture, from another direction: degrees of heading and pitch. */
export function turnedAround(view: View, pivot: Place, heading: number, pitch: number, world: World): View {
  const eye = offsetOf(view, pivot, world);
  // What the pivot is in the camera's own directions must stay the same.
  const seen = intoCamera(eye, view.heading, view.pitch);
  const turned = outOfCamera(seen, heading, pitch);
  return placed(view, pivot, turned, world, { heading, pitch });
}

/** Nearer to the pivot by a factor below 1, or further away. */
export function scaledAround(view: View, pivot: Place, factor: number, world: World): View {
  const [x, y, z] = offsetOf(view, pivot, world);
  return placed(view, pivot, [x * factor, y * factor, z * factor], world, {});
}

type Vector = readonly [number, number, number];

function offsetOf(view: View, pivot: Place, world: World): Vector {
  return [
    (view.easting - pivot.easting) * world.metersPerUnit,
    (view.northing - pivot.northing) * world.metersPerUnit,
    (view.height - pivot.height) * world.exaggeration,
  ];
}

function placed(view: View, pivot: Place, [x, y, z]: Vector, world: World, change: Partial<View>): View {
  return {
    ...view,
    easting: pivot.easting + x / world.metersPerUnit,
    northing: pivot.northing + y / world.metersPerUnit,
    height: pivot.height + z / world.exaggeration,
    ...change,
  };
}

/** The camera's right, up and backwards, as a rotation of the world. */
function axes(heading: number, pitch: number): readonly [Vector, Vector, Vector] {
  const [sh, ch] = [Math.sin(heading * kDegrees), Math.cos(heading * kDegrees)];
  const [sp, cp] = [Math.sin(pitch * kDegrees), Math.cos(pitch * kDegrees)];
  return [
    [ch, -sh, 0],
    [-sh * sp, -ch * sp, cp],
    [-sh * cp, -ch * cp, -sp],
  ];
}

function intoCamera(v: Vector, heading: number, pitch: number): Vector {
  const [right, up, back] = axes(heading, pitch);
  const dot = (a: Vector): number => a[0] * v[0] + a[1] * v[1] + a[2] * v[2];
  return [dot(right), dot(up), dot(back)];
}

function outOfCamera([r, u, b]: Vector, heading: number, pitch: number): Vector {
  const [right, up, back] = axes(heading, pitch);
  return [right[0] * r + up[0] * u + back[0] * b, right[1] * r + up[1] * u + back[1] * b, right[2] * r + up[2] * u + back[2] * b];
}

export function worldOf(viewer: Viewer): World {
  return { metersPerUnit: viewer.dataset?.metersPerUnit ?? 1, exaggeration: viewer.settings.exaggeration };
}

/** Degrees in [0, 360). */
export const wrapHeading = (degrees: number): number => ((degrees % 360) + 360) % 360;

export function faceNorth(viewer: Viewer): void {
  const view = viewer.view;
  const pivot = turningPointOf(viewer);
  void viewer.flyTo(pivot ? turnedAround(view, pivot, 0, view.pitch, worldOf(viewer)) : { heading: 0 }, { seconds: 0.6 });
}

/** Straight down, or back to a slant. */
export function toggleTopDown(viewer: Viewer): void {
  const view = viewer.view;
  const pitch = view.pitch < -80 ? -35 : -89.9;
  const pivot = turningPointOf(viewer);
  void viewer.flyTo(pivot ? turnedAround(view, pivot, view.heading, pitch, worldOf(viewer)) : { pitch }, { seconds: 0.8 });
}

export function zoomBy(viewer: Viewer, factor: number): void {
  const pivot = turningPointOf(viewer);
  if (pivot === null) return;
  const next = scaledAround(viewer.view, pivot, factor, worldOf(viewer));
  if (factor < 1 || isInReach(viewer, next)) void viewer.flyTo(next, { seconds: 0.35 });
}

function isInReach(viewer: Viewer, view: View): boolean {
  if (viewer.dataset === null) return true;
  const { bounds, minHeight, maxHeight } = viewer.dataset;
  const world = worldOf(viewer);
  const middle = {
    easting: (bounds.west + bounds.east) / 2,
    northing: (bounds.south + bounds.north) / 2,
    height: (minHeight + maxHeight) / 2,
  };
  const corner = offsetOf({ ...view, easting: bounds.east, northing: bounds.north, height: maxHeight }, middle, world);
  return Math.hypot(...offsetOf(view, middle, world)) <= kFurthestDiagonals * 2 * Math.hypot(...corner);
}
