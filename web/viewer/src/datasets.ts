/** Which dataset to show: the page's address says it, or the server that delivered the page. */

export interface DatasetChoice {
  name: string;
  /** Of the dataset's directory, or of its manifest. */
  url: string;
  crs?: string;
  attribution?: string;
  bytes?: number;
  minHeight?: number;
  maxHeight?: number;
}

export type Found =
  { kind: "one"; dataset: DatasetChoice } | { kind: "several"; datasets: DatasetChoice[] } | { kind: "none"; reason: string };

/** Looks at `?dataset=`, a name that the server knows or an address, then asks the server for what it has. */
export async function findDataset(page: URL): Promise<Found> {
  const asked = page.searchParams.get("dataset")?.trim() ?? "";
  if (asked !== "" && !/^[\w.~-]+$/.test(asked)) return foundAt(asked, page);

  const served = await servedDatasets(page);
  if (asked !== "") {
    const known = served?.find((each) => each.name === asked || `${each.name}.terrane` === asked);
    if (known) return { kind: "one", dataset: known };
    if (served === null || served.length === 0 || asked.endsWith(".terrane")) return foundAt(asked, page);
    return { kind: "none", reason: `The server has no dataset “${asked}”. It has: ${served.map((each) => each.name).join(", ")}.` };
  }
  if (served === null || served.length === 0)
    return {
      kind: "none",
      reason: "The page’s address names no dataset, and this server has no list of any. Add ?dataset= and the address of one.",
    };
  const [first] = served;
  return served.length === 1 && first ? { kind: "one", dataset: first } : { kind: "several", datasets: served };
}

/** At an address, also one relative to the page. */
function foundAt(address: string, page: URL): Found {
  const url = parse(address, page);
  if (url === null || !/^https?:$/.test(url.protocol))
    return {
      kind: "none",
      reason: `“${address}” is no address of a dataset: those begin with https:// or http://, or are relative to this page.`,
    };
  const folder = url.pathname.replace(/manifest\.json$/, "").replace(/\/+$/, "");
  const name = decode(folder.split("/").at(-1) ?? "").replace(/\.terrane$/, "");
  return { kind: "one", dataset: { name: name || url.host, url: url.href } };
}

function parse(address: string, page: URL): URL | null {
  try {
    return new URL(address, page);
  } catch {
    return null;
  }
}

function decode(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

interface ServedDataset {
  name: string;
  manifest: string;
  immutable?: string;
  crs?: string;
  attribution?: string;
  minHeightMeters?: number;
  maxHeightMeters?: number;
  files?: { bytes?: number }[];
}

let asked: Promise<DatasetChoice[] | null> | null = null;

/** What `terrane serve` lists, asked once; null where the page comes from another kind of server. */
export function servedDatasets(page: URL): Promise<DatasetChoice[] | null> {
  return (asked ??= askServer(page));
}

async function askServer(page: URL): Promise<DatasetChoice[] | null> {
  const address = new URL("datasets.json", page);
  try {
    const answer = await fetch(address, { cache: "no-cache" });
    if (!answer.ok) return null;
    const told = (await answer.json()) as { datasets?: unknown };
    if (!Array.isArray(told.datasets)) return null;
    return (told.datasets as ServedDataset[])
      .filter((each) => typeof each?.name === "string" && typeof each?.manifest === "string")
      .map((each) => ({
        name: each.name,
        // What stands under the hash never changes: the browser may keep it for ever.
        url: new URL(each.immutable ?? each.manifest, address).href,
        crs: each.crs,
        attribution: each.attribution,
        minHeight: each.minHeightMeters,
        maxHeight: each.maxHeightMeters,
        bytes: each.files?.reduce((sum, file) => sum + (file.bytes ?? 0), 0),
      }));
  } catch {
    return null;
  }
}
