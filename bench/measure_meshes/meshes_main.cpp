#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <unordered_map>

#include "bound_check.h"
#include "coded_mesh.h"
#include "greedy_delaunay.h"
#include "mesh_decoding.h"
#include "mesh_input.h"
#include "others.h"
#include "paper_form.h"
#include "terrane/base/parallel.h"
#include "terrane/measure/bench_result.h"

/// Terrane's adaptive meshes beside the strips of Dick, Schneider and Westermann (2009), full grids, and
/// greedily chosen Delaunay triangles.
///
/// usage: measure_meshes RESULT.json CACHE.json WEB.json|- {NAME RASTER {DATASET SECONDS} {DATASET
/// SECONDS}}...
///
/// Each raster comes with two datasets made of it with a --max-error of a half and of a quarter of its sample
/// spacing, and the CPU seconds that building each took. CACHE.json is the codec bench's, WEB.json what
/// measure_mesh_decoding said in node.

namespace terrane {
namespace {

/// As many tiles of a file, evenly spread, are also triangulated greedily.
constexpr size_t kGreedyTiles = 6;

/// Triangles, and how long they take to decode.
struct Decoded {
  double triangles = 0.0;
  double seconds = 0.0;
  void add(const Decoded& other) {
    triangles += other.triangles;
    seconds += other.seconds;
  }
  double millionsASecond() const { return triangles / seconds / 1e6; }
};

struct Ours {
  double bits = 0.0;       ///< of the whole pyramid
  double triangles = 0.0;  ///< of the finest level
  BoundCheck check;
  Decoded decoded;  ///< the whole pyramid
  double decodedSamples = 0.0;
  Decoded web;
};

struct Paper {
  double bits = 0.0;  ///< of its finest level alone
  double triangles = 0.0;
  double pyramidBits = 0.0;
  Decoded decoded;  ///< the finest level
};

/// The smallest of the other codecs on all of the grid's samples, rounded to multiples of twice the bound.
struct FullGrid {
  std::string codec;
  double bits = 0.0;
};

struct Greedy {
  size_t tiles = 0;
  double triangles = 0.0;
  double ours = 0.0;  ///< on the same tiles
};

struct Outcome {
  size_t setting = 0;
  double samples = 0.0;  ///< of the finest level, with a height
  Ours ours;
  Paper paper;
  FullGrid grid;
  Greedy greedy;
};

/// Triangles of each tile of the finest level.
using TriangleCounts = std::unordered_map<TileId, double, TileIdHash>;

Result<TriangleCounts> countTriangles(const StoredPyramid& pyramid, const std::vector<SourceTile>& source) {
  CodedMesh mesh;
  TriangleCounts counts;
  TERRANE_TRY(pyramid.visitFinest(addressesOf(source), [&](TileId id, const Tile& tile) {
    counts[id] = static_cast<double>(mesh.trianglesOf(tile.samples, id).size());
    return Status();
  }));
  return counts;
}

Result<Ours> measureOurs(const StoredPyramid& pyramid, const std::vector<SourceTile>& source,
                         const TriangleCounts& counts) {
  Ours ours;
  ours.bits = 8.0 * static_cast<double>(pyramid.bytes());
  for (const auto& [id, count] : counts) ours.triangles += count;
  TERRANE_ASSIGN(ours.check, checkBound(pyramid, source));
  TERRANE_ASSIGN(const MeshDecoding decoding, measureMeshDecoding(pyramid));
  ours.decoded = {static_cast<double>(decoding.triangles), decoding.seconds};
  ours.decodedSamples = static_cast<double>(decoding.tiles) * kTileSampleCount;
  return ours;
}

Result<Paper> measurePaper(const Manifest& manifest, const std::vector<SourceTile>& source, int shares) {
  TERRANE_ASSIGN(const PaperForm form,
                 encodePaperForm(gridOf(source, manifest), manifest.frame.spacingXMeters(), shares));
  TERRANE_ASSIGN(const double seconds, measurePaperDecoding(form.finest));
  Paper paper;
  paper.bits = static_cast<double>(form.levels.front().bits);
  paper.triangles = static_cast<double>(form.levels.front().triangles);
  for (const PaperLevel& level : form.levels) paper.pyramidBits += static_cast<double>(level.bits);
  paper.decoded = {paper.triangles, seconds};
  return paper;
}

Result<FullGrid> measureGrid(const std::vector<SourceTile>& source, const ElevationScale& scale,
                             double boundMeters, nlohmann::json& cache) {
  std::vector<TileContent> tiles;
  for (const SourceTile& tile : source) tiles.push_back(contentOf(tile, scale, boundMeters));
  TERRANE_ASSIGN(const OtherSizes sizes, measureSizes(tiles, cache));
  const auto codecs = makeOtherCodecs();
  FullGrid grid;
  for (size_t i = 0; i < codecs.size(); ++i) {
    const double bits = 8.0 * static_cast<double>(sizes.bytes[i]);
    if (bits == 0.0 || (!grid.codec.empty() && bits >= grid.bits)) continue;
    grid = {std::string(codecs[i]->name()), bits};
  }
  return grid;
}

/// Some of the tiles that have a height everywhere, evenly spread.
std::vector<const SourceTile*> chooseWholeTiles(const std::vector<SourceTile>& source) {
  std::vector<const SourceTile*> whole;
  for (const SourceTile& tile : source) {
    if (std::none_of(tile.heights.begin(), tile.heights.end(), [](float h) { return std::isnan(h); }))
      whole.push_back(&tile);
  }
  std::vector<const SourceTile*> chosen;
  const size_t count = std::min(kGreedyTiles, whole.size());
  for (size_t i = 0; i < count; ++i) chosen.push_back(whole[(2 * i + 1) * whole.size() / (2 * count)]);
  return chosen;
}

Greedy measureGreedy(const std::vector<SourceTile>& source, const TriangleCounts& counts,
                     double boundMeters) {
  const std::vector<const SourceTile*> chosen = chooseWholeTiles(source);
  std::vector<size_t> triangles(chosen.size());
  parallelFor(static_cast<int64_t>(chosen.size()), 0, [&](int64_t i) {
    const auto place = static_cast<size_t>(i);
    triangles[place] = greedyDelaunay(chosen[place]->heights, kTileSamples, boundMeters).size();
  });
  Greedy greedy;
  greedy.tiles = chosen.size();
  for (size_t i = 0; i < chosen.size(); ++i) {
    greedy.triangles += static_cast<double>(triangles[i]);
    greedy.ours += counts.find(chosen[i]->id)->second;
  }
  return greedy;
}

/// What node said of a dataset; zeros where it was not asked.
Result<Decoded> decodedInNode(const nlohmann::json& web, const std::string& dataset) {
  if (web.is_null()) return Decoded();
  if (!web.contains(dataset)) return makeError("{}: node has not decoded it", dataset);
  return Decoded{web[dataset]["triangles"].get<double>(), web[dataset]["seconds"].get<double>()};
}

/// Null where there is nothing to divide by.
nlohmann::ordered_json quotient(double dividend, double divisor) {
  return divisor == 0.0 ? nlohmann::ordered_json() : nlohmann::ordered_json(dividend / divisor);
}

nlohmann::ordered_json rowOf(const MeshInput& input, const Outcome& outcome) {
  const auto& [setting, samples, ours, paper, grid, greedy] = outcome;
  return {{"file", input.name},
          {"bound", kMeshSettings[setting].name},
          {"samples", static_cast<int64_t>(samples)},
          {"tris_a_sample", ours.triangles / samples},
          {"bits_a_tri", ours.bits / ours.triangles},
          {"bits_a_sample", ours.bits / samples},
          {"paper_tris_a_sample", paper.triangles / samples},
          {"paper_bits_a_tri", paper.bits / paper.triangles},
          {"paper_bits_a_sample", paper.bits / samples},
          {"paper_pyramid", paper.pyramidBits / samples},
          {"vs_paper", ours.bits / paper.bits},
          {"vs_paper_pyramid", ours.bits / paper.pyramidBits},
          {"grid", grid.codec},
          {"grid_bits_a_tri", grid.bits / (2.0 * samples)},
          {"grid_bits_a_sample", grid.bits / samples},
          {"greedy_tiles", static_cast<int64_t>(greedy.tiles)},
          {"vs_greedy", quotient(greedy.ours, greedy.triangles)},
          {"build_ns_a_sample", input.buildSeconds[setting] / samples * 1e9},
          {"mtris", ours.decoded.millionsASecond()},
          {"msps", ours.decodedSamples / ours.decoded.seconds / 1e6},
          {"paper_mtris", paper.decoded.millionsASecond()},
          {"web_mtris", quotient(ours.web.triangles / 1e6, ours.web.seconds)},
          {"max_error_m", ours.check.largestMeters},
          {"violations", ours.check.violations}};
}

Result<Outcome> measureSetting(const MeshInput& input, size_t setting, const std::vector<SourceTile>& source,
                               const nlohmann::json& web, nlohmann::json& cache) {
  const std::string& dataset = input.datasets[setting];
  TERRANE_ASSIGN(const StoredPyramid pyramid, openBounded(dataset, kMeshSettings[setting]));
  const Manifest& manifest = pyramid.manifest();
  const double boundMeters = boundMetersOf(manifest, kMeshSettings[setting]);
  TERRANE_ASSIGN(const TriangleCounts counts, countTriangles(pyramid, source));

  Outcome outcome;
  outcome.setting = setting;
  for (const SourceTile& tile : source) outcome.samples += static_cast<double>(tile.ownSamples);
  TERRANE_ASSIGN(outcome.ours, measureOurs(pyramid, source, counts));
  TERRANE_ASSIGN(outcome.ours.web, decodedInNode(web, dataset));
  TERRANE_ASSIGN(outcome.paper, measurePaper(manifest, source, kMeshSettings[setting].shares));
  TERRANE_ASSIGN(outcome.grid, measureGrid(source, manifest.scale, boundMeters, cache));
  outcome.greedy = measureGreedy(source, counts, boundMeters);
  return outcome;
}

void setBars(const std::vector<Outcome>& outcomes, BenchResult& result) {
  std::array<double, kMeshSettings.size()> bits{};
  std::array<double, kMeshSettings.size()> triangles{};
  double worst = 0.0;
  double violations = 0.0;
  Greedy greedy;
  Decoded ours, paper, web;
  for (const Outcome& outcome : outcomes) {
    bits[outcome.setting] += outcome.ours.bits;
    triangles[outcome.setting] += outcome.ours.triangles;
    // All levels of ours over all levels of the paper's.
    worst = std::max(worst, outcome.ours.bits / outcome.paper.pyramidBits);
    violations += static_cast<double>(outcome.ours.check.violations);
    greedy.tiles += outcome.greedy.tiles;
    greedy.triangles += outcome.greedy.triangles;
    greedy.ours += outcome.greedy.ours;
    ours.add(outcome.ours.decoded);
    paper.add(outcome.paper.decoded);
    web.add(outcome.ours.web);
  }
  for (size_t i = 0; i < kMeshSettings.size(); ++i) {
    const std::string name = kMeshSettings[i].name;
    result.bars.push_back({"bits_per_triangle_" + name, bits[i] / triangles[i], "", 3.0});
  }
  constexpr auto kAtLeast = Bar::Side::AtLeast;
  result.bars.push_back({"vs_paper_form", worst, "", 0.25});
  result.bars.push_back({"bound_violations", violations, "samples", 0.0});
  if (greedy.tiles > 0)
    result.bars.push_back({"triangles_vs_greedy_delaunay", greedy.ours / greedy.triangles, "", 2.4});
  result.bars.push_back({"decode_mtris_per_core", ours.millionsASecond(), "", 30.0, kAtLeast});
  result.bars.push_back({"paper_decode_mtris_per_core", paper.millionsASecond(), "", 33.0, kAtLeast});
  if (web.seconds > 0.0)
    result.bars.push_back({"web_decode_mtris_per_core", web.millionsASecond(), "", 10.0, kAtLeast});
}

/// The object in a file; an empty one where there is no file.
Result<nlohmann::json> readObject(const std::string& path) {
  std::ifstream file(path);
  if (!file) return nlohmann::json::object();
  nlohmann::json object = nlohmann::json::parse(file, nullptr, false);
  if (!object.is_object()) return makeError("{}: is damaged; remove it", path);
  return object;
}

Status run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3)
    return makeError("usage: measure_meshes RESULT.json CACHE.json WEB.json|- INPUT...");
  const std::string& cachePath = arguments[1];
  TERRANE_ASSIGN(nlohmann::json cache, readObject(cachePath));
  nlohmann::json web;
  if (arguments[2] != "-") {
    TERRANE_ASSIGN(web, readObject(arguments[2]));
  }
  TERRANE_ASSIGN(const std::vector<MeshInput> inputs, meshInputsFrom(std::span(arguments).subspan(3)));

  BenchResult result;
  result.bench = "meshes";
  std::vector<Outcome> outcomes;
  for (const MeshInput& input : inputs) {
    TERRANE_ASSIGN(const StoredPyramid pyramid, StoredPyramid::open(input.datasets.front()));
    TERRANE_ASSIGN(const std::vector<SourceTile> source, readSourceTiles(input.raster, pyramid.manifest()));
    for (size_t setting = 0; setting < kMeshSettings.size(); ++setting) {
      TERRANE_ASSIGN(const Outcome outcome, measureSetting(input, setting, source, web, cache));
      TERRANE_TRY(writeTextFile(cachePath, cache.dump(1) + "\n"));
      std::fprintf(stderr, "%s, %s: %.2f bits a triangle, %.3f of the paper's form\n", input.name.c_str(),
                   kMeshSettings[setting].name, outcome.ours.bits / outcome.ours.triangles,
                   outcome.ours.bits / outcome.paper.bits);
      outcomes.push_back(outcome);
      result.rows.push_back(rowOf(input, outcome));
    }
  }
  setBars(outcomes, result);
  return finishBench(result, arguments[0]);
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  return terrane::benchMain("measure_meshes", argc, argv, terrane::run);
}
