#include "terrane/bake/verify.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <set>

#include "node_measure.h"
#include "pyramid_steps.h"
#include "terrane/codec/all_layers.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/hash.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

namespace fs = std::filesystem;

constexpr size_t kFaultsKept = 20;

/// Collects faults from any thread.
class Faults {
 public:
  explicit Faults(VerifyReport& report) : report_(report) {}
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    const std::lock_guard lock(mutex_);
    ++report_.faultCount;
    if (report_.faults.size() < kFaultsKept)
      report_.faults.push_back(fmt::format(format, std::forward<Args>(args)...));
  }
  bool any() const {
    const std::lock_guard lock(mutex_);
    return report_.faultCount > 0;
  }

 private:
  mutable std::mutex mutex_;
  VerifyReport& report_;
};

/// What a tile states, beside its samples.
struct Stated {
  TileNodes nodes;
  std::array<ChildSummary, 4> children;
  Coverage coverage;
};

class Verifier {
 public:
  Verifier(const Dataset& dataset, const Workers& workers, Scratch scratch, VerifyReport& report,
           Progress& progress)
      : dataset_(dataset),
        manifest_(dataset.manifest()),
        workers_(workers),
        jobs_(workers, nullptr),
        scratch_(std::move(scratch)),
        pyramid_(manifest_.frame.finestLevel, scratch_, manifest_.scale.layerCount),
        stated_(pyramid_.levels.size()),
        report_(report),
        faults_(report),
        progress_(progress) {}

  Status run() {
    TERRANE_TRY(checkFiles());
    TERRANE_TRY(checkImagery());
    if (!listTiles()) return {};
    TERRANE_TRY(decodeTiles());
    // What follows needs all samples.
    if (faults_.any()) return {};
    TERRANE_TRY(checkBorders());
    TERRANE_TRY(checkCoverage());
    NodeStores stores(scratch_);
    TERRANE_ASSIGN(const GroundRange measured, measureNodes(pyramid_, stores, jobs_, progress_));
    TERRANE_TRY(saturateNodes(pyramid_, stores, manifest_.scale, manifest_.maxErrorMeters, jobs_));
    TERRANE_TRY(takeNodes(pyramid_, stores));
    takeStatedNodes();
    TERRANE_TRY(checkNodes());
    checkManifestNumbers(measured);
    return {};
  }

 private:
  // ---- files

  Status checkFiles() {
    progress_.beginStage("hashing", static_cast<int64_t>(manifest_.archives.size()), "files");
    std::set<std::string> known = {"manifest.json"};
    for (const ArchiveRecord& archive : manifest_.archives) {
      known.insert(archive.name);
      const std::string path = dataset_.directory() + "/" + archive.name;
      std::error_code code;
      const auto bytes = static_cast<uint64_t>(fs::file_size(path, code));
      if (code) {
        faults_.add("{}: cannot be read: {}", path, code.message());
        continue;
      }
      report_.bytes += bytes;
      if (bytes != archive.bytes)
        faults_.add("{}: has {} bytes, the manifest says {}", path, bytes, archive.bytes);
      const auto hash = sha256OfFile(path);
      if (!hash.ok()) {
        faults_.add("{}", hash.error().message);
      } else if (*hash != archive.sha256) {
        faults_.add("{}: its SHA-256 is not the manifest's: the file was changed", path);
      }
      progress_.advance(1);
      TERRANE_TRY(workers_.checkCancelled());
    }
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(dataset_.directory(), ignored)) {
      const std::string name = entry.path().filename().string();
      if (!known.contains(name))
        progress_.warn(fmt::format("{}: is not part of the dataset; not checked", entry.path().string()));
    }
    return {};
  }

  // ---- tiles

  /// The tiles that the archive holds, as a pyramid; false where they cannot form one.
  bool listTiles() {
    std::vector<TileId> ids = dataset_.elevationTiles();
    std::sort(ids.begin(), ids.end());
    report_.tiles = ids.size();
    if (ids.size() != manifest_.tileCount) {
      faults_.add("the archive holds {} tiles, the manifest says {}", ids.size(), manifest_.tileCount);
    }
    if (ids.empty() || !ids.front().isRoot()) {
      faults_.add("the root tile 0/0/0 is missing");
      return false;
    }
    bool fine = true;
    int64_t blocks = 0;
    for (const TileId id : ids) {
      if (!id.valid() || id.level > pyramid_.finestLevel()) {
        faults_.add("tile {}: deeper than the dataset's finest level {}", toString(id),
                    pyramid_.finestLevel());
        fine = false;
      } else if (!id.isRoot() && pyramid_.find(id.parent()) < 0) {
        faults_.add("tile {}: its parent is not stored", toString(id));
        fine = false;
      } else {
        PyramidTile tile;
        tile.id = id;
        tile.block = blocks++;
        pyramid_.levels[static_cast<size_t>(id.level)].push_back(tile);
      }
    }
    if (fine) pyramid_.link();
    for (size_t level = 0; level < stated_.size(); ++level)
      stated_[level].resize(pyramid_.levels[level].size());
    return fine;
  }

  Status decodeTiles() {
    progress_.beginStage("decoding", static_cast<int64_t>(report_.tiles), "tiles");
    std::vector<TileSamples> parents(static_cast<size_t>(workers_.count()));
    TERRANE_TRY(decodeTile({0, 0, 0}, 0, nullptr));
    for (size_t level = 1; level < pyramid_.levels.size(); ++level) {
      const auto& above = pyramid_.levels[level - 1];
      const Status done =
          workers_.forEach(static_cast<int64_t>(above.size()), [&](int worker, int64_t i) -> Status {
            const PyramidTile& parent = above[static_cast<size_t>(i)];
            TileSamples& samples = parents[static_cast<size_t>(worker)];
            // note: a parent that could not be decoded has no samples, nor have its children then.
            if (!isDecoded(parent) || *std::max_element(parent.children.begin(), parent.children.end()) < 0)
              return {};
            TERRANE_TRY(pyramid_.readSamples(parent, samples));
            for (const int32_t child : parent.children) {
              if (child < 0) continue;
              TERRANE_TRY(decodeTile(pyramid_.levels[level][static_cast<size_t>(child)].id, child, &samples));
            }
            return {};
          });
      TERRANE_TRY(done);
    }
    return {};
  }

  Status decodeTile(TileId id, int index, const TileSamples* parent) {
    const auto payloads = dataset_.readAllLayers(id);
    progress_.advance(1);
    if (!payloads.ok() || !payloads->has_value()) {
      faults_.add("tile {}: {}", toString(id),
                  payloads.ok() ? "is listed but not there" : payloads.error().message);
      return {};
    }
    auto decoded =
        decodeAllLayers(**payloads, parent, parent != nullptr ? id.quadrant() : 0, manifest_.scale);
    if (!decoded.ok()) {
      faults_.add("tile {}: {}", toString(id), decoded.error().message);
      return {};
    }
    PyramidTile& tile = pyramid_.levels[static_cast<size_t>(id.level)][static_cast<size_t>(index)];
    TERRANE_TRY(pyramid_.writeRawHeights(tile, decoded->samples.heights));
    const auto& states = decoded->samples.states;
    if (std::any_of(states.begin(), states.end(),
                    [](SampleState state) { return state != SampleState::Coded; })) {
      TERRANE_TRY(pyramid_.writeStates(tile, states));
      tile.hasStates = true;
    }
    const auto& layers = decoded->samples.layers;
    if (std::any_of(layers.begin(), layers.end(), [](uint8_t layer) { return layer != 0; })) {
      TERRANE_TRY(pyramid_.writeLayers(tile, layers));
      tile.hasLayers = true;
    }
    tile.complete = std::find(states.begin(), states.end(), SampleState::Void) == states.end();
    checkClosure(id, decoded->samples);
    checkLayers(id, decoded->samples);
    Stated& stated = stated_[static_cast<size_t>(id.level)][static_cast<size_t>(index)];
    checkChildren(tile, *decoded);
    stated.nodes = std::move(decoded->nodes);
    stated.children = decoded->children;
    stated.coverage = std::move(decoded->samples.coverage);
    return {};
  }

  /// Samples that are coded need coded parents: with inputs of one level, what is significant is closed under
  /// "parent of", in each layer. note: samples on larger multiples than this are always coded, and of a
  /// border sample's two parents one may lie in the neighbour, which has the sample too.
  void checkClosure(TileId id, const TileSamples& samples) {
    const auto& inputs = manifest_.inputs;
    const bool mixed = std::any_of(inputs.begin(), inputs.end(), [&](const InputRecord& input) {
      return input.nativeLevel != inputs.front().nativeLevel;
    });
    if (mixed) return;
    const auto indexOf = [](LatticePoint p) { return static_cast<size_t>(p.y * kTileSamples + p.x); };
    const Lattice lattice(0);
    int orphans = 0, layerOrphans = 0;
    for (int level = id.isRoot() ? 0 : lattice.deepestLevel() - 1; level <= lattice.deepestLevel(); ++level) {
      const int s = lattice.halfSize(level);
      const bool quads = level % 2 == 0;
      for (int y = quads ? s : 0; y <= kTileCells; y += quads ? 2 * s : s) {
        for (int x = quads ? s : (y / s % 2 == 0 ? s : 0); x <= kTileCells; x += 2 * s) {
          const size_t at = indexOf({x, y});
          if (samples.states[at] != SampleState::Coded) continue;
          for (const LatticePoint apex : lattice.apexes({x, y, level})) {
            const size_t above = indexOf(apex);
            if (samples.states[above] == SampleState::Interpolated) ++orphans;
            if (samples.states[above] == SampleState::Coded && samples.layerAt(above) > samples.layerAt(at))
              ++layerOrphans;
          }
        }
      }
    }
    if (orphans > 0)
      faults_.add("tile {}: {} coded samples have an interpolated parent", toString(id), orphans);
    if (layerOrphans > 0)
      faults_.add("tile {}: {} samples have a parent of a later layer", toString(id), layerOrphans);
  }

  /// How far the samples of each layer but the last are from what all of them make.
  void checkLayers(TileId id, const TileSamples& samples) {
    const ElevationScale& scale = manifest_.scale;
    for (int layer = 0; layer + 1 < scale.layerCount; ++layer) {
      const TileSamples early = samplesOfLayer(samples, layer);
      double largest = 0.0;
      for (size_t i = 0; i < samples.heights.size(); ++i) {
        if (samples.states[i] == SampleState::Void) continue;
        const double off = static_cast<double>(early.heights[i]) - static_cast<double>(samples.heights[i]);
        largest = std::max(largest, std::abs(off));
      }
      if (largest > scale.layerOffset(layer)) {
        faults_.add("tile {}: with the layers up to {}, a sample is off by {:.4f} m, {:g} m are allowed",
                    toString(id), layer, largest, scale.layerOffset(layer));
      }
    }
  }

  bool isDecoded(const PyramidTile& tile) const {
    const int index = pyramid_.find(tile.id);
    return !stated_[static_cast<size_t>(tile.id.level)][static_cast<size_t>(index)].nodes.error.empty();
  }

  /// What the tile says of children that are not stored, and whether those that it calls present are.
  void checkChildren(const PyramidTile& tile, const Tile& decoded) {
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      const ChildSummary& said = decoded.children[static_cast<size_t>(quadrant)];
      const bool present = tile.children[static_cast<size_t>(quadrant)] >= 0;
      if (present != (said.state == ChildState::Present)) {
        faults_.add("tile {}: calls its child {} {}, which is {}", toString(tile.id), quadrant,
                    said.state == ChildState::Present ? "present" : "missing",
                    present ? "stored" : "not stored");
      }
      if (present) continue;
      const ChildSummary expected =
          summariseMissingChild(decoded.samples, decoded.nodes, tile.id.isRoot(), quadrant);
      if (said.state != expected.state || said.low > expected.low || said.high < expected.high) {
        faults_.add("tile {}: its summary of the missing child {} does not hold", toString(tile.id),
                    quadrant);
      }
    }
  }

  // ---- imagery

  /// That every tile decodes, and has its parent.
  Status checkImagery() {
    for (size_t layer = 0; layer < manifest_.imagery.size(); ++layer) {
      const ImageryLayerRecord& record = manifest_.imagery[layer];
      std::vector<TileId> ids = dataset_.imageryTiles(layer);
      std::sort(ids.begin(), ids.end());
      report_.imageryTiles += ids.size();
      progress_.beginStage(fmt::format("imagery {}", record.name), static_cast<int64_t>(ids.size()), "tiles");
      const Status done = workers_.forEach(static_cast<int64_t>(ids.size()), [&](int, int64_t i) -> Status {
        const TileId id = ids[static_cast<size_t>(i)];
        const auto said = [&](const std::string& what) {
          faults_.add("{}: tile {}: {}", record.archive, toString(id), what);
        };
        progress_.advance(1);
        if (!id.valid() || id.level > record.finestLevel) {
          said(fmt::format("deeper than the layer's finest level {}", record.finestLevel));
        } else if (!id.isRoot() && !std::binary_search(ids.begin(), ids.end(), id.parent())) {
          said("its parent is not stored");
        }
        const auto bytes = dataset_.readImagery(layer, id);
        if (!bytes.ok() || !bytes->has_value()) {
          said(bytes.ok() ? "is listed but not there" : bytes.error().message);
          return {};
        }
        const auto tile = decodeImagery(**bytes);
        if (!tile.ok())
          said(tile.error().message);
        else if (coverOf(*tile) == ImageryCover::None)
          said("is empty, and should not be stored");
        return {};
      });
      TERRANE_TRY(done);
    }
    return {};
  }

  // ---- borders

  struct BorderScratch {
    TileSamples own;
    TileSamples other;
  };

  Status checkBorders() {
    progress_.beginStage("borders", static_cast<int64_t>(report_.tiles), "tiles");
    std::vector<BorderScratch> scratches(static_cast<size_t>(workers_.count()));
    for (const auto& tiles : pyramid_.levels) {
      const Status done = workers_.forEach(static_cast<int64_t>(tiles.size()), [&](int worker, int64_t i) {
        progress_.advance(1);
        return checkBordersOf(tiles[static_cast<size_t>(i)], scratches[static_cast<size_t>(worker)]);
      });
      TERRANE_TRY(done);
    }
    return {};
  }

  /// Compares with the neighbours that come later, corners included, and with those that are not stored.
  Status checkBordersOf(const PyramidTile& tile, BorderScratch& scratch) {
    TERRANE_TRY(pyramid_.readSamples(tile, scratch.own));
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const TileId id{tile.id.level, tile.id.col + dx, tile.id.row + dy};
        if ((dx == 0 && dy == 0) || !id.valid()) continue;
        const int index = pyramid_.find(id);
        if (index < 0) {
          checkAgainstInterpolation(tile.id, scratch.own, dx, dy);
        } else if (dy > 0 || (dy == 0 && dx > 0)) {
          TERRANE_TRY(pyramid_.readSamples(
              pyramid_.levels[static_cast<size_t>(id.level)][static_cast<size_t>(index)], scratch.other));
          compareBorder(tile.id, scratch.own, id, scratch.other, dx, dy);
        }
      }
    }
    return {};
  }

  /// The samples of the border towards (dx, dy): first, last and the steps between them.
  struct Border {
    int x0, y0, stepX, stepY, count;
  };
  static Border borderTowards(int dx, int dy) {
    const int x = dx > 0 ? kTileCells : 0;
    const int y = dy > 0 ? kTileCells : 0;
    return {x, y, dx == 0 ? 1 : 0, dy == 0 ? 1 : 0, dx != 0 && dy != 0 ? 1 : kTileSamples};
  }

  void compareBorder(TileId a, const TileSamples& own, TileId b, const TileSamples& other, int dx, int dy) {
    const Border border = borderTowards(dx, dy);
    const Border opposite = borderTowards(-dx, -dy);
    int differences = 0;
    for (int i = 0; i < border.count; ++i) {
      const auto here =
          static_cast<size_t>((border.y0 + i * border.stepY) * kTileSamples + border.x0 + i * border.stepX);
      const auto there = static_cast<size_t>((opposite.y0 + i * opposite.stepY) * kTileSamples + opposite.x0 +
                                             i * opposite.stepX);
      const bool sameGround =
          (own.states[here] == SampleState::Void) == (other.states[there] == SampleState::Void);
      const bool sameLayer = own.states[here] != SampleState::Coded ||
                             other.states[there] != SampleState::Coded ||
                             own.layerAt(here) == other.layerAt(there);
      if (own.heights[here] != other.heights[there] || !sameGround || !sameLayer) ++differences;
    }
    if (differences > 0)
      faults_.add("tiles {} and {}: {} samples of their border differ", toString(a), toString(b),
                  differences);
  }

  /// A neighbour that is not stored has means between the samples that the parents share.
  void checkAgainstInterpolation(TileId id, const TileSamples& own, int dx, int dy) {
    const Border border = borderTowards(dx, dy);
    if (id.isRoot() || border.count == 1) return;
    const int step = border.stepY * kTileSamples + border.stepX;
    int differences = 0;
    for (int i = 1; i < border.count; i += 2) {
      const int at = border.y0 * kTileSamples + border.x0 + i * step;
      const auto height = [&](int index) { return own.heights[static_cast<size_t>(index)]; };
      if (height(at) != (height(at - step) + height(at + step)) * 0.5F) ++differences;
    }
    if (differences > 0) {
      faults_.add("tile {}: {} samples of its border differ from the neighbour's, which is interpolated",
                  toString(id), differences);
    }
  }

  // ---- coverage

  Status checkCoverage() {
    TERRANE_ASSIGN(const double cells, coverTiles(pyramid_, scratch_, jobs_));
    if (cells != manifest_.coveredCells)
      faults_.add("{} cells are ground, the manifest says {}", cells, manifest_.coveredCells);
    for (size_t level = 0; level < pyramid_.levels.size(); ++level) {
      for (size_t i = 0; i < pyramid_.levels[level].size(); ++i) {
        Coverage expected;
        TERRANE_TRY(pyramid_.readCoverage(pyramid_.levels[level][i], expected));
        const Coverage& said = stated_[level][i].coverage;
        if (expected.kind != said.kind || expected.bits != said.bits) {
          faults_.add("tile {}: its coverage does not follow from the samples below",
                      toString(pyramid_.levels[level][i].id));
        }
      }
    }
    return {};
  }

  // ---- nodes

  /// The stated codes where nodeCodesAt() looks for them.
  void takeStatedNodes() {
    for (size_t level = 0; level < pyramid_.levels.size(); ++level) {
      LevelNodes& nodes = pyramid_.nodes[level];
      nodes.errorCode.clear();
      nodes.lowCode.clear();
      nodes.highCode.clear();
      for (const Stated& stated : stated_[level]) {
        nodes.errorCode.insert(nodes.errorCode.end(), stated.nodes.error.begin(), stated.nodes.error.end());
        nodes.lowCode.insert(nodes.lowCode.end(), stated.nodes.low.begin(), stated.nodes.low.end());
        nodes.highCode.insert(nodes.highCode.end(), stated.nodes.high.begin(), stated.nodes.high.end());
      }
      report_.nodes += nodes.errorCode.size();
    }
  }

  Status checkNodes() {
    progress_.beginStage("nodes", static_cast<int64_t>(report_.tiles), "tiles");
    for (size_t level = 0; level < pyramid_.levels.size(); ++level) {
      const auto& tiles = pyramid_.levels[level];
      const Status done = workers_.forEach(static_cast<int64_t>(tiles.size()), [&](int, int64_t i) -> Status {
        checkNodesOf(static_cast<int>(level), static_cast<size_t>(i));
        progress_.advance(1);
        return {};
      });
      TERRANE_TRY(done);
    }
    return {};
  }

  void checkNodesOf(int level, size_t index) {
    const TileId id = pyramid_.levels[static_cast<size_t>(level)][index].id;
    const LevelNodes& nodes = pyramid_.nodes[static_cast<size_t>(level)];
    const bool isRoot = level == 0;
    const Lattice lattice(level);
    for (int node = 0; node < nodes.nodesPerTile; ++node) {
      const size_t at = index * static_cast<size_t>(nodes.nodesPerTile) + static_cast<size_t>(node);
      const NodePlace place = nodePlace(node, isRoot);
      const LatticePoint center{id.col * kTileCells + place.x, id.row * kTileCells + place.y};
      const NodeCodes said{nodes.errorCode[at], nodes.lowCode[at], nodes.highCode[at]};
      checkNode(id, place, at, said, nodes);

      // note: a quad-centre's children stand in the next level's tiles, at twice the coordinates.
      const bool below = place.nodeLevel == 8;
      if (below && level == pyramid_.finestLevel()) continue;
      const Diamond diamond{center.x, center.y, place.nodeLevel + 2 * level};
      for (const Diamond& child : lattice.children(diamond)) {
        const NodeCodes codes = below ? nodeCodesAt(pyramid_, level + 1, 7, {2 * child.x, 2 * child.y})
                                      : nodeCodesAt(pyramid_, level, place.nodeLevel + 1, child.center());
        if (codes.error < 0) continue;
        if (said.error <= codes.error) {
          faults_.add("tile {}: node at {}, {} has the error code {}, its child {}: not strictly saturated",
                      toString(id), place.x, place.y, said.error, codes.error);
        }
        if (said.low > codes.low || said.high < codes.high) {
          faults_.add("tile {}: node at {}, {} has a height range that does not hold its child's",
                      toString(id), place.x, place.y);
        }
      }
    }
    checkSummaries(level, index);
    checkLargeNodes(level, index);
  }

  /// The codes of larger patches follow from what was measured, so they have one right value.
  void checkLargeNodes(int level, size_t index) {
    const std::vector<uint8_t>& said = stated_[static_cast<size_t>(level)][index].nodes.largeError;
    const std::vector<uint8_t>& expected = pyramid_.nodes[static_cast<size_t>(level)].largeErrorCode;
    if (!std::equal(said.begin(), said.end(),
                    expected.begin() + static_cast<ptrdiff_t>(index * said.size()))) {
      faults_.add("tile {}: the error codes of its larger patches do not follow from the samples",
                  toString(pyramid_.levels[static_cast<size_t>(level)][index].id));
    }
  }

  /// One node against what was measured, and against its copy in a neighbour.
  void checkNode(TileId id, NodePlace place, size_t at, const NodeCodes& said, const LevelNodes& measured) {
    const double heightError = manifest_.maxErrorMeters;
    const ElevationScale& scale = manifest_.scale;
    const bool hasRange = measured.low[at] <= measured.high[at];
    if (hasRange) {
      const double low = static_cast<double>(measured.low[at]) - heightError;
      const double high = static_cast<double>(measured.high[at]) + heightError;
      if (said.low > scale.lowCode(low) || said.high < scale.highCode(high)) {
        faults_.add("tile {}: node at {}, {} has ground from {:.3f} to {:.3f} m outside its range",
                    toString(id), place.x, place.y, low, high);
      }
    }
    if (said.low <= said.high) {
      const double error = static_cast<double>(measured.error[at]) + heightError;
      if (said.error < scale.codeFromError(error)) {
        faults_.add("tile {}: node at {}, {} claims an error of {:.4f} m and has {:.4f} m", toString(id),
                    place.x, place.y, scale.errorFromCode(static_cast<uint8_t>(said.error)), error);
      }
    }
    const bool onBorder = place.x == 0 || place.y == 0 || place.x == kTileCells || place.y == kTileCells;
    if (!onBorder) return;
    const LatticePoint center{id.col * kTileCells + place.x, id.row * kTileCells + place.y};
    const NodeCodes other = nodeCodesAt(pyramid_, id.level, place.nodeLevel, center);
    if (other.error != said.error || other.low != said.low || other.high != said.high) {
      faults_.add("tile {}: node at {}, {} has other codes in the neighbour tile", toString(id), place.x,
                  place.y);
    }
  }

  /// What the tile says of the children that are stored.
  void checkSummaries(int level, size_t index) {
    const PyramidTile& tile = pyramid_.levels[static_cast<size_t>(level)][index];
    for (size_t quadrant = 0; quadrant < 4; ++quadrant) {
      const int32_t child = tile.children[quadrant];
      if (child < 0) continue;
      const TileNodes& nodes = stated_[static_cast<size_t>(level) + 1][static_cast<size_t>(child)].nodes;
      const ChildSummary& said = stated_[static_cast<size_t>(level)][index].children[quadrant];
      if (said.error != *std::max_element(nodes.error.begin(), nodes.error.end()) ||
          said.low != *std::min_element(nodes.low.begin(), nodes.low.end()) ||
          said.high != *std::max_element(nodes.high.begin(), nodes.high.end())) {
        faults_.add("tile {}: its summary of the child {} is not what that says itself", toString(tile.id),
                    quadrant);
      }
    }
  }

  void checkManifestNumbers(const GroundRange& measured) {
    const auto [low, high] = measured;
    if (low > high) return;
    if (static_cast<double>(low) != manifest_.minHeight || static_cast<double>(high) != manifest_.maxHeight) {
      faults_.add("heights reach from {} to {} m, the manifest says {} to {} m", low, high,
                  manifest_.minHeight, manifest_.maxHeight);
    }
    // note: older datasets do not tell; theirs is the usual one.
    const Frame& frame = manifest_.frame;
    const double rough =
        roughnessOf(pyramid_, manifest_.scale, std::max(frame.spacingXMeters(), frame.spacingYMeters()));
    const double said = manifest_.scale.roughness;
    if (said != ElevationScale{}.roughness && std::abs(said - rough) > 1e-9 * (1.0 + rough))
      faults_.add("the ground's roughness is {}, the manifest says {}", rough, said);
    const auto zero = zeroShareOf(pyramid_, manifest_.maxErrorMeters);
    if (manifest_.zeroShare && zero.ok() && std::abs(*zero - *manifest_.zeroShare) > 1e-12)
      faults_.add("a share of {} of the root's ground stands at 0, the manifest says {}", *zero,
                  *manifest_.zeroShare);
  }

  const Dataset& dataset_;
  const Manifest& manifest_;
  const Workers& workers_;
  Jobs jobs_;
  Scratch scratch_;
  Pyramid pyramid_;
  std::vector<std::vector<Stated>> stated_;
  VerifyReport& report_;
  Faults faults_;
  Progress& progress_;
};

}  // namespace

Result<VerifyReport> verifyDataset(const std::string& directory, const VerifyOptions& options,
                                   Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  TERRANE_ASSIGN(const Dataset dataset, Dataset::open(directory));
  const Workers workers(options.threads, options.cancel);
  VerifyReport report;
  std::error_code code;
  report.bytes = static_cast<uint64_t>(fs::file_size(directory + "/manifest.json", code));
  const std::string scratch =
      options.scratchFolder.empty() ? fs::temp_directory_path(code).string() : options.scratchFolder;
  Verifier verifier(dataset, workers, {scratch, false}, report, progress);
  TERRANE_TRY(verifier.run());
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace terrane
