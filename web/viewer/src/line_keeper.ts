import type { DatasetInfo } from "terrane";
import type { GroundLine, LineStore, Point } from "./line_store.js";

/** So much is kept. What does not fit was a file, which its owner has; what was drawn by hand is small. */
const kMostCharacters = 1_000_000;
const kRestMilliseconds = 300;

type KeptLine = Omit<GroundLine, "id" | "parts"> & { parts: [number, number][][] };

/** Brings back the lines that were over this ground when the page was left, and keeps what comes of them; in this browser alone. */
export function keepLines(lines: LineStore, dataset: DatasetInfo, address: string): void {
  // Another dataset at the same address may lie elsewhere.
  const key = `terrane-lines ${new URL(address, location.href).href} ${dataset.crsName}`;
  for (const { name, parts, ...style } of read(key))
    lines.add(
      name,
      parts.map((part) => part.map(([easting, northing]): Point => ({ easting, northing }))),
      style,
    );
  let timer: number | undefined;
  const write = (): void => {
    timer = undefined;
    const kept = lines.lines.map(
      ({ name, color, width, widthUnit, parts }): KeptLine => ({
        name,
        color,
        width,
        widthUnit,
        parts: parts.map((part) => part.map(({ easting, northing }): [number, number] => [rounded(easting), rounded(northing)])),
      }),
    );
    let left = kMostCharacters;
    const fitting = kept.map((line) => JSON.stringify(line)).filter((text) => text.length < left && (left -= text.length));
    store((storage) => (fitting.length === 0 ? storage.removeItem(key) : storage.setItem(key, `[${fitting.join(",")}]`)));
  };
  lines.onEdit(() => (timer ??= window.setTimeout(write, kRestMilliseconds)));
  window.addEventListener("pagehide", () => {
    if (timer !== undefined) write();
  });
}

/** What is no list of lines counts as none: anybody may write there. */
function read(key: string): KeptLine[] {
  let kept: unknown = null;
  store((storage) => (kept = JSON.parse(storage.getItem(key) ?? "null")));
  return Array.isArray(kept) ? kept.filter(isLine) : [];
}

function isLine(value: unknown): value is KeptLine {
  const line = value as Partial<KeptLine> | null;
  return (
    typeof line?.name === "string" &&
    /^#[0-9a-f]{6}$/i.test(String(line.color)) &&
    typeof line.width === "number" &&
    line.width > 0 &&
    (line.widthUnit === "pixels" || line.widthUnit === "meters") &&
    Array.isArray(line.parts) &&
    line.parts.length > 0 &&
    line.parts.every((part) => Array.isArray(part) && part.length > 0 && part.every((at) => Array.isArray(at) && at.every(Number.isFinite) && at.length === 2))
  );
}

/** Storage may be forbidden or full; then nothing is kept. */
function store(use: (storage: Storage) => void): void {
  try {
    use(window.localStorage);
  } catch {
    // as if there were nothing
  }
}

function rounded(value: number): number {
  return Number(value.toFixed(3));
}
