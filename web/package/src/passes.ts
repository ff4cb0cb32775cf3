import { type DatasetInfo, type Pass, ViewerError } from "./api.js";
import type { EngineView } from "./engine.js";

/** The caller's own passes: kept here, since the engine loses them with its graphics and takes none before the dataset is open. */
export class Passes {
  private readonly all = new Map<string, Pass>();

  /** `native`: an engine's view that can take the pass now, or null. Throws where the pass does not compile. */
  add(pass: Pass, native: EngineView | null, info: DatasetInfo | null): void {
    if (native !== null && info !== null) {
      const trouble = give(native, info, pass);
      if (trouble !== "") throw new ViewerError({ code: "engine", message: `The pass "${pass.name}" does not compile:\n${trouble}`, isFatal: false });
    }
    this.all.set(pass.name, pass);
  }

  setUniforms(name: string, uniforms: Record<string, number | number[]>, native: EngineView | null): void {
    const pass = this.all.get(name);
    if (pass === undefined) throw new RangeError(`There is no pass "${name}".`);
    this.all.set(name, { ...pass, uniforms: { ...pass.uniforms, ...uniforms } });
    if (native !== null) giveUniforms(native, name, uniforms);
  }

  /** Returns whether there was one. */
  remove(name: string): boolean {
    return this.all.delete(name);
  }

  /** Those that were added before the dataset was open, or the graphics were lost. */
  giveAll(native: EngineView, info: DatasetInfo): void {
    for (const pass of this.all.values()) {
      const trouble = give(native, info, pass);
      if (trouble !== "") reportError(new Error(`The pass "${pass.name}" does not compile:\n${trouble}`));
    }
  }
}

function give(native: EngineView, info: DatasetInfo, pass: Pass): string {
  const { west, east, south, north } = info.bounds;
  const origin = pass.origin ?? { easting: (west + east) / 2, northing: (south + north) / 2, height: 0 };
  const trouble = native.setPass(pass.name, pass.fragment, origin.easting, origin.northing, origin.height);
  if (trouble === "") giveUniforms(native, pass.name, pass.uniforms ?? {});
  return trouble;
}

function giveUniforms(native: EngineView, name: string, uniforms: Record<string, number | number[]>): void {
  for (const [uniform, value] of Object.entries(uniforms)) native.setPassUniform(name, uniform, new Float32Array([value].flat()));
}
