#pragma once

#include "terrane/base/packing.h"
#include "terrane/codec/imagery_codec.h"
#include "terrane/codec/mesh_level.h"
#include "terrane/codec/tile.h"

/// What decoding gives, as bytes for another memory (base/packing.h). Unpacking checks sizes, and that what
/// counts or points stays inside; not heights. Cost: a copy.
namespace terrane {

void pack(Packer& packer, const Coverage& coverage);
Coverage unpackCoverage(Unpacker& unpacker);

void pack(Packer& packer, const TileSamples& samples);
TileSamples unpackSamples(Unpacker& unpacker);
/// What decoding a child of that quadrant reads of its parent's samples; the others are 0 when unpacked.
void packQuadrant(Packer& packer, const TileSamples& parent, int quadrant);
TileSamples unpackQuadrant(Unpacker& unpacker, int quadrant);

/// A decoded tile, or one of which only samples and nodes' errors are of use.
void pack(Packer& packer, const Tile& tile);
Tile unpackTile(Unpacker& unpacker);

void pack(Packer& packer, const ImageryTile& picture);
ImageryTile unpackPicture(Unpacker& unpacker);

void pack(Packer& packer, const MeshLevel& meshes);
MeshLevel unpackMeshLevel(Unpacker& unpacker);

}  // namespace terrane
