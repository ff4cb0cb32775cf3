import type { ProfilePoint } from "terrane";
import { el, oncePerFrame } from "../parts/dom.js";
import { formatNumber, formatTick } from "../parts/format.js";
import { draw, niceStep } from "../parts/plots.js";

const kMargin = { right: 12, top: 10, bottom: 22 };
/** Wide enough for most heights; it grows with labels that are longer. */
const kLeastLeft = 48;
const kGap = 6;
/** So many arrow keys lead from the one end to the other. */
const kSteps = 512;

interface Shown {
  points: readonly ProfilePoint[];
  breaks: readonly number[];
}

/** Heights over the distance, with the bound of their error as a band. One of its points can be chosen: by pointing, or by keys. */
export class ProfilePlot {
  readonly element = el("canvas", { class: "profile-plot", tabindex: 0, role: "img" });
  private shown: Shown = { points: [], breaks: [] };
  private chosen: number | null = null;
  private left = kLeastLeft;
  /** Of each gapless run what can be seen at this width. */
  private runs: ProfilePoint[][] = [];
  private runsWidth = 0;
  private readonly resizes = new ResizeObserver(() => this.paint());

  /** `changed`: told when another point is chosen. */
  constructor(private readonly changed: () => void) {
    const { element } = this;
    element.addEventListener("pointermove", (event) => this.point(event));
    element.addEventListener("pointerdown", (event) => this.point(event));
    element.addEventListener("pointerleave", (event) => {
      if (event.pointerType !== "touch") this.choose(null);
    });
    element.addEventListener("keydown", (event) => this.key(event));
    this.resizes.observe(element);
  }

  get chosenPoint(): ProfilePoint | undefined {
    return this.chosen === null ? undefined : this.shown.points[this.chosen];
  }

  show(points: readonly ProfilePoint[], breaks: readonly number[]): void {
    // Who looks at a place goes on looking at it, however many points there are now.
    const at = this.chosenPoint?.distance;
    this.shown = { points, breaks };
    this.chosen = at === undefined || points.length === 0 ? null : this.nearest(at);
    this.runsWidth = 0;
    this.paint();
  }
  close(): void {
    this.resizes.disconnect();
  }

  private choose(index: number | null): void {
    this.chosen = index;
    this.paint();
    this.changed();
  }
  private point(event: PointerEvent): void {
    const inner = this.element.clientWidth - this.left - kMargin.right;
    const share = Math.min(Math.max((event.offsetX - this.left) / Math.max(inner, 1), 0), 1);
    if (this.shown.points.length > 1) this.choose(this.nearest(share * this.length));
  }
  private key(event: KeyboardEvent): void {
    const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: 32, PageUp: -32 }[event.key];
    const last = this.shown.points.length - 1;
    if (step === undefined || last < 1) return;
    event.preventDefault();
    event.stopPropagation();
    const single = Math.max(1, Math.round(last / kSteps));
    this.choose(Math.min(Math.max((this.chosen ?? 0) + step * single * (event.shiftKey ? 10 : 1), 0), last));
  }

  private get length(): number {
    return this.shown.points.at(-1)?.distance ?? 0;
  }
  private nearest(distance: number): number {
    const { points } = this.shown;
    let [low, high] = [0, points.length - 1];
    while (low + 1 < high) {
      const middle = (low + high) >> 1;
      if ((points[middle]?.distance ?? 0) <= distance) low = middle;
      else high = middle;
    }
    return distance - (points[low]?.distance ?? 0) < (points[high]?.distance ?? 0) - distance ? low : high;
  }

  private readonly paint = oncePerFrame(() =>
    draw(this.element, (context, width, height, color) => this.paintOn(context, width, height, color)),
  );

  private paintOn(context: CanvasRenderingContext2D, width: number, height: number, color: (name: string) => string): void {
    const { length } = this;
    if (this.runsWidth !== width) {
      this.runs = runsOf(this.shown.points).map((run) => visibleOf(run, length / width));
      this.runsWidth = width;
    }
    if (this.runs.length === 0 || !(length > 0)) return;
    let [low, high] = [Infinity, -Infinity];
    for (const run of this.runs)
      for (const each of run) {
        low = Math.min(low, each.height - each.error);
        high = Math.max(high, each.height + each.error);
      }
    const pad = Math.max((high - low) * 0.08, 1);
    [low, high] = [low - pad, high + pad];

    context.font = `11px ${getComputedStyle(document.body).fontFamily}`;
    context.lineWidth = 1;
    const heightStep = niceStep(high - low, (height - 30) / 26);
    const labels: [number, string][] = [];
    for (let value = Math.ceil(low / heightStep) * heightStep; value <= high; value += heightStep)
      labels.push([value, `${formatNumber(value, heightStep < 1 ? 1 : 0)} m`]);
    this.left = Math.max(kLeastLeft, ...labels.map(([, label]) => Math.ceil(context.measureText(label).width) + 2 * kGap));
    const { left } = this;
    const x = (distance: number): number => left + (distance / length) * (width - left - kMargin.right);
    const y = (value: number): number =>
      height - kMargin.bottom - ((value - low) / (high - low)) * (height - kMargin.top - kMargin.bottom);

    context.textBaseline = "middle";
    context.textAlign = "right";
    for (const [value, label] of labels) {
      context.strokeStyle = color("--hairline");
      context.beginPath();
      context.moveTo(left, y(value));
      context.lineTo(width - kMargin.right, y(value));
      context.stroke();
      context.fillStyle = color("--faint");
      context.fillText(label, left - kGap, y(value));
    }
    context.textBaseline = "alphabetic";
    const distanceStep = niceStep(length, width / 110);
    for (let value = 0; value <= length; value += distanceStep) {
      context.textAlign = value === 0 ? "left" : value > length - distanceStep * 0.3 ? "right" : "center";
      context.fillStyle = color("--faint");
      context.fillText(value === 0 ? "0" : formatTick(value, distanceStep), x(value), height - 6);
    }

    // Where there is no ground the plot has a gap.
    for (const run of this.runs) {
      const [first, last] = [run[0], run.at(-1)];
      if (!first || !last) continue;
      context.beginPath();
      for (const each of run) context.lineTo(x(each.distance), y(each.height));
      context.lineTo(x(last.distance), height - kMargin.bottom);
      context.lineTo(x(first.distance), height - kMargin.bottom);
      context.globalAlpha = 0.18;
      context.fillStyle = color("--accent");
      context.fill();
      // The bound of the error, as a band.
      context.beginPath();
      for (const each of run) context.lineTo(x(each.distance), y(each.height + each.error));
      for (const each of [...run].reverse()) context.lineTo(x(each.distance), y(each.height - each.error));
      context.globalAlpha = 0.3;
      context.fill();
      context.globalAlpha = 1;
      context.beginPath();
      for (const each of run) context.lineTo(x(each.distance), y(each.height));
      context.strokeStyle = color("--accent");
      context.lineWidth = 2;
      context.lineJoin = "round";
      context.stroke();
    }

    // Where one part of the line ends and another begins.
    context.strokeStyle = color("--faint");
    context.lineWidth = 1;
    context.setLineDash([4, 4]);
    for (const index of this.shown.breaks) {
      const distance = this.shown.points[index]?.distance ?? 0;
      context.beginPath();
      context.moveTo(x(distance), kMargin.top);
      context.lineTo(x(distance), height - kMargin.bottom);
      context.stroke();
    }
    context.setLineDash([]);

    const at = this.chosenPoint;
    if (!at) return;
    context.strokeStyle = color("--text");
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x(at.distance), kMargin.top);
    context.lineTo(x(at.distance), height - kMargin.bottom);
    context.stroke();
    if (!Number.isFinite(at.height)) return;
    context.fillStyle = color("--warm");
    context.beginPath();
    context.arc(x(at.distance), y(at.height), 4.5, 0, 7);
    context.fill();
  }
}

function runsOf(points: readonly ProfilePoint[]): ProfilePoint[][] {
  const out: ProfilePoint[][] = [[]];
  for (const point of points) {
    if (Number.isFinite(point.height)) out.at(-1)?.push(point);
    else if ((out.at(-1)?.length ?? 0) > 0) out.push([]);
  }
  return out.filter((run) => run.length > 1);
}

/** Of the points in one column of pixels only the lowest and the highest are seen, and those with the widest bounds. */
function visibleOf(run: ProfilePoint[], columnMeters: number): ProfilePoint[] {
  const out: ProfilePoint[] = [];
  for (let begin = 0; begin < run.length; ) {
    const column = Math.floor((run[begin]?.distance ?? 0) / columnMeters);
    let end = begin + 1;
    while (end < run.length && Math.floor((run[end]?.distance ?? 0) / columnMeters) === column) ++end;
    // The ends of a run stay where they are.
    const kept = new Set([begin === 0 ? begin : NaN, end === run.length ? end - 1 : NaN]);
    const keepMost = (measure: (point: ProfilePoint) => number): void => {
      let [best, most] = [begin, -Infinity];
      for (let i = begin; i < end; ++i) {
        const point = run[i];
        if (point && measure(point) > most) [best, most] = [i, measure(point)];
      }
      kept.add(best);
    };
    keepMost((point) => point.height);
    keepMost((point) => -point.height);
    keepMost((point) => point.height + point.error);
    keepMost((point) => point.error - point.height);
    for (const i of [...kept].sort((a, b) => a - b)) {
      const point = run[i];
      if (point) out.push(point);
    }
    begin = end;
  }
  return out;
}
