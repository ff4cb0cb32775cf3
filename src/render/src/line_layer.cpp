#include "line_layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/vec4.hpp>
#include <memory>
#include <utility>

#include "shader_library.h"
#include "stage_units.h"

namespace terrane {
namespace {

/// Of the pictures that tables are folded into, a megabyte each; the shader has the same numbers.
constexpr int kColumns = 1024, kRows = 64;

float linearFromSrgb(float c) {
  return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
}

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

Status LineLayer::set(std::span<const GroundLine> lines) {
  grid_ = {};
  LineGrid grid = makeLineGrid(lines);
  if (grid.levels == 0) return {};
  if (program_ == nullptr) {
    TERRANE_ASSIGN(gpu::Program made, makeProgram(context_, ProgramRecipes{}.groundLines));
    made.setSampler("uPlaces", kPlacesUnit);
    made.setSampler("uLineCells", kLineCellsUnit);
    made.setSampler("uLineEntries", kLineEntriesUnit);
    made.setSampler("uLineStyles", kLineStylesUnit);
    program_ = std::make_unique<gpu::Program>(std::move(made));
  }
  std::vector<glm::vec4> styles;
  for (const GroundLine& line : lines) {
    const auto part = [&](size_t i) { return std::clamp(line.srgba[i], 0.0F, 1.0F); };
    styles.emplace_back(linearFromSrgb(part(0)), linearFromSrgb(part(1)), linearFromSrgb(part(2)), part(3));
    const auto half = static_cast<float>(0.5 * line.width);
    styles.emplace_back(line.isWidthInMeters ? 0.0F : half, line.isWidthInMeters ? half : 0.0F, 0.0F, 0.0F);
  }
  TERRANE_TRY(upload(cells_, grid.slots.data(), grid.slots.size()));
  TERRANE_TRY(upload(entries_, grid.entries.data(), grid.entries.size()));
  TERRANE_TRY(upload(styles_, styles.data(), styles.size()));

  // Lists and table are on the GPU now.
  grid_ = std::move(grid);
  slotCount_ = static_cast<int>(grid_.slots.size());
  grid_.slots = {};
  grid_.entries = {};
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
