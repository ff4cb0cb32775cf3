#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "made_raster.h"
#include "terrane/bake/source.h"

/// What the tests of the inputs share: open, read a tile, look at a message.
namespace terrane::test {

/// Keeps the warnings.
class ListeningProgress final : public Progress {
 public:
  void beginStage(std::string_view, int64_t, std::string_view) override {}
  void advance(int64_t) override {}
  void warn(const std::string& message) override { warnings.push_back(message); }
  std::string all() const {
    std::string text;
    for (const auto& warning : warnings) text += warning + "\n";
    return text;
  }
  std::vector<std::string> warnings;
};

/// A tile as the source gives it.
struct ReadTile {
  bool any = false;
  std::vector<float> heights = std::vector<float>(kTileSampleCount);
  std::vector<uint16_t> ranks = std::vector<uint16_t>(kTileSampleCount);
  float at(int x, int y) const {
    return heights[static_cast<size_t>(y) * kTileSamples + static_cast<size_t>(x)];
  }
  bool voidAt(int x, int y) const { return std::isnan(at(x, y)) && rankAt(x, y) == 0; }
  int rankAt(int x, int y) const {
    return ranks[static_cast<size_t>(y) * kTileSamples + static_cast<size_t>(x)];
  }
};

inline Result<ReadTile> tryRead(const Source& source, TileId id) {
  TERRANE_ASSIGN(auto reader, source.openReader());
  ReadTile tile;
  TERRANE_ASSIGN(tile.any, reader->readTile(id, tile.heights, tile.ranks));
  return tile;
}

inline ReadTile read(const Source& source, TileId id) {
  auto tile = tryRead(source, id);
  EXPECT_TRUE(tile.ok()) << tile.error().message;
  return tile.ok() ? *tile : ReadTile{};
}

/// Options that name the inputs and nothing else.
inline SourceOptions from(std::vector<std::string> inputs) {
  SourceOptions options;
  options.inputs = std::move(inputs);
  return options;
}

inline std::unique_ptr<Source> open(const SourceOptions& options) {
  SilentProgress silent;
  auto source = openSource(options, silent);
  EXPECT_TRUE(source.ok()) << source.error().message;
  return source.ok() ? std::move(source).value() : nullptr;
}

inline std::string openError(const SourceOptions& options) {
  SilentProgress silent;
  const auto source = openSource(options, silent);
  return source.ok() ? "no error" : source.error().message;
}

#define EXPECT_HAS(text, part) EXPECT_NE(std::string(text).find(part), std::string::npos) << (text)

}  // namespace terrane::test
