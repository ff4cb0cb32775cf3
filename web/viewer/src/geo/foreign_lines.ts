import type { LineStyle } from "../line_store.js";

/** Lines as a file has them, before anybody knows where they are. */
export interface ForeignLine {
  name: string;
  style: Partial<LineStyle>;
  /** x and y, as in the file; a part of one place is a point. */
  parts: [number, number][][];
}

export interface ForeignLines {
  lines: ForeignLine[];
  /** The CRS that the file names, and its EPSG number if it has one; absent: it names none. */
  crsName?: string;
  epsg?: number;
}

/** A file that cannot be used, with a reason that a person understands. */
export class FileError extends Error {}

export const kMostBytes = 64 * 2 ** 20;
/** More than anybody draws; the picture would take its time. */
export const kMostPoints = 500_000;

/** Points are dots, which a line's usual width would hardly show. */
export function isOfPoints(line: { parts: readonly unknown[][] }): boolean {
  return line.parts.every((part) => part.length === 1);
}

/** Counts points, so that a file does not bring more than can be drawn. */
export class PointBudget {
  private count = 0;

  spend(points: number): void {
    this.count += points;
    if (this.count > kMostPoints) throw new FileError(`it has more than ${kMostPoints} points`);
  }
}

/** Names come from strangers: one line of text, not too long. */
export function cleanName(value: unknown): string {
  return typeof value === "string"
    ? value
        .replace(/[\u0000-\u001f\u007f\u202a-\u202e\u2066-\u2069]+/g, " ")
        .trim()
        .slice(0, 80)
    : "";
}
