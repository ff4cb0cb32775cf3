import type { View } from "../api.js";
import {
  type Vector, add, basisOf, clamp, kDegrees, nearestOf, placeFromWorld, rayThrough, scale, subtract, worldFromPlace, wrapHeading,
} from "../geometry.js";
import { type CameraHost, type Controls, Listeners, pointOf } from "./host.js";
import { HeldKeys } from "./keys.js";

const kTurnPerPixel = 0.3;
const kZoomPerWheelPixel = 0.0016;
/** Two thirds of what is left of a zoom is done in so many seconds. */
const kZoomSeconds = 0.09;
const kGlideSeconds = 0.25;
/** The camera comes no nearer to what it zooms to, metres. */
const kNearest = 4;
const kHighestPitch = 30;
const kLowestPitch = -89.9;
/** Where ground is looked for to turn around, as shares of the picture's height. */
const kPivotShares = [0.5, 0.65, 0.8, 0.95];
/** A grabbed point further away than this many heights moves the camera as if it were there. */
const kFurthestGrab = 40;

const kKeys = new Set([
  "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "KeyW", "KeyA", "KeyS", "KeyD", "KeyQ", "KeyE", "KeyR", "KeyF", "Equal",
  "Minus", "NumpadAdd", "NumpadSubtract", "PageUp", "PageDown", "ShiftLeft", "ShiftRight",
]);

interface Pointer {
  x: number;
  y: number;
}

/**
 * Moves the camera like a map: what is grabbed stays under the pointer. Left button or a finger drags; right button, or Ctrl or
 * Shift with the left, turns and tilts around what it grabs; the wheel, two fingers and + and - zoom to what they point at. Turns and
 * zooms that begin beside the ground take what is in the middle of the picture.
 */
export class MapControls implements Controls {
  private host!: CameraHost;
  private listeners = new Listeners();
  private readonly keys = new HeldKeys(kKeys);
  private readonly pointers = new Map<number, Pointer>();
  private mode: "none" | "pan" | "turn" | "fingers" = "none";
  /** What is grabbed, in the world; null: sky. */
  private grabbed: Vector | null = null;
  /** What turns and pinches go around; null: the dataset is not open. */
  private pivot: Vector | null = null;
  private zoom = { left: 0, target: null as Vector | null };
  /** Metres of the world a second. */
  private glide: Vector = [0, 0, 0];
  private lastMove = 0;

  attach(host: CameraHost): void {
    this.host = host;
    this.listeners = new Listeners();
    const { canvas } = host;
    const listen = this.listeners;
    listen.on(canvas, "pointerdown", (event) => this.pointerDown(event));
    listen.on(canvas, "pointermove", (event) => this.pointerMove(event));
    listen.on(canvas, "pointerup", (event) => this.pointerUp(event));
    listen.on(canvas, "pointercancel", (event) => this.pointerUp(event));
    listen.on(canvas, "contextmenu", (event) => event.preventDefault());
    listen.on(canvas, "wheel", (event) => this.wheel(event), { passive: false });
    listen.on(canvas, "dblclick", (event) => this.zoomTo(pointOf(event, canvas), event.shiftKey ? -Math.LN2 : Math.LN2));
    listen.on(canvas, "keydown", (event) => {
      if (!this.keys.down(event)) return;
      if (!event.code.startsWith("Shift")) event.preventDefault();
      this.stop();
      host.wake();
    });
    listen.on(canvas, "keyup", (event) => this.keys.up(event));
    listen.on(canvas, "blur", () => this.keys.clear());
  }

  detach(): void {
    this.listeners.remove();
    this.stop();
    this.keys.clear();
    this.pointers.clear();
    this.mode = "none";
  }

  stop(): void {
    this.zoom = { left: 0, target: null };
    this.glide = [0, 0, 0];
  }

  tick(seconds: number): boolean {
    const isKeyed = this.tickKeys(seconds);
    return this.tickZoom(seconds) || this.tickGlide(seconds) || isKeyed;
  }

  // ------------------------------------------------------------------------------------------ pointers

  private pointerDown(event: PointerEvent): void {
    const { canvas } = this.host;
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, pointOf(event, canvas));
    this.stop();
    this.hold(this.middle());
    const turns = event.button === 2 || event.button === 1 || event.ctrlKey || event.shiftKey;
    this.mode = this.pointers.size > 1 ? "fingers" : turns ? "turn" : "pan";
  }

  private pointerMove(event: PointerEvent): void {
    const before = this.pointers.get(event.pointerId);
    if (before === undefined) return;
    const now = pointOf(event, this.host.canvas);
    if (this.mode === "fingers") {
      this.moveFingers(event.pointerId, now);
    } else {
      this.pointers.set(event.pointerId, now);
      if (this.mode === "turn") this.turnAround(now.x - before.x, now.y - before.y);
      if (this.mode === "pan") this.pan(before, now);
    }
    this.lastMove = event.timeStamp;
  }

  private pointerUp(event: PointerEvent): void {
    if (!this.pointers.delete(event.pointerId)) return;
    // A pointer that stood still before it let go throws nothing.
    if (this.mode !== "pan" || event.timeStamp - this.lastMove > 60) this.glide = [0, 0, 0];
    this.mode = this.pointers.size > 0 ? "pan" : "none";
    if (this.pointers.size > 0) this.hold(this.middle());
    this.host.wake();
  }

  private middle(): Pointer {
    const all = [...this.pointers.values()].slice(0, 2);
    return {
      x: all.reduce((sum, at) => sum + at.x, 0) / all.length,
      y: all.reduce((sum, at) => sum + at.y, 0) / all.length,
    };
  }

  /** The ground there; not further away than the camera could follow. */
  private grab(at: Pointer): Vector | null {
    const found = this.host.groundUnder(at.x, at.y);
    if (found === null) return null;
    const eye = this.eye();
    const flat = Math.hypot(found[0] - eye[0], found[1] - eye[1]);
    const most = kFurthestGrab * Math.max(this.host.clearance(), kNearest);
    if (flat <= most) return found;
    return [eye[0] + ((found[0] - eye[0]) * most) / flat, eye[1] + ((found[1] - eye[1]) * most) / flat, eye[2] + ((found[2] - eye[2]) * most) / flat];
  }

  private hold(at: Pointer): void {
    this.grabbed = this.grab(at);
    this.pivot = this.grabbed ?? this.pivotOfPicture();
  }

  /** The ground in the middle of the picture, or the next below it; where there is none, the nearest of what holds all ground. */
  private pivotOfPicture(): Vector | null {
    const { width, height } = this.host.size();
    for (const share of kPivotShares) {
      const found = this.grab({ x: width / 2, y: height * share });
      if (found !== null) return found;
    }
    const box = this.host.groundBox();
    if (box === null) return null;
    // Whoever is inside the box turns around what is under him.
    const eye = this.eye();
    const [x, y, z] = nearestOf(box, eye);
    return [x, y, Math.min(z, eye[2] - this.host.clearance())];
  }

  private eye(): Vector {
    return worldFromPlace(this.host.view(), this.host.world());
  }
  private moveEye(eye: Vector, change: Partial<View> = {}): void {
    this.host.move({ ...this.host.view(), ...placeFromWorld(eye, this.host.world()), ...change });
  }

  /** What was grabbed comes under the pointer again. */
  private pan(before: Pointer, now: Pointer): void {
    if (this.grabbed === null) {
      this.look(before.x - now.x, before.y - now.y);
      return;
    }
    const hit = this.onPlane(now, this.grabbed[2]);
    if (hit === null) return;
    const way: Vector = [this.grabbed[0] - hit[0], this.grabbed[1] - hit[1], 0];
    // Near the horizon a pixel is kilometres; no further than to what is grabbed.
    const eye = this.eye();
    const most = Math.hypot(this.grabbed[0] - eye[0], this.grabbed[1] - eye[1]) + this.host.clearance();
    const far = Math.hypot(way[0], way[1]);
    const step = far > most ? scale(way, most / far) : way;
    this.moveEye(add(eye, step));
    const seconds = Math.max((performance.now() - this.lastMove) / 1000, 1 / 240);
    this.glide = scale(add(scale(this.glide, 0.6), scale(step, 0.4 / seconds)), 1);
  }

  private onPlane(at: Pointer, height: number): Vector | null {
    const ray = rayThrough(this.host.view(), this.host.size(), at.x, at.y);
    const eye = this.eye();
    const along = (height - eye[2]) / ray[2];
    return along > 0 && Number.isFinite(along) ? add(eye, scale(ray, along)) : null;
  }

  /** Turns the head. */
  private look(dx: number, dy: number): void {
    const view = this.host.view();
    const perPixel = view.fov / this.host.size().height;
    this.host.move({
      ...view,
      heading: wrapHeading(view.heading + dx * perPixel),
      pitch: clamp(view.pitch - dy * perPixel, kLowestPitch, kHighestPitch),
    });
  }

  private turnAround(dx: number, dy: number): void {
    this.orbit(dx * kTurnPerPixel, -dy * kTurnPerPixel);
  }

  /** Turns the world around the pivot: degrees of heading, and of pitch. */
  private orbit(turn: number, tilt: number): void {
    const view = this.host.view();
    const pitch = clamp(view.pitch + tilt, kLowestPitch, kHighestPitch);
    const heading = wrapHeading(view.heading + turn);
    if (this.pivot === null) {
      this.host.move({ ...view, heading, pitch });
      return;
    }
    // The eye keeps its place as seen from the pivot, in the camera's own directions.
    const from = basisOf(view);
    const to = basisOf({ ...view, heading, pitch });
    const offset = subtract(this.eye(), this.pivot);
    const parts = [from.right, from.up, from.forward].map((axis) => offset[0] * axis[0] + offset[1] * axis[1] + offset[2] * axis[2]);
    const turned = add(add(scale(to.right, parts[0] ?? 0), scale(to.up, parts[1] ?? 0)), scale(to.forward, parts[2] ?? 0));
    this.moveEye(add(this.pivot, turned), { heading, pitch });
  }

  /** Two fingers: apart zooms, around each other turns, up and down together tilts. */
  private moveFingers(id: number, now: Pointer): void {
    const ids = [...this.pointers.keys()].slice(0, 2);
    const [a, b] = ids.map((each) => this.pointers.get(each));
    if (a === undefined || b === undefined) return;
    const before = { x: b.x - a.x, y: b.y - a.y };
    const middleBefore = this.middle();
    this.pointers.set(id, now);
    const [c, d] = ids.map((each) => this.pointers.get(each));
    if (c === undefined || d === undefined) return;
    const after = { x: d.x - c.x, y: d.y - c.y };
    const middle = this.middle();
    const angle = (Math.atan2(after.y, after.x) - Math.atan2(before.y, before.x)) / kDegrees;
    const turn = ((angle + 540) % 360) - 180;
    const stretch = Math.hypot(after.x, after.y) / Math.max(Math.hypot(before.x, before.y), 1);
    const isTilt = Math.abs(stretch - 1) < 0.006 && Math.abs(turn) < 0.5;
    this.orbit(-turn, isTilt ? (middle.y - middleBefore.y) * -kTurnPerPixel : 0);
    if (this.pivot !== null) this.approach(this.pivot, Math.log(stretch));
    if (!isTilt && this.grabbed !== null) this.pan(middleBefore, middle);
  }

  // ------------------------------------------------------------------------------------------ zoom and keys

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === 1 ? 33 : event.deltaMode === 2 ? 400 : 1);
    // note: a pinch on a touchpad comes as a wheel with Ctrl, in much smaller steps.
    const amount = clamp(-pixels * (event.ctrlKey ? 6 : 1), -400, 400) * kZoomPerWheelPixel;
    this.zoomTo(pointOf(event, this.host.canvas), amount);
  }

  /** Comes nearer to what is at a point of the canvas: by the factor exp(-amount), in a moment. */
  private zoomTo(at: Pointer, amount: number): void {
    this.glide = [0, 0, 0];
    this.zoom.target = this.host.groundUnder(at.x, at.y) ?? this.pivotOfPicture();
    this.zoom.left = this.zoom.target === null ? 0 : clamp(this.zoom.left + amount, -3, 3);
    this.host.wake();
  }

  private approach(target: Vector, amount: number): void {
    const eye = this.eye();
    const way = subtract(eye, target);
    const far = Math.hypot(...way);
    const wanted = Math.max(far * Math.exp(-amount), amount > 0 ? Math.min(kNearest, far) : 0);
    this.moveEye(add(target, scale(way, wanted / Math.max(far, 1e-9))));
  }

  private tickZoom(seconds: number): boolean {
    if (this.zoom.target === null) return false;
    const step = this.zoom.left * (1 - Math.exp(-seconds / kZoomSeconds));
    this.zoom.left -= step;
    this.approach(this.zoom.target, step);
    if (Math.abs(this.zoom.left) > 0.002) return true;
    this.zoom.target = null;
    return false;
  }

  private tickGlide(seconds: number): boolean {
    if (this.mode !== "none") return false;
    const speed = Math.hypot(this.glide[0], this.glide[1]);
    if (speed < 0.02 * this.host.clearance()) return false;
    this.moveEye(add(this.eye(), scale(this.glide, seconds)));
    this.glide = scale(this.glide, Math.exp(-seconds / kGlideSeconds));
    return true;
  }

  private tickKeys(seconds: number): boolean {
    if (!this.keys.any) return false;
    const { keys, host } = this;
    const isTurning = keys.has("ShiftLeft", "ShiftRight");
    const sideways = keys.axis(["ArrowRight", "KeyD"], ["ArrowLeft", "KeyA"]);
    const forwards = keys.axis(["ArrowUp", "KeyW"], ["ArrowDown", "KeyS"]);
    const turn = keys.axis(["KeyE"], ["KeyQ"]) + (isTurning ? sideways : 0);
    const tilt = keys.axis(["KeyR", "PageUp"], ["KeyF", "PageDown"]) + (isTurning ? forwards : 0);
    const zoom = keys.axis(["Equal", "NumpadAdd"], ["Minus", "NumpadSubtract"]);
    if (turn !== 0 || tilt !== 0 || zoom !== 0) this.pivot = this.pivotOfPicture();
    if (turn !== 0 || tilt !== 0) {
      this.orbit(turn * 60 * seconds, tilt * 40 * seconds);
    }
    if (!isTurning && (sideways !== 0 || forwards !== 0)) {
      const heading = host.view().heading * kDegrees;
      const step = 1.2 * host.clearance() * seconds;
      const way: Vector = [
        (Math.sin(heading) * forwards + Math.cos(heading) * sideways) * step,
        (Math.cos(heading) * forwards - Math.sin(heading) * sideways) * step,
        0,
      ];
      this.moveEye(add(this.eye(), way));
    }
    if (zoom !== 0 && this.pivot !== null) this.approach(this.pivot, zoom * 1.2 * seconds);
    return turn !== 0 || tilt !== 0 || sideways !== 0 || forwards !== 0 || zoom !== 0;
  }
}
