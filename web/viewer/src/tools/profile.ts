import type { ProfilePoint } from "terrane";
import type { App, OpenPanel, Panel } from "../app.js";
import type { GroundScale } from "../geo/ground_scale.js";
import type { Point } from "../line_store.js";
import { el, fill } from "../parts/dom.js";
import { formatDistance, formatError, formatHeight, formatNumber, formatTick } from "../parts/format.js";
import { draw } from "../parts/plots.js";
import { climbOf, lengthOverGround } from "./ground_measures.js";
import { Path, pathButtons, whenFiner } from "./path.js";

const kSamples = 512;
const kMargin = { left: 48, right: 12, top: 10, bottom: 22 };

export const profileTool: Panel = {
  id: "profile",
  title: "Profile",
  icon: "profile",
  key: "p",
  purpose: "Heights along a line as a plot; pointing at the plot shows the place on the ground",
  isWide: true,
  open: (app) => openProfile(app, []),
};

/** The profile of a line that is there already. */
export function profileOf(name: string, points: readonly Point[]): Panel {
  return { ...profileTool, title: `Profile of ${name}`, open: (app) => openProfile(app, points) };
}

function openProfile(app: App, given: readonly Point[]): OpenPanel {
  const { viewer, overlay } = app;
  const canvas = el("canvas", { class: "profile-plot", tabindex: 0, role: "img" });
  const summary = el("div", { class: "profile-summary number", "aria-live": "polite" });
  let points: ProfilePoint[] = [];
  let lengthOnMap = 0;
  let scale: GroundScale | null = null;
  let hovered: number | null = null;

  const show = (): void => {
    const onMap = path.corners.length >= 2 ? viewer.profile(path.corners, kSamples) : [];
    lengthOnMap = onMap.at(-1)?.distance ?? 0;
    points = scale?.along(onMap) ?? onMap;
    if (hovered !== null && hovered >= points.length) hovered = null;
    paint();
    tell();
  };
  const tell = (): void => {
    const at = hovered === null ? undefined : points[hovered];
    overlay.setMark("profile-hover", at && Number.isFinite(at.height) ? at : null, "hover");
    canvas.hidden = points.length < 2;
    if (points.length < 2) {
      fill(
        summary,
        path.corners.length === 0
          ? "Click on the ground where the profile begins."
          : "Click where it goes on. Enter or a double click ends.",
      );
      return;
    }
    const climb = climbOf(points);
    const whole = `${formatDistance(lengthOnMap)} on the map, ${formatDistance(lengthOverGround(points))} over the ground · ${formatNumber(climb.lowest?.height ?? NaN)} to ${formatNumber(climb.highest?.height ?? NaN)} m · ${formatNumber(climb.up)} m up, ${formatNumber(climb.down)} m down · steepest ${formatNumber(climb.steepest)}°`;
    canvas.setAttribute("aria-label", `Profile: ${whole}. Arrow keys move along it.`);
    fill(
      summary,
      at
        ? `${formatDistance(at.distance)}: ${Number.isFinite(at.height) ? `${formatHeight(at.height, at.error)} ${formatError(at.error)}` : "no ground"} · E ${formatNumber(at.easting)} N ${formatNumber(at.northing)}`
        : whole,
    );
  };
  const paint = (): void => draw(canvas, (context, width, height, color) => paintProfile(context, width, height, color, points, hovered));

  const hover = (index: number | null): void => {
    hovered = index;
    paint();
    tell();
  };
  const point = (event: PointerEvent): void => {
    const inner = canvas.clientWidth - kMargin.left - kMargin.right;
    const share = Math.min(Math.max((event.offsetX - kMargin.left) / Math.max(inner, 1), 0), 1);
    if (points.length > 1) hover(Math.round(share * (points.length - 1)));
  };
  canvas.addEventListener("pointermove", point);
  canvas.addEventListener("pointerdown", point);
  canvas.addEventListener("pointerleave", (event) => {
    if (event.pointerType !== "touch") hover(null);
  });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: 32, PageUp: -32 }[event.key];
    if (step === undefined || points.length < 2) return;
    event.preventDefault();
    event.stopPropagation();
    hover(Math.min(Math.max((hovered ?? 0) + step * (event.shiftKey ? 10 : 1), 0), points.length - 1));
  });

  const path = new Path(app, "profile", { color: "#4cc9f0", widthPixels: 3 }, () => show());
  const stop = whenFiner(app, show);
  void app.groundScale().then((found) => {
    scale = found;
    show();
  });
  const resizes = new ResizeObserver(paint);
  resizes.observe(canvas);
  if (given.length >= 2) path.take(given);
  else show();
  return {
    body: el("div", { class: "profile" }, summary, canvas, pathButtons(app, path)),
    close: () => {
      stop();
      resizes.disconnect();
      overlay.setMark("profile-hover", null);
      path.close();
    },
  };
}

/** Steps of 1, 2 or 5 that make about so many labels. */
function niceStep(span: number, labels: number): number {
  const rough = span / Math.max(labels, 1);
  const power = 10 ** Math.floor(Math.log10(Math.max(rough, 1e-9)));
  return ([1, 2, 5, 10].find((step) => step * power >= rough) ?? 10) * power;
}

function paintProfile(
  context: CanvasRenderingContext2D,
  width: number,
  height: number,
  color: (name: string) => string,
  points: readonly ProfilePoint[],
  hovered: number | null,
): void {
  const heights = points.filter((each) => Number.isFinite(each.height));
  const length = points.at(-1)?.distance ?? 0;
  if (heights.length < 2 || !(length > 0)) return;
  let low = Math.min(...heights.map((each) => each.height - each.error));
  let high = Math.max(...heights.map((each) => each.height + each.error));
  const pad = Math.max((high - low) * 0.08, 1);
  [low, high] = [low - pad, high + pad];
  const x = (distance: number): number => kMargin.left + (distance / length) * (width - kMargin.left - kMargin.right);
  const y = (value: number): number => height - kMargin.bottom - ((value - low) / (high - low)) * (height - kMargin.top - kMargin.bottom);

  context.font = `11px ${getComputedStyle(document.body).fontFamily}`;
  context.lineWidth = 1;
  context.textBaseline = "middle";
  context.textAlign = "right";
  const heightStep = niceStep(high - low, (height - 30) / 34);
  for (let value = Math.ceil(low / heightStep) * heightStep; value <= high; value += heightStep) {
    context.strokeStyle = color("--hairline");
    context.beginPath();
    context.moveTo(kMargin.left, y(value));
    context.lineTo(width - kMargin.right, y(value));
    context.stroke();
    context.fillStyle = color("--faint");
    context.fillText(`${formatNumber(value, heightStep < 1 ? 1 : 0)} m`, kMargin.left - 6, y(value));
  }
  context.textBaseline = "alphabetic";
  const distanceStep = niceStep(length, width / 110);
  for (let value = 0; value <= length; value += distanceStep) {
    context.textAlign = value === 0 ? "left" : value > length - distanceStep * 0.3 ? "right" : "center";
    context.fillStyle = color("--faint");
    context.fillText(value === 0 ? "0" : formatTick(value, distanceStep), x(value), height - 6);
  }

  // Where there is no ground the plot has a gap.
  for (const run of runsOf(points)) {
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

  const at = hovered === null ? undefined : points[hovered];
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

function runsOf(points: readonly ProfilePoint[]): ProfilePoint[][] {
  const out: ProfilePoint[][] = [[]];
  for (const point of points) {
    if (Number.isFinite(point.height)) out.at(-1)?.push(point);
    else if ((out.at(-1)?.length ?? 0) > 0) out.push([]);
  }
  return out.filter((run) => run.length > 1);
}
