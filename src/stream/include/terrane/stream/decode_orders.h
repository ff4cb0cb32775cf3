#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "terrane/codec/imagery_codec.h"
#include "terrane/codec/tile.h"
#include "terrane/stream/work.h"

/// The orders by which payloads become tiles and pictures (work.h).
namespace terrane {

using SharedBytes = std::shared_ptr<const std::vector<uint8_t>>;

/// An elevation tile, from its payload and its parent's samples.
struct DecodeElevation {
  static constexpr uint32_t kKind = 1;
  using Answer = Result<Tile>;
  SharedBytes payload;
  std::shared_ptr<const TileSamples> parent;  ///< with any layers of significance; null for the root
  int quadrant = 0;                           ///< of the parent
  ElevationScale scale;

  Answer run() const;
  void pack(Packer& packer) const;
  static DecodeElevation unpack(Unpacker& unpacker);
  static void packAnswer(Packer& packer, const Answer& answer);
  static Answer unpackAnswer(Unpacker& unpacker);
};

/// An elevation tile's samples with one layer of significance more, from its refinement's payload.
struct RefineElevation {
  static constexpr uint32_t kKind = 4;
  using Answer = Result<TileSamples>;
  SharedBytes payload;
  std::shared_ptr<const TileSamples> before;  ///< the tile's, with all layers before this one and no other
  std::shared_ptr<const TileSamples> parent;  ///< with this layer at least; null for the root
  int quadrant = 0;                           ///< of the parent
  ElevationScale scale;

  Answer run() const;
  void pack(Packer& packer) const;
  static RefineElevation unpack(Unpacker& unpacker);
  static void packAnswer(Packer& packer, const Answer& answer);
  static Answer unpackAnswer(Unpacker& unpacker);
};

/// What can be seen of the world's root from the beginning of its payload.
struct SketchElevation {
  static constexpr uint32_t kKind = 2;
  using Answer = Result<Tile>;
  SharedBytes beginning;
  ElevationScale scale;

  Answer run() const;
  void pack(Packer& packer) const;
  static SketchElevation unpack(Unpacker& unpacker);
  static void packAnswer(Packer& packer, const Answer& answer);
  static Answer unpackAnswer(Unpacker& unpacker);
};

/// A picture, from its payload or the beginning of it.
struct DecodePicture {
  static constexpr uint32_t kKind = 3;
  using Answer = Result<ImageryTile>;
  SharedBytes payload;
  bool isBeginning = false;

  Answer run() const;
  void pack(Packer& packer) const;
  static DecodePicture unpack(Unpacker& unpacker);
  static void packAnswer(Packer& packer, const Answer& answer);
  static Answer unpackAnswer(Unpacker& unpacker);
};

}  // namespace terrane
