/** Numbers as people read them. Groups of three are parted by a narrow space, the point is a point. */

const kNarrowSpace = "\u202f";

export function formatNumber(value: number, digits = 0): string {
  if (!Number.isFinite(value)) return "–";
  const [whole = "", part] = Math.abs(value).toFixed(digits).split(".");
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, kNarrowSpace) : whole;
  const isZero = Number(Math.abs(value).toFixed(digits)) === 0;
  return `${value < 0 && !isZero ? "−" : ""}${grouped}${part === undefined ? "" : `.${part}`}`;
}

/** Metres, or kilometres where they are many; about four digits. */
export function formatDistance(meters: number): string {
  const size = Math.abs(meters);
  if (size >= 100_000) return `${formatNumber(meters / 1000, 0)} km`;
  if (size >= 10_000) return `${formatNumber(meters / 1000, 1)} km`;
  if (size >= 1000) return `${formatNumber(meters / 1000, 2)} km`;
  return `${formatNumber(meters, size < 100 ? 1 : 0)} m`;
}

/** A place on an axis with such steps: no more digits than tell it from its neighbours. */
export function formatTick(meters: number, step: number): string {
  if (step >= 1000 || meters >= 10_000) return `${formatNumber(meters / 1000, step % 1000 === 0 ? 0 : 1)} km`;
  return meters >= 1000 ? `${formatNumber(meters / 1000, step % 100 === 0 ? 1 : 2)} km` : `${formatNumber(meters, step < 1 ? 1 : 0)} m`;
}

export function formatArea(squareMeters: number): string {
  if (squareMeters >= 1e6) return `${formatNumber(squareMeters / 1e6, squareMeters < 1e8 ? 2 : 0)} km²`;
  if (squareMeters >= 1e5) return `${formatNumber(squareMeters / 1e4, 1)} ha`;
  return `${formatNumber(squareMeters, 0)} m²`;
}

/** As many decimals as a bound of the error makes worth saying. */
export function digitsFor(errorMeters: number): number {
  if (!(errorMeters > 0)) return 2;
  return errorMeters < 0.05 ? 2 : errorMeters < 2 ? 1 : 0;
}

export function formatHeight(meters: number, errorMeters = 1): string {
  return `${formatNumber(meters, digitsFor(errorMeters))} m`;
}

/** The bound of an error: never less than it is. */
export function formatError(meters: number): string {
  if (!Number.isFinite(meters)) return "–";
  const digits = meters < 0.1 ? 3 : meters < 10 ? 2 : 0;
  const factor = 10 ** digits;
  return `± ${formatNumber(Math.ceil(meters * factor - 1e-6) / factor, digits)} m`;
}

export function formatBytes(bytes: number): string {
  if (bytes >= 1e9) return `${formatNumber(bytes / 1e9, 2)} GB`;
  if (bytes >= 1e6) return `${formatNumber(bytes / 1e6, 1)} MB`;
  if (bytes >= 1e3) return `${formatNumber(bytes / 1e3, 0)} kB`;
  return `${formatNumber(bytes)} B`;
}

export function formatCount(count: number): string {
  if (count >= 1e6) return `${formatNumber(count / 1e6, 2)} M`;
  if (count >= 1e4) return `${formatNumber(count / 1e3, 0)} k`;
  return formatNumber(count);
}

export function formatDuration(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

const kWinds = ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];
export function windOf(headingDegrees: number): string {
  return kWinds[Math.round(headingDegrees / 45) % 8] ?? "north";
}
