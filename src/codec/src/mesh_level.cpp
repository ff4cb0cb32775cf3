#include "terrane/codec/mesh_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "find_relief.h"
#include "mesh_lattice.h"
#include "terrane/base/check.h"
#include "terrane/codec/elevation_codec.h"
#include "terrane/tiling/node_layout.h"

namespace terrane {

namespace {

/// Cells along the side of the blocks whose errors a tile states: its nodes of the finest level.
constexpr int kBlockCells = 16;
constexpr int kBlocks = kTileCells / kBlockCells;
/// However wrong the samples are, meshes may leave them by this share of the bound.
constexpr double kLeastShare = 0.75;
/// Samples may be so far from where all layers of significance have them, in bounds of the meshes.
constexpr double kLayerShare = 0.6;
/// Chords along sides may leave the samples by this share of the next level's bound.
constexpr double kShareAlongSides = 0.7;
/// The same where the next level is made of more layers of significance, so that these are off by more.
constexpr double kLeastAlongSides = 0.15;
/// A patch's bound, in spacings, is as many times the ground's roughness, within limits.
constexpr double kBoundOfRoughness = 5.0;
constexpr double kLeastBound = 0.5;
constexpr double kLargestBound = 2.0;
/// What counts as exact: in spacings of the finest level. Means of floats are not quite on a line.
constexpr double kExactSpacings = 1.0 / 4096;

/// What a tile's own samples get wrong, and how far its meshes may leave them, block by block.
struct Blocks {
  std::array<double, kBlocks * kBlocks> error{};
  std::array<double, kBlocks * kBlocks> tolerance{};
};

/// `offset`: see MeshScale::layerOffset().
Blocks blocksOf(TileId id, const Tile& tile, double offset, double bound, double least,
                const ElevationScale& scale) {
  Blocks out;
  for (int row = 0; row < kBlocks; ++row) {
    for (int col = 0; col < kBlocks; ++col) {
      const int half = kBlockCells / 2;
      const int node =
          nodeIndex(kNodeLevels - 1, col * kBlockCells + half, row * kBlockCells + half, id.isRoot());
      const auto at = static_cast<size_t>(row * kBlocks + col);
      out.error[at] = scale.errorFromCode(tile.nodes.error[static_cast<size_t>(node)]) + offset;
      out.tolerance[at] = std::max(bound - out.error[at], least);
    }
  }
  return out;
}

/// The blocks that a row or column of samples lies in: two where it is between them.
struct BlocksAt {
  size_t before, after;
  explicit BlocksAt(int sample)
      : before(static_cast<size_t>(std::max(sample - 1, 0) / kBlockCells)),
        after(static_cast<size_t>(std::min(sample / kBlockCells, kBlocks - 1))) {}
};

/// What blocks say at the samples of rows that are gone through from the first on; on the sides of blocks
/// what the one of them says that `choose` takes.
template <class Choose>
class AlongRows {
 public:
  AlongRows(const std::array<double, kBlocks * kBlocks>& blocks, Choose choose)
      : blocks_(blocks), choose_(choose) {}

  const std::array<float, kTileSamples>& at(int y) {
    // Rows say the same from the second of a block to its last.
    if (y % kBlockCells > 1) return row_;
    const BlocksAt rows(y);
    std::array<double, kBlocks> chosen;
    for (size_t col = 0; col < kBlocks; ++col)
      chosen[col] = choose_(blocks_[rows.before * kBlocks + col], blocks_[rows.after * kBlocks + col]);
    for (int x = 0; x < kTileSamples; ++x) {
      const BlocksAt columns(x);
      row_[static_cast<size_t>(x)] =
          static_cast<float>(choose_(chosen[columns.before], chosen[columns.after]));
    }
    return row_;
  }

 private:
  const std::array<double, kBlocks * kBlocks>& blocks_;
  Choose choose_;
  std::array<float, kTileSamples> row_{};
};

HeightBand bandOf(const TileSamples& samples, const Blocks& blocks, bool isFinest) {
  const std::vector<float>& heights = samples.heights;
  const double least = *std::min_element(blocks.tolerance.begin(), blocks.tolerance.end());
  // note: a little less, for what floats round.
  HeightBand out{heights, heights, static_cast<float>(0.999 * least)};
  AlongRows tolerances(blocks.tolerance, [](double a, double b) { return std::min(a, b); });
  for (int y = 0; y < kTileSamples; ++y) {
    const std::array<float, kTileSamples>& tolerance = tolerances.at(y);
    float* low = out.low.data() + y * kTileSamples;
    float* high = out.high.data() + y * kTileSamples;
    for (size_t x = 0; x < kTileSamples; ++x) {
      low[x] -= tolerance[x];
      high[x] += tolerance[x];
    }
  }
  const std::vector<uint8_t> measured = measuredSamples(samples, isFinest);
  for (size_t i = 0; i < measured.size(); ++i)
    if (measured[i] == 0) out.low[i] = out.high[i] = std::numeric_limits<float>::quiet_NaN();
  return out;
}

/// The largest error that a patch may have which keeps to the band.
double errorWithin(const PatchCorners& corners, const Blocks& blocks) {
  const auto [left, right] = std::minmax({corners.ends[0][0], corners.ends[1][0], corners.apex[0]});
  const auto [top, bottom] = std::minmax({corners.ends[0][1], corners.ends[1][1], corners.apex[1]});
  double most = 0.0;
  for (int row = top / kBlockCells; row * kBlockCells < bottom; ++row)
    for (int col = left / kBlockCells; col * kBlockCells < right; ++col) {
      const auto at = static_cast<size_t>(row * kBlocks + col);
      most = std::max(most, blocks.error[at] + blocks.tolerance[at]);
    }
  return most;
}

/// How far a surface may be off the source at each measured sample; 0 elsewhere.
std::vector<float> errorsOf(std::span<const float> surface, std::span<const float> heights,
                            const HeightBand& band, const Blocks& blocks) {
  std::vector<float> out(surface.size());
  AlongRows own(blocks.error, [](double a, double b) { return std::max(a, b); });
  for (int y = 0; y < kTileSamples; ++y) {
    const std::array<float, kTileSamples>& error = own.at(y);
    const auto first = static_cast<size_t>(y * kTileSamples);
    for (size_t x = 0; x < kTileSamples; ++x) {
      const size_t at = first + x;
      const float off = std::abs(surface[at] - heights[at]) + error[x];
      out[at] = std::isnan(band.low[at]) ? 0.0F : off;
    }
  }
  return out;
}

/// The largest of the samples of a patch.
double mostIn(const PatchCorners& of, std::span<const float> values) {
  MeshPoint corners[3] = {
      {of.ends[0][0], of.ends[0][1]}, {of.ends[1][0], of.ends[1][1]}, {of.apex[0], of.apex[1]}};
  if (doubleArea(corners[0], corners[1], corners[2]) < 0) std::swap(corners[0], corners[1]);
  const int top = std::min({corners[0].y, corners[1].y, corners[2].y});
  const int bottom = std::max({corners[0].y, corners[1].y, corners[2].y});
  float most = 0.0F;
  for (int y = top; y <= bottom; ++y) {
    const RowSpan row = rowOf(corners, y);
    for (int x = row.first; x <= row.last; ++x)
      most = std::max(most, values[static_cast<size_t>(y * kTileSamples + x)]);
  }
  return static_cast<double>(most);
}

/// Takes in the triangles of a patch that do not come of the chosen vertices.
void addOthers(ReliefFinder& relief, const PatchMesh& mesh) {
  for (size_t i = mesh.hasMore ? 0 : 3 * static_cast<size_t>(mesh.bisected); i < mesh.indices.size();
       i += 3) {
    const PatchVertex& a = mesh.vertices[mesh.indices[i]];
    const PatchVertex& b = mesh.vertices[mesh.indices[i + 1]];
    const PatchVertex& c = mesh.vertices[mesh.indices[i + 2]];
    const auto [low, high] = std::minmax(
        {a.heightMeters, a.coarseMeters, b.heightMeters, b.coarseMeters, c.heightMeters, c.coarseMeters});
    relief.add({{a.x(), a.y()}, {b.x(), b.y()}, {c.x(), c.y()}}, low, high);
  }
}

/// How far chords along a level's legs may leave its samples: the next level has them as hypotenuses.
double alongSides(int bintreeLevel, const MeshScale& meshScale) {
  const double next = meshScale.boundMeters(bintreeLevel + 1);
  const double moved = meshScale.layerOffsets[static_cast<size_t>(meshScale.layerOf(bintreeLevel))] -
                       meshScale.layerOffsets[static_cast<size_t>(meshScale.layerOf(bintreeLevel + 1))];
  return std::max(kShareAlongSides * next - moved, kLeastAlongSides * next);
}

std::vector<uint8_t> unpacked(std::span<const uint8_t> bits) {
  std::vector<uint8_t> out(kTileSampleCount);
  for (size_t i = 0; i < out.size(); ++i) out[i] = bits[i / 8] >> (i % 8) & 1U;
  return out;
}
std::vector<uint8_t> packed(std::span<const uint8_t> vertices) {
  std::vector<uint8_t> out((vertices.size() + 7) / 8, 0);
  for (size_t i = 0; i < vertices.size(); ++i)
    out[i / 8] = static_cast<uint8_t>(out[i / 8] | (vertices[i] & kMeshVertex) << (i % 8));
  return out;
}

}  // namespace

MeshScale MeshScale::of(const Frame& frame, const ElevationScale& scale) {
  MeshScale out;
  out.boundSpacings = std::clamp(kBoundOfRoughness * scale.roughness, kLeastBound, kLargestBound);
  out.spacingMeters = std::max(frame.spacingXMeters(), frame.spacingYMeters());
  out.finestLevel = frame.finestLevel;
  out.layerCount = scale.layerCount;
  out.sampleErrorMeters = scale.sampleError;
  for (int layer = 0; layer < scale.layerCount; ++layer)
    out.layerOffsets[static_cast<size_t>(layer)] = scale.layerOffset(layer);
  return out;
}

double MeshScale::boundMeters(int bintreeLevel) const {
  if (bintreeLevel >= deepestLevel()) return 0.0;
  // Of the finest tiles' last own level the spacing is that of the data.
  const int finest = 2 * finestLevel + lastOwnLevel();
  return boundSpacings * spacingMeters * std::exp2(0.5 * (finest - bintreeLevel));
}

int MeshScale::layerOf(int bintreeLevel) const {
  // note: the last level but one gives the deepest sides, on which all samples count.
  const double most = bintreeLevel + 1 < deepestLevel() ? kLayerShare * boundMeters(bintreeLevel) : 0.0;
  const bool isFinest = bintreeLevel >= 2 * finestLevel + firstLevel(finestLevel == 0);
  int layer = 0;
  while (layer + 1 < layerCount && layerOffset(layer, isFinest) > most) ++layer;
  return layer;
}

double MeshScale::leastStatedMeters(int bintreeLevel) const {
  const double bound = boundMeters(bintreeLevel);
  const bool isFinest = bintreeLevel >= 2 * finestLevel + firstLevel(finestLevel == 0);
  const int layer = layerOf(bintreeLevel);
  return std::max(bound, sampleErrorMeters + layerOffset(layer, isFinest) + kLeastShare * bound);
}

double statedErrorOver(int quadrant, TileId id, const Tile& tile, int level, const MeshScale& meshScale,
                       const ElevationScale& scale) {
  constexpr int kHalf = kBlocks / 2;
  const uint8_t* codes = tile.nodes.error.data() + nodeOffset(kNodeLevels - 1, id.isRoot()) +
                         (quadrant >> 1) * kHalf * kBlocks + (quadrant & 1) * kHalf;
  uint8_t most = 0;
  for (int row = 0; row < kHalf; ++row)
    most = std::max(most, *std::max_element(codes + row * kBlocks, codes + row * kBlocks + kHalf));
  const int bintreeLevel = level + 2 * id.level;
  const double bound = meshScale.boundMeters(bintreeLevel);
  const double offset =
      meshScale.layerOffset(meshScale.layerOf(bintreeLevel), id.level == meshScale.finestLevel);
  return std::max(bound, scale.errorFromCode(most) + offset + kLeastShare * bound);
}

MeshLevel makeMeshLevel(TileId id, const Tile& tile, int level, const MeshLevel* before,
                        const MeshScale& meshScale, const ElevationScale& scale) {
  TERRANE_CHECK(level >= meshScale.firstLevel(id.isRoot()) && level <= kDeepestVertexLevel,
                "mesh level {} of tile {}", level, toString(id));
  TERRANE_CHECK((before == nullptr) == (id.isRoot() && level == 0), "mesh level {} of tile {}", level,
                toString(id));
  const double exact = kExactSpacings * meshScale.spacingMeters;
  const int bintreeLevel = level + 2 * id.level;
  const double bound = meshScale.boundMeters(bintreeLevel);
  const int layer = meshScale.layerOf(bintreeLevel);
  TERRANE_CHECK(layer < tile.samples.layerCount, "mesh level {} of tile {} wants layer {} of {}", level,
                toString(id), layer, tile.samples.layerCount);
  TileSamples room;
  if (layer + 1 < tile.samples.layerCount) room = samplesOfLayer(tile.samples, layer);
  const TileSamples& samples = layer + 1 < tile.samples.layerCount ? room : tile.samples;
  const double offset = meshScale.layerOffset(layer, id.level == meshScale.finestLevel);
  const Blocks blocks = blocksOf(id, tile, offset, bound, std::max(kLeastShare * bound, exact), scale);
  const HeightBand band = bandOf(samples, blocks, id.level == meshScale.finestLevel);

  std::vector<uint8_t> inherited;
  if (before != nullptr) {
    inherited = unpacked(before->chosen);
    if (level == meshScale.firstLevel(id.isRoot())) inherited = inheritedVertices(inherited, id.quadrant());
  }
  const std::vector<float>& heights = samples.heights;
  MeshLevelRule rule{level, kTileCells, alongSides(bintreeLevel, meshScale)};
  const int served = std::min(meshScale.grid.tileLevel(bintreeLevel), meshScale.finestLevel);
  rule.borderSquare = kTileCells >> std::max(served - id.level, 0);
  const std::vector<uint8_t> vertices = chooseMeshVertices(samples, band, inherited, rule);
  const bool centerFalls = (id.col + id.row) % 2 == 0;
  const std::vector<float> coarse =
      before == nullptr ? heights : meshSurface(heights, inherited, level - 1, centerFalls);

  MeshLevel out;
  out.level = level;
  out.centerFalls = centerFalls;
  // The vertices' surfaces are the meshes' but for what makePatchMesh() makes otherwise.
  ReliefFinder relief(meshSurface(heights, vertices, level, centerFalls), coarse, level);
  const std::vector<float> startErrors = errorsOf(coarse, heights, band, blocks);
  const int count = patchCount(level);
  out.patches.reserve(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) {
    const PatchCorners corners = patchCorners(level, i, centerFalls);
    const PatchMesh mesh = makePatchMesh(corners, level, vertices, heights, coarse, band);
    addOthers(relief, mesh);
    MeshLevel::Patch patch;
    patch.firstVertex = static_cast<uint32_t>(out.vertices.size());
    patch.vertexCount = static_cast<uint32_t>(mesh.vertices.size());
    patch.firstIndex = static_cast<uint32_t>(out.indices.size());
    patch.indexCount = static_cast<uint32_t>(mesh.indices.size());
    patch.bisectedCount = static_cast<uint32_t>(mesh.bisected);
    patch.firstExtra = static_cast<uint32_t>(out.extras.size());
    patch.extraCount = static_cast<uint32_t>(mesh.extras.size());
    const double within = errorWithin(corners, blocks);
    patch.errorMeters = static_cast<float>(within + mesh.excessMeters);
    // The world's first level has none before it: it begins as it is.
    double start = before != nullptr ? mostIn(corners, startErrors) : within + mesh.excessMeters;
    if (mesh.bisected < mesh.triangles()) start = std::max(start, within + mesh.startExcessMeters);
    patch.startErrorMeters = static_cast<float>(start);
    out.patches.push_back(patch);
    out.vertices.insert(out.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    out.indices.insert(out.indices.end(), mesh.indices.begin(), mesh.indices.end());
    out.extras.insert(out.extras.end(), mesh.extras.begin(), mesh.extras.end());
  }
  out.relief = relief.find(centerFalls);
  out.chosen = packed(vertices);
  return out;
}

}  // namespace terrane
