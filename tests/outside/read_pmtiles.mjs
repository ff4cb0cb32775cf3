// Reads an archive that we wrote with the PMTiles project's own reader (npm package pmtiles, tried with 4.3) and
// compares: every tile that the header counts is found, and nothing else; every payload begins with its version.
//
//   npm install --prefix build/outside pmtiles
//   node tests/outside/read_pmtiles.mjs build/outside name.terrane/elevation.pmtiles

import { open } from "node:fs/promises";
import { createRequire } from "node:module";
import { resolve } from "node:path";

const [modules, archive] = process.argv.slice(2);
if (!archive) {
  console.error("usage: node read_pmtiles.mjs FOLDER_WITH_NODE_MODULES ARCHIVE");
  process.exit(2);
}
const { Compression, PMTiles, TileType, tileIdToZxy } = createRequire(resolve(modules, "package.json"))("pmtiles");

/** A file on disk as the reader wants it. */
class FileSource {
  constructor(handle) {
    this.handle = handle;
  }
  getKey() {
    return archive;
  }
  async getBytes(offset, length) {
    const { buffer, bytesRead } = await this.handle.read(new Uint8Array(length), 0, length, offset);
    return { data: buffer.buffer.slice(0, bytesRead) };
  }
}

let failed = 0;
function expect(what, found, wanted) {
  if (found === wanted) return;
  console.error(`${what}: ${found} instead of ${wanted}`);
  failed = 1;
}

const handle = await open(archive);
const reader = new PMTiles(new FileSource(handle));
const header = await reader.getHeader();
expect("version", header.specVersion, 3);
expect("clustered", header.clustered, true);
expect("tile type", header.tileType, TileType.Unknown);
expect("tile compression", header.tileCompression, Compression.None);
expect("metadata", typeof (await reader.getMetadata()), "object");

// All ids there can be, up to a bound that keeps a large archive's test short.
let found = 0;
const ids = Math.min((4 ** (header.maxZoom + 1) - 1) / 3, 200000);
for (let id = 0; id < ids; ++id) {
  const tile = await reader.getZxy(...tileIdToZxy(id));
  if (!tile) continue;
  ++found;
  expect(`version of payload ${id}`, new Uint8Array(tile.data)[0], 1);
}
if (ids < 200000) expect("tiles", found, header.numAddressedTiles);
await handle.close();
console.log(`${archive}: ${found} tiles of ${header.numAddressedTiles}, levels ${header.minZoom} to ${header.maxZoom}`);
process.exit(failed);
