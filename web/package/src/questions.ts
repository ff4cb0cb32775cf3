import type { ProfilePoint, Sight } from "./api.js";
import type { EngineView } from "./engine.js";

/** How much air bends light downwards by day, as a share of the earth's curvature. */
const kUsualRefraction = 0.13;

type GroundPoint = { easting: number; northing: number };

/** Viewer.profile() out of the engine's rows of numbers. */
export function profileAlong(native: EngineView, line: GroundPoint[], samples: number): ProfilePoint[] {
  const corners = new Float64Array(line.flatMap((point) => [point.easting, point.northing]));
  const rows = native.profile(corners, Math.max(2, Math.floor(samples)));
  const out: ProfilePoint[] = [];
  for (let i = 0; i + 4 < rows.length; i += 5) {
    const [distance = NaN, easting = NaN, northing = NaN, height = NaN, error = NaN] = rows.subarray(i, i + 5);
    out.push({ distance, easting, northing, height, error });
  }
  return out;
}

/** Viewer.lineOfSight(). `above`: metres above the ground; `isEarth`: is there air unless somebody says otherwise? */
export function lookFrom(
  native: EngineView,
  isEarth: boolean,
  from: GroundPoint & { above?: number },
  to: GroundPoint & { above?: number },
  options: { curvature?: boolean; refraction?: number; length?: number },
): Sight {
  const { curvature = true, refraction = isEarth ? kUsualRefraction : 0, length } = options;
  if (!(refraction >= 0 && refraction < 1)) throw new RangeError("The refraction is a coefficient from 0 to 1: 0.13 is usual.");
  if (length !== undefined && !(length >= 0 && Number.isFinite(length))) throw new RangeError("The length is a number of metres.");
  const [seen, clearance = NaN, easting, northing, height] = native.lineOfSight(
    from.easting, from.northing, from.above ?? 2, to.easting, to.northing, to.above ?? 2,
    curvature ? refraction : NaN, length ?? NaN,
  );
  const isHidden = seen !== 1 && easting !== undefined && northing !== undefined && height !== undefined;
  return { visible: seen === 1, clearance, blockedAt: isHidden ? { easting, northing, height } : null };
}
