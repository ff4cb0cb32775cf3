import type { View } from "./api.js";
import { type WorldScale, clamp, turnBetween, wrapHeading } from "./geometry.js";

/** Moves the camera by itself: gives where it is after so many seconds, null when it has arrived. */
export type Motion = (elapsedSeconds: number) => View | null;

const smooth = (share: number): number => share * share * share * (share * (share * 6 - 15) + 10);
const mix = (a: number, b: number, share: number): number => a + (b - a) * share;

/** From one view to another, in an arc where it is far. Ends with `to`, then null. */
export function glide(from: View, to: View, world: WorldScale, seconds?: number): Motion {
  const far = Math.hypot(to.easting - from.easting, to.northing - from.northing) * world.metersPerUnit;
  const climb = Math.abs(to.height - from.height);
  const turn = turnBetween(from.heading, to.heading);
  const hop = Math.max(0, 0.3 * far - 0.5 * climb);
  const size = Math.max(Math.abs(from.height), Math.abs(to.height), 100);
  const duration = seconds ?? clamp(0.7 + 0.6 * Math.log2(1 + (far + climb) / size) + Math.abs(turn) / 180, 0.7, 5);
  let isThere = false;
  return (elapsed) => {
    if (isThere) return null;
    const share = duration > 0 ? clamp(elapsed / duration, 0, 1) : 1;
    isThere = share >= 1;
    if (isThere) return to;
    const s = smooth(share);
    return {
      easting: mix(from.easting, to.easting, s),
      northing: mix(from.northing, to.northing, s),
      height: mix(from.height, to.height, s) + hop * 4 * s * (1 - s),
      heading: wrapHeading(from.heading + turn * s),
      pitch: mix(from.pitch, to.pitch, s),
      fov: mix(from.fov, to.fov, s),
    };
  };
}
