import type { View } from "../api.js";
import type { Box, Canvas, Vector, WorldScale } from "../geometry.js";

/** What controls see of a viewer. */
export interface CameraHost {
  readonly canvas: HTMLCanvasElement;
  view(): View;
  /** Moves the camera there, as somebody's own doing: not into the ground, nor out of its sight. */
  move(view: View): void;
  world(): WorldScale;
  size(): Canvas;
  /** The ground under a point of the canvas, in the world. */
  groundUnder(x: number, y: number): Vector | null;
  /** All of the ground; null before the dataset is open. */
  groundBox(): Box | null;
  /** Of the eye above the ground under it, metres of the world; at least a little. */
  clearance(): number;
  /** A frame will follow. */
  wake(): void;
}

/** One way to move the camera. Listens from attach() to detach(). */
export interface Controls {
  attach(host: CameraHost): void;
  detach(): void;
  /** Once a frame, `seconds` after the last. Returns whether it goes on by itself. */
  tick(seconds: number): boolean;
  /** Ends what goes on by itself. */
  stop(): void;
}

/** Listeners that go together. */
export class Listeners {
  private readonly abort = new AbortController();

  on<Name extends keyof HTMLElementEventMap>(
    target: HTMLElement, name: Name, listener: (event: HTMLElementEventMap[Name]) => void, options: AddEventListenerOptions = {},
  ): void {
    target.addEventListener(name, listener as EventListener, { ...options, signal: this.abort.signal });
  }
  onWindow<Name extends keyof WindowEventMap>(name: Name, listener: (event: WindowEventMap[Name]) => void): void {
    addEventListener(name, listener, { signal: this.abort.signal });
  }
  remove(): void {
    this.abort.abort();
  }
}

/** A pointer event's place on its canvas, CSS pixels. */
export function pointOf(event: MouseEvent, canvas: HTMLElement): { x: number; y: number } {
  const box = canvas.getBoundingClientRect();
  return { x: event.clientX - box.left, y: event.clientY - box.top };
}
