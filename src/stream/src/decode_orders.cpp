#include "terrane/stream/decode_orders.h"

#include "terrane/codec/elevation_codec.h"
#include "terrane/codec/packed.h"

namespace terrane {
namespace {

SharedBytes unpackBytes(Unpacker& unpacker) {
  return std::make_shared<const std::vector<uint8_t>>(unpacker.array<uint8_t>());
}
/// Of a parent, what decoding a child reads.
void packParent(Packer& packer, const TileSamples* parent, int quadrant) {
  packer.value(static_cast<uint8_t>(parent != nullptr ? 1 : 0));
  if (parent != nullptr) packQuadrant(packer, *parent, quadrant);
}
std::shared_ptr<const TileSamples> unpackParent(Unpacker& unpacker, int quadrant) {
  if (unpacker.value<uint8_t>() == 0) return nullptr;
  return std::make_shared<const TileSamples>(unpackQuadrant(unpacker, quadrant));
}
void packSamples(Packer& packer, const TileSamples& samples) {
  pack(packer, samples);
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
  // note: the largest part first, so that there is room for all of it.
  packer.reserve(payload->size());
  packParent(packer, parent.get(), quadrant);
  packer.array(*payload);
}
DecodeElevation DecodeElevation::unpack(Unpacker& unpacker) {
  DecodeElevation out;
  out.quadrant = unpacker.value<int32_t>();
  out.scale = unpacker.value<ElevationScale>();
  out.parent = unpackParent(unpacker, out.quadrant);
  out.payload = unpackBytes(unpacker);
  return out;
}
void DecodeElevation::packAnswer(Packer& packer, const Answer& answer) {
  packResult(packer, answer, packTile);
}
DecodeElevation::Answer DecodeElevation::unpackAnswer(Unpacker& unpacker) {
  return unpackResult<Tile>(unpacker, unpackTile);
}

RefineElevation::Answer RefineElevation::run() const {
  return refineTile(*payload, *before, parent.get(), quadrant, scale);
}
void RefineElevation::pack(Packer& packer) const {
  packer.value(static_cast<int32_t>(quadrant));
  packer.value(scale);
  packer.reserve(payload->size());
  packSamples(packer, *before);
  packParent(packer, parent.get(), quadrant);
  packer.array(*payload);
}
RefineElevation RefineElevation::unpack(Unpacker& unpacker) {
  RefineElevation out;
  out.quadrant = unpacker.value<int32_t>();
  out.scale = unpacker.value<ElevationScale>();
  out.before = std::make_shared<const TileSamples>(unpackSamples(unpacker));
  out.parent = unpackParent(unpacker, out.quadrant);
  out.payload = unpackBytes(unpacker);
  return out;
}
void RefineElevation::packAnswer(Packer& packer, const Answer& answer) {
  packResult(packer, answer, packSamples);
}
RefineElevation::Answer RefineElevation::unpackAnswer(Unpacker& unpacker) {
  return unpackResult<TileSamples>(unpacker, unpackSamples);
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
