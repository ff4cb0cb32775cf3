import type { Problem } from "terrane";
import type { DatasetChoice } from "../datasets.js";
import { makeAddressForm } from "./address_form.js";
import { makeChooser } from "./chooser.js";
import { type Child, el } from "./dom.js";
import { icon } from "./icons.js";

/** What stands in place of the ground: nothing to show, or something to choose. */
function fullPage(id: string, title: string, ...children: Child[]): void {
  document.querySelector(".full-page")?.remove();
  document.body.append(el("main", { class: "full-page", id }, el("div", { class: "full-card" }, el("h1", {}, title), ...children)));
}

const again = (): HTMLElement => el("button", { class: "secondary", type: "button", on: { click: () => location.reload() } }, "Try again");

export function showNoDataset(reason: string): void {
  fullPage(
    "no-dataset",
    "No terrain to show",
    el("p", {}, reason),
    el(
      "p",
      { class: "faint" },
      "A dataset is a folder that ",
      el("code", {}, "terrane build"),
      " makes; ",
      el("code", {}, "terrane serve"),
      " or any web server delivers it.",
    ),
    makeAddressForm(),
    again(),
  );
}

/** Nothing more will be drawn. */
export function showFatal(problem: Problem): void {
  if (problem.code === "no-dataset") {
    showNoDataset(problem.message);
    return;
  }
  const title = problem.code === "no-webgl2" ? "This browser cannot draw terrain" : "The terrain engine did not start";
  fullPage(
    problem.code,
    title,
    icon("warning"),
    el("p", {}, problem.message),
    problem.code === "no-webgl2" &&
      el(
        "p",
        { class: "faint" },
        "WebGL2 is in every current Firefox, Chrome, Edge and Safari. If yours is one of them, hardware acceleration may be switched off in its settings, or the graphics driver is blocked.",
      ),
    again(),
  );
}

export function showChooser(datasets: DatasetChoice[]): void {
  document.title = "Terrane";
  fullPage("chooser", "Which terrain?", makeChooser(datasets));
}
