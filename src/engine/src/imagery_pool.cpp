#include "terrane/engine/imagery_pool.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <unordered_set>

#include "terrane/base/parallel.h"

namespace terrane {

namespace {

constexpr int kSide = kImageryTileSide;
constexpr int kBordered = kSide + 2;
/// Tiles that are kept beyond those of the frame.
constexpr size_t kSpareTiles = 500;

/// A box in local coordinates, heights exaggerated.
struct Box {
  glm::dvec3 low, high;
};

double distanceTo(const Box& box, glm::dvec3 point) {
  return glm::length(glm::max(glm::max(box.low - point, point - box.high), glm::dvec3(0.0)));
}

bool maySee(const Camera& camera, const Box& box) {
  std::array<bool, 5> outside = {true, true, true, true, true};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at((corner & 1) != 0 ? box.high.x : box.low.x,
                        (corner & 2) != 0 ? box.high.y : box.low.y,
                        (corner & 4) != 0 ? box.high.z : box.low.z);
    const glm::dvec3 view = camera.viewFromLocal(at);
    const double x = view.z * camera.tanHalfX();
    const double y = view.z * camera.tanHalfY();
    const std::array<bool, 5> out = {view.z < 0.0, view.x<-x, view.x> x, view.y<-y, view.y> y};
    for (size_t i = 0; i < out.size(); ++i) outside[i] = outside[i] && out[i];
  }
  return std::none_of(outside.begin(), outside.end(), [](bool is) { return is; });
}

/// Lowest and highest sample of a part of the world, from the deepest elevation tile that is here.
void heightsOf(const TilePool& pool, TileId id, double& low, double& high) {
  TileId at = id;
  const Tile* tile = pool.find(at);
  while (tile == nullptr && !at.isRoot()) {
    at = at.parent();
    tile = pool.find(at);
  }
  if (tile == nullptr) return;
  const int up = std::min(id.level - at.level, 8);
  const int side = kTileCells >> up;
  const TileId part = id.level - at.level > up ? id.ancestor(at.level + up) : id;
  const int x0 = (part.col & ((1 << up) - 1)) * side;
  const int y0 = (part.row & ((1 << up) - 1)) * side;
  float lowest = std::numeric_limits<float>::infinity();
  float highest = -lowest;
  for (int y = y0; y <= y0 + side; ++y) {
    const float* row = &tile->samples.heights[static_cast<size_t>(y * kTileSamples)];
    const auto [least, most] = std::minmax_element(row + x0, row + x0 + side + 1);
    lowest = std::min(lowest, *least);
    highest = std::max(highest, *most);
  }
  low = static_cast<double>(lowest);
  high = static_cast<double>(highest);
}

/// The part of an ancestor that lies on `id`, enlarged.
ImageryTile enlarge(const ImageryTile& ancestor, int levelsUp, TileId id) {
  ImageryTile out;
  const double shrink = std::ldexp(1.0, -levelsUp);
  const int64_t mask = (int64_t{1} << levelsUp) - 1;
  const double left = kSide * shrink * static_cast<double>(id.col & mask);
  const double top = kSide * shrink * static_cast<double>(id.row & mask);
  const auto texel = [&](int x, int y) {
    return &ancestor.rgba[static_cast<size_t>(
        4 * (std::clamp(y, 0, kSide - 1) * kSide + std::clamp(x, 0, kSide - 1)))];
  };
  for (int y = 0; y < kSide; ++y) {
    const double v = top + (y + 0.5) * shrink - 0.5;
    const int row = static_cast<int>(std::floor(v));
    for (int x = 0; x < kSide; ++x) {
      const double u = left + (x + 0.5) * shrink - 0.5;
      const int col = static_cast<int>(std::floor(u));
      std::array<double, 4> sum{};
      for (int corner = 0; corner < 4; ++corner) {
        const uint8_t* from = texel(col + (corner & 1), row + (corner >> 1));
        const double weight = ((corner & 1) != 0 ? u - col : 1.0 - (u - col)) *
                              ((corner >> 1) != 0 ? v - row : 1.0 - (v - row)) * from[3];
        for (size_t c = 0; c < 3; ++c) sum[c] += weight * from[c];
        sum[3] += weight;
      }
      if (sum[3] <= 0.0) continue;
      uint8_t* to = &out.rgba[static_cast<size_t>(4 * (y * kSide + x))];
      for (size_t c = 0; c < 3; ++c) to[c] = static_cast<uint8_t>(std::lround(sum[c] / sum[3]));
      to[3] = static_cast<uint8_t>(std::lround(std::min(sum[3], 255.0)));
    }
  }
  return out;
}

/// Lays `over` on `under`.
void layOver(ImageryTile& under, const ImageryTile& over) {
  for (size_t i = 0; i < under.rgba.size(); i += 4) {
    uint8_t* to = &under.rgba[i];
    const uint8_t* top = &over.rgba[i];
    if (top[3] == 0) continue;
    if (top[3] == 255 || to[3] == 0) {
      std::copy_n(top, 4, to);
      continue;
    }
    const unsigned a = 255U * top[3];
    const unsigned b = (255U - top[3]) * to[3];
    for (int c = 0; c < 3; ++c)
      to[c] = static_cast<uint8_t>((a * top[c] + b * to[c] + (a + b) / 2) / (a + b));
    to[3] = static_cast<uint8_t>((a + b + 127) / 255);
  }
}

}  // namespace

ImageryPool::ImageryPool(const Dataset& dataset, const std::vector<size_t>& layers) : dataset_(&dataset) {
  for (const size_t index : layers) {
    Layer layer{index, dataset.manifest().imagery[index].finestLevel, dataset.imageryTiles(index)};
    std::sort(layer.tiles.begin(), layer.tiles.end());
    layers_.push_back(std::move(layer));
  }
}

bool ImageryPool::Layer::has(TileId id) const {
  return std::binary_search(tiles.begin(), tiles.end(), id);
}

bool ImageryPool::hasDeeper(TileId id) const {
  for (const Layer& layer : layers_) {
    for (int quadrant = 0; id.level < layer.finestLevel && quadrant < 4; ++quadrant)
      if (layer.has(id.child(quadrant))) return true;
  }
  return false;
}

std::vector<TileId> ImageryPool::tilesFor(const Camera& camera, double exaggeration,
                                          const TilePool& heights) const {
  std::vector<TileId> out;
  if (layers_.empty()) return out;
  double texelPixels = 1.0;
  while (!collect(camera, exaggeration, heights, texelPixels, out)) texelPixels *= 1.4;
  std::sort(out.begin(), out.end());
  return out;
}

/// False: there would be too many.
bool ImageryPool::collect(const Camera& camera, double exaggeration, const TilePool& heights,
                          double texelPixels, std::vector<TileId>& out) const {
  const Manifest& manifest = dataset_->manifest();
  const Frame& frame = manifest.frame;
  out.clear();
  std::vector<TileId> open = {TileId{}};
  while (!open.empty()) {
    const TileId id = open.back();
    open.pop_back();
    out.push_back(id);
    if (out.size() > kMostTiles) return false;
    if (!hasDeeper(id)) continue;
    const double cells = std::ldexp(kSide, frame.finestLevel - id.level);
    double low = manifest.minHeight, high = manifest.maxHeight;
    heightsOf(heights, id, low, high);
    const glm::dvec2 northWest = frame.localFromSample({id.col * cells, id.row * cells});
    const glm::dvec2 southEast = frame.localFromSample({(id.col + 1) * cells, (id.row + 1) * cells});
    const Box box{{northWest.x, southEast.y, low * exaggeration},
                  {southEast.x, northWest.y, high * exaggeration}};
    const double texelMeters = (southEast.x - northWest.x) / kSide;
    const double metersPerPixel = distanceTo(box, camera.eyeLocal) / camera.pixelsPerTangent();
    if (texelMeters <= metersPerPixel * texelPixels || !maySee(camera, box)) continue;
    for (int quadrant = 0; quadrant < 4; ++quadrant) open.push_back(id.child(quadrant));
  }
  return true;
}

Status ImageryPool::load(std::span<const TileId> ids) {
  std::vector<TileId> missing;
  for (const TileId id : ids)
    if (tiles_.count(id) == 0) missing.push_back(id);
  if (tiles_.size() + missing.size() > ids.size() + kSpareTiles) {
    const std::unordered_set<TileId, TileIdHash> needed(ids.begin(), ids.end());
    for (auto at = tiles_.begin(); at != tiles_.end();)
      at = needed.count(at->first) != 0 ? std::next(at) : tiles_.erase(at);
  }
  std::vector<std::optional<Result<std::unique_ptr<ImageryTile>>>> made(missing.size());
  std::vector<uint64_t> bytes(missing.size());
  parallelFor(static_cast<int64_t>(missing.size()), 0, [&](int64_t index) {
    const auto i = static_cast<size_t>(index);
    made[i] = make(missing[i], bytes[i]);
  });
  for (size_t i = 0; i < missing.size(); ++i) {
    if (!made[i]->ok())
      return makeError("{}: imagery tile {}: {}", dataset_->directory(), toString(missing[i]),
                       made[i]->error().message);
    bytesRead_ += bytes[i];
    tiles_[missing[i]] = std::move(**made[i]);
  }
  return {};
}

Result<std::unique_ptr<ImageryTile>> ImageryPool::make(TileId id, uint64_t& bytes) const {
  std::unique_ptr<ImageryTile> out;
  for (const Layer& layer : layers_) {
    // Beyond its finest level a layer is enlarged.
    const int up = std::max(0, id.level - layer.finestLevel);
    const TileId stored = id.ancestor(id.level - up);
    if (!layer.has(stored)) continue;
    TERRANE_ASSIGN(const auto payload, dataset_->readImagery(layer.index, stored));
    if (!payload) continue;
    bytes += payload->size();
    TERRANE_ASSIGN(ImageryTile tile, decodeImagery(*payload));
    if (up > 0) tile = enlarge(tile, up, id);
    if (out == nullptr)
      out = std::make_unique<ImageryTile>(std::move(tile));
    else
      layOver(*out, tile);
  }
  if (out != nullptr && layers_.size() > 1 && coverOf(*out) == ImageryCover::Partial) fillTransparent(*out);
  return out;
}

const ImageryTile* ImageryPool::find(TileId id) const {
  const auto at = tiles_.find(id);
  return at == tiles_.end() ? nullptr : at->second.get();
}

std::vector<uint8_t> ImageryPool::bordered(TileId id) const {
  const ImageryTile* own = find(id);
  std::vector<uint8_t> out;
  if (own == nullptr) return out;
  out.resize(size_t{4} * kBordered * kBordered);
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const TileId at{id.level, id.col + dx, id.row + dy};
      const ImageryTile* there = at.valid() ? find(at) : nullptr;
      const int x0 = dx < 0 ? 0 : dx == 0 ? 1 : kBordered - 1;
      const int y0 = dy < 0 ? 0 : dy == 0 ? 1 : kBordered - 1;
      for (int y = y0; y < y0 + (dy == 0 ? kSide : 1); ++y) {
        for (int x = x0; x < x0 + (dx == 0 ? kSide : 1); ++x) {
          // In the neighbour, or the own texel that is nearest.
          const int col = there != nullptr ? x - 1 - dx * kSide : std::clamp(x - 1, 0, kSide - 1);
          const int row = there != nullptr ? y - 1 - dy * kSide : std::clamp(y - 1, 0, kSide - 1);
          std::copy_n(&(there != nullptr ? there : own)->rgba[static_cast<size_t>(4 * (row * kSide + col))],
                      4, &out[static_cast<size_t>(4 * (y * kBordered + x))]);
        }
      }
    }
  }
  return out;
}

}  // namespace terrane
