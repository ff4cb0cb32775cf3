import type { Profile, Settings } from "./api.js";
import type { EngineLimits } from "./engine.js";

/** What suits a device before anything is known of its speed. */
export interface DeviceDefaults {
  settings: Settings;
  limits: EngineLimits;
  workers: number;
}

/** Small and touched: a phone. */
export function detectProfile(): Profile {
  const isTouched = matchMedia("(pointer: coarse)").matches;
  const isSmall = Math.min(screen.width, screen.height) < 700;
  return isTouched && isSmall ? "phone" : "desktop";
}

const kLimits: Record<Profile, EngineLimits> = {
  desktop: {
    compressedMegabytes: 64,
    decodedMegabytes: 192,
    pictureMegabytes: 48,
    gpuGeometryMegabytes: 128,
    gpuTextureMegabytes: 256,
    meshMegabytes: 96,
    uploadMegabytesAFrame: 4,
  },
  phone: {
    compressedMegabytes: 16,
    decodedMegabytes: 72,
    pictureMegabytes: 16,
    gpuGeometryMegabytes: 48,
    gpuTextureMegabytes: 96,
    meshMegabytes: 40,
    uploadMegabytesAFrame: 2,
  },
};

export function defaultsFor(profile: Profile): DeviceDefaults {
  const isPhone = profile === "phone";
  const cores = navigator.hardwareConcurrency || 2;
  return {
    limits: kLimits[profile],
    workers: Math.max(1, Math.min(isPhone ? 2 : 4, cores - 1)),
    settings: {
      surface: "meshes",
      tau: isPhone ? 1.5 : 1,
      samples: isPhone ? 1 : 4,
      pixelRatio: Math.min(devicePixelRatio || 1, isPhone ? 1.5 : 2),
      mode: "shaded",
      outline: "none",
      exaggeration: 1,
      sunAzimuth: 315,
      sunAltitude: 38,
      haze: true,
      imageryRelief: 0.45,
      imageryBrightness: 1,
      water: true,
      frozen: false,
    },
  };
}

/** Is the picture made by the processor? By the name that the driver gives. */
export function isSoftwareRenderer(name: string): boolean {
  return /llvmpipe|softpipe|swiftshader|software|basic render/i.test(name);
}
