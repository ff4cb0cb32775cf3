#include "imagery_compose.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane {
namespace {

constexpr int kSide = kImageryTileSide;
constexpr int kBordered = kSide + 2;

}  // namespace

ImageryTile enlargeImagery(const ImageryTile& ancestor, int levelsUp, TileId id) {
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

void layImageryOver(ImageryTile& under, const ImageryTile& over) {
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

ImageryBorder imageryBorder(TileId id, int dx, int dy,
                            const std::function<const ImageryTile*(TileId)>& find) {
  ImageryBorder out;
  const ImageryTile* own = find(id);
  if (own == nullptr) return out;
  const TileId at{id.level, id.col + dx, id.row + dy};
  const ImageryTile* there = at.valid() ? find(at) : nullptr;
  out.x = dx < 0 ? 0 : dx == 0 ? 1 : kBordered - 1;
  out.y = dy < 0 ? 0 : dy == 0 ? 1 : kBordered - 1;
  out.width = dx == 0 ? kSide : 1;
  out.height = dy == 0 ? kSide : 1;
  out.rgba.reserve(static_cast<size_t>(4 * out.width * out.height));
  for (int y = out.y; y < out.y + out.height; ++y) {
    for (int x = out.x; x < out.x + out.width; ++x) {
      // In the neighbour, or the own texel that is nearest.
      const int col = there != nullptr ? x - 1 - dx * kSide : std::clamp(x - 1, 0, kSide - 1);
      const int row = there != nullptr ? y - 1 - dy * kSide : std::clamp(y - 1, 0, kSide - 1);
      const uint8_t* from = &(there != nullptr ? there : own)->rgba[static_cast<size_t>(4 * (row * kSide + col))];
      out.rgba.insert(out.rgba.end(), from, from + 4);
    }
  }
  return out;
}

std::vector<uint8_t> borderedImagery(TileId id, const std::function<const ImageryTile*(TileId)>& find) {
  std::vector<uint8_t> out;
  if (find(id) == nullptr) return out;
  out.resize(size_t{4} * kBordered * kBordered);
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const ImageryBorder part = imageryBorder(id, dx, dy, find);
      for (int row = 0; row < part.height; ++row)
        std::copy_n(part.rgba.begin() + static_cast<ptrdiff_t>(4 * row * part.width), 4 * part.width,
                    out.begin() + static_cast<ptrdiff_t>(4 * ((part.y + row) * kBordered + part.x)));
    }
  }
  return out;
}

}  // namespace terrane
