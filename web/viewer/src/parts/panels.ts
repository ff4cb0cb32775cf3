import type { App, OpenPanel, Panel } from "../app.js";
import { el } from "./dom.js";
import { icon } from "./icons.js";
import { closeBySwipe } from "./swipe.js";

/** Shows one panel at a time: a card at the side, or a sheet at the bottom of a small screen. */
export class Panels {
  readonly element = el("div", { class: "panels" });
  private current: { panel: Panel; open: OpenPanel; element: HTMLElement; before: Element | null } | null = null;
  private readonly listeners: ((open: string | null) => void)[] = [];
  private app: App | null = null;
  /** A sheet takes its height from the ground on small screens: the middle of the picture stays in sight. */
  private readonly sizes = new ResizeObserver(() => {
    document.documentElement.style.setProperty("--sheet", `${this.current?.element.offsetHeight ?? 0}px`);
  });

  use(app: App): void {
    this.app = app;
  }
  get openId(): string | null {
    return this.current?.panel.id ?? null;
  }
  onChange(listener: (open: string | null) => void): void {
    this.listeners.push(listener);
  }

  /** Opens it in place of another; closes it if it is open. With `focus`, what is in it comes next for Tab. */
  toggle(panel: Panel, focus = false): void {
    if (this.openId === panel.id) this.close();
    else this.open(panel, focus);
  }

  open(panel: Panel, focus = false): void {
    const { app } = this;
    if (app === null) return;
    const before = this.current?.before ?? document.activeElement;
    this.close();
    const open = panel.open(app);
    const head = el(
      "header",
      { class: "panel-head" },
      el("h2", { id: `title-${panel.id}` }, panel.title),
      el(
        "button",
        { class: "plain", type: "button", "aria-label": `Close ${panel.title}`, title: "Close (Esc)", on: { click: () => this.close() } },
        icon("close"),
      ),
    );
    const element = el(
      "section",
      { class: `panel${panel.isWide ? " is-wide" : ""}`, id: `panel-${panel.id}`, "aria-labelledby": `title-${panel.id}`, tabindex: -1 },
      head,
      el("div", { class: "panel-body" }, open.body),
    );
    closeBySwipe(head, element, () => this.close());
    this.element.append(element);
    this.current = { panel, open, element, before };
    this.sizes.observe(element);
    if (focus) element.focus({ preventScroll: true });
    this.tell();
  }

  /** Returns whether there was one. */
  close(): boolean {
    const { current } = this;
    if (current === null) return false;
    this.current = null;
    const hadFocus = current.element.contains(document.activeElement);
    current.open.close?.();
    this.sizes.disconnect();
    document.documentElement.style.setProperty("--sheet", "0px");
    current.element.remove();
    if (hadFocus && current.before instanceof HTMLElement) current.before.focus({ preventScroll: true });
    this.tell();
    return true;
  }

  private tell(): void {
    for (const listener of this.listeners) listener(this.openId);
    document.body.classList.toggle("has-panel", this.current !== null);
    document.body.classList.toggle("has-wide-panel", this.current?.panel.isWide ?? false);
  }
}
