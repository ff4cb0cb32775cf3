import type { Settings } from "./api.js";
import { clamp } from "./geometry.js";

/** The settings within what the engine can do; throws a RangeError where one is no number. */
export function checkSettings(settings: Settings): Settings {
  const positive = ["tau", "pixelRatio", "exaggeration"] as const;
  for (const name of positive)
    if (!(settings[name] > 0 && Number.isFinite(settings[name]))) throw new RangeError(`${name} must be a number above 0, not ${settings[name]}.`);
  for (const name of ["sunAzimuth", "sunAltitude", "imageryRelief", "imageryBrightness"] as const)
    if (!Number.isFinite(settings[name])) throw new RangeError(`${name} must be a number, not ${settings[name]}.`);
  return {
    ...settings,
    samples: settings.samples >= 2 ? 4 : 1,
    sunAltitude: clamp(settings.sunAltitude, 1, 90),
    exaggeration: clamp(settings.exaggeration, 0.01, 100),
    pixelRatio: clamp(settings.pixelRatio, 0.1, 4),
  };
}
