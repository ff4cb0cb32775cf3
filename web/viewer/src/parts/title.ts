import type { DatasetInfo } from "terrane";
import { type DatasetChoice, servedDatasets } from "../datasets.js";
import { makeChooser } from "./chooser.js";
import { el, fill } from "./dom.js";
import { icon } from "./icons.js";

/** Name and CRS of what is open; where the server has several datasets, a click opens the list of them. */
export function makeTitle(dataset: DatasetInfo, choice: DatasetChoice): HTMLElement {
  const name = el("h1", {}, dataset.name);
  const title = el("header", { class: "title" }, name, el("span", { class: "faint" }, dataset.crsName));
  void servedDatasets(new URL(location.href)).then((served) => {
    const others = served?.filter((each) => each.url !== choice.url) ?? [];
    if (served === null || others.length === 0) return;
    fill(
      name,
      el(
        "button",
        { class: "title-button", type: "button", "aria-haspopup": "dialog", title: "Other datasets", on: { click: () => openList(served, choice) } },
        dataset.name,
        icon("expand"),
      ),
    );
  });
  return title;
}

function openList(served: DatasetChoice[], choice: DatasetChoice): void {
  const dialog = el(
    "dialog",
    { class: "datasets", "aria-labelledby": "datasets-title" },
    el(
      "header",
      { class: "panel-head" },
      el("h2", { id: "datasets-title" }, "Which terrain?"),
      el("button", { class: "plain", type: "button", "aria-label": "Close", on: { click: () => dialog.close() } }, icon("close")),
    ),
    makeChooser(served, (each) => each.url === choice.url),
  );
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}
