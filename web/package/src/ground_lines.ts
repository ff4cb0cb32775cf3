import type { Line } from "./api.js";
import type { EngineView } from "./engine.js";

const kUsualWidthPixels = 3;

type GroundPoint = { easting: number; northing: number };

function checkPoints(id: string, points: GroundPoint[]): void {
  if (!points.every((point) => Number.isFinite(point.easting) && Number.isFinite(point.northing)))
    throw new RangeError(`The line "${id}" has points that are no numbers.`);
}

/** The lines that are drawn on the ground. The engine is told of all at once, before the next frame. */
export class GroundLines {
  private readonly lines = new Map<string, Line>();
  /** Does the engine not know them as they are? */
  isStale = false;

  get all(): ReadonlyMap<string, Line> {
    return this.lines;
  }
  set(id: string, line: Line): void {
    checkPoints(id, line.points);
    this.lines.set(id, line);
    this.isStale = true;
  }
  /** Returns whether there was one. */
  remove(id: string): boolean {
    const isNew = this.lines.delete(id);
    this.isStale ||= isNew;
    return isNew;
  }
  give(native: EngineView, pixelRatio: number): void {
    this.isStale = false;
    const packed = packLines(this.lines.values(), pixelRatio);
    native.setLines(packed.corners, packed.lines);
  }
}

/** The lines along which the ground is fetched as finely as it is stored. The engine is told of all at once, before the next frame. */
export class StudiedLines {
  private readonly lines = new Map<string, GroundPoint[]>();
  /** Does the engine not know them as they are? */
  isStale = false;

  /** None, or one of no points, forgets it. Returns whether anything changed. */
  set(id: string, line: GroundPoint[] | null): boolean {
    checkPoints(id, line ?? []);
    if (line === null || line.length === 0) {
      if (!this.lines.delete(id)) return false;
    } else {
      this.lines.set(id, line.map(({ easting, northing }) => ({ easting, northing })));
    }
    this.isStale = true;
    return true;
  }
  give(native: EngineView): void {
    this.isStale = false;
    const lines = [...this.lines.values()];
    native.studyGround(
      Float64Array.from(lines.flat().flatMap((place) => [place.easting, place.northing])),
      Float64Array.from(lines, (line) => line.length),
    );
  }
}

/** Lines as the engine takes them: EngineView.setLines(). */
function packLines(lines: Iterable<Line>, pixelRatio: number): { corners: Float64Array; lines: Float32Array } {
  const corners: number[] = [];
  const rows: number[] = [];
  for (const line of lines) {
    for (const point of line.points) corners.push(point.easting, point.northing);
    const isMeters = line.widthMeters !== undefined;
    const width = line.widthMeters ?? (line.widthPixels ?? kUsualWidthPixels) * pixelRatio;
    rows.push(line.points.length, ...colorOf(line.color ?? "#ff4d3d"), width, isMeters ? 1 : 0);
  }
  return { corners: new Float64Array(corners), lines: new Float32Array(rows) };
}

let painter: CanvasRenderingContext2D | null | undefined;
const known = new Map<string, readonly number[]>();

/** A CSS colour's red, green, blue and alpha, 0 to 1; black where the browser does not know it. */
function colorOf(css: string): readonly number[] {
  const before = known.get(css);
  if (before !== undefined) return before;
  if (painter === undefined) {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 1;
    painter = canvas.getContext("2d", { willReadFrequently: true });
  }
  if (!painter) return [0, 0, 0, 1];
  painter.clearRect(0, 0, 1, 1);
  painter.fillStyle = "#000";
  painter.fillStyle = css;
  painter.fillRect(0, 0, 1, 1);
  const color = [...painter.getImageData(0, 0, 1, 1).data].map((value) => value / 255);
  known.set(css, color);
  return color;
}
