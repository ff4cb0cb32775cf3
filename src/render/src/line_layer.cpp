#include "line_layer.h"

#include <array>
#include <cmath>
#include <memory>

#include "shader_library.h"
#include "stage_units.h"

namespace terrane {
namespace {

/// Of the pictures that tables are folded into, a megabyte each; the shader has the same numbers.
constexpr int kColumns = 1024, kRows = 64;

}  // namespace

LineLayer::LineLayer(gpu::Context& context)
    : context_(context),
      cells_(gpu::kRgba32I, kColumns, kRows, gpu::Filter::Nearest),
      entries_(gpu::kRgba32I, kColumns, kRows, gpu::Filter::Nearest),
      styles_(gpu::kRgba32F, kColumns, kRows, gpu::Filter::Nearest) {}

Status LineLayer::upload(gpu::TextureArray& target, const void* texels, size_t count) const {
  constexpr size_t kLayer = size_t{kColumns} * kRows, kTexelBytes = 16;
  TERRANE_TRY(target.reserve(context_, static_cast<int>((count + kLayer - 1) / kLayer), gpu::Growth::Exact));
  // Whole rows, and what is left in the last one.
  const auto* bytes = static_cast<const uint8_t*>(texels);
  for (size_t begin = 0; begin < count;) {
    const int row = static_cast<int>(begin % kLayer / kColumns);
    const size_t left = count - begin;
    const int rows = static_cast<int>(std::min<size_t>(left / kColumns, static_cast<size_t>(kRows - row)));
    const gpu::TexelRect rect =
        rows > 0 ? gpu::TexelRect{0, row, kColumns, rows} : gpu::TexelRect{0, row, static_cast<int>(left), 1};
    target.upload(static_cast<int>(begin / kLayer), rect, bytes + begin * kTexelBytes);
    begin += rows > 0 ? static_cast<size_t>(rows) * kColumns : left;
  }
  return {};
}

Status LineLayer::set(const PreparedLines& lines) {
  grid_ = {};
  const LineGrid& grid = lines.grid;
  if (grid.levels == 0) return {};
  if (program_ == nullptr) {
    TERRANE_ASSIGN(gpu::Program made, makeProgram(context_, ProgramRecipes{}.groundLines));
    made.setSampler("uPlaces", kPlacesUnit);
    made.setSampler("uLineCells", kLineCellsUnit);
    made.setSampler("uLineEntries", kLineEntriesUnit);
    made.setSampler("uLineStyles", kLineStylesUnit);
    program_ = std::make_unique<gpu::Program>(std::move(made));
  }
  TERRANE_TRY(upload(cells_, grid.slots.data(), grid.slots.size()));
  TERRANE_TRY(upload(entries_, grid.entries.data(), grid.entries.size()));
  TERRANE_TRY(upload(styles_, lines.styles.data(), lines.styles.size()));

  // Lists and table are on the GPU now.
  slotCount_ = static_cast<int>(grid.slots.size());
  grid_.finestCellMeters = grid.finestCellMeters;
  grid_.levels = grid.levels;
  grid_.reachMeters = grid.reachMeters;
  grid_.reachPixels = grid.reachPixels;
  return {};
}

void LineLayer::draw(const gpu::Texture& places, const Camera& camera, const gpu::Framebuffer& picture) {
  // The eye from its cell: what is near it is told exactly, wherever in the world it is.
  const double cell = grid_.finestCellMeters;
  const double col = std::floor(camera.eyeLocal.x / cell), row = std::floor(camera.eyeLocal.y / cell);
  program_->setInts("uLineTable", std::array<int, 4>{slotCount_ - 1, grid_.levels, static_cast<int>(col),
                                                     static_cast<int>(row)});
  program_->setFloats("uLineEye",
                      std::array<float, 4>{static_cast<float>(camera.eyeLocal.x - col * cell),
                                           static_cast<float>(camera.eyeLocal.y - row * cell),
                                           static_cast<float>(cell), static_cast<float>(grid_.reachMeters)});
  program_->setFloat("uLineReach", static_cast<float>(grid_.reachPixels));
  places.bindToUnit(kPlacesUnit);
  cells_.bindToUnit(kLineCellsUnit);
  entries_.bindToUnit(kLineEntriesUnit);
  styles_.bindToUnit(kLineStylesUnit);
  picture.bind();
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  program_->use();
  nothing_.bind();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindVertexArray(0);
  glDisable(GL_BLEND);
}

}  // namespace terrane
