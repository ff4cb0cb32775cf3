import { el } from "./dom.js";

/** Draws on a canvas as large as its element, in its own pixels. */
export function draw(
  canvas: HTMLCanvasElement,
  paint: (context: CanvasRenderingContext2D, width: number, height: number, color: (name: string) => string) => void,
): void {
  const { clientWidth: width, clientHeight: height } = canvas;
  const context = canvas.getContext("2d");
  if (context === null || width === 0 || height === 0) return;
  const ratio = devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  const style = getComputedStyle(canvas);
  paint(context, width, height, (name) => style.getPropertyValue(name).trim());
}

/** Steps of 1, 2 or 5 that make about so many labels. */
export function niceStep(span: number, labels: number): number {
  const rough = span / Math.max(labels, 1);
  const power = 10 ** Math.floor(Math.log10(Math.max(rough, 1e-9)));
  return ([1, 2, 5, 10].find((step) => step * power >= rough) ?? 10) * power;
}

/** A small plot of the last values, and what the last one is. */
export class Sparkline {
  private readonly canvas = el("canvas", { class: "sparkline", "aria-hidden": "true" });
  private readonly output = el("strong", { class: "number" });
  private readonly values: number[] = [];
  readonly element: HTMLElement;

  /** `limit`: a value that is worth a line of its own. */
  constructor(
    private readonly name: string,
    label: string,
    private readonly count: number,
    private readonly format: (value: number) => string,
    private readonly limit?: () => number,
    hint = "",
  ) {
    this.element = el(
      "div",
      { class: "plot", "data-plot": this.name, title: hint || undefined },
      el("div", { class: "row" }, el("span", {}, label), this.output),
      this.canvas,
    );
  }

  add(value: number): void {
    this.values.push(value);
    if (this.values.length > this.count) this.values.shift();
    this.output.textContent = this.format(value);
    draw(this.canvas, (context, width, height, color) => {
      const limit = this.limit?.();
      const top = Math.max(...this.values, (limit ?? 0) * 1.2, 1e-9) * 1.05;
      const x = (i: number): number => width - (this.values.length - 1 - i) * (width / (this.count - 1));
      const y = (value: number): number => height - 1 - (value / top) * (height - 3);
      context.beginPath();
      this.values.forEach((value, i) => context.lineTo(x(i), y(value)));
      context.strokeStyle = color("--accent");
      context.lineWidth = 1.5;
      context.lineJoin = "round";
      context.stroke();
      context.lineTo(x(this.values.length - 1), height);
      context.lineTo(x(0), height);
      context.globalAlpha = 0.16;
      context.fillStyle = color("--accent");
      context.fill();
      context.globalAlpha = 1;
      if (limit === undefined) return;
      context.setLineDash([3, 3]);
      context.lineWidth = 1;
      context.strokeStyle = color("--warm");
      context.beginPath();
      context.moveTo(0, y(limit));
      context.lineTo(width, y(limit));
      context.stroke();
      context.setLineDash([]);
    });
  }
}
