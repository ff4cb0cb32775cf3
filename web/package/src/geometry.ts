import type { Place, View } from "./api.js";

/**
 * The viewer's own arithmetic. *World*: metres, x east, y north, z up and exaggerated, counted from the CRS's origin; the camera
 * lives there, as in the engine.
 */
export type Vector = readonly [number, number, number];

export const kDegrees = Math.PI / 180;
/** Straight down has no heading; so near to it nobody sees the difference. */
export const kSteepestPitch = 89.95;

export const add = (a: Vector, b: Vector): Vector => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vector, factor: number): Vector => [a[0] * factor, a[1] * factor, a[2] * factor];
export const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vector): number => Math.hypot(a[0], a[1], a[2]);

export const clamp = (value: number, low: number, high: number): number => Math.min(Math.max(value, low), high);
/** Degrees in [0, 360). */
export const wrapHeading = (degrees: number): number => ((degrees % 360) + 360) % 360;
/** The shortest way from one heading to another, degrees in [-180, 180). */
export const turnBetween = (from: number, to: number): number => wrapHeading(to - from + 180) - 180;

/** How world and CRS relate. */
export interface WorldScale {
  metersPerUnit: number;
  exaggeration: number;
}

export function worldFromPlace(place: Place, world: WorldScale): Vector {
  return [place.easting * world.metersPerUnit, place.northing * world.metersPerUnit, place.height * world.exaggeration];
}
export function placeFromWorld(at: Vector, world: WorldScale): Place {
  return { easting: at[0] / world.metersPerUnit, northing: at[1] / world.metersPerUnit, height: at[2] / world.exaggeration };
}

/** A box of the world, along its axes. */
export interface Box {
  low: Vector;
  high: Vector;
}

export function nearestOf({ low, high }: Box, at: Vector): Vector {
  return [clamp(at[0], low[0], high[0]), clamp(at[1], low[1], high[1]), clamp(at[2], low[2], high[2])];
}

/** The way from one point to another, ended where it leaves the ball; one from outside it may only come nearer. */
export function stayInBall(from: Vector, to: Vector, middle: Vector, radius: number): Vector {
  const begin = subtract(from, middle);
  const end = subtract(to, middle);
  if (length(end) <= Math.max(radius, length(begin))) return to;
  if (length(begin) >= radius) return from;
  const way = subtract(to, from);
  const [a, b, c] = [dot(way, way), dot(way, begin), dot(begin, begin) - radius * radius];
  return add(from, scale(way, (Math.sqrt(b * b - a * c) - b) / a));
}

/** The camera's directions in the world, all of length 1. */
export interface Basis {
  right: Vector;
  up: Vector;
  forward: Vector;
}

export function basisOf(view: View): Basis {
  const heading = view.heading * kDegrees;
  const pitch = clamp(view.pitch, -kSteepestPitch, kSteepestPitch) * kDegrees;
  const [sh, ch, sp, cp] = [Math.sin(heading), Math.cos(heading), Math.sin(pitch), Math.cos(pitch)];
  return { forward: [sh * cp, ch * cp, sp], right: [ch, -sh, 0], up: [-sh * sp, -ch * sp, cp] };
}

/** A picture on the page: its size in CSS pixels. */
export interface Canvas {
  width: number;
  height: number;
}

/** Direction of the ray through a point of the canvas; its part along `forward` is 1. */
export function rayThrough(view: View, canvas: Canvas, x: number, y: number): Vector {
  const { right, up, forward } = basisOf(view);
  const half = Math.tan((view.fov * kDegrees) / 2);
  const perPixel = (2 * half) / canvas.height;
  return add(forward, add(scale(right, (x - canvas.width / 2) * perPixel), scale(up, (canvas.height / 2 - y) * perPixel)));
}

/** Where a point of the world is on the canvas; null behind the camera. */
export function pixelOf(view: View, canvas: Canvas, world: WorldScale, at: Vector): { x: number; y: number } | null {
  const { right, up, forward } = basisOf(view);
  const offset = subtract(at, worldFromPlace(view, world));
  const depth = dot(offset, forward);
  if (!(depth > 0)) return null;
  const perTangent = canvas.height / 2 / Math.tan((view.fov * kDegrees) / 2);
  return {
    x: canvas.width / 2 + (dot(offset, right) / depth) * perTangent,
    y: canvas.height / 2 - (dot(offset, up) / depth) * perTangent,
  };
}

/** The view from one point of the world to another. */
export function viewBetween(eye: Vector, target: Vector, fov: number, world: WorldScale): View {
  const way = subtract(target, eye);
  const flat = Math.hypot(way[0], way[1]);
  return {
    ...placeFromWorld(eye, world),
    heading: wrapHeading(Math.atan2(way[0], way[1]) / kDegrees),
    pitch: clamp(Math.atan2(way[2], flat) / kDegrees, -kSteepestPitch, kSteepestPitch),
    fov,
  };
}

/** Of the canvas's width and height, what an overview fills. */
const kFill = 0.92;
/** An overview looks down so steeply. */
const kOverviewTilt = 34 * kDegrees;

/** A view from the south that sees all corners, around `middle`, close to filling the canvas. */
export function viewOfCorners(corners: Vector[], middle: Vector, fov: number, canvas: Canvas, world: WorldScale): View {
  const back: Vector = [0, -Math.cos(kOverviewTilt), Math.sin(kOverviewTilt)];
  const size = Math.max(...corners.map((corner) => length(subtract(corner, middle))), 1);
  let target = middle;
  let view = viewBetween(add(target, scale(back, size)), target, fov, world);
  // Far ground takes less of the picture than near ground: where the middle has to be shows by trying.
  for (let turn = 0; turn < 6; ++turn) {
    const at = (far: number): View => viewBetween(add(target, scale(back, far)), target, fov, world);
    const extent = (from: View): { width: number; low: number; high: number } | null => {
      const pixels = corners.map((corner) => pixelOf(from, canvas, world, corner));
      if (pixels.some((pixel) => pixel === null)) return null;
      const xs = pixels.map((pixel) => Math.abs(pixel!.x - canvas.width / 2));
      const ys = pixels.map((pixel) => pixel!.y);
      return { width: 2 * Math.max(...xs), low: Math.min(...ys), high: Math.max(...ys) };
    };
    const fits = (far: number): boolean => {
      const seen = extent(at(far));
      return seen !== null && seen.width <= kFill * canvas.width && seen.high - seen.low <= kFill * canvas.height;
    };
    let [near, far] = [0.01 * size, 200 * size];
    for (let i = 0; i < 40; ++i) {
      const between = Math.sqrt(near * far);
      if (fits(between)) far = between;
      else near = between;
    }
    view = at(far);
    const seen = extent(view);
    if (seen === null) break;
    const metersPerPixel = (2 * far * Math.tan((fov * kDegrees) / 2)) / canvas.height;
    const offCentre = canvas.height / 2 - (seen.low + seen.high) / 2;
    target = add(target, [0, (0.8 * offCentre * metersPerPixel) / Math.sin(kOverviewTilt), 0]);
  }
  return view;
}
