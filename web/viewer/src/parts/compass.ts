import type { Viewer } from "terrane";
import { faceNorth, turnedAround, turningPointOf, worldOf, wrapHeading } from "../camera.js";
import { el, svg } from "./dom.js";
import { windOf } from "./format.js";

const kDegreesPerPixel = 0.6;
const kSlop = 4;

/** Shows where the camera looks: the needle north, flatter the more it is tilted. A click turns north up, a drag turns and tilts. */
export function makeCompass(viewer: Viewer): HTMLElement {
  const rose = svg(
    "g",
    {},
    svg("circle", { class: "compass-ring", cx: 0, cy: 0, r: 26 }),
    ...[0, 45, 90, 135, 180, 225, 270, 315].map((angle) =>
      svg("line", { class: "compass-tick", x1: 0, y1: -25, x2: 0, y2: angle % 90 === 0 ? -20 : -22.5, transform: `rotate(${angle})` }),
    ),
    svg("path", { class: "compass-north", d: "M0-17 5 0H-5z" }),
    svg("path", { class: "compass-south", d: "M0 17 5 0H-5z" }),
  );
  const letter = svg("text", { class: "compass-letter", "text-anchor": "middle", "dominant-baseline": "central" });
  letter.textContent = "N";
  const degrees = el("span", { class: "compass-degrees number" });
  const button = el(
    "button",
    { class: "compass", type: "button" },
    svg("svg", { viewBox: "-32 -32 64 64", "aria-hidden": "true" }, rose, letter),
    degrees,
  );

  const show = (): void => {
    const { heading, pitch } = viewer.view;
    // Looking straight down the rose is round; at the horizon it is almost a line.
    const flat = Math.max(0.35, Math.sin((Math.min(Math.abs(pitch), 90) * Math.PI) / 180));
    rose.setAttribute("transform", `scale(1 ${flat.toFixed(3)}) rotate(${(-heading).toFixed(2)})`);
    const angle = ((-heading - 90) * Math.PI) / 180;
    letter.setAttribute("x", (Math.cos(angle) * 26).toFixed(1));
    letter.setAttribute("y", (Math.sin(angle) * 26 * flat).toFixed(1));
    degrees.textContent = `${Math.round(heading) % 360}°`;
    const words = `Heading ${Math.round(heading) % 360} degrees, ${windOf(heading)}; ${Math.round(Math.abs(pitch))} degrees ${pitch < 0 ? "down" : "up"}`;
    button.setAttribute("aria-label", `${words}. Turn north up`);
    button.title = `${words}\nClick: north up (N). Drag: turn and tilt.`;
  };
  viewer.on("view", show);
  show();

  let drag: { x: number; y: number; view: typeof viewer.view; pivot: ReturnType<typeof turningPointOf>; isFar: boolean } | null = null;
  let wasDragged = false;
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    drag = { x: event.clientX, y: event.clientY, view: viewer.view, pivot: turningPointOf(viewer), isFar: false };
    wasDragged = false;
  });
  button.addEventListener("pointermove", (event) => {
    if (drag === null) return;
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    drag.isFar ||= Math.hypot(dx, dy) > kSlop;
    if (!drag.isFar) return;
    wasDragged = true;
    const heading = wrapHeading(drag.view.heading - dx * kDegreesPerPixel);
    const pitch = Math.min(Math.max(drag.view.pitch - dy * kDegreesPerPixel * 0.6, -89.9), 20);
    viewer.setView(drag.pivot ? turnedAround(drag.view, drag.pivot, heading, pitch, worldOf(viewer)) : { heading, pitch });
  });
  const end = (): void => void (drag = null);
  button.addEventListener("pointerup", end);
  button.addEventListener("pointercancel", end);
  button.addEventListener("click", () => {
    if (!wasDragged) faceNorth(viewer);
    wasDragged = false;
  });
  return button;
}
