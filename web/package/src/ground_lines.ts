import type { Line } from "./api.js";

const kUsualWidthPixels = 3;

/** Lines as the engine takes them: EngineView.setLines(). */
export function packLines(lines: Iterable<Line>, pixelRatio: number): { corners: Float64Array; lines: Float32Array } {
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
