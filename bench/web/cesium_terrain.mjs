// Terrain tiles for CesiumJS, quantized-mesh 1.0, from a raster in UTM.
//
// usage: node cesium_terrain.mjs RASTER.json FOLDER
//
// RASTER.json: {"file": raw little-endian 32-bit floats in rows from the north, "cols", "rows", "west", "north" (centre of the first
// sample), "spacing", "zone": of UTM in the north}. Tiles are those of the geographic scheme that the raster lies in, and both at
// level 0, gzipped as servers send them.
//
// A tile is a right-triangulated mesh whose error is at most the one that Cesium supposes at its level, so that Cesium's screen space
// error is true: over 257 x 257 heights, or fewer where the raster has no more. Heights are those of the raster, bilinear. The finest
// level stays within a metre, as our dataset does. Without normals: Cesium does not light ground unless it is told to.
import fs from "node:fs";
import path from "node:path";
import zlib from "node:zlib";

import Martini from "@mapbox/martini";
import { BoundingSphere, Cartesian3, Ellipsoid, EllipsoidalOccluder, TerrainProvider } from "cesium";

const FINEST_LEVEL = 15; // 9.5 m from north to south at 65 heights
const FINEST_ERROR_METERS = 1;
const MOST_CELLS = 256, LEAST_CELLS = 64;
const QUANTIZED = 32767;

/** Easting and northing in a UTM zone of the north (WGS 84): Krüger's series, to the millimetre. */
function utm(zone) {
  const a = 6378137, f = 1 / 298.257223563, n = f / (2 - f), k0 = 0.9996;
  const radius = (a / (1 + n)) * (1 + n ** 2 / 4 + n ** 4 / 64);
  const alpha = [n / 2 - (2 / 3) * n ** 2 + (5 / 16) * n ** 3, (13 / 48) * n ** 2 - (3 / 5) * n ** 3, (61 / 240) * n ** 3];
  const e = (2 * Math.sqrt(n)) / (1 + n), middle = ((zone * 6 - 183) * Math.PI) / 180;
  return (longitude, latitude) => {
    const s = Math.sin(latitude), t = Math.sinh(Math.atanh(s) - e * Math.atanh(e * s));
    const x = Math.atan2(t, Math.cos(longitude - middle)), y = Math.atanh(Math.sin(longitude - middle) / Math.sqrt(1 + t * t));
    let east = y, north = x;
    for (let j = 1; j <= 3; ++j) {
      east += alpha[j - 1] * Math.cos(2 * j * x) * Math.sinh(2 * j * y);
      north += alpha[j - 1] * Math.sin(2 * j * x) * Math.cosh(2 * j * y);
    }
    return [500000 + k0 * radius * east, k0 * radius * north];
  };
}

/** The raster's height at a place, bilinear; beside the raster that of its border if the place is near, else 0. */
function heights(raster) {
  const bytes = fs.readFileSync(raster.file);
  const data = new Float32Array(bytes.buffer, bytes.byteOffset, raster.cols * raster.rows);
  const project = utm(raster.zone), near = 200;
  return (longitude, latitude) => {
    const [east, north] = project(longitude, latitude);
    let x = (east - raster.west) / raster.spacing, y = (raster.north - north) / raster.spacing;
    if (!(x > -near && y > -near && x < raster.cols + near && y < raster.rows + near)) return 0;
    x = Math.min(Math.max(x, 0), raster.cols - 1);
    y = Math.min(Math.max(y, 0), raster.rows - 1);
    const col = Math.min(Math.floor(x), raster.cols - 2), row = Math.min(Math.floor(y), raster.rows - 2);
    const at = row * raster.cols + col, u = x - col, v = y - row;
    return (1 - v) * ((1 - u) * data[at] + u * data[at + 1]) + v * ((1 - u) * data[at + raster.cols] + u * data[at + raster.cols + 1]);
  };
}

const martinis = new Map();
function martiniOf(size) {
  if (!martinis.has(size)) martinis.set(size, new Martini(size));
  return martinis.get(size);
}

/** Vertices in the order of first use, triangles counterclockwise as seen from above, and the vertices along each side. */
function arrange(mesh, cells) {
  const order = new Map(), places = [], indices = [];
  const use = (vertex) => {
    if (!order.has(vertex)) {
      order.set(vertex, places.length);
      places.push([mesh.vertices[2 * vertex], mesh.vertices[2 * vertex + 1]]);
    }
    indices.push(order.get(vertex));
  };
  for (let i = 0; i < mesh.triangles.length; i += 3) {
    const [a, b, c] = mesh.triangles.subarray(i, i + 3);
    const [ax, ay, bx, by, cx, cy] = [a, b, c].flatMap((v) => [mesh.vertices[2 * v], mesh.vertices[2 * v + 1]]);
    const isClockwise = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) > 0; // rows go south
    for (const vertex of isClockwise ? [a, c, b] : [a, b, c]) use(vertex);
  }
  const side = (isOn) => places.flatMap((place, i) => (isOn(place) ? [i] : []));
  const sides = [side(([x]) => x === 0), side(([, y]) => y === cells), side(([x]) => x === cells), side(([, y]) => y === 0)];
  return { places, indices, sides };
}

class Writer {
  parts = [];
  add(array) {
    this.parts.push(Buffer.from(array.buffer, array.byteOffset, array.byteLength));
  }
  pad(to) {
    const length = this.parts.reduce((sum, part) => sum + part.length, 0);
    this.parts.push(Buffer.alloc((to - (length % to)) % to));
  }
}

function deltas(values) {
  let last = 0;
  return Uint16Array.from(values, (value) => {
    const delta = value - last;
    last = value;
    return (delta << 1) ^ (delta >> 31);
  });
}

function encodeTile(level, col, row, heightAt, errorMeters) {
  const degrees = 180 / 2 ** level, west = -180 + col * degrees, south = -90 + row * degrees;
  // No more heights than the raster has.
  const cells = Math.max(LEAST_CELLS, Math.min(MOST_CELLS, LEAST_CELLS * 2 ** (FINEST_LEVEL - level)));
  const grid = new Float32Array((cells + 1) ** 2), curved = new Float32Array(grid.length), radians = Math.PI / 180;
  const narrowing = Math.cos((south + degrees / 2) * radians);
  for (let y = 0; y <= cells; ++y)
    for (let x = 0; x <= cells; ++x) {
      const at = y * (cells + 1) + x;
      grid[at] = heightAt((west + (degrees * x) / cells) * radians, (south + degrees * (1 - y / cells)) * radians);
      // The ellipsoid's curvature is an error of flat triangles, too.
      const [across, along] = [(x / cells - 0.5) * narrowing, y / cells - 0.5].map((share) => share * degrees * radians);
      curved[at] = grid[at] - (Ellipsoid.WGS84.maximumRadius / 2) * (across ** 2 + along ** 2);
    }
  const { places, indices, sides } = arrange(martiniOf(cells + 1).createTile(curved).getMesh(errorMeters), cells);
  const tall = places.map(([x, y]) => grid[y * (cells + 1) + x]);
  const lowest = Math.min(...tall), highest = Math.max(...tall);

  const points = places.map(([x, y], i) =>
    Cartesian3.fromDegrees(west + (degrees * x) / cells, south + degrees * (1 - y / cells), tall[i]));
  const sphere = BoundingSphere.fromPoints(points);
  const occludee = new EllipsoidalOccluder(Ellipsoid.WGS84, Cartesian3.ZERO)
    .computeHorizonCullingPointPossiblyUnderEllipsoid(sphere.center, points, Math.min(lowest, 0)) ??
    // From nowhere is a tile of half the globe hidden: comparing with this is never true.
    new Cartesian3(NaN, NaN, NaN);
  const out = new Writer(), { center } = sphere;
  out.add(Float64Array.of(center.x, center.y, center.z));
  out.add(Float32Array.of(lowest, highest));
  out.add(Float64Array.of(center.x, center.y, center.z, sphere.radius, occludee.x, occludee.y, occludee.z));
  out.add(Uint32Array.of(places.length));
  out.add(deltas(places.map(([x]) => Math.round((QUANTIZED * x) / cells))));
  out.add(deltas(places.map(([, y]) => Math.round(QUANTIZED * (1 - y / cells)))));
  out.add(deltas(tall.map((height) => (highest > lowest ? Math.round((QUANTIZED * (height - lowest)) / (highest - lowest)) : 0))));
  const Indices = places.length > 65536 ? Uint32Array : Uint16Array;
  out.pad(Indices.BYTES_PER_ELEMENT);
  out.add(Uint32Array.of(indices.length / 3));
  let next = 0;
  out.add(Indices.from(indices, (index) => {
    const code = next - index;
    if (code === 0) ++next;
    return code;
  }));
  for (const side of sides) {
    out.add(Uint32Array.of(side.length));
    out.add(Indices.from(side));
  }
  return { bytes: zlib.gzipSync(Buffer.concat(out.parts), { level: 9 }), triangles: indices.length / 3 };
}

const [rasterFile, folder] = process.argv.slice(2);
const raster = JSON.parse(fs.readFileSync(rasterFile, "utf8"));
const heightAt = heights(raster);
const levelZeroError = TerrainProvider.getEstimatedLevelZeroGeometricErrorForAHeightmap(Ellipsoid.WGS84, 65, 2);
const available = [];
let tiles = 0, bytes = 0, triangles = 0;
for (let level = 0; level <= FINEST_LEVEL; ++level) {
  const degrees = 180 / 2 ** level, { west, south, east, north } = raster.bounds;
  const first = [Math.floor((west + 180) / degrees), Math.floor((south + 90) / degrees)];
  const last = [Math.floor((east + 180) / degrees), Math.floor((north + 90) / degrees)];
  if (level === 0) [first[0], last[0]] = [0, 1];
  const error = Math.min(levelZeroError / 2 ** level, level === FINEST_LEVEL ? FINEST_ERROR_METERS : Infinity);
  for (let col = first[0]; col <= last[0]; ++col) {
    const into = path.join(folder, String(level), String(col));
    fs.mkdirSync(into, { recursive: true });
    for (let row = first[1]; row <= last[1]; ++row) {
      const tile = encodeTile(level, col, row, heightAt, error);
      fs.writeFileSync(path.join(into, `${row}.terrain`), tile.bytes);
      ++tiles;
      bytes += tile.bytes.length;
      triangles += tile.triangles;
    }
  }
  available.push([{ startX: first[0], startY: first[1], endX: last[0], endY: last[1] }]);
}
fs.writeFileSync(path.join(folder, "layer.json"), JSON.stringify({
  tilejson: "2.1.0", name: "raster", version: "1.0.0", format: "quantized-mesh-1.0", scheme: "tms", projection: "EPSG:4326",
  tiles: ["{z}/{x}/{y}.terrain"], minzoom: 0, maxzoom: FINEST_LEVEL, bounds: [-180, -90, 180, 90], available }));
console.log(`${tiles} tiles, ${(bytes / 1e6).toFixed(1)} MB, ${(triangles / 1e6).toFixed(2)} million triangles`);
