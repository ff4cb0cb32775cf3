import type { Action, App, Panel } from "../app.js";
import { actions, panelGroups, viewActions } from "../panels/all.js";
import { el } from "./dom.js";
import { icon, type IconName } from "./icons.js";
import { makeCompass } from "./compass.js";

/** What stands in the bar of a small screen; the rest is behind “More”. */
const kFirst = new Set(["layers", "measure", "profile", "lines"]);

/** All panels and actions, as a column at the side or a bar at the bottom. */
export function makeToolbar(app: App, toggleHelp: () => void): HTMLElement {
  const { panels } = app;
  const buttons = new Map<string, HTMLButtonElement[]>();
  const remember = (id: string, button: HTMLButtonElement): HTMLButtonElement => {
    buttons.set(id, [...(buttons.get(id) ?? []), button]);
    return button;
  };
  const panelButton = (panel: Panel): HTMLButtonElement => {
    const button = toolButton(panel.id, panel.title, panel.key, panel.icon, (event) => {
      closeMore();
      // With the keyboard one goes on in what has opened; with a pointer one goes on on the map.
      panels.toggle(panel, event.detail === 0);
    });
    button.setAttribute("aria-expanded", "false");
    return remember(panel.id, button);
  };
  const actionButton = (action: Action): HTMLButtonElement =>
    toolButton(action.id, action.title, action.key, action.icon, () => {
      closeMore();
      action.run(app);
    });
  const helpButton = (): HTMLButtonElement =>
    toolButton("help", "Keys and gestures", "?", "help", () => {
      closeMore();
      toggleHelp();
    });

  const moreButton = toolButton("more", "More", "", "more", () => {
    more.hidden = !more.hidden;
    moreButton.setAttribute("aria-expanded", String(!more.hidden));
    if (!more.hidden) panels.close();
  });
  moreButton.setAttribute("aria-expanded", "false");
  const more = el(
    "div",
    { class: "more-sheet", hidden: true, role: "group", "aria-label": "More tools" },
    ...panelGroups
      .flat()
      .filter((panel) => !kFirst.has(panel.id))
      .map(panelButton),
    ...actions.map(actionButton),
    helpButton(),
  );
  const bar = el(
    "nav",
    { class: "toolbar", "aria-label": "Tools" },
    ...panelGroups.map((group, i) =>
      el(
        "div",
        { class: "tool-group" },
        ...group.map(panelButton),
        ...(i === panelGroups.length - 1 ? [...actions.map(actionButton), helpButton()] : []),
      ),
    ),
    moreButton,
  );

  const closeMore = (): boolean => {
    const wasOpen = !more.hidden;
    more.hidden = true;
    moreButton.setAttribute("aria-expanded", "false");
    return wasOpen;
  };
  app.viewer.canvas.addEventListener("pointerdown", closeMore);
  addEventListener(
    "keydown",
    (event) => {
      if (event.key === "Escape" && closeMore()) event.stopImmediatePropagation();
    },
    { capture: true },
  );
  panels.onChange((open) => {
    closeMore();
    for (const [id, all] of buttons) for (const button of all) button.setAttribute("aria-expanded", String(id === open));
  });
  // A recording goes on without its panel: its button says so, and the one that hides it on small screens.
  app.flights.onChange(() => {
    const isRecording = app.flights.state === "recording";
    for (const button of buttons.get("flights") ?? []) markRecording(button, isRecording, "Flights", "Recording");
    markRecording(moreButton, isRecording, "More", "More, recording");
  });
  return el("div", { class: "tools" }, bar, more);
}

function markRecording(button: HTMLButtonElement, isRecording: boolean, title: string, titleRecording: string): void {
  const key = button.getAttribute("aria-keyshortcuts");
  const now = isRecording ? titleRecording : title;
  button.classList.toggle("is-recording", isRecording);
  button.title = key ? `${now} (${key.toUpperCase()})` : now;
  if (isRecording) button.setAttribute("aria-label", now);
  else button.removeAttribute("aria-label");
}

function toolButton(id: string, title: string, key: string, name: IconName, click: (event: MouseEvent) => void): HTMLButtonElement {
  return el(
    "button",
    {
      class: `tool${kFirst.has(id) || id === "more" ? " is-first" : ""}`,
      type: "button",
      "data-tool": id,
      title: key ? `${title} (${key.toUpperCase()})` : title,
      "aria-keyshortcuts": key || undefined,
      on: { click },
    },
    icon(name),
    el("span", { class: "tool-label" }, title),
  );
}

/** Compass, zoom, overview, flying. */
export function makeNavigation(app: App): { element: HTMLElement; fly: HTMLButtonElement | null } {
  const buttons = viewActions.map((action) => toolButton(action.id, action.title, action.key, action.icon, () => action.run(app)));
  const fly = buttons.find((button) => button.dataset["tool"] === "fly") ?? null;
  fly?.setAttribute("aria-pressed", "false");
  return {
    element: el(
      "nav",
      { class: "navigation", "aria-label": "View" },
      makeCompass(app.viewer),
      el("div", { class: "tool-group" }, ...buttons),
    ),
    fly,
  };
}
