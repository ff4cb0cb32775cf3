#include "imagery_build.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "block_store.h"
#include "terrane/dataset/hash.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {

namespace {

constexpr size_t kTileBytes = static_cast<size_t>(kImageryTexels) * 4;

/// Payloads in the order in which they come to be; a file that nobody sees and that goes with the program.
class PayloadSpool {
 public:
  explicit PayloadSpool(std::string folder) : folder_(std::move(folder)) {}
  ~PayloadSpool() {
    if (file_ >= 0) close(file_);
  }
  PayloadSpool(const PayloadSpool&) = delete;
  PayloadSpool& operator=(const PayloadSpool&) = delete;

  struct Place {
    uint64_t offset = 0;
    uint32_t bytes = 0;  ///< 0: nothing was stored
  };

  Status open() {
    std::string name = folder_ + "/imagery-XXXXXX";
    file_ = mkostemp(name.data(), O_CLOEXEC);
    if (file_ < 0) return makeError("{}: no scratch file can be made: {}", folder_, std::strerror(errno));
    unlink(name.c_str());
    return {};
  }
  /// From any thread.
  Result<Place> write(std::span<const uint8_t> payload) {
    const Place place{end_.fetch_add(payload.size()), static_cast<uint32_t>(payload.size())};
    for (size_t done = 0; done < payload.size();) {
      const ssize_t count = pwrite(file_, payload.data() + done, payload.size() - done,
                                   static_cast<off_t>(place.offset + done));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0)
        return makeError("{}: a scratch file cannot be written: {}; make room, or choose another folder",
                         folder_, std::strerror(errno));
      done += static_cast<size_t>(count);
    }
    return place;
  }
  Status read(Place place, std::vector<uint8_t>& payload) const {
    payload.resize(place.bytes);
    for (size_t done = 0; done < payload.size();) {
      const ssize_t count =
          pread(file_, payload.data() + done, payload.size() - done, static_cast<off_t>(place.offset + done));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0)
        return makeError("{}: a scratch file cannot be read: {}", folder_, std::strerror(errno));
      done += static_cast<size_t>(count);
    }
    return {};
  }

 private:
  std::string folder_;
  int file_ = -1;
  std::atomic<uint64_t> end_{0};
};

/// The tiles of one level in the making: row by row, as their jobs are numbered.
struct Level {
  std::vector<TileId> tiles;
  std::vector<PayloadSpool::Place> payloads;  ///< a tile
  std::unique_ptr<BlockStore> texels;         ///< a block a tile

  int64_t find(TileId id) const {
    const auto at = std::lower_bound(tiles.begin(), tiles.end(), id);
    return at != tiles.end() && *at == id ? at - tiles.begin() : -1;
  }
};

/// The parents of the tiles that have something, in order.
std::vector<TileId> parentsOf(const Level& level) {
  std::vector<TileId> out;
  for (size_t i = 0; i < level.tiles.size(); ++i)
    if (level.payloads[i].bytes > 0) out.push_back(level.tiles[i].parent());
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
                                             const std::string& folder, uint64_t memoryBytes,
                                             const Workers& workers, Progress& progress) {
  const int finest = layer.record.finestLevel;
  PayloadSpool spool(folder);
  TERRANE_TRY(spool.open());
  std::vector<Level> levels(static_cast<size_t>(finest) + 1);
  progress.beginStage(fmt::format("imagery {}", layer.record.name), countTiles(layer.finestTiles), "tiles");
  const auto workerCount = static_cast<size_t>(workers.count());

  // The finest level from the pictures, each coarser one from the one before.
  std::vector<std::vector<std::unique_ptr<PictureSampler>>> samplers(workerCount);
  std::vector<ImageryTile> scratch(workerCount);
  std::vector<std::array<ImageryTile, 4>> children(workerCount);
  for (int l = finest; l >= 0; --l) {
    Level& level = levels[static_cast<size_t>(l)];
    Level* below = l < finest ? &levels[static_cast<size_t>(l) + 1] : nullptr;
    level.tiles = below == nullptr ? layer.finestTiles : parentsOf(*below);
    level.payloads.resize(level.tiles.size());
    level.texels = std::make_unique<BlockStore>(kTileBytes, memoryBytes / 2, folder);

    const auto makeTile = [&](int worker, TileId id, ImageryTile& tile) -> Status {
      if (below == nullptr)
        return readFinestImagery(samplers[static_cast<size_t>(worker)], layer, plan.frame, id, tile);
      std::array<const ImageryTile*, 4> four{};
      for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const int64_t at = below->find(id.child(quadrant));
        if (at < 0 || below->payloads[static_cast<size_t>(at)].bytes == 0) continue;
        ImageryTile& child = children[static_cast<size_t>(worker)][static_cast<size_t>(quadrant)];
        TERRANE_TRY(below->texels->readValues(static_cast<uint64_t>(at), std::span(child.rgba)));
        four[static_cast<size_t>(quadrant)] = &child;
      }
      tile = halveImagery(four);
      return {};
    };
    const Status done =
        workers.forEach(static_cast<int64_t>(level.tiles.size()), [&](int worker, int64_t i) -> Status {
          ImageryTile& tile = scratch[static_cast<size_t>(worker)];
          TERRANE_TRY(makeTile(worker, level.tiles[static_cast<size_t>(i)], tile));
          progress.advance(1);
          if (coverOf(tile) == ImageryCover::None) return {};
          if (l > 0)
            TERRANE_TRY(
                level.texels->writeValues(static_cast<uint64_t>(i), std::span<const uint8_t>(tile.rgba)));
          TERRANE_ASSIGN(level.payloads[static_cast<size_t>(i)],
                         spool.write(encodeImagery(tile, plan.format, plan.quality)));
          return {};
        });
    TERRANE_TRY(done);
    if (below != nullptr) below->texels.reset();
    if (below == nullptr) samplers.clear();
  }

  // The archive, in its own order.
  ImageryLayerRecord record = layer.record;
  std::vector<std::pair<uint64_t, std::pair<TileId, PayloadSpool::Place>>> order;
  for (const Level& level : levels) {
    for (size_t i = 0; i < level.tiles.size(); ++i)
      if (level.payloads[i].bytes > 0)
        order.push_back({pmtilesId(level.tiles[i]), {level.tiles[i], level.payloads[i]}});
  }
  if (order.empty())
    return makeError(
        "{}: imagery layer '{}' has no texel over the elevation (all is nodata or transparent); "
        "leave it out, or pass --imagery-nodata",
        layer.pictures.front().input.raster.path, record.name);
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  record.tileCount = order.size();
  const std::string path = folder + "/" + record.archive;
  TERRANE_ASSIGN(PmtilesWriter writer, PmtilesWriter::create(path));
  std::vector<uint8_t> payload;
  for (const auto& [id, tile] : order) {
    TERRANE_TRY(spool.read(tile.second, payload));
    TERRANE_TRY(writer.add(tile.first, payload));
  }
  TERRANE_TRY(writer.finish(R"({"name":"imagery","format":"terrane imagery payload 1"})"));

  // What is covered: the stored tiles of the finest level within the pictures.
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::array<double, 4> pictures = {kFar, kFar, -kFar, -kFar};
  for (const PlacedPicture& picture : layer.pictures) {
    pictures = {std::min(pictures[0], picture.west), std::min(pictures[1], picture.south),
                std::max(pictures[2], picture.east), std::max(pictures[3], picture.north)};
  }
  std::array<double, 4> tiles = {kFar, kFar, -kFar, -kFar};
  const Frame& frame = plan.frame.frame;
  const double side = std::ldexp(kImageryTileSide, frame.finestLevel - finest);
  const Level& level = levels[static_cast<size_t>(finest)];
  for (size_t i = 0; i < level.tiles.size(); ++i) {
    if (level.payloads[i].bytes == 0) continue;
    const double west = frame.originEasting + level.tiles[i].col * side * frame.spacingX;
    const double north = frame.originNorthing - level.tiles[i].row * side * frame.spacingY;
    tiles = {std::min(tiles[0], west), std::min(tiles[1], north - side * frame.spacingY),
             std::max(tiles[2], west + side * frame.spacingX), std::max(tiles[3], north)};
  }
  record.bounds = {std::max(pictures[0], tiles[0]), std::max(pictures[1], tiles[1]),
                   std::min(pictures[2], tiles[2]), std::min(pictures[3], tiles[3])};
  return record;
}

Status buildImagery(const ImageryPlan& plan, const std::string& folder, uint64_t memoryBytes,
                    const Workers& workers, Progress& progress, Manifest& manifest) {
  for (const PlannedLayer& layer : plan.layers) {
    TERRANE_ASSIGN(ImageryLayerRecord record,
                   buildImageryLayer(plan, layer, folder, memoryBytes, workers, progress));
    const std::string path = folder + "/" + record.archive;
    std::error_code code;
    ArchiveRecord archive{record.archive, static_cast<uint64_t>(std::filesystem::file_size(path, code)), {}};
    if (code) return makeError("{}: {}", path, code.message());
    TERRANE_ASSIGN(archive.sha256, sha256OfFile(path));
    manifest.archives.push_back(std::move(archive));
    manifest.imagery.push_back(std::move(record));
  }
  return {};
}

}  // namespace terrane
