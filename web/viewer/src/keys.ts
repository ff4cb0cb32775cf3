import type { Action, App } from "./app.js";
import { actions, keyActions, panelGroups, viewActions } from "./panels/all.js";
import { usesKey } from "./parts/dom.js";

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
  letMapKeepKeys(app.viewer.canvas);
  addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (event.key === "Escape") {
      escape(app);
      return;
    }
    if (usesKey(event.target, event.key)) return;
    const key = event.key.toLowerCase();
    const panel = panels.get(key);
    const action = runs.get(key);
    if (key === "?") toggleHelp();
    else if (panel) app.panels.toggle(panel);
    else if (action && !event.repeat) action.run(app);
    else if (passOn(app.viewer.canvas, event)) return;
    event.preventDefault();
  });
}

/** Keys move the map whatever a pointer pressed last, and whatever Tab went to. */
function letMapKeepKeys(canvas: HTMLCanvasElement): void {
  // Before the button does what it does: what opens then knows where to give the focus back to.
  addEventListener(
    "click",
    (event) => {
      const isPointer = event.detail > 0;
      if (isPointer && event.target instanceof Element && event.target.closest("button") && !document.querySelector("dialog[open]"))
        canvas.focus({ preventScroll: true });
    },
    { capture: true },
  );
  addEventListener("change", ({ target }) => {
    const isSwitch = target instanceof HTMLInputElement && (target.type === "checkbox" || target.type === "radio");
    if (isSwitch && !document.body.classList.contains("uses-keys")) canvas.focus({ preventScroll: true });
  });
  // A key that went down on the map comes up there, and none stays down when the window is left.
  addEventListener("keyup", (event) => passOn(canvas, event));
  addEventListener("blur", () => canvas.dispatchEvent(new FocusEvent("blur")));
}

/** Gives the map a key that was pressed elsewhere. Returns whether it had no use for it. */
function passOn(canvas: HTMLCanvasElement, event: KeyboardEvent): boolean {
  return event.target === canvas || canvas.dispatchEvent(new KeyboardEvent(event.type, event));
}

/** Ends what was begun last: a flight, then a tool, then flying. */
function escape(app: App): void {
  if (app.flights.state === "flying") app.flights.stopFlying();
  else if (!app.panels.close() && app.viewer.controls === "fly") app.setFlying(false);
}
