import type { Loading, Viewer } from "terrane";
import { makeAddressForm } from "./address_form.js";
import { el } from "./dom.js";
import { formatBytes } from "./format.js";

/** Shorter than this nobody needs to be told. */
const kPatienceMilliseconds = 500;

/** What loading is at: large while there is nothing to see, then a small line until all is there. */
export function makeLoading(viewer: Viewer, datasetName: string): HTMLElement {
  const phase = el("p", { class: "loading-phase" });
  const amount = el("p", { class: "loading-amount number faint" });
  // Nothing to see, and nobody who answers: why, and a way to somewhere else.
  const why = el("p", { class: "faint" });
  const elsewhere = el("div", { class: "splash-elsewhere", hidden: true }, why, makeAddressForm());
  const splash = el(
    "div",
    { class: "splash" },
    el("div", { class: "splash-mark", "aria-hidden": "true" }),
    el("h1", {}, datasetName),
    phase,
    amount,
    elsewhere,
  );
  const pill = el("div", { class: "loading-pill number", hidden: true });
  const element = el("div", { class: "loading", role: "status", "aria-live": "off" }, splash, pill);

  let since = 0;
  viewer.on("loading", (now) => {
    const isSeen = now.phase === "detail" || now.phase === "settled";
    phase.textContent = wordsFor(now);
    amount.textContent = now.bytesReceived > 0 ? `${formatBytes(now.bytesReceived)} received` : "\u00a0";
    element.dataset["phase"] = now.phase;
    if (isSeen && !splash.classList.contains("is-over")) {
      splash.classList.add("is-over");
      splash.addEventListener("transitionend", () => splash.remove());
      setTimeout(() => splash.remove(), 1000);
    }
    const isWaiting = now.phase === "detail" && now.requestsUnderway > 0;
    if (!isWaiting) since = 0;
    else if (since === 0) since = performance.now();
    pill.hidden = !isWaiting || performance.now() - since < kPatienceMilliseconds;
    if (!pill.hidden)
      pill.textContent = `Finer ground is coming: ${now.requestsUnderway} ${now.requestsUnderway === 1 ? "request" : "requests"}, ${formatBytes(now.bytesReceived)} so far`;
  });
  viewer.on("problem", (problem) => {
    if (problem?.isFatal) element.remove();
    elsewhere.hidden = problem?.code !== "offline";
    why.textContent = problem?.message ?? "";
  });
  phase.textContent = "Loading the engine";
  amount.textContent = "\u00a0";
  return element;
}

function wordsFor(now: Loading): string {
  switch (now.phase) {
    case "engine":
      return "Loading the engine";
    case "dataset":
      return "Asking what the dataset has";
    case "ground":
      return now.requestsUnderway > 0
        ? `Waiting for the first ground: ${now.requestsUnderway} ${now.requestsUnderway === 1 ? "request" : "requests"} underway`
        : "Waiting for the first ground";
    default:
      return "Here it is";
  }
}
