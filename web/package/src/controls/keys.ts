/** The keys that are down, by `event.code`; those that a caller names only. */
export class HeldKeys {
  private readonly held = new Set<string>();

  constructor(private readonly known: ReadonlySet<string>) {}

  /** Returns whether the key is one of those known, so that it is not the page's any more. */
  down(event: KeyboardEvent): boolean {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.known.has(event.code)) return false;
    this.held.add(event.code);
    return true;
  }
  up(event: KeyboardEvent): void {
    this.held.delete(event.code);
  }
  clear(): void {
    this.held.clear();
  }
  get any(): boolean {
    return this.held.size > 0;
  }
  has(...codes: string[]): boolean {
    return codes.some((code) => this.held.has(code));
  }
  /** 1, -1 or 0. */
  axis(plus: string[], minus: string[]): number {
    return Number(this.has(...plus)) - Number(this.has(...minus));
  }
}
