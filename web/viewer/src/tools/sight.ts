import type { Panel } from "../app.js";
import type { GroundScale } from "../geo/ground_scale.js";
import { resultRow, switchControl } from "../parts/controls.js";
import { el, fill } from "../parts/dom.js";
import { formatDistance, formatNumber } from "../parts/format.js";
import { icon } from "../parts/icons.js";
import { distanceIn } from "./ground_measures.js";
import { Path, pathButtons, whenFiner } from "./path.js";

const kFree = "#3ddc97";
const kBlocked = "#ff5a3c";
/** A person's eyes. */
const kEyeMeters = 1.7;
const kMostMeters = 100_000;

export const sightTool: Panel = {
  id: "sight",
  title: "Line of sight",
  icon: "sight",
  key: "v",
  purpose: "Whether one place sees another, and where the ground hides it",
  open(app) {
    const { viewer, overlay, dataset } = app;
    const results = el("div", { class: "results", "aria-live": "polite" });
    const above = { eye: kEyeMeters, target: 0 };
    let isRound = true;
    let scale: GroundScale | null = null;

    const clear = (): void => {
      viewer.removeLine("sight/free");
      viewer.removeLine("sight/blocked");
      overlay.setMark("sight-blocked", null);
    };
    const show = (): void => {
      clear();
      const [eye, target] = path.corners;
      if (!eye || !target) {
        fill(results, el("p", { class: "faint" }, eye ? "Click on what should be seen." : "Click on the ground where somebody stands."));
        return;
      }
      const distance = distanceIn(dataset, scale);
      const whole = distance(eye, target);
      const ends = [{ ...eye, above: above.eye }, { ...target, above: above.target }] as const;
      const sight = viewer.lineOfSight(...ends, { curvature: isRound, length: whole });
      const blockedAt = sight.visible ? null : sight.blockedAt;
      viewer.setLine("sight/free", {
        points: [eye, blockedAt ?? target],
        color: sight.visible || blockedAt ? kFree : kBlocked,
        widthPixels: 4,
      });
      if (blockedAt) {
        viewer.setLine("sight/blocked", { points: [blockedAt, target], color: kBlocked, widthPixels: 4 });
        overlay.setMark("sight-blocked", blockedAt, "blocked", "hidden from here on");
      }
      fill(
        results,
        el(
          "p",
          { class: `verdict ${sight.visible ? "is-good" : "is-bad"}` },
          icon(sight.visible ? "check" : "close"),
          sight.visible ? "It is seen." : "It is hidden by the ground.",
        ),
        resultRow("Distance", formatDistance(whole)),
        blockedAt ? resultRow("Hidden after", formatDistance(distance(eye, blockedAt))) : null,
        blockedAt ? resultRow("By ground at", `${formatNumber(blockedAt.height)} m`) : null,
        resultRow(
          "Clearance",
          `${formatNumber(sight.clearance, 1)} m`,
          "The least height of the line above the ground; negative where the ground stands above it",
        ),
        el(
          "p",
          { class: "faint" },
          `Over the ground that is here, whose heights are ± ${formatNumber(dataset.maxErrorMeters, 2)} m when all of it along the line has come. ${overWhat(isRound, dataset.ellipsoid.isEarth)}`,
        ),
      );
    };
    const path = new Path(app, "sight", { color: "#00000000", widthPixels: 1 }, () => show(), undefined, 2);
    const input = (label: string, which: "eye" | "target"): HTMLElement => {
      const problem = el("p", { class: "field-problem", id: `sight-${which}-problem`, role: "status" });
      const field = el("input", {
        type: "number",
        min: 0,
        max: kMostMeters,
        step: "any",
        value: above[which],
        inputmode: "decimal",
        "data-above": which,
        "aria-describedby": problem.id,
        on: {
          input: () => {
            const value = field.value.trim() === "" ? NaN : Number(field.value);
            const isRight = value >= 0 && value <= kMostMeters;
            field.setAttribute("aria-invalid", String(!isRight));
            problem.textContent = isRight ? "" : `From 0 to ${formatNumber(kMostMeters)} m: ${above[which]} m is used.`;
            if (!isRight) return;
            above[which] = value;
            show();
          },
        },
      });
      return el(
        "div",
        {},
        el("label", { class: "row" }, el("span", {}, label), el("span", { class: "unit" }, field, " m")),
        problem,
      );
    };
    const round = switchControl(dataset.ellipsoid.isEarth ? "Round earth" : "Curvature", isRound, (on) => {
      isRound = on;
      show();
    });
    const stop = whenFiner(app, show);
    show();
    void app.groundScale().then((found) => {
      scale = found;
      show();
    });
    return {
      body: el(
        "div",
        {},
        results,
        el("div", { class: "group" }, input("Eye above the ground", "eye"), input("Target above the ground", "target"), round.element),
        pathButtons(app, path),
      ),
      close: () => {
        stop();
        path.close();
        clear();
      },
    };
  },
};

function overWhat(isRound: boolean, isEarth: boolean): string {
  if (!isRound) return isEarth ? "As if the earth were flat." : "As if the ground were flat.";
  return isEarth ? "Over a round earth, in air as it bends light by day (0.13)." : "Over a round body without air.";
}
