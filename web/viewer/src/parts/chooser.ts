import type { DatasetChoice } from "../datasets.js";
import { el } from "./dom.js";
import { formatBytes, formatNumber } from "./format.js";

/** A link to each dataset, with what is known of it. `isShown`: the one that is open. */
export function makeChooser(datasets: DatasetChoice[], isShown: (dataset: DatasetChoice) => boolean = () => false): HTMLElement {
  return el(
    "ul",
    { class: "chooser" },
    ...datasets.map((each) =>
      el(
        "li",
        {},
        el(
          "a",
          { href: `?dataset=${encodeURIComponent(each.name)}`, "aria-current": isShown(each) ? "page" : undefined },
          el("strong", {}, each.name),
          el("span", {}, each.crs ?? ""),
          el(
            "span",
            { class: "faint" },
            each.minHeight !== undefined && each.maxHeight !== undefined
              ? `${formatNumber(each.minHeight)} to ${formatNumber(each.maxHeight)} m`
              : "",
            each.bytes ? ` · ${formatBytes(each.bytes)}` : "",
            each.attribution ? ` · ${each.attribution}` : "",
          ),
        ),
      ),
    ),
  );
}
