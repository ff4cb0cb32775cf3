import type { ProfilePoint } from "terrane";
import type { App } from "../app.js";
import type { GroundScale } from "../geo/ground_scale.js";
import type { Point } from "../line_store.js";
import { formatDistance } from "../parts/format.js";
import { type Climb, climbOf, lengthOfCorners, lengthOverGround, mapDistance } from "./ground_measures.js";

/** A line crosses the edges of the ground's triangles between its samples, too, and only there it turns up or down: with so many
 * heights to a spacing, climbs are within some hundredths of all that there is. */
const kSamplesPerSpacing = 4;
/** Enough for a plot to be smooth, on ground however coarse. */
const kLeastSamples = 512;
/** 12 to 17 ms over the Moon on a quiet processor, 83 on one with much else to do. */
const kMostSamples = 20_000;
/** So many are taken while somebody waits for them: a few milliseconds. */
const kMostAtOnce = 2048;
const kRestMilliseconds = 150;
const kPatienceMilliseconds = 2000;

/** Heights along a line, and what follows from them. */
export interface GroundProfile {
  /** Of all its parts one after the other, with a point without height between two. Distances are those on the ground. */
  points: ProfilePoint[];
  /** Which of them stand between parts. */
  breaks: number[];
  lengthOnMap: number;
  lengthOverGround: number;
  climb: Climb;
  /** Metres on the ground between two heights, and between two of the dataset's. */
  stepMeters: number;
  spacingMeters: number;
  /** It is taken again, more finely, when the line rests and its ground has come. */
  isPreliminary: boolean;
}

/** A line's profile, as fine as the ground. A long line has a coarse one at once, and the fine one when it
 * rests and its ground has come: what takes more than a few milliseconds is kept from the way of the pointer. */
export class ProfileKeeper {
  now: GroundProfile | null = null;
  private timer = 0;
  private line = "";
  /** Of its parts, on the map. */
  private lengths: number[] = [];
  private changedAt = 0;

  /** `refined`: told when the fine one is here. `scale` and `parts` are asked for what they are then. */
  constructor(
    private readonly app: App,
    private readonly parts: () => readonly (readonly Point[])[],
    private readonly scale: () => GroundScale | null,
    private readonly refined: () => void,
  ) {}

  /** Takes it anew, when the line is another or its ground may be finer. */
  renew(): GroundProfile | null {
    clearTimeout(this.timer);
    const onMap = mapDistance(this.app.dataset.metersPerUnit);
    this.lengths = this.parts().map((part) => lengthOfCorners(part, onMap));
    const line = this.signature();
    const isAnother = line !== this.line;
    if (isAnother) this.changedAt = performance.now();
    this.line = line;
    const isLong = this.samplesWanted() > kMostAtOnce;
    // A fine one stays until there is another.
    if (isAnother || !isLong || this.now === null || this.now.isPreliminary) this.now = this.take(kMostAtOnce);
    if (isLong) this.refineLater();
    return this.now;
  }
  /** The fine one, though it takes a moment. */
  refine(): GroundProfile | null {
    if (this.now?.isPreliminary) this.now = this.take(kMostSamples);
    return this.now;
  }
  close(): void {
    clearTimeout(this.timer);
  }

  private refineLater(): void {
    this.timer = window.setTimeout(() => {
      const hasCome = this.app.viewer.isSettled || performance.now() > this.changedAt + kPatienceMilliseconds;
      if (!hasCome) return this.refineLater();
      this.now = this.take(kMostSamples);
      this.refined();
    }, kRestMilliseconds);
  }

  /** The same for the same line, measured by the same scale. */
  private signature(): string {
    const last = this.parts().at(-1)?.at(-1);
    return [this.scale() === null, last?.easting, last?.northing, ...this.lengths].join();
  }
  private get lengthOnMap(): number {
    return this.lengths.reduce((sum, length) => sum + length, 0);
  }
  private samplesWanted(): number {
    const wanted = (kSamplesPerSpacing * this.lengthOnMap) / this.app.dataset.spacingMeters;
    return Math.min(Math.max(wanted, kLeastSamples), kMostSamples);
  }

  private take(most: number): GroundProfile | null {
    const { lengthOnMap } = this;
    const samples = Math.min(this.samplesWanted(), most);
    const stepOnMap = lengthOnMap / samples;
    if (!(stepOnMap > 0)) return null;
    const points: ProfilePoint[] = [];
    const breaks: number[] = [];
    let [length, overGround] = [0, 0];
    for (const [i, part] of this.parts().entries()) {
      const own = this.sample(part, Math.ceil((this.lengths[i] ?? 0) / stepOnMap - 1e-6) + 1);
      const first = own[0];
      if (!first) continue;
      if (points.length > 0) {
        breaks.push(points.length);
        points.push({ ...first, distance: length, height: NaN, error: NaN });
      }
      for (const point of own) {
        point.distance += length;
        points.push(point);
      }
      overGround += lengthOverGround(own);
      length = points.at(-1)?.distance ?? length;
    }
    const stretch = length / lengthOnMap;
    return {
      points,
      breaks,
      lengthOnMap,
      lengthOverGround: overGround,
      climb: climbOf(points),
      stepMeters: stepOnMap * stretch,
      spacingMeters: this.app.dataset.spacingMeters * stretch,
      isPreliminary: most < this.samplesWanted(),
    };
  }

  private sample(part: readonly Point[], samples: number): ProfilePoint[] {
    const onMap = part.length >= 2 ? this.app.viewer.profile([...part], samples) : [];
    return this.scale()?.along(onMap) ?? onMap;
  }
}

/** That heights lie further apart than the ground's own; empty where they do not. */
export function coarsenessOf({ stepMeters, spacingMeters, isPreliminary }: GroundProfile): string {
  if (stepMeters <= 1.01 * spacingMeters) return "";
  const apart = `a height every ${formatDistance(stepMeters)}`;
  return isPreliminary ? `${apart} for now` : `${apart}, where the ground has one every ${formatDistance(spacingMeters)}`;
}

/** As a table: places in the dataset's CRS, metres along the line on the ground, no height where there is no ground. */
export function csvOf({ points, breaks }: GroundProfile): string {
  const between = new Set(breaks);
  const rows = ["part,distance_m,height_m,error_m,easting,northing"];
  let part = 1;
  points.forEach((point, i) => {
    if (between.has(i)) {
      part += 1;
      return;
    }
    const [height, error] = [point.height, point.error].map((meters) => (Number.isFinite(meters) ? meters.toFixed(3) : ""));
    rows.push([part, point.distance.toFixed(3), height, error, point.easting.toFixed(3), point.northing.toFixed(3)].join());
  });
  return rows.join("\r\n") + "\r\n";
}
