/** What a page sees: the types of the package. `createViewer` is in viewer.ts. */

/** A point of the ground, or above it. Easting and northing in the dataset's CRS, height in metres as the data has it. */
export interface Place {
  easting: number;
  northing: number;
  height: number;
}

/** Where the camera is and where it looks. Degrees; heading clockwise from grid north, pitch above the horizon (-90 straight
 * down), fov vertical. Height is the eye's, in metres, without exaggeration. */
export interface View extends Place {
  heading: number;
  pitch: number;
  fov: number;
}

export type Surface = "patches" | "meshes";
export type Mode = "shaded" | "height" | "slope" | "normals" | "tiles" | "error";
export type Outline = "none" | "wireframe" | "patches";

/** What can be changed while a viewer lives, by `viewer.set()`. */
export interface Settings {
  /** How tiles become triangles. */
  surface: Surface;
  /** The bound of the geometric error on screen, in CSS pixels, above 0. */
  tau: number;
  /** Samples a pixel of the picture: 1 or 4. */
  samples: number;
  /** Pixels of the picture for each CSS pixel. */
  pixelRatio: number;
  mode: Mode;
  outline: Outline;
  /** Of heights, above 0. */
  exaggeration: number;
  /** Degrees clockwise from north, and above the horizon. */
  sunAzimuth: number;
  sunAltitude: number;
  haze: boolean;
  /** How much of light and shade lies over pictures: 0 none, 1 all. */
  imageryRelief: number;
  imageryBrightness: number;
  /** Ground at or below the sea's level is drawn as water, where the dataset seems to have a sea. */
  water: boolean;
  /** What is drawn stays what it is now, so that one can fly around it. */
  frozen: boolean;
}

/** What fits a device: memory, pixel ratio, workers, samples, surface. */
export type Profile = "desktop" | "phone";

export interface ViewerOptions {
  /** Address of the dataset's directory or of its manifest.json. */
  dataset: string;
  /** Absent: chosen by the device. */
  profile?: Profile;
  /** Where to begin; absent: all of the ground is seen. */
  view?: Partial<View>;
  settings?: Partial<Settings>;
  /** Web Workers that decode; 0: none, between frames. Absent: by the device. */
  workers?: number;
  /** Mouse, touch and keyboard move the camera. True if absent. */
  controls?: boolean;
  /** Where terrane.wasm and the worker lie; absent: beside the package's own files. */
  assets?: string;
}

/** A rectangle of ground in the dataset's CRS. */
export interface Bounds {
  west: number;
  south: number;
  east: number;
  north: number;
}

export interface LayerInfo {
  name: string;
  attribution: string;
  bounds: Bounds;
  /** Size of a texel on the ground at the finest level, metres. */
  texelMeters: number;
}

export interface DatasetInfo {
  name: string;
  crsName: string;
  crsWkt: string;
  /** The body that the CRS lies on; the earth's where it does not say. */
  ellipsoid: { semiMajorMeters: number; flattening: number; isEarth: boolean };
  attribution: string;
  verticalDatum: string;
  bounds: Bounds;
  minHeight: number;
  maxHeight: number;
  /** Bound of the finest level's error against what the dataset was built from, metres. */
  maxErrorMeters: number;
  spacingMeters: number;
  metersPerUnit: number;
  finestLevel: number;
  /** Imagery, bottom to top. */
  layers: LayerInfo[];
  /** Bytes of all archives. */
  bytes: number;
}

/** A point along a profile. */
export interface ProfilePoint extends Place {
  /** Metres along the line, as the projection shows them. */
  distance: number;
  /** Bound of the height's error, metres: more where finer ground has not come. */
  error: number;
}

export interface Sight {
  visible: boolean;
  /** Least height of the line above the ground, metres; negative where the ground hides it. */
  clearance: number;
  /** Where the ground first hides the target. */
  blockedAt: Place | null;
}

/** A line that lies on the ground, exact to the pixel. */
export interface Line {
  points: { easting: number; northing: number }[];
  /** CSS colour. */
  color?: string;
  /** In CSS pixels, or metres on the ground. 3 px if both are absent. */
  widthPixels?: number;
  widthMeters?: number;
}

/** What went wrong, for people and for programs. */
export type ProblemCode =
  | "no-webgl2" // this browser, or its graphics, gives no WebGL2
  | "no-dataset" // there is none at that address, or it cannot be read
  | "engine" // WebAssembly did not load
  | "context-lost" // the graphics were taken away; comes back by itself
  | "offline" // the server does not answer; asked again until it does
  | "damaged"; // parts are missing or damaged; coarser ground stands for them
export interface Problem {
  code: ProblemCode;
  /** One or two sentences: what, and what to do. */
  message: string;
  /** Nothing more will be drawn. */
  isFatal: boolean;
}

/** What loading is at, so that a page can say something true. */
export interface Loading {
  phase: "engine" | "dataset" | "ground" | "detail" | "settled";
  bytesReceived: number;
  bytesWanted: number;
  requestsUnderway: number;
}

export interface Statistics {
  /** Of the last frame, milliseconds: work on the page's thread, and since the frame before. */
  frameMilliseconds: number;
  intervalMilliseconds: number;
  triangles: number;
  patches: number;
  drawCalls: number;
  /** Bound of the error of what is drawn, in the picture's pixels. */
  errorPixels: number;
  /** That was chosen with, in the picture's pixels. */
  tau: number;
  tilesByLevel: number[];
  tilesOnGpu: number;
  imageryOnGpu: number;
  gpuBytes: number;
  memoryBytes: number;
  bytesReceived: number;
  requests: number;
  requestsFailed: number;
  bytesPerSecond: number;
  latencySeconds: number;
  wishes: number;
  /** Pixels of error above tau, times the pixels that have them, of what has not come. */
  debt: number;
  isOffline: boolean;
  renderer: string;
}

/** Events, with what their listeners are given. */
export interface ViewerEvents {
  ready: DatasetInfo;
  /** The camera moved. */
  view: View;
  /** A frame was drawn. */
  frame: Statistics;
  loading: Loading;
  /** Something went wrong; null: it is over. */
  problem: Problem | null;
  settings: Settings;
  layers: LayerState[];
}

export interface LayerState extends LayerInfo {
  visible: boolean;
}

/** A stage of the caller's own, over the finished ground: docs/web.md has a finished example. */
export interface Pass {
  name: string;
  /** GLSL ES 3.00: `vec3 apply(Ground ground)`, which returns linear colour; and uniforms of its own. */
  fragment: string;
  /** What `ground.place` counts from; absent: the middle of the ground, at height 0. */
  origin?: Place;
  uniforms?: Record<string, number | number[]>;
}

export interface Recording {
  /** The flight so far, as docs/flights.md has it. */
  stop(): string;
}

export interface Viewer {
  readonly canvas: HTMLCanvasElement;
  /** Resolves when the dataset is open; rejects with a ViewerError where it never will be. */
  readonly ready: Promise<DatasetInfo>;
  /** Null until it is open. */
  readonly dataset: DatasetInfo | null;
  readonly settings: Readonly<Settings>;
  readonly layers: readonly LayerState[];
  readonly view: View;
  /** What is wrong now. */
  readonly problem: Problem | null;

  set(settings: Partial<Settings>): void;
  setLayer(name: string, visible: boolean): void;
  /** At once. */
  setView(view: Partial<View>): void;
  /** All of the ground, or a part of it, from the south. */
  overview(bounds?: Bounds): View;
  /** Glides there; resolves true when it arrives, false where something else moved the camera. */
  flyTo(view: Partial<View>, options?: { seconds?: number }): Promise<boolean>;

  /** The height of the finest ground that is here; null where there is none. */
  elevationAt(easting: number, northing: number): number | null;
  /** The ground under a point of the canvas, CSS pixels from its top left; null: sky. */
  pick(x: number, y: number): (Place & { distance: number }) | null;
  /** Where a place is on the canvas, CSS pixels; null behind the camera. (Ground before it is not considered.) */
  project(place: Place): { x: number; y: number } | null;
  profile(line: { easting: number; northing: number }[], samples?: number): ProfilePoint[];
  /** `above`: heights above the ground, 2 m. Over the body's curvature, which a `refraction` of the air flattens (below 1; left out,
   * 0.13 on the earth as by day, 0 elsewhere); or without, as if it were flat. `length`: metres from place to place on the ground;
   * left out, as the projection shows them, which far from its middle is not the same: web Mercator at 60 degrees shows twice as
   * much, and so four times the curvature. */
  lineOfSight(
    from: { easting: number; northing: number; above?: number },
    to: { easting: number; northing: number; above?: number },
    options?: { curvature?: boolean; refraction?: number; length?: number },
  ): Sight;

  /** Has the ground along a line fetched as finely as it is stored, whatever the picture needs, so that `profile()`,
   * `elevationAt()` and `lineOfSight()` answer as exactly as the dataset can: their errors shrink as it comes. After what is in
   * view, and only as finely as a quarter of the memory for tiles allows (some 100 tiles). It stays until the line of that id is
   * another, or null. */
  studyGround(id: string, line: { easting: number; northing: number }[] | null): void;

  /** Adds a line, or replaces the one of that id. */
  setLine(id: string, line: Line): void;
  removeLine(id: string): void;
  readonly lines: ReadonlyMap<string, Line>;

  /** Throws a ViewerError with the compiler's words where the stage does not compile. */
  addPass(pass: Pass): void;
  setPassUniforms(name: string, uniforms: Record<string, number | number[]>): void;
  removePass(name: string): void;

  /** Mouse, touch and keyboard move the camera like a map, fly it, or do not. */
  controls: "map" | "fly" | "none";
  record(): Recording;
  /** Flies a flight (its JSON); resolves true at its end, false where something else moved the camera. */
  replay(flight: string): Promise<boolean>;

  statistics(): Statistics;
  /** All that the camera needs is drawn. */
  readonly isSettled: boolean;
  requestRender(): void;
  /** The picture as PNG, with the canvas's own pixels. */
  screenshot(): Promise<Blob>;

  on<Name extends keyof ViewerEvents>(name: Name, listener: (what: ViewerEvents[Name]) => void): () => void;
  /** Gives everything back. */
  dispose(): void;
}

export class ViewerError extends Error {
  readonly problem: Problem;
  constructor(problem: Problem) {
    super(problem.message);
    this.name = "ViewerError";
    this.problem = problem;
  }
}
