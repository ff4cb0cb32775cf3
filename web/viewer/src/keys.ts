import type { Action, App } from "./app.js";
import { actions, keyActions, panelGroups, viewActions } from "./panels/all.js";
import { isTyping } from "./parts/dom.js";

/** Keys that open panels and do actions. The map and the tools have had theirs before. */
export function listenToKeys(app: App, toggleHelp: () => void): void {
  const panels = new Map(panelGroups.flat().map((panel) => [panel.key, panel]));
  const runs = new Map<string, Action>([...actions, ...keyActions, ...viewActions].map((action) => [action.key, action]));
  addEventListener(
    "keydown",
    (event) => {
      if (event.key === "Tab" || event.key === " ") document.body.classList.add("uses-keys");
    },
    { capture: true },
  );
  addEventListener("pointerdown", () => document.body.classList.remove("uses-keys"), { capture: true });
  addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (event.key === "Escape") {
      escape(app);
      return;
    }
    if (isTyping(event.target)) return;
    const key = event.key.toLowerCase();
    const panel = panels.get(key);
    const action = runs.get(key);
    if (key === "?") toggleHelp();
    else if (panel) app.panels.toggle(panel);
    else if (action && !event.repeat) action.run(app);
    else return;
    event.preventDefault();
  });
}

/** Ends what was begun last: a flight, then a tool, then flying. */
function escape(app: App): void {
  if (app.flights.state === "flying") app.flights.stopFlying();
  else if (!app.panels.close() && app.viewer.controls === "fly") app.setFlying(false);
}
