#include "mesh_drawer.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "patch_instances.h"
#include "terrane/base/bit_cast.h"

namespace terrane {

namespace {

constexpr int kRecordsUnit = 6;
constexpr int kRecordTexels = sizeof(MeshRecord) / 16;
/// Records stand side by side in rows of as many.
constexpr int kRecordsARow = 64;

int32_t packed(std::array<int, 2> p) {
  return p[0] | p[1] << 16;
}

}  // namespace

MeshDrawer::MeshDrawer(gpu::Context& context)
    : context_(context),
      records_(gpu::kRgba32I, kRecordsARow * kRecordTexels, MeshStore::kMostSlots / kRecordsARow,
               gpu::Filter::Nearest) {}

void MeshDrawer::setSamplers(const gpu::Program& program) {
  program.setSampler("uMeshRecords", kRecordsUnit);
}

Status MeshDrawer::setCut(const Cut& cut, const Frame& frame, LatticePoint anchor, const TileStore& tiles,
                          ImageryStore& imagery, MeshStore& meshes) {
  const Lattice lattice(cut.latticeDepth);
  meshes.beginFrame();
  triangles_ = 0;
  std::unordered_set<TileId, TileIdHash> used;
  struct Drawn {
    double distance;
    const MeshStore::Entry* entry;
  };
  std::vector<Drawn> order;
  order.reserve(cut.patches.size());
  // note: uploading may move any of them, so all are placed before any is asked where it is.
  std::vector<const MeshStore::Entry*> entries;
  entries.reserve(cut.patches.size());
  for (const Patch& patch : cut.patches) {
    TERRANE_ASSIGN(const MeshStore::Entry* entry,
                   meshes.place(patch.tile, patch.mesh.level, patch.mesh.index));
    entries.push_back(entry);
  }
  TERRANE_TRY(meshes.upload());
  TileId last{-1, 0, 0};
  TileColors colors;
  for (size_t i = 0; i < cut.patches.size(); ++i) {
    const Patch& patch = cut.patches[i];
    const MeshStore::Entry* entry = entries[i];
    TERRANE_ASSIGN(const ShadingPlace shading, shadingPlace(patch, tiles));
    // note: patches of a tile mostly follow each other.
    if (!(patch.tile == last)) used.insert(patch.tile);
    last = patch.tile;
    if (shading.entry->coverage == Coverage::Kind::None) continue;

    MeshRecord record;
    const int shift = cut.latticeDepth - patch.tile.level;
    const LatticePoint origin{(patch.tile.col * kTileCells) << shift, (patch.tile.row * kTileCells) << shift};
    record.lattice = {origin.x - anchor.x, origin.y - anchor.y, 1 << shift,
                      static_cast<int32_t>(entry->firstIndex)};
    const PatchCorners corners =
        patchCorners(patch.mesh.level, patch.mesh.index, (patch.tile.col + patch.tile.row) % 2 == 0);
    record.corners = {packed(corners.apex), packed(corners.ends[0]), packed(corners.ends[1]), 0};
    const auto cells = shadingCells(origin, 1 << shift, cut.latticeDepth, shading.tile, frame);
    for (size_t c = 0; c < cells.size(); ++c) record.shading[c] = bitCast<int32_t>(cells[c]);
    record.layers = {shading.entry->layer, shading.entry->coverageLayer, colors.of(patch.tile),
                     bitCast<int32_t>(patch.errorPixels)};
    record.imagery = {imagery.addPage(lattice, patch.triangle, shading.tile), bitCast<int32_t>(patch.morph),
                      0, 0};
    if (table_.size() <= static_cast<size_t>(entry->slot))
      table_.resize(static_cast<size_t>(entry->slot) + 1);
    table_[static_cast<size_t>(entry->slot)] = record;

    const double dx = static_cast<double>(patch.triangle.diamond.x) - anchor.x;
    const double dy = static_cast<double>(patch.triangle.diamond.y) - anchor.y;
    order.push_back({dx * dx + dy * dy, entry});
    triangles_ += entry->patch().indexCount / 3;
  }
  tiles_ = static_cast<int>(used.size());

  // Near patches first: what they hide is not shaded.
  std::stable_sort(order.begin(), order.end(),
                   [](const Drawn& a, const Drawn& b) { return a.distance < b.distance; });
  counts_.clear();
  offsets_.clear();
  drawn_.clear();
  for (const Drawn& each : order) {
    counts_.push_back(static_cast<GLsizei>(each.entry->patch().indexCount));
    offsets_.push_back(reinterpret_cast<const void*>(size_t{each.entry->firstIndex} * sizeof(uint32_t)));
    drawn_.push_back(each.entry);
  }

  TERRANE_TRY(records_.reserve(context_, 1, gpu::Growth::Exact));
  const int rows = (static_cast<int>(table_.size()) + kRecordsARow - 1) / kRecordsARow;
  table_.resize(static_cast<size_t>(rows * kRecordsARow));
  if (rows > 0) records_.upload(0, {0, 0, kRecordsARow * kRecordTexels, rows}, table_.data());
  return {};
}

int MeshDrawer::draw(const gpu::Program& program, const MeshStore& meshes, bool oneByOne) const {
  if (counts_.empty()) return 0;
  records_.bindToUnit(kRecordsUnit);
  program.setInt("uTemplate", 0);
  meshes.bind();
  const int calls = context_.drawRanges(counts_, offsets_, oneByOne);
  glBindVertexArray(0);
  return calls;
}

int MeshDrawer::drawPlaces(const gpu::Program& program, const MeshStore& meshes) const {
  constexpr GLuint kVertexBinding = 1, kIndexBinding = 2;
  if (!context_.isGles()) {
    context_.bindStorage(kVertexBinding, meshes.vertices().name());
    context_.bindStorage(kIndexBinding, meshes.indices().name());
  }
  // Only who looks triangles up by their number in the call needs one for each range.
  return draw(program, meshes, !context_.isGles());
}

void MeshDrawer::drawLines(const MeshStore& meshes) {
  // Each side once, also where two triangles share it.
  std::vector<uint32_t> ends;
  std::vector<uint64_t> sides;
  for (const MeshStore::Entry* entry : drawn_) {
    const MeshLevel::Patch& patch = entry->patch();
    sides.clear();
    for (uint32_t i = 0; i < patch.indexCount; ++i) {
      const uint32_t next = i % 3 == 2 ? i - 2 : i + 1;
      const uint32_t a = entry->meshes->indices[patch.firstIndex + i];
      const uint32_t b = entry->meshes->indices[patch.firstIndex + next];
      sides.push_back(uint64_t{std::min(a, b)} << 32 | std::max(a, b));
    }
    std::sort(sides.begin(), sides.end());
    sides.erase(std::unique(sides.begin(), sides.end()), sides.end());
    for (const uint64_t side : sides) {
      ends.push_back(entry->firstVertex + static_cast<uint32_t>(side >> 32));
      ends.push_back(entry->firstVertex + static_cast<uint32_t>(side));
    }
  }
  if (ends.empty()) return;
  meshes.setAttributes(lineArray_);
  lineArray_.setIndices(lines_);
  lines_.upload(ends.data(), ends.size() * sizeof(uint32_t));
  records_.bindToUnit(kRecordsUnit);
  glDrawElements(GL_LINES, static_cast<GLsizei>(ends.size()), GL_UNSIGNED_INT, nullptr);
  glBindVertexArray(0);
}

}  // namespace terrane
