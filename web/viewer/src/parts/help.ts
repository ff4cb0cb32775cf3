import { actions, keyActions, panelGroups, viewActions } from "../panels/all.js";
import { el } from "./dom.js";
import { icon } from "./icons.js";

type Row = readonly [keys: string, what: string];

const kMap: readonly Row[] = [
  ["Drag", "move the map"],
  ["Right drag, Ctrl or Shift drag", "turn and tilt"],
  ["Wheel, double click", "nearer, further"],
  ["W A S D, arrows", "move"],
  ["Q E, R F", "turn, tilt"],
  ["+ −", "nearer, further"],
];
const kFly: readonly Row[] = [
  ["W A S D", "forwards, left, back, right"],
  ["Q E", "sink, rise"],
  ["Shift", "five times as fast"],
  ["Drag", "look around"],
  ["Wheel", "faster, slower"],
];
const kTouch: readonly Row[] = [
  ["One finger", "move the map"],
  ["Two fingers", "nearer, further, turn, tilt"],
];
const kTools: readonly Row[] = [
  ["Click", "add a point"],
  ["Space", "add the middle of the picture"],
  ["Enter, double click", "end the line"],
  ["Backspace", "take the last point back"],
  ["Esc", "close the tool"],
];

/** The sheet of all keys. Opens over everything; Escape closes it. */
export function makeHelp(): { element: HTMLDialogElement; toggle(): void } {
  const named: Row[] = [
    ...panelGroups.flat(),
    ...actions,
    ...viewActions.filter((each) => !["+", "-"].includes(each.key)),
    ...keyActions,
  ].map((each) => [each.key.toUpperCase(), `${each.title}: ${lower(each.purpose)}`]);
  const isTouched = matchMedia("(pointer: coarse)").matches;
  const tools = table("Tools and panels", [...named, ["?", "This sheet"]]);
  const [map, fingers] = [table("Map", kMap), table("Fingers", kTouch)];
  // What one has at hand comes first.
  const gestures = el(
    "div",
    {},
    ...(isTouched ? [fingers, map] : [map, fingers]),
    table("Flying", kFly),
    table("While a tool is open", kTools),
  );
  const dialog = el(
    "dialog",
    { class: "help", "aria-labelledby": "help-title" },
    el(
      "header",
      { class: "panel-head" },
      el("h2", { id: "help-title" }, "Keys and gestures"),
      el("button", { class: "plain", type: "button", "aria-label": "Close", on: { click: () => dialog.close() } }, icon("close")),
    ),
    el("div", { class: "help-body", tabindex: 0, autofocus: true }, ...(isTouched ? [gestures, tools] : [tools, gestures])),
  );
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  return { element: dialog, toggle: () => (dialog.open ? dialog.close() : dialog.showModal()) };
}

function table(title: string, rows: readonly Row[]): HTMLElement {
  return el(
    "section",
    {},
    el("h3", {}, title),
    el(
      "dl",
      { class: "keys" },
      ...rows.flatMap(([keys, what]) => [el("dt", {}, ...(keys.length === 1 ? [el("kbd", {}, keys)] : [keys])), el("dd", {}, what)]),
    ),
  );
}

const lower = (text: string): string => text.charAt(0).toLowerCase() + text.slice(1);
