#include "terrane/render/prepare_lines.h"

#include <algorithm>
#include <cmath>

#include "prepared_lines.h"
#include "srgb.h"

namespace terrane {
namespace {

/// Does all that the shader follows stay inside the tables?
bool holdsTogether(const PreparedLines& lines) {
  const LineGrid& grid = lines.grid;
  if (grid.levels == 0) return grid.slots.empty() && grid.entries.empty();
  const size_t slots = grid.slots.size();
  if (grid.levels < 0 || grid.levels > LineGrid::kMostLevels || slots == 0 || (slots & (slots - 1)) != 0)
    return false;
  // note: a search ends at a slot that is free.
  bool hasFree = false;
  for (const LineCell& slot : grid.slots) {
    const auto count = static_cast<size_t>(slot[3] & LineGrid::kMostCellLines);
    hasFree |= count == 0;
    if (count > 0 && (slot[2] < 0 || static_cast<size_t>(slot[2]) + count > grid.entries.size()))
      return false;
  }
  return hasFree && std::all_of(grid.entries.begin(), grid.entries.end(), [&](const LineEntry& entry) {
           return entry[2] >= 0 && static_cast<size_t>(entry[2]) < lines.styles.size() / 2;
         });
}

}  // namespace

std::shared_ptr<const PreparedLines> prepareLines(std::span<const GroundLine> lines) {
  auto out = std::make_shared<PreparedLines>();
  out->grid = makeLineGrid(lines);
  for (const GroundLine& line : lines) {
    const auto part = [&](size_t i) { return std::clamp(line.srgba[i], 0.0F, 1.0F); };
    out->styles.emplace_back(linearFromSrgb(part(0)), linearFromSrgb(part(1)), linearFromSrgb(part(2)),
                             part(3));
    const auto half = static_cast<float>(0.5 * line.width);
    out->styles.emplace_back(line.isWidthInMeters ? 0.0F : half, line.isWidthInMeters ? half : 0.0F, 0.0F,
                             0.0F);
  }
  return out;
}

void pack(Packer& packer, const GroundLine& line) {
  packer.array(line.corners);
  packer.value(line.srgba);
  packer.value(line.width);
  packer.value(static_cast<uint8_t>(line.isWidthInMeters ? 1 : 0));
}
GroundLine unpackGroundLine(Unpacker& unpacker) {
  GroundLine out;
  out.corners = unpacker.array<glm::dvec2>();
  out.srgba = unpacker.value<std::array<float, 4>>();
  out.width = unpacker.value<double>();
  out.isWidthInMeters = unpacker.value<uint8_t>() != 0;
  unpacker.require(out.width > 0.0 && out.width < 1e7, "a line of no width");
  return out;
}

void pack(Packer& packer, const PreparedLines& prepared) {
  const LineGrid& grid = prepared.grid;
  packer.value(grid.finestCellMeters);
  packer.value(static_cast<int32_t>(grid.levels));
  packer.value(grid.reachMeters);
  packer.value(grid.reachPixels);
  packer.array(grid.slots);
  packer.array(grid.entries);
  packer.array(prepared.styles);
}
std::shared_ptr<const PreparedLines> unpackPreparedLines(Unpacker& unpacker) {
  auto out = std::make_shared<PreparedLines>();
  out->grid.finestCellMeters = unpacker.value<double>();
  out->grid.levels = unpacker.value<int32_t>();
  out->grid.reachMeters = unpacker.value<double>();
  out->grid.reachPixels = unpacker.value<double>();
  out->grid.slots = unpacker.array<LineCell>();
  out->grid.entries = unpacker.array<LineEntry>();
  out->styles = unpacker.array<glm::vec4>();
  unpacker.require(!unpacker.ok() || holdsTogether(*out), "lists of lines that do not hold together");
  return out;
}

}  // namespace terrane
