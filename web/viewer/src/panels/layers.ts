import type { Mode, Outline } from "terrane";
import type { Panel } from "../app.js";
import { choiceControl, sliderControl, switchControl } from "../parts/controls.js";
import { el, fill } from "../parts/dom.js";
import { formatNumber } from "../parts/format.js";
import { makeLegend } from "./legends.js";

export const layersPanel: Panel = {
  id: "layers",
  title: "Layers",
  icon: "layers",
  key: "l",
  purpose: "Pictures over the ground, colours that tell heights, slopes or errors, outlines, water, haze",
  open({ viewer, dataset }) {
    const legend = el("div");
    const showLegend = (): void => fill(legend, makeLegend(dataset, viewer.settings));
    const mode = choiceControl<Mode>(
      "Ground",
      [
        { value: "shaded", label: "Natural" },
        { value: "height", label: "Height" },
        { value: "slope", label: "Slope" },
        { value: "normals", label: "Normals" },
        { value: "tiles", label: "Tiles" },
        { value: "error", label: "Error" },
      ],
      viewer.settings.mode,
      (value) => viewer.set({ mode: value }),
      3,
    );
    const outline = choiceControl<Outline>(
      "Outlines",
      [
        { value: "none", label: "None" },
        { value: "wireframe", label: "Triangles" },
        { value: "patches", label: "Patches" },
      ],
      viewer.settings.outline,
      (value) => viewer.set({ outline: value }),
    );
    const layers = viewer.layers.map((layer) => ({
      name: layer.name,
      control: switchControl(
        layer.name,
        layer.visible,
        (on) => viewer.setLayer(layer.name, on),
        `${formatNumber(layer.texelMeters, layer.texelMeters < 10 ? 1 : 0)} m a texel`,
      ),
    }));
    const percent = (value: number): string => `${Math.round(value * 100)} %`;
    const relief = sliderControl({
      label: "Light and shade on pictures",
      min: 0,
      max: 1,
      step: 0.05,
      value: viewer.settings.imageryRelief,
      format: percent,
      change: (value) => viewer.set({ imageryRelief: value }),
    });
    const brightness = sliderControl({
      label: "Brightness of pictures",
      min: 0.4,
      max: 2,
      step: 0.05,
      value: viewer.settings.imageryBrightness,
      format: percent,
      change: (value) => viewer.set({ imageryBrightness: value }),
    });
    const water = switchControl(
      "Water at sea level",
      viewer.settings.water,
      (on) => viewer.set({ water: on }),
      "Where the dataset seems to have a sea",
    );
    const haze = switchControl("Haze", viewer.settings.haze, (on) => viewer.set({ haze: on }));
    showLegend();

    const stops = [
      viewer.on("settings", (settings) => {
        mode.show(settings.mode);
        outline.show(settings.outline);
        relief.show(settings.imageryRelief);
        brightness.show(settings.imageryBrightness);
        water.show(settings.water);
        haze.show(settings.haze);
        showLegend();
      }),
      viewer.on("layers", (now) =>
        layers.forEach(({ name, control }) => control.show(now.find((layer) => layer.name === name)?.visible ?? false)),
      ),
    ];
    const pictures = el(
      "fieldset",
      { class: "group" },
      el("legend", {}, "Pictures"),
      ...(layers.length > 0
        ? [...layers.map((layer) => layer.control.element), relief.element, brightness.element]
        : [el("p", { class: "faint" }, "This dataset has no imagery.")]),
    );
    return {
      body: el("div", {}, mode.element, legend, pictures, outline.element, el("div", { class: "group" }, water.element, haze.element)),
      close: () => stops.forEach((stop) => stop()),
    };
  },
};
