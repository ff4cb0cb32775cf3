#include "studied_ground.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

namespace terrane {
namespace {

/// What the picture wants comes first; then this, before what it may want later.
constexpr double kStudiedChance = 0.9;
constexpr double kLookSeconds = 0.5;

struct Segment {
  glm::dvec2 from, to;
};

/// Does a segment meet the square of a tile? Its border counts.
bool meets(const Segment& segment, TileId id, const Frame& frame) {
  const double side = std::ldexp(kTileCells, frame.finestLevel - id.level);
  double begin = 0.0, end = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double low = side * (axis == 0 ? id.col : id.row);
    const double from = segment.from[axis], step = segment.to[axis] - from;
    if (step == 0.0) {
      if (from < low || from > low + side) return false;
      continue;
    }
    const double a = (low - from) / step, b = (low + side - from) / step;
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return begin <= end;
}

/// A tile and the segments that meet it.
struct Crossed {
  TileId id;
  std::vector<uint32_t> segments;
};

}  // namespace

std::vector<TileId> tilesAlong(const std::vector<std::vector<glm::dvec2>>& lines, const Frame& frame,
                               const std::function<bool(TileId)>& isStored, size_t most) {
  std::vector<Segment> segments;
  for (const auto& line : lines)
    for (size_t i = 0; i < line.size(); ++i)
      if (i > 0 || line.size() == 1) segments.push_back({line[i > 0 ? i - 1 : 0], line[i]});
  Crossed root;
  for (uint32_t i = 0; i < segments.size(); ++i)
    if (meets(segments[i], root.id, frame)) root.segments.push_back(i);
  if (root.segments.empty()) return {TileId{}};

  std::vector<TileId> done;  // nothing finer is stored of these
  std::vector<Crossed> level = {std::move(root)};
  while (!level.empty()) {
    std::vector<Crossed> next;
    std::vector<TileId> ended = done;
    for (const Crossed& tile : level) {
      const size_t before = next.size();
      for (int quadrant = 0; quadrant < 4 && tile.id.level < frame.finestLevel; ++quadrant) {
        Crossed child{tile.id.child(quadrant), {}};
        for (const uint32_t i : tile.segments)
          if (meets(segments[i], child.id, frame)) child.segments.push_back(i);
        if (!child.segments.empty() && isStored(child.id)) next.push_back(std::move(child));
      }
      if (next.size() == before) ended.push_back(tile.id);
      if (next.size() + ended.size() > most) {
        for (const Crossed& each : level) done.push_back(each.id);
        return done;
      }
    }
    done = std::move(ended);
    level = std::move(next);
  }
  return done;
}

std::vector<glm::dvec2> thinned(const std::vector<glm::dvec2>& line, double tileSide) {
  const auto isBeside = [&](size_t a, size_t b) {
    return b >= line.size() || glm::floor(line[a] / tileSide) != glm::floor(line[b] / tileSide);
  };
  std::vector<glm::dvec2> out;
  for (size_t i = 0; i < line.size(); ++i)
    if (i == 0 || isBeside(i, i - 1) || isBeside(i, i + 1)) out.push_back(line[i]);
  return out;
}

void StudiedGround::addWishes(const TileStream& stream, size_t mostTiles, double nowSeconds,
                              std::vector<StreamWish>& wishes) {
  if (lines_.empty()) return;
  const Frame& frame = stream.manifest().frame;
  if (areTilesStale_) {
    samples_ = lines_;
    for (auto& line : samples_) {
      for (glm::dvec2& place : line) place = frame.sampleFromLocal(place);
      line = thinned(line, kTileCells);
    }
  }
  if (areTilesStale_ || nowSeconds >= nextLookSeconds_) {
    const auto isStored = [&](TileId id) { return stream.isStored(TileKey::elevation(id)); };
    tiles_ = tilesAlong(samples_, frame, isStored, mostTiles);
    areTilesStale_ = false;
    nextLookSeconds_ = nowSeconds + kLookSeconds;
  }
  // Those that are here, too: what is wished for stays.
  for (const TileId id : tiles_)
    wishes.push_back(
        {TileKey::elevation(id, stream.manifest().scale.layerCount - 1), 2.0, 1.0, 1.0, 1.0, kStudiedChance});
}

}  // namespace terrane
