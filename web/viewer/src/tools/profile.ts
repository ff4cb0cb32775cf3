import type { App, OpenPanel, Panel } from "../app.js";
import type { GroundScale } from "../geo/ground_scale.js";
import type { Point } from "../line_store.js";
import { download, el, fill } from "../parts/dom.js";
import { formatDistance, formatError, formatHeight, formatNumber } from "../parts/format.js";
import { icon } from "../parts/icons.js";
import { ProfileKeeper, coarsenessOf, csvOf } from "./ground_profile.js";
import { Path, pathButtons, whenFiner } from "./path.js";
import { ProfilePlot } from "./profile_plot.js";

export const profileTool: Panel = {
  id: "profile",
  title: "Profile",
  icon: "profile",
  key: "p",
  purpose: "Heights along a line as a plot; pointing at the plot shows the place on the ground",
  isWide: true,
  open: (app) => openProfile(app, []),
};

/** The profile of a line that is there already: of all its parts, one after the other. */
export function profileOf(name: string, parts: readonly (readonly Point[])[]): Panel {
  return { ...profileTool, title: `Profile of ${name}`, open: (app) => openProfile(app, parts) };
}

function openProfile(app: App, given: readonly (readonly Point[])[]): OpenPanel {
  const { overlay } = app;
  const summary = el("div", { class: "profile-summary number", "aria-live": "polite" });
  const save = el(
    "button",
    {
      class: "plain",
      type: "button",
      title: "Save as CSV",
      "aria-label": "Save the profile as CSV",
      "data-do": "save",
      on: {
        click: () => {
          const profile = keeper.refine();
          if (profile) download(`${app.dataset.name}-profile.csv`, new Blob([csvOf(profile)], { type: "text/csv" }));
          show();
        },
      },
    },
    icon("download"),
  );
  let scale: GroundScale | null = null;

  const show = (): void => {
    const profile = keeper.now;
    plot.element.hidden = save.hidden = profile === null;
    plot.show(profile?.points ?? [], profile?.breaks ?? []);
    tell();
  };
  const tell = (): void => {
    const profile = keeper.now;
    const at = plot.chosenPoint;
    overlay.setMark("profile-hover", at && Number.isFinite(at.height) ? at : null, "hover");
    if (profile === null) {
      fill(
        summary,
        path.corners.length === 0
          ? "Click on the ground where the profile begins."
          : "Click where it goes on. Enter or a double click ends.",
      );
      return;
    }
    const { climb } = profile;
    const whole = [
      `${formatDistance(profile.lengthOnMap)} on the map, ${formatDistance(profile.lengthOverGround)} over the ground`,
      `${formatNumber(climb.lowest?.height ?? NaN)} to ${formatNumber(climb.highest?.height ?? NaN)} m`,
      `${formatNumber(climb.up)} m up, ${formatNumber(climb.down)} m down`,
      `steepest ${formatNumber(climb.steepest)}°`,
      profile.breaks.length > 0 && `${formatNumber(profile.breaks.length + 1)} parts, one after the other`,
      coarsenessOf(profile),
    ]
      .filter((words) => words !== false && words !== "")
      .join(" · ");
    plot.element.setAttribute("aria-label", `Profile: ${whole}. Arrow keys move along it.`);
    fill(
      summary,
      at
        ? `${formatDistance(at.distance)}: ${Number.isFinite(at.height) ? `${formatHeight(at.height, at.error)} ${formatError(at.error)}` : "no ground"} · E ${formatNumber(at.easting)} N ${formatNumber(at.northing)}`
        : whole,
    );
  };

  const renew = (): void => {
    keeper.renew();
    show();
  };
  const plot = new ProfilePlot(tell);
  const path = new Path(app, "profile", { color: "#4cc9f0", widthPixels: 3 }, renew);
  const keeper = new ProfileKeeper(
    app,
    () => path.parts,
    () => scale,
    show,
  );
  const stop = whenFiner(app, renew);
  void app.groundScale().then((found) => {
    scale = found;
    renew();
  });
  if (given.length > 0) path.take(given);
  else renew();
  return {
    body: el("div", { class: "profile" }, el("div", { class: "profile-head" }, summary, save), plot.element, pathButtons(app, path)),
    close: () => {
      stop();
      keeper.close();
      plot.close();
      overlay.setMark("profile-hover", null);
      path.close();
    },
  };
}
