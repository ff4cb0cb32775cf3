import type { LineStyle } from "../line_store.js";

const kWidest = 10_000;

/** The style that a feature's properties ask for, by the names that Simplestyle and `terrane render --lines` give them; what is
 * not understood is left out. */
export function readStyle(properties: Record<string, unknown>): Partial<LineStyle> {
  const out: Partial<LineStyle> = {};
  const color = colorOf(properties["stroke"] ?? properties["color"]);
  if (color !== null) out.color = color;
  const pixels = widthOf(properties["stroke-width"]);
  const meters = widthOf(properties["stroke-meters"]);
  if (meters !== null) [out.width, out.widthUnit] = [meters, "meters"];
  // Files of earlier versions name the unit beside the width.
  else if (pixels !== null) [out.width, out.widthUnit] = [pixels, properties["stroke-width-unit"] === "m" ? "meters" : "pixels"];
  return out;
}

export function writeStyle({ color, width, widthUnit }: LineStyle): Record<string, unknown> {
  return { stroke: color, [widthUnit === "meters" ? "stroke-meters" : "stroke-width"]: width };
}

function widthOf(value: unknown): number | null {
  const width = typeof value === "string" && value.trim() !== "" ? Number(value) : value;
  return typeof width === "number" && width > 0 && width <= kWidest ? width : null;
}

/** Any colour of CSS as #rrggbb, which the field for colours needs; what shines through is not kept. */
function colorOf(value: unknown): string | null {
  if (typeof value !== "string" || !CSS.supports("color", value)) return null;
  const context = document.createElement("canvas").getContext("2d");
  if (context === null) return null;
  context.canvas.width = context.canvas.height = 1;
  context.fillStyle = value;
  const solid = /^rgba\((\d+), (\d+), (\d+)/.exec(String(context.fillStyle));
  const text = solid ? `#${solid.slice(1).map((part) => Number(part).toString(16).padStart(2, "0")).join("")}` : String(context.fillStyle);
  return /^#[0-9a-f]{6}$/.test(text) ? text : null;
}
