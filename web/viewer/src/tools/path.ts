import type { Line, Place } from "terrane";
import type { App } from "../app.js";
import { el } from "../parts/dom.js";
import { icon } from "../parts/icons.js";

const kMostMarks = 60;

/** A line that grows by clicks on the ground: drawn there, with marks at its corners and a band to the pointer. */
export class Path {
  readonly corners: Place[] = [];
  /** Clicks add to it. */
  isOpen = true;
  private readonly release: () => void;
  /** A line that was taken in parts has its last one in `corners`, and those before it here. */
  private readonly before: Place[][] = [];
  private drawn: string[] = [];
  private pointer: { x: number; y: number } | null = null;

  /** `changed` is told of corners, `finished` when Enter or a double click ends it. */
  constructor(
    private readonly app: App,
    private readonly id: string,
    private readonly style: Pick<Line, "color" | "widthPixels">,
    private readonly changed: () => void,
    private readonly finished: () => void = () => {},
    private readonly most = Infinity,
  ) {
    this.release = app.pointing.use({
      click: (place) => this.add(place),
      hover: (_, at) => {
        this.pointer = at;
        this.showBand();
      },
      undo: () => this.undo(),
      finish: () => this.finish(),
    });
  }

  /** All of it: one part, unless a line in several was taken. */
  get parts(): readonly (readonly Place[])[] {
    return [...this.before, this.corners];
  }

  /** Takes a line as it is, from its first corner to its last, in one part or several. */
  take(parts: readonly (readonly { easting: number; northing: number }[])[]): void {
    this.empty();
    const placed = parts.map((part) =>
      part.map(({ easting, northing }) => ({ easting, northing, height: this.app.viewer.elevationAt(easting, northing) ?? 0 })),
    );
    for (const corner of placed.pop() ?? []) this.corners.push(corner);
    this.before.push(...placed);
    this.isOpen = false;
    this.show();
  }
  add(place: Place): void {
    // A click after the end begins anew.
    if (!this.isOpen) this.empty();
    this.isOpen = true;
    this.corners.push({ easting: place.easting, northing: place.northing, height: place.height });
    this.show();
    if (this.corners.length >= this.most) this.finish();
  }
  undo(): void {
    this.corners.pop();
    if (this.corners.length === 0) for (const corner of this.before.pop() ?? []) this.corners.push(corner);
    this.isOpen = true;
    this.show();
  }
  clear(): void {
    this.empty();
    this.isOpen = true;
    this.show();
  }
  finish(): void {
    if (!this.isOpen || this.corners.length < 2) return;
    this.isOpen = false;
    this.app.overlay.setBand(null, null);
    this.finished();
    this.changed();
  }
  close(): void {
    this.release();
    this.empty();
    this.app.overlay.clear(this.id);
    this.app.overlay.setBand(null, null);
    this.drawParts();
  }

  /** Draws it as it is now. */
  show(): void {
    const { app, id } = this;
    app.overlay.clear(id);
    // A track has thousands of corners: then its ends are marked.
    const corners = this.parts.flat();
    corners.forEach((corner, i) => {
      if (corners.length <= kMostMarks || i === 0 || i === corners.length - 1)
        app.overlay.setMark(`${id}/${i}`, corner, i === 0 ? "start" : "corner");
    });
    this.drawParts();
    this.showBand();
    this.changed();
  }

  private empty(): void {
    this.corners.length = 0;
    this.before.length = 0;
  }

  /** From the last corner to the pointer, while clicks add to it. */
  private showBand(): void {
    this.app.overlay.setBand(this.isOpen ? (this.corners.at(-1) ?? null) : null, this.pointer);
  }

  private drawParts(): void {
    const { viewer } = this.app;
    const shown = new Map<string, Place[]>();
    for (const [i, part] of [this.corners, ...this.before].entries()) if (part.length > 0) shown.set(i === 0 ? this.id : `${this.id}/part-${i}`, part);
    for (const old of this.drawn) {
      if ((shown.get(old)?.length ?? 0) < 2) viewer.removeLine(old);
      if (!shown.has(old)) viewer.studyGround(old, null);
    }
    for (const [id, part] of shown) {
      if (part.length >= 2) viewer.setLine(id, { points: part, ...this.style });
      // What is asked along it shall be as exact as the dataset is.
      viewer.studyGround(id, part);
    }
    this.drawn = [...shown.keys()];
  }
}

/** What every tool that draws a path has: a point in the middle of the picture, one step back, from the beginning. */
export function pathButtons(app: App, path: Path): HTMLElement {
  return el(
    "div",
    { class: "buttons path-buttons" },
    el(
      "button",
      {
        class: "secondary",
        type: "button",
        title: "Add the ground in the middle of the picture (Space)",
        "data-do": "middle",
        on: { click: () => app.pointing.clickMiddle() },
      },
      icon("target"),
      "Middle",
    ),
    el(
      "button",
      {
        class: "secondary",
        type: "button",
        title: "Take the last point back (Backspace)",
        "data-do": "undo",
        on: { click: () => path.undo() },
      },
      icon("undo"),
      "Undo",
    ),
    el(
      "button",
      { class: "secondary", type: "button", title: "Begin anew", "data-do": "clear", on: { click: () => path.clear() } },
      icon("trash"),
      "Clear",
    ),
  );
}

const kAgainMilliseconds = 500;

/** Calls when the ground has become finer, so that answers about it may be better; not all the time while it does. */
export function whenFiner(app: App, work: () => void): () => void {
  let told = "";
  let last = 0;
  return app.viewer.on("loading", ({ phase, bytesReceived }) => {
    // Bytes that came are ground only when they are decoded: at the latest when all has settled.
    const state = phase === "settled" ? `${bytesReceived} settled` : `${bytesReceived}`;
    const time = performance.now();
    if (state === told || (phase !== "settled" && time < last + kAgainMilliseconds)) return;
    told = state;
    last = time;
    work();
  });
}
