import type { Place, Viewer } from "terrane";
import { oncePerFrame, svg } from "./dom.js";

export type MarkKind = "corner" | "start" | "hover" | "blocked" | "eye" | "target";

/** Ground that is nearer than this share of the way to a mark hides it: the mark's own slope does not. */
const kNearer = 0.97;

interface Mark {
  place: Place;
  element: SVGGElement;
}

/** Small marks over the picture that stay at their places of the ground while the camera moves. */
export class Overlay {
  readonly element = svg("svg", { class: "overlay", "aria-hidden": "true" });
  private readonly band = svg("line", { class: "band", visibility: "hidden" });
  private readonly marks = new Map<string, Mark>();
  private bandFrom: Place | null = null;
  private bandTo: { x: number; y: number } | null = null;

  constructor(private readonly viewer: Viewer) {
    this.element.append(this.band);
    viewer.on("view", this.update);
    viewer.on("frame", this.update);
    addEventListener("resize", this.update);
  }

  /** Puts a mark at a place, or moves it there; null takes it away. */
  setMark(id: string, place: Place | null, kind: MarkKind = "corner", label = ""): void {
    this.marks.get(id)?.element.remove();
    this.marks.delete(id);
    if (place === null) return;
    const element = svg("g", { class: `mark mark-${kind}` }, svg("circle", { r: kind === "hover" ? 7 : 5.5 }));
    if (label !== "") {
      const text = svg("text", { x: 10, y: -8 });
      text.textContent = label;
      element.append(text);
    }
    this.element.append(element);
    this.marks.set(id, { place, element });
    this.update();
  }

  /** Takes away all marks whose name begins so. */
  clear(prefix: string): void {
    for (const id of [...this.marks.keys()]) if (id.startsWith(prefix)) this.setMark(id, null);
  }

  /** A dashed line from a place to a point of the canvas: what the next click would add. */
  setBand(from: Place | null, to: { x: number; y: number } | null): void {
    this.bandFrom = from;
    this.bandTo = to;
    this.update();
  }

  /** Where the ground is now, if finer ground has come since. */
  private onGround(place: Place): Place {
    return { ...place, height: this.viewer.elevationAt(place.easting, place.northing) ?? place.height };
  }

  /** Is nearer ground before a place that is seen at a point of the canvas? */
  private isBehind(place: Place, at: { x: number; y: number }): boolean {
    const ground = this.viewer.pick(at.x, at.y);
    if (ground === null) return false;
    const { easting, northing } = this.viewer.view;
    const away = (point: Place): number => Math.hypot(point.easting - easting, point.northing - northing);
    return away(ground) < kNearer * away(place);
  }

  private readonly update = oncePerFrame(() => {
    for (const { place, element } of this.marks.values()) {
      const at = this.viewer.project(this.onGround(place));
      element.setAttribute("visibility", at ? "visible" : "hidden");
      if (!at) continue;
      element.setAttribute("transform", `translate(${at.x.toFixed(1)} ${at.y.toFixed(1)})`);
      element.classList.toggle("is-behind", this.isBehind(place, at));
    }
    const from = this.bandFrom && this.viewer.project(this.onGround(this.bandFrom));
    this.band.setAttribute("visibility", from && this.bandTo ? "visible" : "hidden");
    if (!from || !this.bandTo) return;
    this.band.setAttribute("x1", from.x.toFixed(1));
    this.band.setAttribute("y1", from.y.toFixed(1));
    this.band.setAttribute("x2", this.bandTo.x.toFixed(1));
    this.band.setAttribute("y2", this.bandTo.y.toFixed(1));
  });
}
