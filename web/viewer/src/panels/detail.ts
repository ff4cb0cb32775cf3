import type { Surface } from "terrane";
import { kRanges } from "../address.js";
import type { Panel } from "../app.js";
import { choiceControl, sliderControl, switchControl } from "../parts/controls.js";
import { el } from "../parts/dom.js";
import { formatNumber } from "../parts/format.js";

export const detailPanel: Panel = {
  id: "detail",
  title: "Detail",
  icon: "detail",
  key: "t",
  purpose: "How fine the picture is: the error allowed on screen, triangles, samples; freeze what is drawn",
  open({ viewer }) {
    const { settings } = viewer;
    const tau = sliderControl({
      label: "Error allowed on screen, τ",
      min: kRanges.tau[0],
      max: kRanges.tau[1],
      isLogarithmic: true,
      value: settings.tau,
      format: (value) => `${formatNumber(value, 2)} px`,
      change: (value) => viewer.set({ tau: Number(value.toFixed(2)) }),
    });
    const surface = choiceControl<Surface>(
      "Triangles",
      [
        { value: "meshes", label: "Meshes", hint: "Adaptive triangles: a tenth as many" },
        { value: "patches", label: "Patches", hint: "Regular patches that blend without a jump" },
      ],
      settings.surface,
      (value) => viewer.set({ surface: value }),
    );
    const samples = choiceControl<"1" | "4">(
      "Samples a pixel",
      [
        { value: "1", label: "1, faster" },
        { value: "4", label: "4, smoother" },
      ],
      settings.samples >= 2 ? "4" : "1",
      (value) => viewer.set({ samples: Number(value) }),
    );
    const sharpness = sliderControl({
      label: "Sharpness, pixels a screen pixel",
      min: 0.5,
      max: Math.max(2, devicePixelRatio),
      step: 0.25,
      value: settings.pixelRatio,
      format: (value) => `× ${formatNumber(value, 2)}`,
      change: (value) => viewer.set({ pixelRatio: value }),
    });
    const frozen = switchControl(
      "Freeze",
      settings.frozen,
      (on) => viewer.set({ frozen: on }),
      "What is drawn stays: fly around, and see what was chosen for where you were",
    );
    const stop = viewer.on("settings", (now) => {
      tau.show(now.tau);
      surface.show(now.surface);
      samples.show(now.samples >= 2 ? "4" : "1");
      sharpness.show(now.pixelRatio);
      frozen.show(now.frozen);
    });
    return {
      body: el(
        "div",
        {},
        tau.element,
        el("p", { class: "faint" }, "Nowhere on screen is the picture further from the dataset than this, once all has come."),
        surface.element,
        samples.element,
        sharpness.element,
        el("div", { class: "group" }, frozen.element),
      ),
      close: stop,
    };
  },
};
