import type { View } from "./api.js";
import { turnBetween } from "./geometry.js";

/** Key frames a second. Between them a flight is smooth. */
const kKeysPerSecond = 10;
/** As many as a flight may have. */
const kMostKeys = 10000;

interface Key {
  time: number;
  eye: [number, number, number];
  heading: number;
  pitch: number;
  fovy: number;
}

/** Writes down where the camera is, and makes a flight of it (docs/flights.md). */
export class FlightRecorder {
  private readonly keys: Key[] = [];
  private begun = 0;

  /** Once a frame. */
  see(view: View, nowSeconds: number): void {
    const last = this.keys.at(-1);
    if (last === undefined) this.begun = nowSeconds;
    const time = nowSeconds - this.begun;
    if (last !== undefined && (time - last.time < 1 / kKeysPerSecond || this.keys.length >= kMostKeys)) return;
    this.keys.push({
      time: round(time, 3),
      eye: [round(view.easting, 3), round(view.northing, 3), round(view.height, 3)],
      // note: headings go on counting, so that a turn over north is not one the other way round.
      heading: round(last === undefined ? view.heading : last.heading + turnBetween(last.heading, view.heading), 3),
      pitch: round(view.pitch, 3),
      fovy: round(view.fov, 3),
    });
  }

  /** The flight as JSON. */
  finish(name: string): string {
    const rows = this.keys.map((key) => "    " + JSON.stringify(key)).join(",\n");
    const head = { terraneFlight: 1, name, coordinates: "crs", look: "angles", interpolation: "smooth" };
    return JSON.stringify(head, null, 2).replace(/\n}$/, `,\n  "keys": [\n${rows}\n  ]\n}\n`);
  }
}

const round = (value: number, digits: number): number => Number(value.toFixed(digits));
