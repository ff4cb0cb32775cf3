import type { DatasetInfo } from "terrane";
import { formatNumber } from "../parts/format.js";

/** Mean radii, kilometres. */
const kBodies: readonly (readonly [string, number])[] = [
  ["the Moon", 1737.4],
  ["Mars", 3389.5],
  ["Mercury", 2439.7],
  ["Venus", 6051.8],
];

/** What the ground lies on, for a sentence: “the Moon”. */
export function bodyName({ ellipsoid }: DatasetInfo): string {
  if (ellipsoid.isEarth) return "the Earth";
  const radius = ellipsoid.semiMajorMeters / 1000;
  // Ellipsoids of one body differ by some thousandths.
  const known = kBodies.find(([, mean]) => Math.abs(radius / mean - 1) < 0.004);
  return known?.[0] ?? `a body of radius ${formatNumber(radius)} km`;
}

/** What longitude and latitude are counted on: “WGS 84”, “on the Moon”. */
export function degreesName(dataset: DatasetInfo): string {
  return dataset.ellipsoid.isEarth ? "WGS 84" : `on ${bodyName(dataset)}`;
}
