import { svg } from "./dom.js";

/** Line drawings on a square of 24: paths, `M x y` alone is a dot. */
const kPaths = {
  layers: "M12 3.5 3.5 8.2 12 13l8.5-4.8zM3.8 12.4 12 17l8.2-4.6M3.8 16.4 12 21l8.2-4.6",
  sun: "M12 7.5a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9zM12 2v2M12 20v2M2 12h2M20 12h2M4.9 4.9l1.5 1.5M17.6 17.6l1.5 1.5M4.9 19.1l1.5-1.5M17.6 6.4l1.5-1.5",
  detail: "M3 20 12 4l9 16zM7.5 12h9M12 20l-4.5-8M12 20l4.5-8",
  statistics: "M4 4v16h16M8 15l3.5-4.5 3 2.5L20 7",
  measure: "M3.5 15.5 15.5 3.5l5 5-12 12zM7 12l2.2 2.2M10 9l3 3M13 6l2.2 2.2",
  profile: "M3 19.5h18M3 16l4.5-7 4 5 3.5-8 6 10",
  sight: "M2.5 12S6 5.5 12 5.5 21.5 12 21.5 12 18 18.5 12 18.5 2.5 12 2.5 12zM12 9a3 3 0 1 0 0 6 3 3 0 0 0 0-6z",
  lines: "M4 19c4-9 7 2 10-5 1.2-2.8 1.5-5 2-7M14 7l4-4 3 3-4 4z",
  flights: "M3 18c5 0 5-9 10-9 2.5 0 3.5 1.5 6 1.5M16.5 7.5l3.5 3-3 3.2M3 18h.01",
  camera: "M4 7.5h3.5L9 5h6l1.5 2.5H20v11.5H4zM12 9.7a3.3 3.3 0 1 0 0 6.6 3.3 3.3 0 0 0 0-6.6z",
  link: "M10 14a4 4 0 0 0 5.7 0l3.1-3.1a4 4 0 0 0-5.7-5.7L11.8 6.500M14 10a4 4 0 0 0-5.7 0l-3.1 3.1a4 4 0 0 0 5.7 5.7l1.300-1.300",
  help: "M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18zM9.500 9.300a2.600 2.600 0 1 1 3.700 2.500c-.8.4-1.2.9-1.200 1.900M12 16.800v.1",
  more: "M5 12h.01M12 12h.01M19 12h.01",
  expand: "M7 10l5 5 5-5",
  close: "M6 6l12 12M18 6 6 18",
  plus: "M12 5v14M5 12h14",
  minus: "M5 12h14",
  home: "M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",
  fly: "M3 11.500 21 4l-6.500 17-3-7zM11.500 14 21 4",
  trash: "M5 7h14M10 7V4.500h4V7M7 7l.8 13h8.400L17 7M10.500 10.500v6M13.500 10.500v6",
  download: "M12 4v11M7.500 11l4.500 4.500L16.500 11M5 20h14",
  open: "M12 16V5M7.500 9.500 12 5l4.500 4.500M5 20h14",
  target: "M12 5a7 7 0 1 0 0 14 7 7 0 0 0 0-14zM12 2v5M12 17v5M2 12h5M17 12h5",
  record: "M12 6a6 6 0 1 0 0 12 6 6 0 0 0 0-12z",
  stop: "M7 7h10v10H7z",
  play: "M8 5.500v13l11-6.500z",
  undo: "M8 6 4 10l4 4M4 10h10a5 5 0 0 1 0 10h-3",
  check: "M5 12.500l4.500 4.500L19 7.500",
  warning: "M12 4 2.500 20h19zM12 10v5M12 17.500v.1",
} as const;

export type IconName = keyof typeof kPaths;

export function icon(name: IconName): SVGSVGElement {
  return svg("svg", { viewBox: "0 0 24 24", class: "icon", "aria-hidden": "true", focusable: "false" }, svg("path", { d: kPaths[name] }));
}
