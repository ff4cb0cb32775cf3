import { kRanges } from "../address.js";
import type { Panel } from "../app.js";
import { sliderControl } from "../parts/controls.js";
import { el, svg } from "../parts/dom.js";
import { formatNumber, windOf } from "../parts/format.js";

const kFirst = { sunAzimuth: 315, sunAltitude: 38, exaggeration: 1 };

export const lightPanel: Panel = {
  id: "light",
  title: "Sun and relief",
  icon: "sun",
  key: "u",
  purpose: "Where the sun stands, and how much heights are exaggerated",
  open({ viewer }) {
    const dot = svg("circle", { class: "dial-sun", r: 8 });
    const ray = svg("line", { class: "dial-ray", x1: 0, y1: 0 });
    const north = svg("text", { class: "dial-letter", x: 0, y: -54, "text-anchor": "middle" });
    north.textContent = "N";
    const dial = svg(
      "svg",
      { class: "dial", viewBox: "-68 -68 136 136", "aria-hidden": "true" },
      ...[50, 33.3, 16.7].map((r) => svg("circle", { class: "dial-ring", r })),
      north,
      ray,
      dot,
    );
    const azimuth = sliderControl({
      label: "Direction",
      min: 0,
      max: 360,
      step: 1,
      value: viewer.settings.sunAzimuth,
      format: (value) => `${formatNumber(value % 360)}° ${windOf(value % 360)}`,
      change: (value) => viewer.set({ sunAzimuth: value % 360 }),
    });
    const altitude = sliderControl({
      label: "Height above the horizon",
      min: 1,
      max: 90,
      step: 1,
      value: viewer.settings.sunAltitude,
      format: (value) => `${formatNumber(value)}°`,
      change: (value) => viewer.set({ sunAltitude: value }),
    });
    const exaggeration = sliderControl({
      label: "Exaggeration of heights",
      min: kRanges.exaggeration[0],
      max: kRanges.exaggeration[1],
      isLogarithmic: true,
      value: viewer.settings.exaggeration,
      format: (value) => `× ${formatNumber(value, 2)}`,
      change: (value) => viewer.set({ exaggeration: Math.abs(value - 1) < 0.03 ? 1 : Number(value.toFixed(2)) }),
    });

    const show = (): void => {
      const { sunAzimuth, sunAltitude } = viewer.settings;
      const r = 50 * (1 - sunAltitude / 90);
      const angle = (sunAzimuth * Math.PI) / 180;
      const [x, y] = [Math.sin(angle) * r, -Math.cos(angle) * r];
      dot.setAttribute("cx", x.toFixed(1));
      dot.setAttribute("cy", y.toFixed(1));
      ray.setAttribute("x2", x.toFixed(1));
      ray.setAttribute("y2", y.toFixed(1));
    };
    // The middle of the dial is overhead, its rim the horizon.
    const point = (event: PointerEvent): void => {
      const box = dial.getBoundingClientRect();
      const x = ((event.clientX - box.left) / box.width) * 136 - 68;
      const y = ((event.clientY - box.top) / box.height) * 136 - 68;
      const away = Math.min(Math.hypot(x, y) / 50, 1);
      viewer.set({ sunAzimuth: ((Math.atan2(x, -y) * 180) / Math.PI + 360) % 360, sunAltitude: Math.max(1, 90 * (1 - away)) });
    };
    dial.addEventListener("pointerdown", (event) => {
      dial.setPointerCapture(event.pointerId);
      point(event);
    });
    dial.addEventListener("pointermove", (event) => {
      if (dial.hasPointerCapture(event.pointerId)) point(event);
    });
    const stop = viewer.on("settings", (settings) => {
      azimuth.show(settings.sunAzimuth);
      altitude.show(settings.sunAltitude);
      exaggeration.show(settings.exaggeration);
      show();
    });
    show();
    return {
      body: el(
        "div",
        {},
        el("div", { class: "dial-box" }, dial),
        azimuth.element,
        altitude.element,
        exaggeration.element,
        el("button", { class: "secondary", type: "button", on: { click: () => viewer.set(kFirst) } }, "Reset"),
      ),
      close: stop,
    };
  },
};
