#pragma once

#include <memory>

#include "terrane/base/packing.h"
#include "terrane/codec/tile.h"

namespace terrane {

/// What a tile's heights become before they are drawn: which cells are shown, and how they catch the light.
struct PreparedTile;
/// A pure function, about two milliseconds; any thread, and without OpenGL.
std::shared_ptr<const PreparedTile> prepareTile(const TileSamples& samples);

/// As bytes for another memory (base/packing.h). What is unpacked from other bytes must not be used: the
/// unpacker's status() tells.
void pack(Packer& packer, const PreparedTile& prepared);
std::shared_ptr<const PreparedTile> unpackPrepared(Unpacker& unpacker);

}  // namespace terrane
