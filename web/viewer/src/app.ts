import type { DatasetInfo, Viewer } from "terrane";
import type { LineStore } from "./line_store.js";
import type { Overlay } from "./parts/overlay.js";
import type { Panels } from "./parts/panels.js";
import type { Pointing } from "./parts/pointing.js";
import type { IconName } from "./parts/icons.js";
import type { FlightDeck } from "./flight_deck.js";
import type { GroundScale } from "./geo/ground_scale.js";
import type { Projection } from "./geo/projection.js";

/** What panels, tools and actions are given. Exists from the moment the dataset is open. */
export interface App {
  readonly viewer: Viewer;
  readonly dataset: DatasetInfo;
  /** Marks at places of the ground, over the picture. */
  readonly overlay: Overlay;
  /** Who is told of clicks on the ground. */
  readonly pointing: Pointing;
  readonly panels: Panels;
  /** Lines that somebody drew or opened. */
  readonly lines: LineStore;
  readonly flights: FlightDeck;
  /** Between WGS 84 and the dataset's CRS; null where that CRS is not understood. Loads what it needs when first asked. */
  projection(): Promise<Projection | null>;
  /** Lengths as they are on the ground; null where that CRS is not understood, and the map's have to do. */
  groundScale(): Promise<GroundScale | null>;
  /** A short message that goes away by itself. */
  say(message: string, kind?: "info" | "warning"): void;
  /** Asks for a file from the disk, and takes it as if it had been dropped on the page. */
  openFiles(): void;
  copyLink(): void;
  /** Flies in place of moving the map, or does not. */
  setFlying(on: boolean): void;
}

/** A card beside the toolbar. */
export interface Panel {
  id: string;
  title: string;
  icon: IconName;
  /** The key that opens and closes it, as `KeyboardEvent.key` has it. */
  key: string;
  /** One line for the help. */
  purpose: string;
  /** Low and wide, at the bottom; otherwise a card at the side. */
  isWide?: boolean;
  open(app: App): OpenPanel;
}

export interface OpenPanel {
  body: HTMLElement;
  /** Gives back what it used: marks, lines, listeners. */
  close?(): void;
}

/** Something that is done at once. */
export interface Action {
  id: string;
  title: string;
  icon: IconName;
  key: string;
  purpose: string;
  run(app: App): void;
}
