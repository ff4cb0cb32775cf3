#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/codec/tile.h"

/// Elevation payloads, version 4 (docs/format/elevation-v4.md): bytes <-> samples, as pure functions. The
/// same bytes give the same heights, bit for bit, on every machine.
namespace terrane {

/// What a tile's samples are before its own bytes are read: the parent's samples of that quadrant on every
/// second place, and between them the mean of their hypotenuse's ends. An interpolated quad-centre is ground
/// where its four corners are, an interpolated edge-centre where its two ends are; the cells inherit the
/// parent's coverage. Cost: one pass over the tile.
TileSamples interpolateSamples(const TileSamples& parent, int quadrant);

/// The whole child tile that a parent's summary says to be Interpolated or Void. Its nodes have error code 0
/// and the summary's range; edge-centres on its border may have larger codes in the neighbour that is stored.
Tile interpolateTile(const Tile& parent, int quadrant);

/// A tile's samples as the layers up to `layer` have them: Coded ones of later layers are Interpolated, and
/// what is not Coded has the mean of its ends. `layer` is one that is here. Precondition: the world's corners
/// and all samples with a half-size of 16 and more are of the first layer. Cost: a pass over the tile; a copy
/// where all are here.
TileSamples samplesOfLayer(const TileSamples& samples, int layer);

/// Encodes a tile; of one whose samples are in layers, the first. `parent` is null for the root only.
/// Precondition: samples that the parent holds are equal in both, Interpolated and Void samples have the
/// height that interpolateSamples() gives them, Coded ones lie on the scale's step.
std::vector<uint8_t> encodeTile(const Tile& tile, const TileSamples* parent, int quadrant,
                                const ElevationScale& scale);

/// Decodes a tile. `parent` is null for the root only. Errors: any input that encodeTile() cannot have made,
/// with the byte where it went wrong; never reads beyond `payload`, allocates a tile's size at most.
/// `recycled`: a tile that nobody needs any more; whatever it holds, its memory is used again. A third of a
/// megabyte that is fresh from the system takes as long as decoding a thousand samples.
Result<Tile> decodeTile(std::span<const uint8_t> payload, const TileSamples* parent, int quadrant,
                        const ElevationScale& scale, Tile recycled = {});

/// Encodes what a layer of significance after the first adds to a tile (docs/format/refinement-v1.md).
/// `tile`, `parent`: with this layer and perhaps more.
std::vector<uint8_t> encodeRefinement(const TileSamples& tile, const TileSamples* parent, int quadrant,
                                      int layer, const ElevationScale& scale);

/// A tile with one layer more: `before` has all layers before it and no other, `parent` at least it. The
/// layer is before.layerCount. Errors: like decodeTile(), and a layer that the dataset does not have.
Result<TileSamples> refineTile(std::span<const uint8_t> payload, const TileSamples& before,
                               const TileSamples* parent, int quadrant, const ElevationScale& scale);

/// The world's root tile from the beginning of its payload: as many levels of samples as are whole, every
/// 16th at least, means between them, and codes of nodes that claim no more than is known. It looks like the
/// tile from afar; no child may be decoded from it, for its samples are not its own. Errors: too few bytes
/// (some hundred suffice for the coarsest levels), or bytes that begin no root tile. The check is that of
/// the whole payload: damage may go unnoticed until all of it is there.
Result<Tile> decodeRootBeginning(std::span<const uint8_t> beginning, const ElevationScale& scale);

}  // namespace terrane
