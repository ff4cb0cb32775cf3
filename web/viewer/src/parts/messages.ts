import type { Problem } from "terrane";
import { el, fill } from "./dom.js";
import { icon } from "./icons.js";

/** Short messages, and the banner that stays while something is wrong. */
export class Messages {
  private readonly toasts = el("div", { class: "toasts", role: "status", "aria-live": "polite" });
  private readonly banner = el("div", { class: "banner", role: "status", "aria-live": "polite", hidden: true });
  readonly element = el("div", { class: "messages" }, this.banner, this.toasts);

  say(message: string, kind: "info" | "warning" = "info"): void {
    // The same again is not more.
    for (const shown of [...this.toasts.children]) if (shown.textContent === message) shown.remove();
    const toast = el(
      "div",
      { class: `toast is-${kind}` },
      kind === "warning" && icon("warning"),
      el("span", {}, message),
      el("button", { class: "plain", type: "button", "aria-label": "Dismiss", on: { click: () => toast.remove() } }, icon("close")),
    );
    while (this.toasts.childElementCount >= 2) this.toasts.firstElementChild?.remove();
    this.toasts.append(toast);
    // Long enough to be read, twice.
    setTimeout(() => toast.remove(), 4000 + 60 * message.length);
  }

  /** What is wrong now; null: nothing. `hasGround`: there is something to see meanwhile. */
  showProblem(problem: Problem | null, hasGround: boolean): void {
    this.banner.hidden = problem === null;
    if (problem === null) return;
    this.banner.dataset["code"] = problem.code;
    fill(this.banner, icon("warning"), el("span", {}, wordsFor(problem, hasGround)));
  }
}

function wordsFor(problem: Problem, hasGround: boolean): string {
  switch (problem.code) {
    case "offline":
      return hasGround ? "The server does not answer; what is here stays; trying again." : "The server does not answer; trying again.";
    case "context-lost":
      return "The graphics were taken away; coming back.";
    default:
      return problem.message;
  }
}
