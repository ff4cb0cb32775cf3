import {
  type Bounds, type DatasetInfo, type LayerState, type Line, type Loading, type Pass, type Place, type Problem, type ProblemCode,
  type ProfilePoint, type Profile, type Recording, type Settings, type Sight, type Statistics, type View, type Viewer,
  type ViewerEvents, ViewerError, type ViewerOptions,
} from "./api.js";
import { FlyControls } from "./controls/fly.js";
import type { CameraHost, Controls } from "./controls/host.js";
import { MapControls } from "./controls/map.js";
import { type DeviceDefaults, defaultsFor, detectProfile, isSoftwareRenderer } from "./device.js";
import { EarlyWorkers, askEarly } from "./early.js";
import type { Engine, EngineReport, EngineView } from "./engine.js";
import { Events } from "./events.js";
import { FlightRecorder } from "./flight_recorder.js";
import {
  type Box, type Vector, add, basisOf, clamp, kSteepestPitch, length, pixelOf, placeFromWorld, scale, stayInBall, subtract,
  viewBetween, viewOfCorners, worldFromPlace, wrapHeading,
} from "./geometry.js";
import { GroundLines, StudiedLines } from "./ground_lines.js";
import { type Motion, glide } from "./motion.js";
import { Passes } from "./passes.js";
import { lookFrom, profileAlong } from "./questions.js";
import { SamplesChoice } from "./samples_choice.js";
import { checkSettings } from "./settings.js";
import makeEngine from "./terrane.mjs";

const kUsualFov = 45;
/** The eye stays so far above the ground, metres, when somebody moves it. */
const kLeastClearance = 3;
/** Nobody gets further away from the middle of the ground than so many of its diagonals: it is a few per cent of the picture then. */
const kFurthestDiagonals = 10;
/** Nothing moves and nothing comes: looked after so often. */
const kIdleMilliseconds = 250;
/** The camera counts as moving for so long after it moved. */
const kRestMilliseconds = 180;
/** A line of sight of this many metres from camera to target: long enough for directions, short enough for numbers. */
const kTargetMeters = 1000;

/** Shows a dataset on a canvas, whose size on the page it follows. Returns at once; `ready` tells when the dataset is open. */
export function createViewer(canvas: HTMLCanvasElement, options: ViewerOptions): Viewer {
  return new TerraneViewer(canvas, options);
}

class TerraneViewer implements Viewer {
  readonly ready: Promise<DatasetInfo>;
  private resolveReady!: (info: DatasetInfo) => void;
  private rejectReady!: (error: ViewerError) => void;

  private readonly events = new Events<ViewerEvents>();
  private readonly device: DeviceDefaults;
  private readonly chosen: Settings;
  private readonly url: string;
  private readonly resizes: ResizeObserver;
  private readonly abort = new AbortController();

  private engine: Engine | null = null;
  private native: EngineView | null = null;
  private isAttached = false;
  private info: DatasetInfo | null = null;
  private layerStates: LayerState[] = [];
  private current: View;
  private isPlaced: boolean;
  private wrong: Problem | null = null;
  private isDisposed = false;

  private readonly groundLines = new GroundLines();
  private readonly studied = new StudiedLines();
  private readonly passes = new Passes();

  private way: "map" | "fly" | "none" = "none";
  private controller: Controls | null = null;
  private motion: { at: Motion; begun: number; done: (arrived: boolean) => void } | null = null;
  private recorder: FlightRecorder | null = null;

  private scheduled = 0;
  private timer = 0;
  private lastStep = 0;
  private lastMoved = -1e9;
  private readonly samples = new SamplesChoice();
  private frameMilliseconds = 0;
  private intervalMilliseconds = 0;
  private loading: Loading = { phase: "engine", bytesReceived: 0, bytesWanted: 0, requestsUnderway: 0 };

  constructor(readonly canvas: HTMLCanvasElement, private readonly options: ViewerOptions) {
    const profile: Profile = options.profile ?? detectProfile();
    this.device = defaultsFor(profile);
    this.chosen = checkSettings({ ...this.device.settings, ...options.settings });
    this.url = new URL(options.dataset, location.href).href;
    this.isPlaced = options.view !== undefined;
    this.current = { easting: 0, northing: 0, height: 0, heading: 0, pitch: -30, fov: kUsualFov, ...options.view };
    this.ready = new Promise((resolve, reject) => {
      this.resolveReady = resolve;
      this.rejectReady = reject;
    });
    // Nobody needs to wait for it.
    this.ready.catch(() => {});

    if (canvas.tabIndex < 0) canvas.tabIndex = 0;
    canvas.style.touchAction = "none";
    const { signal } = this.abort;
    canvas.addEventListener("webglcontextlost", (event) => this.contextLost(event), { signal });
    canvas.addEventListener("webglcontextrestored", () => this.contextRestored(), { signal });
    document.addEventListener("visibilitychange", () => this.requestRender(), { signal });
    this.resizes = new ResizeObserver(() => this.wake());
    this.resizes.observe(canvas);
    this.controls = options.controls === false ? "none" : "map";
    void this.start();
  }

  // ------------------------------------------------------------------------------------------ beginning and end

  private async start(): Promise<void> {
    this.tellLoading({ phase: "engine" });
    if (typeof WebGL2RenderingContext === "undefined" || typeof WebAssembly === "undefined") {
      this.fail("no-webgl2", "This browser has no WebGL2. Update it, or use a current Firefox, Chrome, Edge or Safari.");
      return;
    }
    const { assets } = this.options;
    const base = assets === undefined ? null : new URL(assets.endsWith("/") ? assets : assets + "/", location.href);
    const workerCount = this.options.workers ?? this.device.workers;
    const workers = new EarlyWorkers(workerCount, () =>
      base
        ? new Worker(new URL("worker.js", base), { type: "module" })
        : new Worker(new URL("./worker.js", import.meta.url), { type: "module" }),
    );
    try {
      this.engine = await makeEngine({
        ...(base ? { locateFile: (name: string) => new URL(name, base).href } : {}),
        makeWorker: () => workers.take(),
        workerCount,
        early: askEarly(this.url),
      });
    } catch (error) {
      workers.end();
      this.fail("engine", `The engine did not load: ${error instanceof Error ? error.message : String(error)}`);
      return;
    }
    if (this.isDisposed) return workers.end();
    this.tellLoading({ phase: "dataset" });
    const native = new this.engine.View(this.url, this.device.limits);
    // Making a context keeps this thread busy for a while. What follows the manifest, if that is here, can come in the meantime.
    await new Promise((resolve) => setTimeout(resolve));
    if (this.isDisposed) return native.delete();
    native.open();
    this.native = native;
    this.attach(native);
  }

  private attach(native: EngineView): void {
    native.attach(this.canvas);
    const problem = native.problem();
    if (problem !== "") {
      native.delete();
      this.native = null;
      this.fail("no-webgl2", `There is no WebGL2 here: ${problem}. Hardware acceleration may be switched off in the browser's settings.`);
      return;
    }
    this.isAttached = true;
    if (isSoftwareRenderer(native.rendererName())) {
      // Nobody asked for more: pictures drawn by the processor are as plain as they can be.
      const asked = this.options.settings ?? {};
      if (asked.samples === undefined) this.chosen.samples = 1;
      if (asked.pixelRatio === undefined) this.chosen.pixelRatio = 1;
      this.samples.assume(false);
    }
    if (this.info !== null) this.passes.giveAll(native, this.info);
    if (this.layerStates.length > 0) this.giveLayers(native);
    this.groundLines.isStale = true;
    this.samples.restart(this.chosen.samples);
    this.giveStyle();
    this.wake();
  }

  private contextLost(event: Event): void {
    // Otherwise it would never come back.
    event.preventDefault();
    if (this.isDisposed) return;
    this.isAttached = false;
    this.native?.detach();
    this.setProblem({
      code: "context-lost",
      message: "The graphics were taken away from this page; the picture comes back when they do.",
      isFatal: false,
    });
  }

  private contextRestored(): void {
    // Taken away again before this was told: the next time, then.
    if (this.isDisposed || this.isContextLost()) return;
    this.setProblem(null);
    if (this.native !== null) this.attach(this.native);
  }

  /** note: the canvas tells a loss only after a while; frames in between must not reach the engine. */
  private isContextLost(): boolean {
    return this.canvas.getContext("webgl2")?.isContextLost() ?? true;
  }
  private canDraw(): boolean {
    return this.isAttached && !this.isContextLost();
  }

  dispose(): void {
    if (this.isDisposed) return;
    this.isDisposed = true;
    this.endMotion(false);
    cancelAnimationFrame(this.scheduled);
    clearTimeout(this.timer);
    this.controller?.detach();
    this.abort.abort();
    this.resizes.disconnect();
    this.native?.delete();
    this.native = null;
    this.engine = null;
    this.events.clear();
    if (this.info === null)
      this.rejectReady(new ViewerError({ code: "engine", message: "The viewer was given back before it was ready.", isFatal: true }));
  }

  // ------------------------------------------------------------------------------------------ problems, loading

  get problem(): Problem | null {
    return this.wrong;
  }

  private fail(code: ProblemCode, message: string): void {
    this.setProblem({ code, message, isFatal: true });
    this.rejectReady(new ViewerError({ code, message, isFatal: true }));
  }

  private setProblem(problem: Problem | null): void {
    if (this.wrong?.isFatal) return;
    if (problem?.code === this.wrong?.code && problem?.message === this.wrong?.message) return;
    this.wrong = problem;
    this.events.tell("problem", problem);
  }

  private watch(native: EngineView, report: EngineReport): void {
    const problem = native.problem();
    if (problem !== "") {
      this.fail("no-dataset", problem);
    } else if (this.info === null && isAboutFetching(native.trouble())) {
      // note: what the engine reports of its requests begins with the open dataset; before, it only says what went wrong last.
      const message = `The server does not answer; trying again until it does. ${native.trouble()}`;
      this.setProblem({ code: "offline", message, isFatal: false });
    } else if (report.isOffline) {
      const message = "The server does not answer; what is here stays, and the rest is asked for until it does.";
      this.setProblem({ code: "offline", message, isFatal: false });
    } else if (report.tilesLost > 0) {
      this.setProblem({
        code: "damaged",
        message: `${report.tilesLost} parts of the ground are missing or damaged; coarser ground stands for them. ${native.trouble()}`,
        isFatal: false,
      });
    } else {
      this.setProblem(null);
    }
  }

  private tellLoading(change: Partial<Loading>): void {
    const now = { ...this.loading, ...change };
    const isSame = (Object.keys(now) as (keyof Loading)[]).every((key) => now[key] === this.loading[key]);
    this.loading = now;
    if (!isSame) this.events.tell("loading", now);
  }

  // ------------------------------------------------------------------------------------------ frames

  requestRender(): void {
    this.native?.redraw();
    this.wake();
  }

  private wake(): void {
    if (this.isDisposed || this.scheduled !== 0) return;
    clearTimeout(this.timer);
    this.timer = 0;
    this.scheduled = requestAnimationFrame(() => {
      this.scheduled = 0;
      // A mistake somewhere does not stop the picture for ever.
      let isResting = true;
      try {
        isResting = this.step();
      } catch (error) {
        reportError(error);
      }
      if (this.isDisposed || !this.isAttached || this.wrong?.isFatal) return;
      // A page that rests costs nothing.
      if (isResting) this.timer = window.setTimeout(() => this.wake(), kIdleMilliseconds);
      else this.wake();
    });
  }

  /** A frame. Returns whether nothing moves and nothing more comes. */
  private step(): boolean {
    const { native } = this;
    if (native === null || !this.canDraw()) return true;
    const now = performance.now();
    const sinceLast = now - this.lastStep;
    const seconds = clamp(sinceLast / 1000, 0, 0.1);
    this.lastStep = now;

    if (this.info === null && native.isReady()) this.becomeReady(native);
    const isGoing = this.info !== null && this.moveOn(now / 1000, seconds);
    const isResized = this.takeSize(native);
    this.giveCamera(native);
    if (this.groundLines.isStale && this.info !== null) this.groundLines.give(native, this.chosen.pixelRatio);
    if (this.studied.isStale && this.info !== null) this.studied.give(native);
    const isAtRest = now - this.lastMoved > kRestMilliseconds && native.isSettled();
    if (this.samples.choose(this.chosen.samples, isAtRest)) this.giveStyle();

    const begun = performance.now();
    const isDrawn = native.frame(begun / 1000);
    this.frameMilliseconds = performance.now() - begun;
    this.intervalMilliseconds = sinceLast;
    const report = native.report();
    this.watch(native, report);
    this.tellProgress(native, report);
    this.recorder?.see(this.current, now / 1000);
    if (isDrawn) {
      this.samples.judge(sinceLast);
      if (this.events.has("frame")) this.events.tell("frame", this.statistics());
    }

    return (
      !isDrawn && !isGoing && !isResized && native.isSettled() && this.recorder === null && now - this.lastMoved > kRestMilliseconds
    );
  }

  private becomeReady(native: EngineView): void {
    const info = JSON.parse(native.datasetJson()) as DatasetInfo;
    this.info = info;
    this.layerStates = info.layers.map((layer) => ({ ...layer, visible: true }));
    if (!this.isPlaced) this.place({ ...this.overview() });
    else this.place(completeView(this.current, this.options.view ?? {}, this.overview()));
    this.passes.giveAll(native, info);
    this.resolveReady(info);
    this.events.tell("ready", info);
    this.events.tell("layers", this.layerStates);
  }

  /** Controls, glides and flights. Returns whether any goes on. */
  private moveOn(nowSeconds: number, seconds: number): boolean {
    if (this.motion !== null) {
      const at = this.motion.at(nowSeconds - this.motion.begun);
      if (at === null) this.endMotion(true);
      else this.place(at);
      return true;
    }
    return this.controller?.tick(seconds) ?? false;
  }

  private takeSize(native: EngineView): boolean {
    const width = Math.max(1, Math.round(this.canvas.clientWidth * this.chosen.pixelRatio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * this.chosen.pixelRatio));
    const isNew = this.canvas.width !== width || this.canvas.height !== height;
    if (isNew) {
      this.canvas.width = width;
      this.canvas.height = height;
      native.redraw();
    }
    native.setSize(width, height);
    return isNew;
  }

  private giveCamera(native: EngineView): void {
    if (this.info === null) return;
    const { metersPerUnit, exaggeration } = this.world();
    const { forward } = basisOf(this.current);
    const { easting, northing, height, fov } = this.current;
    native.setCamera(
      easting, northing, height,
      easting + (forward[0] * kTargetMeters) / metersPerUnit,
      northing + (forward[1] * kTargetMeters) / metersPerUnit,
      height + (forward[2] * kTargetMeters) / exaggeration,
      fov,
    );
  }

  private tellProgress(native: EngineView, report: EngineReport): void {
    const hasGround = report.tilesOnGpu > 0;
    const phase = native.isSettled() && hasGround ? "settled" : hasGround ? "detail" : this.info === null ? "dataset" : "ground";
    this.tellLoading({
      phase,
      bytesReceived: report.bytesReceived,
      bytesWanted: report.wishedBytes,
      requestsUnderway: report.requestsUnderway,
    });
  }

  statistics(): Statistics {
    const report = this.native?.report();
    return {
      frameMilliseconds: this.frameMilliseconds,
      intervalMilliseconds: this.intervalMilliseconds,
      triangles: report?.triangles ?? 0,
      patches: report?.patches ?? 0,
      drawCalls: report?.drawCalls ?? 0,
      errorPixels: report?.errorPixels ?? 0,
      tau: report?.tau ?? 0,
      tilesByLevel: [...(this.native?.tilesByLevel() ?? [])],
      tilesOnGpu: report?.tilesOnGpu ?? 0,
      imageryOnGpu: report?.imageryOnGpu ?? 0,
      gpuBytes: report?.gpuBytes ?? 0,
      memoryBytes: report?.heapBytes ?? 0,
      bytesReceived: report?.bytesReceived ?? 0,
      requests: report?.requests ?? 0,
      requestsFailed: report?.requestsFailed ?? 0,
      bytesPerSecond: report?.bytesPerSecond ?? 0,
      latencySeconds: report?.latencySeconds ?? 0,
      wishes: report?.wishes ?? 0,
      debt: report?.debt ?? 0,
      isOffline: report?.isOffline ?? false,
      renderer: this.native?.rendererName() ?? "",
    };
  }

  get isSettled(): boolean {
    // What the engine has not been told of yet is still to come, however long a frame takes.
    const isTold = !this.studied.isStale && !(this.groundLines.isStale && this.isAttached);
    return isTold && (this.native?.isSettled() ?? false);
  }

  // ------------------------------------------------------------------------------------------ settings and layers

  get dataset(): DatasetInfo | null {
    return this.info;
  }
  get settings(): Readonly<Settings> {
    return this.chosen;
  }
  get layers(): readonly LayerState[] {
    return this.layerStates;
  }

  set(settings: Partial<Settings>): void {
    Object.assign(this.chosen, checkSettings({ ...this.chosen, ...settings }));
    if (settings.samples !== undefined) this.samples.assume(!isSoftwareRenderer(this.native?.rendererName() ?? ""));
    if (settings.pixelRatio !== undefined) this.groundLines.isStale = true;
    this.samples.restart(this.chosen.samples);
    this.giveStyle();
    this.events.tell("settings", this.chosen);
    this.wake();
  }

  private giveStyle(): void {
    const { pixelRatio, ...style } = this.chosen;
    this.native?.setStyle({ ...style, tau: style.tau * pixelRatio, samples: this.samples.now });
    this.wake();
  }

  setLayer(name: string, visible: boolean): void {
    if (!this.layerStates.some((layer) => layer.name === name)) throw new RangeError(`There is no layer "${name}".`);
    this.layerStates = this.layerStates.map((layer) => (layer.name === name ? { ...layer, visible } : layer));
    if (this.native) this.giveLayers(this.native);
    this.events.tell("layers", this.layerStates);
    this.wake();
  }

  private giveLayers(native: EngineView): void {
    native.setImageryLayers(this.layerStates.filter((layer) => layer.visible).map((layer) => layer.name).join("/"));
  }

  // ------------------------------------------------------------------------------------------ camera

  get view(): View {
    return { ...this.current };
  }

  private world(): { metersPerUnit: number; exaggeration: number } {
    return { metersPerUnit: this.info?.metersPerUnit ?? 1, exaggeration: this.chosen.exaggeration };
  }

  private place(view: View): void {
    const next = { ...view, heading: wrapHeading(view.heading), pitch: clamp(view.pitch, -kSteepestPitch, kSteepestPitch), fov: clamp(view.fov, 1, 170) };
    if (!Object.values(next).every(Number.isFinite)) throw new RangeError(`A view of numbers is needed, not ${JSON.stringify(view)}.`);
    this.current = next;
    this.isPlaced = true;
    this.lastMoved = performance.now();
    this.events.tell("view", this.view);
    this.wake();
  }

  setView(view: Partial<View>): void {
    this.endMotion(false);
    this.controller?.stop();
    this.place({ ...this.current, ...view });
  }

  flyTo(view: Partial<View>, options: { seconds?: number } = {}): Promise<boolean> {
    const from = this.view;
    const to = { ...from, ...view };
    to.heading = wrapHeading(to.heading);
    const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;
    return this.setMotion(glide(from, to, this.world(), isStill ? 0 : options.seconds));
  }

  private setMotion(at: Motion): Promise<boolean> {
    this.endMotion(false);
    this.controller?.stop();
    return new Promise((done) => {
      this.motion = { at, begun: performance.now() / 1000, done };
      this.wake();
    });
  }

  private endMotion(arrived: boolean): void {
    const { motion } = this;
    this.motion = null;
    motion?.done(arrived);
  }

  overview(bounds?: Bounds): View {
    const { info } = this;
    if (info === null) throw new Error("The dataset is not open yet: await viewer.ready.");
    const world = this.world();
    const box = bounds ?? info.bounds;
    const low = worldFromPlace({ easting: box.west, northing: box.south, height: info.minHeight }, world);
    const high = worldFromPlace({ easting: box.east, northing: box.north, height: info.maxHeight }, world);
    const corners: Vector[] = [];
    for (let i = 0; i < 8; ++i) corners.push([i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]]);
    const canvas = { width: Math.max(1, this.canvas.clientWidth), height: Math.max(1, this.canvas.clientHeight) };
    return viewOfCorners(corners, scale(add(low, high), 0.5), this.current.fov, canvas, world);
  }

  get controls(): "map" | "fly" | "none" {
    return this.way;
  }
  set controls(way: "map" | "fly" | "none") {
    if (way === this.way) return;
    this.controller?.detach();
    this.way = way;
    this.controller = way === "map" ? new MapControls() : way === "fly" ? new FlyControls() : null;
    this.controller?.attach(this.host);
    this.wake();
  }

  private readonly host: CameraHost = ((viewer: TerraneViewer) => ({
    get canvas() {
      return viewer.canvas;
    },
    view: () => viewer.view,
    move: (view: View) => {
      if (viewer.info === null) return;
      viewer.endMotion(false);
      viewer.place(viewer.aboveGround(viewer.inReach(view)));
    },
    world: () => viewer.world(),
    size: () => ({ width: Math.max(1, viewer.canvas.clientWidth), height: Math.max(1, viewer.canvas.clientHeight) }),
    groundUnder: (x: number, y: number) => {
      const found = viewer.pick(x, y);
      return found === null ? null : worldFromPlace(found, viewer.world());
    },
    groundBox: () => viewer.groundBox(),
    clearance: () => {
      const { easting, northing, height } = viewer.current;
      const ground = viewer.elevationAt(easting, northing) ?? viewer.info?.minHeight ?? 0;
      return Math.max((height - ground) * viewer.chosen.exaggeration, kLeastClearance);
    },
    wake: () => viewer.wake(),
  }))(this);

  /** All of the ground, in the world. */
  private groundBox(): Box | null {
    const { info } = this;
    if (info === null) return null;
    const { west, south, east, north } = info.bounds;
    const world = this.world();
    return {
      low: worldFromPlace({ easting: west, northing: south, height: info.minHeight }, world),
      high: worldFromPlace({ easting: east, northing: north, height: info.maxHeight }, world),
    };
  }

  private inReach(view: View): View {
    const box = this.groundBox();
    if (box === null) return view;
    const world = this.world();
    const to = worldFromPlace(view, world);
    const middle = scale(add(box.low, box.high), 0.5);
    const most = kFurthestDiagonals * length(subtract(box.high, box.low));
    const at = stayInBall(worldFromPlace(this.current, world), to, middle, most);
    return at === to ? view : { ...view, ...placeFromWorld(at, world) };
  }

  private aboveGround(view: View): View {
    const ground = this.elevationAt(view.easting, view.northing);
    if (ground === null) return view;
    return { ...view, height: Math.max(view.height, ground + kLeastClearance / this.chosen.exaggeration) };
  }

  // ------------------------------------------------------------------------------------------ questions

  elevationAt(easting: number, northing: number): number | null {
    const height = this.native?.elevationAt(easting, northing) ?? NaN;
    return Number.isFinite(height) ? height : null;
  }

  pick(x: number, y: number): (Place & { distance: number }) | null {
    if (this.native === null || this.info === null) return null;
    // What is asked about is the camera as it is now, not as the last frame had it.
    this.giveCamera(this.native);
    const sharpness = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    const [easting, northing, height, distance] = this.native.pick(x * sharpness, y * sharpness);
    if (easting === undefined || northing === undefined || height === undefined || distance === undefined) return null;
    return { easting, northing, height, distance };
  }

  project(place: Place): { x: number; y: number } | null {
    const canvas = { width: this.canvas.clientWidth, height: this.canvas.clientHeight };
    return pixelOf(this.current, canvas, this.world(), worldFromPlace(place, this.world()));
  }

  profile(line: { easting: number; northing: number }[], samples = 256): ProfilePoint[] {
    if (this.native === null || this.info === null || line.length < 2) return [];
    return profileAlong(this.native, line, samples);
  }

  lineOfSight(
    from: { easting: number; northing: number; above?: number },
    to: { easting: number; northing: number; above?: number },
    options: { curvature?: boolean; refraction?: number; length?: number } = {},
  ): Sight {
    if (this.native === null || this.info === null) throw new Error("The dataset is not open yet: await viewer.ready.");
    return lookFrom(this.native, this.info.ellipsoid.isEarth, from, to, options);
  }

  studyGround(id: string, line: { easting: number; northing: number }[] | null): void {
    if (this.studied.set(id, line)) this.wake();
  }

  // ------------------------------------------------------------------------------------------ lines and passes

  get lines(): ReadonlyMap<string, Line> {
    return this.groundLines.all;
  }
  setLine(id: string, line: Line): void {
    this.groundLines.set(id, line);
    this.wake();
  }
  removeLine(id: string): void {
    if (this.groundLines.remove(id)) this.wake();
  }

  addPass(pass: Pass): void {
    this.passes.add(pass, this.canDraw() ? this.native : null, this.info);
    this.requestRender();
  }
  setPassUniforms(name: string, uniforms: Record<string, number | number[]>): void {
    this.passes.setUniforms(name, uniforms, this.info !== null ? this.native : null);
    this.requestRender();
  }
  removePass(name: string): void {
    if (!this.passes.remove(name)) return;
    this.native?.removePass(name);
    this.requestRender();
  }

  // ------------------------------------------------------------------------------------------ flights, pictures

  record(): Recording {
    const recorder = new FlightRecorder();
    this.recorder = recorder;
    this.wake();
    return {
      stop: () => {
        if (this.recorder === recorder) this.recorder = null;
        recorder.see(this.current, performance.now() / 1000);
        return recorder.finish(this.info?.name ?? "flight");
      },
    };
  }

  replay(flight: string): Promise<boolean> {
    if (this.native === null || this.info === null) throw new Error("The dataset is not open yet: await viewer.ready.");
    const trouble = this.native.loadFlight(flight);
    if (trouble !== "") throw new RangeError(trouble);
    const seconds = this.native.flightSeconds();
    const world = this.world();
    let isThere = false;
    return this.setMotion((elapsed) => {
      if (isThere || this.native === null) return null;
      isThere = elapsed >= seconds;
      const [e = 0, n = 0, h = 0, te = 0, tn = 0, th = 0, fov = kUsualFov] = this.native.flightCamera(Math.min(elapsed, seconds));
      const eye = worldFromPlace({ easting: e, northing: n, height: h }, world);
      return viewBetween(eye, worldFromPlace({ easting: te, northing: tn, height: th }, world), fov, world);
    });
  }

  screenshot(): Promise<Blob> {
    const { native } = this;
    if (native === null) return Promise.reject(new Error("Nothing is drawn yet: await viewer.ready."));
    if (!this.canDraw()) return Promise.reject(new Error("The graphics were taken away; try again when they are back."));
    // Drawn in this very turn: later the browser has taken the picture off the canvas.
    native.redraw();
    native.frame(performance.now() / 1000);
    return new Promise((resolve, reject) => {
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("The browser gives no picture."))), "image/png");
    });
  }

  on<Name extends keyof ViewerEvents>(name: Name, listener: (what: ViewerEvents[Name]) => void): () => void {
    return this.events.on(name, listener);
  }
}

/** Such trouble begins with the address of what was asked for; a worker's does not. */
function isAboutFetching(trouble: string): boolean {
  return /^https?:/.test(trouble);
}

/** What a caller leaves out of a first view is as in the overview; but one who names a place looks from above it. */
function completeView(current: View, given: Partial<View>, overview: View): View {
  const isPlaced = given.easting !== undefined && given.northing !== undefined;
  return isPlaced ? { ...current, height: given.height ?? overview.height } : { ...overview, ...given };
}
