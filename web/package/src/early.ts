/** What need not wait until the engine is there. */
import type { EarlyAnswer } from "./engine.js";

/** Where the engine will look for a dataset's manifest: the same as `fileUrl()` of src/stream/src/dataset_url.h. */
export function manifestUrl(dataset: string): string {
  const [, folder = "", query = ""] = /^([^?#]*)(\?[^#]*)?/.exec(dataset) ?? [];
  return `${folder.replace(/\/+$/, "").replace(/\/manifest\.json$/, "").replace(/\/+$/, "")}/manifest.json${query}`;
}

/** Asks for a dataset's manifest while the engine is still on its way. What goes wrong is left to the engine, which asks again. */
export function askEarly(dataset: string): Map<string, Promise<EarlyAnswer | null>> {
  const url = manifestUrl(dataset);
  const begun = performance.now();
  const answer = fetch(url, { cache: "no-cache" }).then(async (came) => {
    if (!came.ok) return null;
    const bytes = new Uint8Array(await came.arrayBuffer());
    return { status: came.status, headers: came.headers, bytes, seconds: (performance.now() - begun) / 1000 };
  });
  return new Map([[url, answer.catch(() => null)]]);
}

/** Workers whose scripts come beside the engine's own. */
export class EarlyWorkers {
  private readonly started: Worker[] = [];
  private readonly failed = new Set<Worker>();

  constructor(count: number, private readonly make: () => Worker) {
    try {
      while (this.started.length < count) {
        const worker = make();
        worker.addEventListener("error", () => this.failed.add(worker), { once: true });
        this.started.push(worker);
      }
    } catch {
      // A page's rules may forbid them: the engine will be told so.
    }
  }

  /** Hands one out. One that failed by then is made again, for the engine to see why. */
  take(): Worker {
    const worker = this.started.shift();
    return worker === undefined || this.failed.has(worker) ? this.make() : worker;
  }

  /** Ends those that nobody took. */
  end(): void {
    for (const worker of this.started.splice(0)) worker.terminate();
  }
}
