#include "imagery_store.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane {

namespace {

constexpr int kImageryUnit = 3;
constexpr int kPagesUnit = 4;
// As in shaders/imagery.glsl.
constexpr int kPageColumns = 256;
constexpr int kPageRows = 64;
constexpr size_t kEntriesPerLayer = static_cast<size_t>(kPageColumns) * kPageRows;
constexpr float kHeightFactor = 64.0F;
/// Pages that are not drawn any more stay until there are so many more than twice those drawn.
constexpr size_t kMostIdlePages = 4096;

}  // namespace

ImageryStore::ImageryStore(const gpu::Context& context)
    : context_(context),
      texels_(gpu::kRgba8, kBordered, kBordered, gpu::Filter::Linear),
      pages_(gpu::kRgba32F, kPageColumns, kPageRows, gpu::Filter::Nearest) {}

Status ImageryStore::upload(TileId id, std::span<const uint8_t> rgba) {
  TERRANE_CHECK(id.valid() && (rgba.empty() || rgba.size() == size_t{4} * kBordered * kBordered),
                "{}, {} bytes", toString(id), rgba.size());
  drop(id);
  isChanged_ = true;
  int layer = -1;
  if (!rgba.empty()) {
    layer = pool_.take();
    if (const Status room = texels_.reserve(context_, pool_.highest()); !room.ok()) {
      pool_.giveBack(layer);
      return makeError("no room for imagery tile {} on the GPU: {}", toString(id), room.error().message);
    }
    texels_.uploadLayer(layer, rgba.data());
  }
  layers_.emplace(id, layer);
  return {};
}

void ImageryStore::update(TileId id, const gpu::TexelRect& rect, std::span<const uint8_t> rgba) {
  TERRANE_CHECK(rgba.size() == size_t{4} * static_cast<size_t>(rect.width * rect.height), "{} bytes",
                rgba.size());
  const auto found = layers_.find(id);
  if (found != layers_.end() && found->second >= 0) texels_.upload(found->second, rect, rgba.data());
}

void ImageryStore::drop(TileId id) {
  const auto found = layers_.find(id);
  if (found == layers_.end()) return;
  if (found->second >= 0) pool_.giveBack(found->second);
  layers_.erase(found);
  isChanged_ = true;
}

std::optional<TileId> ImageryStore::nearest(TileId id) const {
  while (layers_.count(id) == 0) {
    if (id.isRoot()) return std::nullopt;
    id = id.parent();
  }
  return id;
}

/// As selectPatches() gives patches: level by level, by place.
bool ImageryStore::Known::operator<(const Known& other) const {
  const Diamond &a = triangle.diamond, &b = other.triangle.diamond;
  if (a.level != b.level) return a.level < b.level;
  if (a.x != b.x) return a.x < b.x;
  if (a.y != b.y) return a.y < b.y;
  return triangle.apex < other.triangle.apex;
}

void ImageryStore::beginPages() {
  std::swap(drawn_, before_);
  drawn_.clear();
  nextBefore_ = 0;
  if (isChanged_ || made_ > 2 * before_.size() + kMostIdlePages) {
    before_.clear();
    entries_.clear();
    made_ = 0;
    uploadedEntries_ = 0;
  }
  if (!std::exchange(isChanged_, false)) return;
  deepest_.clear();
  for (const auto& [id, layer] : layers_) {
    for (TileId at = id;; at = at.parent()) {
      int& deepest = deepest_[at];
      if (deepest >= id.level && !(at == id)) break;
      deepest = std::max(deepest, id.level);
      if (at.isRoot()) break;
    }
  }
}

int32_t ImageryStore::addPage(const Lattice& lattice, const Triangle& triangle, TileId shading) {
  if (layers_.empty()) return -1;
  Known& known = drawn_.emplace_back();
  known = {triangle, shading, lattice.depth(), -1};
  while (nextBefore_ < before_.size() && before_[nextBefore_] < known) ++nextBefore_;
  if (nextBefore_ < before_.size() && before_[nextBefore_].isOf(known)) {
    known.page = before_[nextBefore_].page;
  } else {
    known.page = makePage(lattice, triangle, shading);
    ++made_;
  }
  return known.page;
}

int32_t ImageryStore::makePage(const Lattice& lattice, const Triangle& triangle, TileId shading) {
  const auto ends = lattice.hypotenuse(triangle.diamond);
  const auto columns = std::minmax({ends[0].x, ends[1].x, triangle.apex.x});
  const auto rows = std::minmax({ends[0].y, ends[1].y, triangle.apex.y});
  const auto rangeOf = [&](int level) {
    // A tile has kSide cells of its own level; levels below the lattice's cut its cells.
    const int shift = kSideBits + lattice.depth() - level;
    const auto first = [shift](int64_t at) { return shift >= 0 ? at >> shift : at << -shift; };
    const auto end = [shift](int64_t at) {
      return shift >= 0 ? (at + (int64_t{1} << shift) - 1) >> shift : at << -shift;
    };
    return Range{first(columns.first), first(rows.first),
                 std::max(end(columns.second), first(columns.first) + 1),
                 std::max(end(rows.second), first(rows.first) + 1)};
  };
  const auto tileAt = [](int level, int64_t col, int64_t row) {
    return TileId{level, static_cast<int32_t>(col), static_cast<int32_t>(row)};
  };

  // The finest level that has a tile over the patch: not deeper than anything below the tile around it.
  TileId around{};
  for (int level = 1; level <= kMaxLevel; ++level) {
    const Range range = rangeOf(level);
    if (range.endCol - range.firstCol > 1 || range.endRow - range.firstRow > 1) break;
    around = tileAt(level, range.firstCol, range.firstRow);
  }
  const std::optional<TileId> holder = nearest(around);
  if (!holder) return -1;
  int level = *holder == around ? deepest_.at(around) : holder->level;
  const auto hasTile = [&](const Range& range) {
    if (range.endCol - range.firstCol > kMostTilesAcross || range.endRow - range.firstRow > kMostTilesAcross)
      return false;
    for (int64_t row = range.firstRow; row < range.endRow; ++row)
      for (int64_t col = range.firstCol; col < range.endCol; ++col)
        if (layers_.count(tileAt(level, col, row)) != 0) return true;
    return false;
  };
  while (level > holder->level && !hasTile(rangeOf(level))) --level;

  // Texels count from a tile that is the first of its ancestors' on all levels of the page.
  const int coarser = std::min(kCoarserLevels, level);
  const Range finest = rangeOf(level);
  const int64_t originCol = finest.firstCol >> coarser << coarser;
  const int64_t originRow = finest.firstRow >> coarser << coarser;
  const auto base = static_cast<int32_t>(entries_.size());
  const double scale = std::ldexp(1.0, level - shading.level);
  entries_.push_back({static_cast<float>(coarser), static_cast<float>(scale),
                      static_cast<float>(kSide * (shading.col * scale - static_cast<double>(originCol))),
                      static_cast<float>(kSide * (shading.row * scale - static_cast<double>(originRow)))});
  const size_t heads = entries_.size();
  entries_.resize(heads + static_cast<size_t>(coarser) + 1);
  bool any = false;
  for (int m = 0; m <= coarser; ++m) {
    const Range range = rangeOf(level - m);
    const int64_t firstCol = originCol >> m;
    const int64_t firstRow = originRow >> m;
    const int64_t wide = range.endCol - range.firstCol;
    const int64_t high = range.endRow - range.firstRow;
    entries_[heads + static_cast<size_t>(m)] = {
        static_cast<float>(entries_.size() - static_cast<size_t>(base)),
        static_cast<float>(range.firstCol - firstCol), static_cast<float>(range.firstRow - firstRow),
        static_cast<float>(wide) + kHeightFactor * static_cast<float>(high)};
    for (int64_t row = range.firstRow; row < range.endRow; ++row) {
      for (int64_t col = range.firstCol; col < range.endCol; ++col) {
        const std::optional<TileId> tile = nearest(tileAt(level - m, col, row));
        const int layer = tile ? layers_.at(*tile) : -1;
        any = any || layer >= 0;
        // The texels of this place in the tile: shrunk, and moved to where it lies in its ancestor.
        const int up = tile ? level - m - tile->level : 0;
        const double shrink = std::ldexp(1.0, -up);
        const auto offset = [&](int64_t at, int64_t first) {
          const int64_t inside = at & ((int64_t{1} << up) - 1);
          return static_cast<float>(kSide * shrink * static_cast<double>(inside - (at - first)));
        };
        entries_.push_back({static_cast<float>(layer), static_cast<float>(shrink), offset(col, firstCol),
                            offset(row, firstRow)});
      }
    }
  }
  if (any) return base;
  entries_.resize(static_cast<size_t>(base));
  return -1;
}

Status ImageryStore::finishPages() {
  const size_t layers = (entries_.size() + kEntriesPerLayer - 1) / kEntriesPerLayer;
  TERRANE_TRY(texels_.reserve(context_, 1));
  TERRANE_TRY(pages_.reserve(context_, std::max(1, static_cast<int>(layers))));
  if (uploadedEntries_ == entries_.size()) return {};
  // Whole rows, those that have begun again.
  const size_t count = entries_.size();
  entries_.resize((count + kPageColumns - 1) / kPageColumns * kPageColumns);
  for (size_t row = uploadedEntries_ / kPageColumns; row * kPageColumns < count;) {
    const size_t layer = row / kPageRows;
    const size_t end = std::min(entries_.size() / kPageColumns, (layer + 1) * kPageRows);
    pages_.upload(static_cast<int>(layer),
                  {0, static_cast<int>(row % kPageRows), kPageColumns, static_cast<int>(end - row)},
                  &entries_[row * kPageColumns]);
    row = end;
  }
  entries_.resize(count);
  uploadedEntries_ = count;
  return {};
}

void ImageryStore::bind() const {
  texels_.bindToUnit(kImageryUnit);
  pages_.bindToUnit(kPagesUnit);
}

void ImageryStore::setSamplers(const gpu::Program& program) {
  program.setSampler("uImagery", kImageryUnit);
  program.setSampler("uImageryPages", kPagesUnit);
}

}  // namespace terrane
