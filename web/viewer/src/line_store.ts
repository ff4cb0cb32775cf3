import type { Bounds, Line, Viewer } from "terrane";

export interface Point {
  easting: number;
  northing: number;
}

export interface LineStyle {
  /** #rrggbb */
  color: string;
  width: number;
  widthUnit: "pixels" | "meters";
}

/** A line as a person sees it: one name and colour, in one part or several. */
export interface GroundLine extends LineStyle {
  id: string;
  name: string;
  /** A part of one point is a dot. */
  parts: Point[][];
}

export const kColors = ["#ff5a3c", "#ffd23f", "#3ddc97", "#4cc9f0", "#b388ff", "#ff7ab6"] as const;

/** The lines that somebody drew or opened, and the viewer's lines that show them. */
export class LineStore {
  private readonly all = new Map<string, GroundLine>();
  private readonly shown = new Map<string, string[]>();
  private readonly listeners = new Set<() => void>();
  private readonly editListeners = new Set<() => void>();
  private count = 0;

  constructor(private readonly viewer: Viewer) {}

  get lines(): GroundLine[] {
    return [...this.all.values()];
  }
  /** Told when lines come and go. */
  onChange(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
  /** Told when something of a line becomes another, too. */
  onEdit(listener: () => void): () => void {
    this.editListeners.add(listener);
    return () => this.editListeners.delete(listener);
  }

  /** `style`: what is left out is chosen here. */
  add(name: string, parts: Point[][], style: Partial<LineStyle> = {}): GroundLine {
    const number = ++this.count;
    const line: GroundLine = {
      id: `line-${number}`,
      name: name || `Line ${number}`,
      parts,
      color: kColors[(number - 1) % kColors.length] ?? kColors[0],
      width: 3,
      widthUnit: "pixels",
      ...style,
    };
    this.all.set(line.id, line);
    this.show(line);
    this.tell();
    return line;
  }

  change(id: string, change: Partial<Omit<GroundLine, "id">>): void {
    const line = this.all.get(id);
    if (line === undefined) return;
    Object.assign(line, change);
    this.show(line);
    for (const listener of this.editListeners) listener();
  }

  remove(id: string): void {
    if (!this.all.delete(id)) return;
    for (const shown of this.shown.get(id) ?? []) this.viewer.removeLine(shown);
    this.shown.delete(id);
    this.tell();
  }

  private show(line: GroundLine): void {
    const ids = line.parts.map((_, part) => `${line.id}/${part}`);
    for (const old of this.shown.get(line.id) ?? []) if (!ids.includes(old)) this.viewer.removeLine(old);
    line.parts.forEach((points, part) => {
      const style: Line = { points, color: line.color };
      if (line.widthUnit === "meters") style.widthMeters = line.width;
      else style.widthPixels = line.width;
      this.viewer.setLine(`${line.id}/${part}`, style);
    });
    this.shown.set(line.id, ids);
  }

  private tell(): void {
    for (const listener of [...this.listeners, ...this.editListeners]) listener();
  }
}

/** What lines cover; null where they have no points. */
export function boundsOf(parts: Iterable<Point[]>): Bounds | null {
  const out = { west: Infinity, south: Infinity, east: -Infinity, north: -Infinity };
  for (const points of parts)
    for (const { easting, northing } of points) {
      out.west = Math.min(out.west, easting);
      out.east = Math.max(out.east, easting);
      out.south = Math.min(out.south, northing);
      out.north = Math.max(out.north, northing);
    }
  return out.west <= out.east ? out : null;
}

/** A tenth more on each side, and never nothing. */
export function padded(bounds: Bounds): Bounds {
  const pad = Math.max(0.1 * (bounds.east - bounds.west), 0.1 * (bounds.north - bounds.south), 50);
  return { west: bounds.west - pad, south: bounds.south - pad, east: bounds.east + pad, north: bounds.north + pad };
}
