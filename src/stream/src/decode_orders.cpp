#include "terrane/stream/decode_orders.h"

#include "terrane/codec/elevation_codec.h"
#include "terrane/codec/packed.h"

namespace terrane {
namespace {

SharedBytes unpackBytes(Unpacker& unpacker) {
  return std::make_shared<const std::vector<uint8_t>>(unpacker.array<uint8_t>());
}
void packTile(Packer& packer, const Tile& tile) {
  pack(packer, tile);
}
void packPicture(Packer& packer, const ImageryTile& picture) {
  pack(packer, picture);
}

}  // namespace

DecodeElevation::Answer DecodeElevation::run() const {
  return decodeTile(*payload, parent.get(), quadrant, scale);
}
void DecodeElevation::pack(Packer& packer) const {
  packer.value(static_cast<int32_t>(quadrant));
  packer.value(scale);
  packer.value(static_cast<uint8_t>(parent != nullptr ? 1 : 0));
  // note: the largest part first, so that there is room for all of it.
  packer.reserve(payload->size());
  if (parent != nullptr) packQuadrant(packer, *parent, quadrant);
  packer.array(*payload);
}
DecodeElevation DecodeElevation::unpack(Unpacker& unpacker) {
  DecodeElevation out;
  out.quadrant = unpacker.value<int32_t>();
  out.scale = unpacker.value<ElevationScale>();
  if (unpacker.value<uint8_t>() != 0)
    out.parent = std::make_shared<const TileSamples>(unpackQuadrant(unpacker, out.quadrant));
  out.payload = unpackBytes(unpacker);
  return out;
}
void DecodeElevation::packAnswer(Packer& packer, const Answer& answer) {
  packResult(packer, answer, packTile);
}
DecodeElevation::Answer DecodeElevation::unpackAnswer(Unpacker& unpacker) {
  return unpackResult<Tile>(unpacker, unpackTile);
}

SketchElevation::Answer SketchElevation::run() const {
  return decodeRootBeginning(*beginning, scale);
}
void SketchElevation::pack(Packer& packer) const {
  packer.value(scale);
  packer.array(*beginning);
}
SketchElevation SketchElevation::unpack(Unpacker& unpacker) {
  SketchElevation out;
  out.scale = unpacker.value<ElevationScale>();
  out.beginning = unpackBytes(unpacker);
  return out;
}
void SketchElevation::packAnswer(Packer& packer, const Answer& answer) {
  packResult(packer, answer, packTile);
}
SketchElevation::Answer SketchElevation::unpackAnswer(Unpacker& unpacker) {
  return unpackResult<Tile>(unpacker, unpackTile);
}

DecodePicture::Answer DecodePicture::run() const {
  return isBeginning ? decodeImageryPrefix(*payload) : decodeImagery(*payload);
}
void DecodePicture::pack(Packer& packer) const {
  packer.value(static_cast<uint8_t>(isBeginning ? 1 : 0));
  packer.array(*payload);
}
DecodePicture DecodePicture::unpack(Unpacker& unpacker) {
  DecodePicture out;
  out.isBeginning = unpacker.value<uint8_t>() != 0;
  out.payload = unpackBytes(unpacker);
  return out;
}
void DecodePicture::packAnswer(Packer& packer, const Answer& answer) {
  packResult(packer, answer, packPicture);
}
DecodePicture::Answer DecodePicture::unpackAnswer(Unpacker& unpacker) {
  return unpackResult<ImageryTile>(unpacker, unpackPicture);
}

}  // namespace terrane
