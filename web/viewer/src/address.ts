import type { Settings, View, Viewer } from "terrane";

/**
 * The view in the page's address: `#easting,northing,height,heading,pitch,fov&mode=slope&...`. A link shows what its sender saw.
 * What is as it is at first is left out.
 */
export interface AddressState {
  view: Partial<View>;
  settings: Partial<Settings>;
  /** Names of the visible layers; absent: all. */
  layers?: string[];
}

const kWords = {
  surface: ["patches", "meshes"],
  mode: ["shaded", "height", "slope", "normals", "tiles", "error"],
  outline: ["none", "wireframe", "patches"],
} as const;
const kNumbers = ["tau", "exaggeration", "sunAzimuth", "sunAltitude", "imageryRelief", "imageryBrightness"] as const;
const kSwitches = ["haze", "water"] as const;
/** What the sliders have: an exaggeration of a thousand million never comes to rest. */
export const kRanges = { exaggeration: [0.5, 8], tau: [0.25, 16] } as const;
/** The camera is at rest after so long. Written sooner, a browser would ask for the page's icon with each step of a move. */
const kRestMilliseconds = 500;
/** One that does not come to rest is written after so long nevertheless. */
const kLongestMilliseconds = 4000;
/** What one reads in an address may move the picture so far. */
const kPixels = 0.01;

/** Takes what it understands, and leaves out the rest: addresses are typed by people. */
export function readAddress(hash: string): AddressState {
  const [place = "", ...pairs] = hash.replace(/^#/, "").split("&");
  const out: AddressState = { view: {}, settings: {} };
  const numbers = place.split(",").map((part) => (part.trim() === "" ? NaN : Number(part)));
  const [easting = NaN, northing = NaN, height = NaN, heading = NaN, pitch = NaN, fov = NaN] = numbers;
  if (Number.isFinite(easting) && Number.isFinite(northing)) {
    out.view = { easting, northing };
    if (Number.isFinite(height)) out.view.height = height;
    if (Number.isFinite(heading)) out.view.heading = heading;
    if (Number.isFinite(pitch) && Math.abs(pitch) <= 90) out.view.pitch = pitch;
    if (fov >= 1 && fov <= 170) out.view.fov = fov;
  }
  for (const pair of pairs) {
    const at = pair.indexOf("=");
    if (at >= 0) readSetting(out, pair.slice(0, at), pair.slice(at + 1));
  }
  return out;
}

function readSetting(out: AddressState, name: string, text: string): void {
  const { settings } = out;
  // Names may have slashes of their own, written as %2F.
  if (name === "layers") out.layers = text === "" ? [] : text.split("/").map(decode);
  const value = decode(text);
  if (name in kWords) {
    const known = kWords[name as keyof typeof kWords] as readonly string[];
    if (known.includes(value)) Object.assign(settings, { [name]: value });
  }
  if ((kNumbers as readonly string[]).includes(name)) {
    const number = Number(value);
    const isPositive = name === "tau" || name === "exaggeration";
    if (value.trim() !== "" && Number.isFinite(number) && (number > 0 || !isPositive))
      Object.assign(settings, { [name]: inRange(name, number) });
  }
  if ((kSwitches as readonly string[]).includes(name) && /^(on|off)$/.test(value)) Object.assign(settings, { [name]: value === "on" });
}

function inRange(name: string, value: number): number {
  const [least, most] = kRanges[name as keyof typeof kRanges] ?? [-Infinity, Infinity];
  return Math.min(Math.max(value, least), most);
}

function decode(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** Short numbers: no more digits than one sees. */
const brief = (value: number, digits: number): string => String(Number(value.toFixed(digits)));
/** Digits behind the point that tell such a step. */
const digitsOf = (step: number): number => Math.min(Math.max(Math.ceil(-Math.log10(step)), 1), 9);

function placeText(viewer: Viewer): string {
  const { view, settings, dataset, canvas } = viewer;
  // What a pixel is in the middle of the picture: degrees, and metres on the nearest ground.
  const radians = (2 * Math.tan((view.fov * Math.PI) / 360)) / Math.max(canvas.clientHeight, 1);
  const ground = viewer.elevationAt(view.easting, view.northing) ?? dataset?.minHeight ?? 0;
  const meters = radians * Math.max((view.height - ground) * settings.exaggeration, 1) * kPixels;
  const degrees = digitsOf(((radians * 180) / Math.PI) * kPixels);
  const place = digitsOf(meters / (dataset?.metersPerUnit ?? 1));
  return [
    brief(view.easting, place),
    brief(view.northing, place),
    brief(view.height, digitsOf(meters / settings.exaggeration)),
    brief(view.heading, degrees),
    brief(view.pitch, degrees),
    brief(view.fov, degrees),
  ].join(",");
}

export function writeAddress(viewer: Viewer, defaults: Settings): string {
  const { settings, layers } = viewer;
  const parts = [placeText(viewer)];
  for (const name of Object.keys(kWords) as (keyof typeof kWords)[])
    if (settings[name] !== defaults[name]) parts.push(`${name}=${settings[name]}`);
  for (const name of kNumbers) if (Math.abs(settings[name] - defaults[name]) > 1e-6) parts.push(`${name}=${brief(settings[name], 3)}`);
  for (const name of kSwitches) if (settings[name] !== defaults[name]) parts.push(`${name}=${settings[name] ? "on" : "off"}`);
  if (layers.some((layer) => !layer.visible))
    parts.push(
      `layers=${layers
        .filter((layer) => layer.visible)
        .map((layer) => encodeURIComponent(layer.name))
        .join("/")}`,
    );
  return `#${parts.join("&")}`;
}

/** Keeps the address and the view the same: moves write it, a changed address moves. Returns what writes it at once. */
export function keepAddress(viewer: Viewer, defaults: Settings): () => void {
  let timer = 0;
  let since = 0;
  let written = location.hash;
  const write = (): void => {
    clearTimeout(timer);
    timer = 0;
    written = writeAddress(viewer, defaults);
    if (written !== location.hash) history.replaceState(history.state, "", written);
  };
  const soon = (): void => {
    const now = performance.now();
    if (timer === 0) since = now;
    clearTimeout(timer);
    timer = window.setTimeout(write, Math.min(kRestMilliseconds, Math.max(since + kLongestMilliseconds - now, 0)));
  };
  viewer.on("view", soon);
  viewer.on("settings", soon);
  viewer.on("layers", soon);
  addEventListener("hashchange", () => {
    if (location.hash === written) return;
    const asked = readAddress(location.hash);
    applyAddress(viewer, asked, defaults);
    if (asked.view.easting !== undefined) viewer.setView(asked.view);
    soon();
  });
  return write;
}

/** Everything but the view. What the address does not name is as it is at first. */
export function applyAddress(viewer: Viewer, asked: AddressState, defaults: Settings): void {
  const plain = Object.fromEntries(
    [...Object.keys(kWords), ...kNumbers, ...kSwitches].map((name) => [name, defaults[name as keyof Settings]]),
  );
  viewer.set({ ...plain, ...asked.settings } as Partial<Settings>);
  for (const layer of viewer.layers) viewer.setLayer(layer.name, asked.layers?.includes(layer.name) ?? true);
}
