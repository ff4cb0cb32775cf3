/** Listeners by the name of what they wait for. */
export class Events<Kinds extends object> {
  private readonly listeners = new Map<keyof Kinds, Set<(what: never) => void>>();

  /** Returns what takes the listener away again. */
  on<Name extends keyof Kinds>(name: Name, listener: (what: Kinds[Name]) => void): () => void {
    const all = this.listeners.get(name) ?? new Set();
    this.listeners.set(name, all);
    all.add(listener as (what: never) => void);
    return () => all.delete(listener as (what: never) => void);
  }

  /** A listener that throws does not keep the others from hearing. */
  tell<Name extends keyof Kinds>(name: Name, what: Kinds[Name]): void {
    for (const listener of [...(this.listeners.get(name) ?? [])]) {
      try {
        (listener as (what: Kinds[Name]) => void)(what);
      } catch (error) {
        reportError(error);
      }
    }
  }

  has(name: keyof Kinds): boolean {
    return (this.listeners.get(name)?.size ?? 0) > 0;
  }

  clear(): void {
    this.listeners.clear();
  }
}
