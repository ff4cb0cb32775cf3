// Writes the seeds of the corpora: make_corpus FOLDER. Existing files of the same names are replaced.
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "example_manifest.h"
#include "fuzz_tiles.h"
#include "pmtiles_format.h"
#include "random_heights.h"
#include "random_images.h"
#include "random_mesh_levels.h"
#include "random_tiles.h"
#include "terrane/codec/compact_mesh.h"
#include "terrane/codec/strip_mesh.h"
#include "terrane/dataset/manifest.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {
namespace {

std::filesystem::path folder;

void store(const std::string& corpus, const std::string& name, const std::vector<uint8_t>& bytes) {
  std::filesystem::create_directories(folder / corpus);
  std::ofstream(folder / corpus / name, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void storeTile(const std::string& name, uint8_t head, const std::vector<uint8_t>& payload) {
  std::vector<uint8_t> bytes{head};
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  store("elevation_payload", name, bytes);
}

void makePayloads() {
  std::mt19937 random(1);
  RandomTileOptions flat{.interpolatedShare = 1.0, .roughness = 0, .startRange = 0};
  RandomTileOptions mixed{
      .voidShare = 0.3, .interpolatedShare = 0.5, .roughness = 1, .partialCoverage = true};
  const Tile parent = fuzzParent();
  storeTile("root_flat", 0,
            encodeTile(randomTile({}, nullptr, kFuzzScale, flat, random), nullptr, 0, kFuzzScale));
  storeTile("root_mixed", 0,
            encodeTile(randomTile({}, nullptr, kFuzzScale, mixed, random), nullptr, 0, kFuzzScale));
  for (int quadrant = 0; quadrant < 4; ++quadrant) {
    const RandomTileOptions& options = quadrant == 0 ? flat : mixed;
    const Tile tile = randomTile(TileId{}.child(quadrant), &parent.samples, kFuzzScale, options, random);
    storeTile("child_" + std::to_string(quadrant), static_cast<uint8_t>(1 | quadrant << 1),
              encodeTile(tile, &parent.samples, quadrant, kFuzzScale));
  }
}

void makeRefinements() {
  const ElevationScale scale = fuzzScaleOfLayers();
  const TileSamples root = fuzzLayeredParent();
  for (const uint8_t head : std::vector<uint8_t>{0, 8, 1, 3, 13, 15}) {
    const FuzzPlace place(head);
    const TileSamples* parent = place.isChild ? &root : nullptr;
    const TileSamples tile = place.isChild ? fuzzLayeredChild(root, place.quadrant) : root;
    std::vector<uint8_t> bytes{head};
    const auto payload = encodeRefinement(tile, parent, place.quadrant, place.layer, scale);
    bytes.insert(bytes.end(), payload.begin(), payload.end());
    store("refinement",
          (place.isChild ? "child_" + std::to_string(place.quadrant) : "root") + "_" +
              std::to_string(place.layer),
          bytes);
  }
  // Nothing more than was there before.
  TileSamples same = samplesOfLayer(root, 1);
  same.layerCount = kFuzzLayers;
  std::vector<uint8_t> bytes{8};
  const auto payload = encodeRefinement(same, nullptr, 0, 2, scale);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  store("refinement", "root_empty", bytes);
}

void makeImagery() {
  for (const bool holes : {false, true}) {
    const ImageryTile tile = randomImage(1, holes);
    const std::string suffix = holes ? "_holes" : "_full";
    store("imagery_payload", "jpeg" + suffix, encodeImagery(tile, ImageryFormat::Jpeg, 10));
    store("imagery_payload", "webp" + suffix, encodeImagery(tile, ImageryFormat::Webp, 10));
  }
}

void makeStripMeshes() {
  for (const int side : {3, 9, 17}) {
    for (const double bound : {1.0, 20.0}) {
      const auto mesh = encodeStripMesh(randomHeights(side, 4), side, {bound, 0.0});
      TERRANE_CHECK(mesh.ok(), "{}", mesh.error().message);
      store("strip_mesh", std::to_string(side) + (bound > 1.0 ? "_coarse" : "_fine"), bytesOf(*mesh));
    }
  }
}

void makeCompactMeshes() {
  // Calm ground, and rough ground with a bound that leaves little of it: small inputs find more.
  for (const unsigned seed : {5U, 2U}) {
    RandomMeshes options = randomMeshesOf(seed);
    options.boundSpacings = 60.0;
    options.lastKept = 3;
    visitRandomMeshes(seed, options, [&](const MeshLevel& meshes) {
      const CompactLevel compact = compactOf(meshes);
      if (compact.words.size() > 6000) return;
      std::vector<uint8_t> bytes(compact.sizeBytes());
      std::memcpy(bytes.data(), compact.words.data(), bytes.size());
      store("compact_mesh", fmt::format("{}_{}", seed == 5 ? "calm" : "rough", meshes.level), bytes);
    });
  }
}

void makeArchives() {
  const std::string path = (folder / "archive.pmtiles").string();
  std::filesystem::remove(path);
  auto writer = PmtilesWriter::create(path);
  TERRANE_CHECK(writer.ok(), "{}", writer.error().message);
  for (const TileId id : {TileId{}, TileId{1, 0, 0}, TileId{1, 0, 1}, TileId{1, 1, 1}, TileId{2, 3, 0}}) {
    const std::vector<uint8_t> tile(20, static_cast<uint8_t>(id.level));
    TERRANE_CHECK(writer->add(id, tile).ok());
  }
  TERRANE_CHECK(writer->finish("{}").ok());
  std::ifstream in(path, std::ios::binary);
  std::vector<uint8_t> bytes{0};
  bytes.insert(bytes.end(), std::istreambuf_iterator<char>(in), {});
  std::filesystem::remove(path);
  store("pmtiles_archive", "whole", bytes);

  const std::vector<PmtilesEntry> leaf{{5, 0, 20, 1}, {6, 20, 30, 3}};
  const std::vector<uint8_t> leafBytes = directoryToBytes(leaf);
  const auto packedLeaf = static_cast<uint32_t>(gzip(leafBytes).size());
  const std::vector<std::pair<std::string, std::vector<PmtilesEntry>>> roots{
      {"root_of_tiles", {{0, 0, 20, 1}, {1, 20, 10, 4}}},
      {"root_of_leaves", {{0, 0, 20, 1}, {5, 0, packedLeaf, 0}}}};
  for (const auto& [name, entries] : roots) {
    const std::vector<uint8_t> root = directoryToBytes(entries);
    std::vector<uint8_t> input{static_cast<uint8_t>(root.size())};
    input.insert(input.end(), root.begin(), root.end());
    input.insert(input.end(), leafBytes.begin(), leafBytes.end());
    store("pmtiles_archive", name, input);
  }
}

void makeManifest() {
  Manifest manifest = exampleManifest();
  for (const char* name : {"example", "layered"}) {
    const std::string text = manifestToJson(manifest);
    store("manifest_json", name, {text.begin(), text.end()});
    manifest.scale.layerCount = 3;
    manifest.scale.layerErrors = {12.5, 3.25, manifest.maxErrorMeters};
  }
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_corpus FOLDER\n");
    return 2;
  }
  terrane::folder = argv[1];
  terrane::makePayloads();
  terrane::makeRefinements();
  terrane::makeImagery();
  terrane::makeStripMeshes();
  terrane::makeCompactMeshes();
  terrane::makeArchives();
  terrane::makeManifest();
}
