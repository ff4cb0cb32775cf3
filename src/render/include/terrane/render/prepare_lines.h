#pragma once

#include <memory>
#include <span>

#include "terrane/base/packing.h"
#include "terrane/render/ground_lines.h"

namespace terrane {

/// What lines become before they are drawn: where on the ground which of their segments are near.
struct PreparedLines;
/// A pure function, any thread, and without OpenGL. Corners that are not finite are passed over. Cost: some
/// 20 ms for ten thousand segments.
std::shared_ptr<const PreparedLines> prepareLines(std::span<const GroundLine> lines);

/// As bytes for another memory (base/packing.h). What is unpacked from other bytes must not be used: the
/// unpacker's status() tells.
void pack(Packer& packer, const GroundLine& line);
GroundLine unpackGroundLine(Unpacker& unpacker);
void pack(Packer& packer, const PreparedLines& prepared);
std::shared_ptr<const PreparedLines> unpackPreparedLines(Unpacker& unpacker);

}  // namespace terrane
