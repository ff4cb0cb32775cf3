import type { Statistics } from "terrane";
import type { Panel } from "../app.js";
import { resultRow } from "../parts/controls.js";
import { el, fill } from "../parts/dom.js";
import { formatBytes, formatCount, formatNumber } from "../parts/format.js";
import { Sparkline } from "../parts/plots.js";

const kEveryMilliseconds = 125;
const kSeconds = 30;
const kCount = (kSeconds * 1000) / kEveryMilliseconds;

export const statisticsPanel: Panel = {
  id: "statistics",
  title: "Statistics",
  icon: "statistics",
  key: "i",
  purpose: "What frames cost and what comes over the line, as plots of the last half minute",
  open({ viewer }) {
    const frame = new Sparkline(
      "frame",
      "Work a frame",
      kCount,
      (value) => `${formatNumber(value, 1)} ms`,
      () => 16.7,
      "The slowest of each eighth of a second; the line is 60 frames a second",
    );
    const triangles = new Sparkline("triangles", "Triangles", kCount, formatCount);
    const error = new Sparkline(
      "error",
      "Error on screen, at most",
      kCount,
      (value) => `${formatNumber(value, 2)} px`,
      () => viewer.statistics().tau,
      "The line is what is allowed, τ",
    );
    const bytes = new Sparkline("bytes", "Received", kCount, (value) => `${formatBytes(value)}/s`);
    const requests = new Sparkline("requests", "Requests", kCount, (value) => `${formatNumber(value, 0)}/s`);
    const levels = el("div", { class: "levels" });
    const table = el("div", { class: "table" });

    // The slowest frame counts: a mean hides what one feels.
    let slowest = 0;
    const stop = viewer.on("frame", (now) => (slowest = Math.max(slowest, now.frameMilliseconds)));
    let before = viewer.statistics();
    let beforeTime = performance.now();
    const step = (): void => {
      const now = viewer.statistics();
      const time = performance.now();
      const seconds = Math.max((time - beforeTime) / 1000, 1e-3);
      frame.add(slowest);
      triangles.add(now.triangles);
      error.add(now.errorPixels);
      bytes.add(Math.max(0, now.bytesReceived - before.bytesReceived) / seconds);
      requests.add(Math.max(0, now.requests - before.requests) / seconds);
      [slowest, before, beforeTime] = [0, now, time];
      showLevels(levels, now);
      fill(
        table,
        resultRow("Draw calls", formatNumber(now.drawCalls)),
        resultRow("Patches", formatCount(now.patches)),
        resultRow("Tiles, pictures on the GPU", `${formatNumber(now.tilesOnGpu)}, ${formatNumber(now.imageryOnGpu)}`),
        resultRow("Memory, GPU", `${formatBytes(now.memoryBytes)}, ${formatBytes(now.gpuBytes)}`),
        resultRow("Received in all", `${formatBytes(now.bytesReceived)} in ${formatNumber(now.requests)} requests`),
        resultRow("Failed requests", formatNumber(now.requestsFailed)),
        resultRow(
          "Line",
          `${formatNumber((now.bytesPerSecond * 8) / 1e6, 1)} Mbit/s, ${formatNumber(now.latencySeconds * 1000)} ms`,
          "As measured by what came",
        ),
        resultRow("Waiting for", `${formatNumber(now.wishes)} tiles`),
        el("p", { class: "faint renderer" }, now.renderer),
      );
    };
    const timer = setInterval(step, kEveryMilliseconds);
    requestAnimationFrame(step);
    return {
      body: el(
        "div",
        {},
        frame.element,
        triangles.element,
        error.element,
        bytes.element,
        requests.element,
        el("h3", {}, "Tiles drawn from, by level"),
        levels,
        table,
      ),
      close: () => {
        clearInterval(timer);
        stop();
      },
    };
  },
};

function showLevels(element: HTMLElement, { tilesByLevel }: Statistics): void {
  const most = Math.max(1, ...tilesByLevel);
  fill(
    element,
    ...tilesByLevel.map((count, level) =>
      el(
        "div",
        { class: "level", title: `Level ${level}: ${count} tiles` },
        el("span", { class: "number level-count" }, count > 0 ? String(count) : ""),
        el("div", { class: "level-bar", style: `--share: ${count / most}` }),
        el("span", { class: "number faint" }, String(level)),
      ),
    ),
  );
}
