import { createViewer } from "terrane";
import { findDataset } from "./datasets.js";
import { el } from "./parts/dom.js";

const canvas = el("canvas", { class: "ground" });
document.body.append(canvas);
const found = await findDataset(new URL(location.href));
if (found.kind === "one") createViewer(canvas, { dataset: found.dataset.url });
