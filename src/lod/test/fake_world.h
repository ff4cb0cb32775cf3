#pragma once

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "terrane/lod/select_patches.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

/// A world whose tiles have made-up, properly saturated node codes and no heights: all that selection sees.
struct FakeWorld {
  int finestLevel;
  Frame frame;
  ElevationScale scale;
  std::map<TileId, Tile> tiles;
  struct Code {
    uint8_t error = 0;
    uint16_t low = 65535;
    uint16_t high = 0;
  };
  std::map<Diamond, Code> codes;  ///< of every diamond that a tile carries, for K = 17

  static std::vector<TileId> allTiles(int finestLevel) {
    std::vector<TileId> out;
    for (int level = 0; level <= finestLevel; ++level)
      for (int row = 0; row < 1 << level; ++row)
        for (int col = 0; col < 1 << level; ++col) out.push_back({level, col, row});
    return out;
  }

  FakeWorld(int finest, uint32_t seed) : finestLevel(finest) {
    frame.finestLevel = finest;
    frame.spacingX = 10.0;
    frame.spacingY = 10.05;
    scale.errorUnit = 0.02;
    scale.rangeBase = -100.0;
    scale.rangeUnit = 0.05;

    // Random errors with rough and smooth regions, saturated from the finest diamonds up.
    std::mt19937 random(seed);
    const Lattice lattice(finest);
    const int deepest = kNodeGrid.deepestLevel(finest);
    std::vector<std::vector<Diamond>> levels(static_cast<size_t>(deepest + 1));
    levels[0] = {{lattice.side() / 2, lattice.side() / 2, 0}};
    for (int n = 0; n < deepest; ++n) {
      std::set<Diamond> next;
      for (const Diamond& d : levels[static_cast<size_t>(n)])
        for (const Diamond& c : lattice.children(d)) next.insert(c);
      levels[static_cast<size_t>(n + 1)].assign(next.begin(), next.end());
    }
    const double roughX = std::uniform_real_distribution<double>(0, lattice.side())(random);
    const double roughY = std::uniform_real_distribution<double>(0, lattice.side())(random);
    for (int n = deepest; n >= 0; --n) {
      for (const Diamond& d : levels[static_cast<size_t>(n)]) {
        Code code;
        const double distance = std::hypot(d.x - roughX, d.y - roughY) / lattice.side();
        const int own =
            static_cast<int>(60 + (deepest - n) * 5 - 60 * distance) + static_cast<int>(random() % 24);
        code.error = static_cast<uint8_t>(std::clamp(own, 0, 200));
        const auto middle = static_cast<uint16_t>(2000 + random() % 3000);
        code.low = static_cast<uint16_t>(middle - random() % 500);
        code.high = static_cast<uint16_t>(middle + random() % 500);
        if (n < deepest) {
          for (const Diamond& c : lattice.children(d)) {
            code.error = std::max<uint8_t>(code.error, static_cast<uint8_t>(codes[c].error + 1));
            code.low = std::min(code.low, codes[c].low);
            code.high = std::max(code.high, codes[c].high);
          }
        }
        codes[d] = code;
      }
    }
    // Larger patches: their own random errors, saturated over their own levels.
    std::map<int, std::map<Diamond, uint8_t>> large;
    for (int k = 5; k <= 7; ++k) {
      for (int n = PatchGrid{k}.deepestLevel(finest); n >= 0; --n) {
        for (const Diamond& d : levels[static_cast<size_t>(n)]) {
          int code = std::max(0, codes[d].error - 20 * (k - 4) + static_cast<int>(random() % 16));
          if (n < PatchGrid{k}.deepestLevel(finest))
            for (const Diamond& c : lattice.children(d)) code = std::max(code, large[k][c] + 1);
          large[k][d] = static_cast<uint8_t>(std::min(code, 250));
        }
      }
    }
    for (const TileId id : allTiles(finest)) {
      Tile tile;
      tile.nodes.largeError.resize(static_cast<size_t>(tileLargeNodeCount(id.isRoot())));
      for (int k = 5; k <= 7; ++k) {
        for (const auto& [d, code] : large[k]) {
          if (PatchGrid{k}.tileLevel(d.level) != id.level) continue;
          const int x = (d.x >> (finest - id.level)) - id.col * kTileCells;
          const int y = (d.y >> (finest - id.level)) - id.row * kTileCells;
          if (x < 0 || y < 0 || x > kTileCells || y > kTileCells) continue;
          tile.nodes
              .largeError[static_cast<size_t>(largeNodeIndex(k, d.level - 2 * id.level, x, y, id.isRoot()))] =
              code;
        }
      }
      const auto count = static_cast<size_t>(tileNodeCount(id.isRoot()));
      tile.nodes.error.resize(count);
      tile.nodes.low.resize(count);
      tile.nodes.high.resize(count);
      const int shift = finest - id.level;
      for (int i = 0; i < static_cast<int>(count); ++i) {
        const NodePlace place = nodePlace(i, id.isRoot());
        const Code& code =
            codes.at({(place.x + id.col * kTileCells) << shift, (place.y + id.row * kTileCells) << shift,
                      place.nodeLevel + 2 * id.level});
        const auto at = static_cast<size_t>(i);
        tile.nodes.error[at] = code.error;
        tile.nodes.low[at] = code.low;
        tile.nodes.high[at] = code.high;
      }
      tiles.emplace(id, std::move(tile));
    }
    for (auto& [id, tile] : tiles) {
      for (int quadrant = 0; quadrant < 4; ++quadrant) {
        ChildSummary& child = tile.children[static_cast<size_t>(quadrant)];
        child = {ChildState::Interpolated, 0, 1500, 6000};
        if (id.level == finest) continue;
        const TileNodes& nodes = tiles.at(id.child(quadrant)).nodes;
        child = {ChildState::Present, *std::max_element(nodes.error.begin(), nodes.error.end()),
                 *std::min_element(nodes.low.begin(), nodes.low.end()),
                 *std::max_element(nodes.high.begin(), nodes.high.end())};
      }
    }
  }
};

/// Some of a fake world's tiles.
class FakeResidents final : public ResidentTiles {
 public:
  FakeResidents(const FakeWorld& world, std::set<TileId> ids) : world_(world), ids_(std::move(ids)) {}
  const Tile* find(TileId id) const override { return ids_.count(id) ? &world_.tiles.at(id) : nullptr; }
  std::set<TileId>& ids() { return ids_; }

 private:
  const FakeWorld& world_;
  std::set<TileId> ids_;
};

}  // namespace terrane
