#include "imagery_build.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "terrane/dataset/pmtiles.h"

namespace terrane {

namespace {

constexpr size_t kTileBytes = static_cast<size_t>(kImageryTexels) * 4;

/// Room for any payload: a block of a sparse file, of which it takes what it needs.
constexpr size_t kMostPayloadBytes = size_t{1} << 19;

/// What a job leaves beside its texels and its payload.
struct Made {
  uint32_t bytes = 0;  ///< of the payload; 0: the tile is empty, and nothing was stored
};

/// The tiles of one level in the making: row by row, as their jobs are numbered.
struct Level {
  std::vector<TileId> tiles;
  std::vector<Made> made;                ///< a tile
  std::unique_ptr<BlockStore> texels;    ///< a block a tile
  std::unique_ptr<BlockStore> payloads;  ///< the same

  int64_t find(TileId id) const {
    const auto at = std::lower_bound(tiles.begin(), tiles.end(), id);
    return at != tiles.end() && *at == id ? at - tiles.begin() : -1;
  }
};

/// The parents of the tiles that have something, in order.
std::vector<TileId> parentsOf(const Level& level) {
  std::vector<TileId> out;
  for (size_t i = 0; i < level.tiles.size(); ++i)
    if (level.made[i].bytes > 0) out.push_back(level.tiles[i].parent());
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

/// The number of tiles that all levels will have, to tell progress.
int64_t countTiles(std::vector<TileId> tiles) {
  int64_t count = 0;
  while (true) {
    count += static_cast<int64_t>(tiles.size());
    if (tiles.empty() || tiles.front().isRoot()) return count;
    for (TileId& id : tiles) id = id.parent();
    std::sort(tiles.begin(), tiles.end());
    tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
  }
}

bool touches(const PlacedPicture& picture, const Frame& frame, TileId id) {
  const double tile = std::ldexp(kImageryTileSide, frame.finestLevel - id.level);
  const double west = frame.originEasting + id.col * tile * frame.spacingX;
  const double north = frame.originNorthing - id.row * tile * frame.spacingY;
  return picture.east > west && picture.west < west + tile * frame.spacingX && picture.south < north &&
         picture.north > north - tile * frame.spacingY;
}

}  // namespace

ImageryTile halveImagery(const std::array<const ImageryTile*, 4>& children) {
  ImageryTile out;
  constexpr int kHalf = kImageryTileSide / 2;
  for (size_t quadrant = 0; quadrant < 4; ++quadrant) {
    if (children[quadrant] == nullptr) continue;
    const std::vector<uint8_t>& in = children[quadrant]->rgba;
    const auto left = static_cast<size_t>((quadrant & 1) * kHalf);
    const auto top = static_cast<size_t>((quadrant >> 1) * kHalf);
    for (size_t y = 0; y < kHalf; ++y) {
      const uint8_t* a = &in[8 * y * kImageryTileSide];
      const uint8_t* b = a + 4 * kImageryTileSide;
      uint8_t* to = &out.rgba[4 * ((top + y) * kImageryTileSide + left)];
      for (size_t x = 0; x < kHalf; ++x, a += 8, b += 8, to += 4) {
        const unsigned alpha = a[3] + a[7] + b[3] + b[7];
        if (alpha == 4 * 255) {
          for (int c = 0; c < 3; ++c)
            to[c] = static_cast<uint8_t>((a[c] + a[c + 4] + b[c] + b[c + 4] + 2) >> 2);
          to[3] = 255;
        } else if (alpha > 0) {
          for (int c = 0; c < 3; ++c) {
            const unsigned sum = a[c] * a[3] + a[c + 4] * a[7] + b[c] * b[3] + b[c + 4] * b[7];
            to[c] = static_cast<uint8_t>((sum + alpha / 2) / alpha);
          }
          to[3] = static_cast<uint8_t>((alpha + 3) >> 2);
        }
      }
    }
  }
  return out;
}

void layUnder(ImageryTile& tile, const ImageryTile& below) {
  for (size_t i = 0; i < kTileBytes; i += 4) {
    uint8_t* over = &tile.rgba[i];
    const uint8_t* under = &below.rgba[i];
    if (over[3] == 255 || under[3] == 0) continue;
    if (over[3] == 0) {
      std::copy_n(under, 4, over);
      continue;
    }
    const unsigned a = 255U * over[3];
    const unsigned b = (255U - over[3]) * under[3];
    for (int c = 0; c < 3; ++c)
      over[c] = static_cast<uint8_t>((a * over[c] + b * under[c] + (a + b) / 2) / (a + b));
    over[3] = static_cast<uint8_t>((a + b + 127) / 255);
  }
}

Status readFinestImagery(std::vector<std::unique_ptr<PictureSampler>>& samplers, const PlannedLayer& layer,
                         const ImageryFrame& frame, TileId id, ImageryTile& out) {
  // From the top down, until nothing below can be seen.
  constexpr size_t kMostOpen = 32;
  samplers.resize(layer.pictures.size());
  bool first = true;
  ImageryTile below;
  for (size_t i = layer.pictures.size(); i-- > 0;) {
    const PlacedPicture& picture = layer.pictures[i];
    if (!touches(picture, frame.frame, id)) continue;
    if (!samplers[i]) {
      const auto open = [](const auto& sampler) { return sampler != nullptr; };
      if (static_cast<size_t>(std::count_if(samplers.begin(), samplers.end(), open)) >= kMostOpen)
        for (auto& sampler : samplers) sampler.reset();
      TERRANE_ASSIGN(samplers[i], PictureSampler::open(picture, frame, id.level));
    }
    TERRANE_TRY(samplers[i]->read(id, first ? out : below));
    if (!first) layUnder(out, below);
    first = false;
    if (i > 0 && coverOf(out) == ImageryCover::Full) break;
  }
  if (first) std::fill(out.rgba.begin(), out.rgba.end(), uint8_t{0});
  return {};
}

Result<ImageryLayerRecord> buildImageryLayer(const ImageryPlan& plan, const PlannedLayer& layer,
                                             const std::string& path, const Scratch& scratch, Jobs& jobs,
                                             Progress& progress) {
  const int finest = layer.record.finestLevel;
  const std::string& name = layer.record.name;
  std::vector<Level> levels(static_cast<size_t>(finest) + 1);
  progress.beginStage(fmt::format("imagery {}", name), countTiles(layer.finestTiles), "tiles");
  const auto workerCount = static_cast<size_t>(jobs.workers().count());

  // The finest level from the pictures, each coarser one from the one before.
  std::vector<std::vector<std::unique_ptr<PictureSampler>>> samplers(workerCount);
  std::vector<ImageryTile> tiles(workerCount);
  std::vector<std::array<ImageryTile, 4>> children(workerCount);
  for (int l = finest; l >= 0; --l) {
    Level& level = levels[static_cast<size_t>(l)];
    const Level* below = l < finest ? &levels[static_cast<size_t>(l) + 1] : nullptr;
    level.tiles = below == nullptr ? layer.finestTiles : parentsOf(*below);
    level.texels =
        std::make_unique<BlockStore>(kTileBytes, scratch, fmt::format("imagery-{}-{}-texels", name, l));
    level.payloads = std::make_unique<BlockStore>(kMostPayloadBytes, scratch,
                                                  fmt::format("imagery-{}-{}-payloads", name, l));

    const auto makeTile = [&](int worker, TileId id, ImageryTile& tile) -> Status {
      if (below == nullptr)
        return readFinestImagery(samplers[static_cast<size_t>(worker)], layer, plan.frame, id, tile);
      std::array<const ImageryTile*, 4> four{};
      for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const int64_t at = below->find(id.child(quadrant));
        if (at < 0 || below->made[static_cast<size_t>(at)].bytes == 0) continue;
        ImageryTile& child = children[static_cast<size_t>(worker)][static_cast<size_t>(quadrant)];
        TERRANE_TRY(below->texels->readValues(static_cast<uint64_t>(at), std::span(child.rgba)));
        four[static_cast<size_t>(quadrant)] = &child;
      }
      tile = halveImagery(four);
      return {};
    };
    auto made = jobs.run<Made>(
        fmt::format("imagery-{} {}", name, l), static_cast<int64_t>(level.tiles.size()), &progress,
        [&](int worker, int64_t i) -> Result<Made> {
          ImageryTile& tile = tiles[static_cast<size_t>(worker)];
          TERRANE_TRY(makeTile(worker, level.tiles[static_cast<size_t>(i)], tile));
          if (coverOf(tile) == ImageryCover::None) return Made{};
          if (l > 0)
            TERRANE_TRY(
                level.texels->writeValues(static_cast<uint64_t>(i), std::span<const uint8_t>(tile.rgba)));
          const std::vector<uint8_t> payload = l > 0 ? encodeImagery(tile, plan.format, plan.quality)
                                                     : encodeImageryRoot(tile, plan.format, plan.quality);
          TERRANE_TRY(
              level.payloads->writeValues(static_cast<uint64_t>(i), std::span<const uint8_t>(payload)));
          return Made{static_cast<uint32_t>(payload.size())};
        });
    if (!made.ok()) return made.error();
    level.made = std::move(made).value();
    if (below == nullptr) samplers.clear();
  }

  // The archive, in its own order.
  ImageryLayerRecord record = layer.record;
  struct Stored {
    uint64_t id;
    const Level* level;
    size_t index;
  };
  std::vector<Stored> order;
  for (const Level& level : levels) {
    for (size_t i = 0; i < level.tiles.size(); ++i)
      if (level.made[i].bytes > 0) order.push_back({pmtilesId(level.tiles[i]), &level, i});
  }
  if (order.empty()) return record;
  std::sort(order.begin(), order.end(), [](const Stored& a, const Stored& b) { return a.id < b.id; });
  record.tileCount = order.size();
  std::optional<PmtilesWriter> writer;
  const Status done = jobs.runInOrder<PmtilesPlace>(
      fmt::format("archive-{}", name), static_cast<int64_t>(order.size()), nullptr,
      [&](std::span<const PmtilesPlace> before) -> Status {
        TERRANE_ASSIGN(writer, PmtilesWriter::goOn(path, before));
        return {};
      },
      [&](int, int64_t i) -> Result<std::vector<uint8_t>> {
        const Stored& stored = order[static_cast<size_t>(i)];
        std::vector<uint8_t> payload(stored.level->made[stored.index].bytes);
        TERRANE_TRY(stored.level->payloads->readValues(stored.index, std::span(payload)));
        return payload;
      },
      [&](int64_t i, const std::vector<uint8_t>& payload) {
        const Stored& stored = order[static_cast<size_t>(i)];
        return writer->add(stored.level->tiles[stored.index], payload);
      });
  TERRANE_TRY(done);
  TERRANE_TRY(writer->finish(R"({"name":"imagery","format":"terrane imagery payload 1"})"));

  // What is covered: the stored tiles of the finest level within the pictures.
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::array<double, 4> pictures = {kFar, kFar, -kFar, -kFar};
  for (const PlacedPicture& picture : layer.pictures) {
    pictures = {std::min(pictures[0], picture.west), std::min(pictures[1], picture.south),
                std::max(pictures[2], picture.east), std::max(pictures[3], picture.north)};
  }
  std::array<double, 4> stored = {kFar, kFar, -kFar, -kFar};
  const Frame& frame = plan.frame.frame;
  const double side = std::ldexp(kImageryTileSide, frame.finestLevel - finest);
  const Level& level = levels[static_cast<size_t>(finest)];
  for (size_t i = 0; i < level.tiles.size(); ++i) {
    if (level.made[i].bytes == 0) continue;
    const double west = frame.originEasting + level.tiles[i].col * side * frame.spacingX;
    const double north = frame.originNorthing - level.tiles[i].row * side * frame.spacingY;
    stored = {std::min(stored[0], west), std::min(stored[1], north - side * frame.spacingY),
              std::max(stored[2], west + side * frame.spacingX), std::max(stored[3], north)};
  }
  record.bounds = {std::max(pictures[0], stored[0]), std::max(pictures[1], stored[1]),
                   std::min(pictures[2], stored[2]), std::min(pictures[3], stored[3])};
  return record;
}

std::string describeImageryPlan(const ImageryPlan& plan) {
  std::string text;
  for (const PlannedLayer& layer : plan.layers) {
    const ImageryLayerRecord& record = layer.record;
    text += fmt::format("imagery {} payload 2 format {} quality {} level {} tiles {} attribution {}\n",
                        record.name, static_cast<int>(plan.format), plan.quality, record.finestLevel,
                        layer.finestTiles.size(), record.attribution);
    for (const auto& [low, high] : record.stretch)
      text += fmt::format("stretch {:.17g} {:.17g}\n", low, high);
    for (const PlacedPicture& picture : layer.pictures) {
      text += fmt::format("picture {}\n", picture.input.bandsText());
      for (const InputRecord& input : picture.input.records) {
        text += fmt::format("input {} {} bytes {} {} x {} {} crs {} nodata {}\n", input.name, input.sha256,
                            input.bytes, input.width, input.height, input.dataType, input.sourceCrs,
                            input.noData);
      }
    }
  }
  return text;
}

uint64_t roomForImagery(const ImageryPlan& plan) {
  // Texels, and the payload twice, with what rounding up to the disk's blocks takes.
  constexpr uint64_t kPayloadBytes = 40'000;
  uint64_t tiles = 0;
  for (const PlannedLayer& layer : plan.layers) tiles += static_cast<uint64_t>(countTiles(layer.finestTiles));
  return tiles * (kTileBytes + 2 * kPayloadBytes);
}

}  // namespace terrane
