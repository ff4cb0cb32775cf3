import { el } from "./dom.js";

/** Takes files that are dropped on the page, and says so while they hang over it. */
export function listenToDrops(take: (files: File[]) => void): HTMLElement {
  const veil = el("div", { class: "drop-veil", hidden: true }, el("p", {}, "Let go to open: GeoJSON, GPX, or a flight"));
  const hasFiles = (event: DragEvent): boolean => event.dataTransfer?.types.includes("Files") ?? false;
  addEventListener("dragenter", (event) => {
    if (hasFiles(event)) veil.hidden = false;
  });
  addEventListener("dragover", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    if (event.dataTransfer) event.dataTransfer.dropEffect = "copy";
  });
  addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) veil.hidden = true;
  });
  addEventListener("drop", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    veil.hidden = true;
    take([...(event.dataTransfer?.files ?? [])]);
  });
  return veil;
}

/** Asks for files. */
export function askForFiles(take: (files: File[]) => void): void {
  const input = el("input", {
    type: "file",
    multiple: true,
    accept: ".geojson,.json,.gpx,application/geo+json,application/json,application/gpx+xml",
  });
  input.addEventListener("change", () => take([...(input.files ?? [])]));
  input.click();
}
