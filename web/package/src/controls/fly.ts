import { type Vector, add, basisOf, clamp, placeFromWorld, scale, wrapHeading, worldFromPlace } from "../geometry.js";
import { type CameraHost, type Controls, Listeners, pointOf } from "./host.js";
import { HeldKeys } from "./keys.js";

const kKeys = new Set([
  "KeyW", "KeyA", "KeyS", "KeyD", "KeyQ", "KeyE", "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "Space", "ShiftLeft",
  "ShiftRight", "PageUp", "PageDown",
]);
/** Of the speed that is wanted, two thirds is reached in so many seconds. */
const kInertiaSeconds = 0.25;
/** Heights above the ground a second. */
const kSpeed = 1.5;
const kBoost = 5;
const kTurnPerPixel = 0.2;
const kTurnPerSecond = 60;

/**
 * Flies: W, A, S, D and the arrows move, Q and E sink and rise, Shift is five times as fast, the wheel makes faster and slower, a
 * drag looks around. Speed follows the height above the ground. A finger looks around, two fly ahead.
 */
export class FlyControls implements Controls {
  private host!: CameraHost;
  private listeners = new Listeners();
  private readonly keys = new HeldKeys(kKeys);
  private readonly pointers = new Map<number, { x: number; y: number }>();
  /** In the camera's own directions, heights above the ground a second. */
  private velocity: Vector = [0, 0, 0];
  private factor = 1;

  attach(host: CameraHost): void {
    this.host = host;
    this.listeners = new Listeners();
    const { canvas } = host;
    const listen = this.listeners;
    listen.on(canvas, "keydown", (event) => {
      if (!this.keys.down(event)) return;
      event.preventDefault();
      host.wake();
    });
    listen.on(canvas, "keyup", (event) => this.keys.up(event));
    listen.on(canvas, "blur", () => this.keys.clear());
    listen.on(canvas, "contextmenu", (event) => event.preventDefault());
    listen.on(canvas, "pointerdown", (event) => {
      canvas.focus({ preventScroll: true });
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, pointOf(event, canvas));
      host.wake();
    });
    const lift = (event: PointerEvent): void => void this.pointers.delete(event.pointerId);
    listen.on(canvas, "pointerup", lift);
    listen.on(canvas, "pointercancel", lift);
    listen.on(canvas, "pointermove", (event) => this.look(event));
    listen.on(canvas, "wheel", (event) => {
      event.preventDefault();
      this.factor = clamp(this.factor * Math.exp(-event.deltaY * 0.001), 0.05, 20);
    }, { passive: false });
  }

  detach(): void {
    this.listeners.remove();
    this.stop();
    this.keys.clear();
    this.pointers.clear();
  }

  stop(): void {
    this.velocity = [0, 0, 0];
  }

  tick(seconds: number): boolean {
    const { keys, host } = this;
    const boost = keys.has("ShiftLeft", "ShiftRight") ? kBoost : 1;
    const speed = kSpeed * this.factor * boost;
    const wanted: Vector = [
      speed * keys.axis(["KeyD"], ["KeyA"]),
      speed * keys.axis(["KeyW", "ArrowUp"], ["KeyS", "ArrowDown"]) + (this.pointers.size > 1 ? speed : 0),
      speed * keys.axis(["KeyE", "Space", "PageUp"], ["KeyQ", "PageDown"]),
    ];
    const share = 1 - Math.exp(-seconds / kInertiaSeconds);
    this.velocity = add(scale(this.velocity, 1 - share), scale(wanted, share));
    const turn = keys.axis(["ArrowRight"], ["ArrowLeft"]);
    const isMoving = Math.hypot(...this.velocity) > 0.01;
    if (!isMoving && turn === 0) return keys.any;

    const view = host.view();
    const { right, forward } = basisOf(view);
    const step = clamp(host.clearance(), 20, 1e6) * seconds;
    const way = add(add(scale(right, this.velocity[0]), scale(forward, this.velocity[1])), [0, 0, this.velocity[2]]);
    const eye = add(worldFromPlace(view, host.world()), scale(way, step));
    host.move({
      ...view,
      ...placeFromWorld(eye, host.world()),
      heading: wrapHeading(view.heading + turn * kTurnPerSecond * seconds),
    });
    return true;
  }

  private look(event: PointerEvent): void {
    const before = this.pointers.get(event.pointerId);
    if (before === undefined) return;
    const now = pointOf(event, this.host.canvas);
    this.pointers.set(event.pointerId, now);
    const view = this.host.view();
    this.host.move({
      ...view,
      heading: wrapHeading(view.heading - (now.x - before.x) * kTurnPerPixel),
      pitch: clamp(view.pitch + (now.y - before.y) * kTurnPerPixel, -89, 89),
    });
  }
}
