/**
 * The engine as WebAssembly gives it: what `web/module/bindings.cpp` binds, in TypeScript. Nothing outside this package sees it.
 *
 * Places are easting, northing (CRS units) and height (metres, as the data has them: not exaggerated). Where there is nothing
 * to tell, numbers are NaN.
 */

/** What `terrane.mjs` exports by default: makes one engine, with memory of its own. */
export type MakeEngine = (options: EngineOptions) => Promise<Engine>;

export interface EngineOptions {
  /** Where terrane.wasm is; absent: beside terrane.mjs. */
  locateFile?(name: string): string;
  /** Gives a worker that runs `terrane_worker.mjs`'s jobs; absent, or where it throws: the engine decodes between frames. */
  makeWorker?(): Worker;
  /** How many of them. */
  workerCount?: number;
  /** What was asked for before the engine was there, by address: `askEarly()`. Each answer is taken once. */
  early?: Map<string, Promise<EarlyAnswer | null>>;
}

/** A whole answer, and how long it took. */
export interface EarlyAnswer {
  status: number;
  headers: Headers;
  bytes: Uint8Array;
  seconds: number;
}

export interface Engine {
  /** Asks for the dataset's beginning at once. */
  View: new (datasetUrl: string, limits: EngineLimits) => EngineView;
}

/** What a view may take. Megabytes are of 2^20 bytes. */
export interface EngineLimits {
  compressedMegabytes: number;
  decodedMegabytes: number;
  pictureMegabytes: number;
  gpuGeometryMegabytes: number;
  gpuTextureMegabytes: number;
  meshMegabytes: number;
  uploadMegabytesAFrame: number;
}

/** How the picture looks, and how fine it is. */
export interface EngineStyle {
  surface: "patches" | "meshes";
  tau: number;
  samples: number;
  mode: "shaded" | "height" | "slope" | "normals" | "tiles" | "error";
  outline: "none" | "wireframe" | "patches";
  exaggeration: number;
  sunAzimuth: number;
  sunAltitude: number;
  haze: boolean;
  imageryRelief: number;
  imageryBrightness: number;
  water: boolean;
  /** What is drawn stays what was chosen when this became true; the camera's frustum of then is drawn. */
  frozen: boolean;
}

export interface EngineReport {
  triangles: number;
  patches: number;
  drawCalls: number;
  errorPixels: number;
  tau: number;
  memoryFactor: number;
  ramping: number;
  tilesOnGpu: number;
  imageryOnGpu: number;
  gpuBytes: number;
  meshBytes: number;
  decodedBytes: number;
  heapBytes: number;
  bytesReceived: number;
  bytesUnwanted: number;
  bytesUnderway: number;
  requests: number;
  requestsUnderway: number;
  requestsFailed: number;
  tilesDecoded: number;
  tilesLost: number;
  wishes: number;
  wishedBytes: number;
  debt: number;
  looseness: number;
  bytesPerSecond: number;
  latencySeconds: number;
  selectSeconds: number;
  isOffline: boolean;
  /** Workers that are ready; 0: decoding happens between frames. */
  workers: number;
}

export interface EngineView {
  delete(): void;

  /** Takes in what has come of the dataset's beginning, and asks for what follows, as a frame does. */
  open(): void;
  /** Draws on this canvas from now on; why it cannot, `problem()` tells. What is decoded stays. */
  attach(canvas: HTMLCanvasElement): void;
  /** Draws on none, as when its context is lost: lines and stages are forgotten. */
  detach(): void;

  /** Why nothing more will be drawn; empty while all is well. */
  problem(): string;
  /** What went wrong last without ending it; empty if nothing did. */
  trouble(): string;
  rendererName(): string;
  isReady(): boolean;
  /** All that the camera needs is drawn, and nothing fades in. */
  isSettled(): boolean;
  /** JSON: DatasetInfo of api.ts. Only when ready. */
  datasetJson(): string;

  setSize(width: number, height: number): void;
  setStyle(style: EngineStyle): void;
  /** Which imagery layers are shown, names parted by "/"; empty: none. At first all are. */
  setImageryLayers(names: string): void;
  /** Heights here, too, are not exaggerated. Before it is ready already. */
  setCamera(
    eyeEast: number, eyeNorth: number, eyeHeight: number,
    targetEast: number, targetNorth: number, targetHeight: number, fovyDegrees: number,
  ): void;

  /** Takes in what has come, draws if the picture is another one (then true), decodes for a while if there are no workers. */
  frame(nowSeconds: number): boolean;
  /** The next frame is drawn whatever changed. */
  redraw(): void;
  report(): EngineReport;
  /** Tiles drawn from, one number a level. A view into the engine's memory: copy it. */
  tilesByLevel(): Float64Array;
  /** The picture as it was drawn last: four bytes a pixel, rows from the top. A view into the engine's memory: copy it. */
  readPicture(): Uint8Array;

  /** The height of the finest ground that is here; NaN where there is none. */
  elevationAt(easting: number, northing: number): number;
  /** How wrong that height may be, metres: a bound. */
  elevationErrorAt(easting: number, northing: number): number;
  /** The ground under a point of the canvas, in pixels of its buffer from the top left: [easting, northing, height, metres from
   * the eye], or nothing. A view into the engine's memory: copy it. */
  pick(x: number, y: number): Float64Array;
  /** Heights at `count` equal distances along a line of easting and northing pairs: [distance, easting, northing, height, error]
   * each. A view into the engine's memory: copy it. */
  profile(corners: Float64Array, count: number): Float64Array;
  /** From one point above the ground to another, over a round body in air of this refraction (NaN: over a flat one), so many metres
   * apart (NaN: as far as the projection shows): [is seen (1 or 0), least clearance in metres, then, where the ground hides it, where
   * it first does: easting, northing, height]. A view into the engine's memory: copy it. */
  lineOfSight(
    fromEast: number, fromNorth: number, fromAboveGround: number,
    toEast: number, toNorth: number, toAboveGround: number, refraction: number, lengthMeters: number,
  ): Float64Array;

  /** Lines along which the ground is fetched as finely as it is stored. `corners`: easting and northing pairs of all, one after the
   * other; `counts`: corners of each. Only when ready. */
  studyGround(corners: Float64Array, counts: Float64Array): void;

  /** Replaces all lines on the ground. `corners`: easting and northing pairs of all lines, one after the other; `lines`: for each
   * line [corner count, red, green, blue, alpha (0 to 1, sRGB), width, 1 if the width is in metres and not in pixels]. */
  setLines(corners: Float64Array, lines: Float32Array): void;
  /** Adds a stage over the finished ground (`pass.ts`), or replaces the one of that name. Returns the compiler's words, empty if
   * it took it. `origin`: what the stage's places count from. */
  setPass(name: string, fragment: string, originEast: number, originNorth: number, originHeight: number): string;
  removePass(name: string): void;
  /** One number to four of a stage's uniform. */
  setPassUniform(name: string, uniform: string, values: Float32Array): void;

  /** Reads a flight (docs/flights.md). Returns what is wrong with it; empty: nothing. Only when ready. */
  loadFlight(json: string): string;
  /** Seconds; NaN without a flight. */
  flightSeconds(): number;
  /** [eye easting, northing, height, target easting, northing, height, fovy in degrees] at a time of the flight. A view into the
   * engine's memory: copy it. */
  flightCamera(seconds: number): Float64Array;
}
