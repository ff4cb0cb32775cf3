import type { Place, Viewer } from "terrane";
import { isTyping, oncePerFrame } from "./dom.js";

/** What a tool does with clicks on the ground. */
export interface GroundTool {
  click(place: Place): void;
  /** The pointer moved: the ground under it, and where that is on the canvas; null: neither. */
  hover?(place: Place | null, at: { x: number; y: number } | null): void;
  /** Enter, or a double click, whose first click was told before. */
  finish?(): void;
  /** Backspace. */
  undo?(): void;
}

/** A press that moves further than this drags the map. Fingers tremble more than mice. */
const kSlopMouse = 5;
const kSlopFinger = 12;
const kDoubleMilliseconds = 350;

/** Tells one tool at a time of clicks on the ground. Drags go on moving the map. */
export class Pointing {
  private tool: GroundTool | null = null;
  private down: { id: number; x: number; y: number; isOne: boolean } | null = null;
  private lastClick = { time: -1e9, x: 0, y: 0 };
  private pointer: { x: number; y: number } | null = null;

  constructor(
    private readonly viewer: Viewer,
    private readonly tellMissed: () => void,
  ) {
    const { canvas } = viewer;
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointerup", (event) => this.lift(event));
    canvas.addEventListener("pointercancel", () => (this.down = null));
    canvas.addEventListener("pointermove", (event) => {
      this.pointer = event.pointerType === "touch" ? null : { x: event.offsetX, y: event.offsetY };
      this.hover();
    });
    canvas.addEventListener("pointerleave", () => {
      this.pointer = null;
      this.hover();
    });
    viewer.on("view", () => this.hover());
    // A double click ends a line; it must not zoom, too. Captured above the canvas, so before the map hears it.
    addEventListener(
      "dblclick",
      (event) => {
        if (this.tool !== null && event.target === canvas) event.stopPropagation();
      },
      { capture: true },
    );
    addEventListener("keydown", (event) => this.key(event), { capture: true });
  }

  /** From now on this tool is told; returns what ends that. */
  use(tool: GroundTool): () => void {
    this.tool = tool;
    this.viewer.canvas.classList.add("is-pointing");
    document.body.classList.add("has-tool");
    return () => {
      if (this.tool !== tool) return;
      this.tool = null;
      this.viewer.canvas.classList.remove("is-pointing");
      document.body.classList.remove("has-tool");
    };
  }

  /** A click in the middle of the picture: for keyboards, and for fingers that would hide what they point at. */
  clickMiddle(): void {
    const { canvas } = this.viewer;
    this.clickAt(canvas.clientWidth / 2, canvas.clientHeight / 2);
  }

  private press(event: PointerEvent): void {
    const isSecond = this.down !== null;
    if (this.down !== null) this.down.isOne = false;
    if (isSecond || event.button !== 0 || event.ctrlKey || event.shiftKey) return;
    this.down = { id: event.pointerId, x: event.offsetX, y: event.offsetY, isOne: true };
  }

  private lift(event: PointerEvent): void {
    const { down } = this;
    if (down === null || down.id !== event.pointerId) return;
    this.down = null;
    const slop = event.pointerType === "touch" ? kSlopFinger : kSlopMouse;
    if (!down.isOne || Math.hypot(event.offsetX - down.x, event.offsetY - down.y) > slop || this.tool === null) return;
    const last = this.lastClick;
    this.lastClick = { time: event.timeStamp, x: event.offsetX, y: event.offsetY };
    const isDouble =
      event.timeStamp - last.time < kDoubleMilliseconds && Math.hypot(event.offsetX - last.x, event.offsetY - last.y) < 2 * slop;
    if (isDouble) this.tool.finish?.();
    else this.clickAt(event.offsetX, event.offsetY);
  }

  private clickAt(x: number, y: number): void {
    const place = this.viewer.pick(x, y);
    if (place === null) this.tellMissed();
    else this.tool?.click(place);
  }

  private readonly hover = oncePerFrame(() => {
    if (this.tool?.hover === undefined) return;
    this.tool.hover(this.pointer && this.viewer.pick(this.pointer.x, this.pointer.y), this.pointer);
  });

  private key(event: KeyboardEvent): void {
    const { tool } = this;
    if (tool === null || event.ctrlKey || event.metaKey || event.altKey || isTyping(event.target)) return;
    const isOnGround = event.target === this.viewer.canvas || event.target === document.body;
    if (event.key === "Backspace" && tool.undo) tool.undo();
    else if (event.key === "Enter" && isOnGround && tool.finish) tool.finish();
    else if (event.key === " " && isOnGround && this.viewer.controls !== "fly") this.clickMiddle();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
