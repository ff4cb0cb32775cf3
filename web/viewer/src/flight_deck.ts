import type { Recording, Viewer } from "terrane";

export interface Flight {
  name: string;
  json: string;
  seconds: number;
}

/** A shorter recording is a slip of the hand, and no reason to give up the flight before it. */
const kLeastSeconds = 0.5;

export type FlightState = "idle" | "recording" | "flying";

/** Records the camera's way, and flies it again. */
export class FlightDeck {
  private recording: { at: Recording; begun: number } | null = null;
  private isFlying = false;
  private count = 0;
  private readonly listeners = new Set<() => void>();
  flight: Flight | null = null;

  constructor(
    private readonly viewer: Viewer,
    private readonly say: (message: string, kind?: "info" | "warning") => void,
  ) {}

  get state(): FlightState {
    return this.recording ? "recording" : this.isFlying ? "flying" : "idle";
  }
  /** Seconds since recording began. */
  get recordedSeconds(): number {
    return this.recording ? (performance.now() - this.recording.begun) / 1000 : 0;
  }
  onChange(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  toggleRecording(): void {
    if (this.recording === null) {
      this.stopFlying();
      this.recording = { at: this.viewer.record(), begun: performance.now() };
    } else {
      const json = this.recording.at.stop();
      this.recording = null;
      const seconds = secondsOf(json);
      if (seconds >= kLeastSeconds) this.flight = { name: "recorded flight", json, seconds };
      else this.say("That was too short for a flight; nothing was kept of it.");
    }
    this.tell();
  }

  /** Takes a flight's JSON. Returns what is wrong with it at first sight; the engine looks closer when it is flown. */
  load(json: string, name: string): string {
    const seconds = secondsOf(json);
    if (!Number.isFinite(seconds)) return "it is no flight that this viewer knows: docs/flights.md tells what one has";
    if (this.recording) this.toggleRecording();
    this.flight = { name, json, seconds };
    this.tell();
    return "";
  }

  replay(): void {
    if (this.flight === null) return;
    if (this.recording) this.toggleRecording();
    const { name, json } = this.flight;
    let flying: Promise<boolean>;
    try {
      flying = this.viewer.replay(json);
    } catch (error) {
      this.say(`“${name}” was not flown: ${error instanceof Error ? error.message : String(error)}`, "warning");
      return;
    }
    this.isFlying = true;
    this.tell();
    // A flight that another one ends must not end that one, too.
    const number = ++this.count;
    void flying.then(() => {
      if (number !== this.count) return;
      this.isFlying = false;
      this.tell();
    });
  }

  stopFlying(): void {
    // Whatever moves the camera ends a flight.
    if (this.isFlying) this.viewer.setView(this.viewer.view);
  }

  private tell(): void {
    for (const listener of this.listeners) listener();
  }
}

function secondsOf(json: string): number {
  try {
    const flight = JSON.parse(json) as { terraneFlight?: unknown; keys?: { time?: unknown }[] };
    const time = flight.terraneFlight === 1 ? flight.keys?.at(-1)?.time : undefined;
    return typeof time === "number" ? time : NaN;
  } catch {
    return NaN;
  }
}
