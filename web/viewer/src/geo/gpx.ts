import { FileError, type ForeignLine, type ForeignLines, PointBudget, cleanName } from "./foreign_lines.js";

/** More waypoints than that are one thing. */
const kMostWaypoints = 20;

/** Tracks, routes and waypoints of a GPX document (1.0 or 1.1): always longitude and latitude in WGS 84. */
export function readGpx(text: string): ForeignLines {
  // What entities could be expanded to is nobody's business here.
  if (/<!(DOCTYPE|ENTITY)/i.test(text)) throw new FileError("it has a DOCTYPE, which GPX files do not have");
  const document = new DOMParser().parseFromString(text, "application/xml");
  if (document.getElementsByTagName("parsererror").length > 0) throw new FileError("it is not well-formed XML");
  if (document.documentElement.localName !== "gpx")
    throw new FileError(`it is XML, but not GPX: its root is “${cleanName(document.documentElement.localName)}”`);
  const out: ForeignLines = { lines: [], crsName: "WGS 84", epsg: 4326 };
  const budget = new PointBudget();
  const add = (owner: Element, segments: Element[], pointName: string): void => {
    const line: ForeignLine = { name: nameOf(owner), style: {}, parts: [] };
    for (const segment of segments) {
      const points = elements(segment, pointName).map(positionOf);
      budget.spend(points.length);
      if (points.length >= 2) line.parts.push(points);
    }
    if (line.parts.length > 0) out.lines.push(line);
  };
  for (const track of elements(document, "trk")) add(track, elements(track, "trkseg"), "trkpt");
  for (const route of elements(document, "rte")) add(route, [route], "rtept");
  const waypoints = elements(document, "wpt");
  budget.spend(waypoints.length);
  const places = waypoints.map((point) => ({ name: nameOf(point) || "Waypoint", style: {}, parts: [[positionOf(point)]] }));
  if (places.length <= kMostWaypoints) out.lines.push(...places);
  else out.lines.push({ name: "Waypoints", style: {}, parts: places.flatMap(({ parts }) => parts) });
  return out;
}

function elements(parent: Document | Element, name: string): Element[] {
  return [...parent.getElementsByTagNameNS("*", name)];
}

function nameOf(owner: Element): string {
  return cleanName([...owner.children].find((child) => child.localName === "name")?.textContent ?? "");
}

function positionOf(point: Element): [number, number] {
  const [longitude, latitude] = [point.getAttribute("lon") ?? "", point.getAttribute("lat") ?? ""].map((text) =>
    text.trim() === "" ? NaN : Number(text),
  );
  if (!(Math.abs(longitude ?? NaN) <= 360 && Math.abs(latitude ?? NaN) <= 90))
    throw new FileError("a point in it has no latitude and longitude");
  return [longitude ?? 0, latitude ?? 0];
}
