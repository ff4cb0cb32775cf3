#include "terrane/engine/line_orders.h"

namespace terrane {

void PrepareLines::pack(Packer& packer) const {
  packer.value(static_cast<uint64_t>(lines->size()));
  for (const GroundLine& line : *lines) terrane::pack(packer, line);
}
PrepareLines PrepareLines::unpack(Unpacker& unpacker) {
  auto lines = std::make_shared<std::vector<GroundLine>>();
  const auto count = unpacker.value<uint64_t>();
  for (uint64_t i = 0; i < count && unpacker.ok(); ++i) lines->push_back(unpackGroundLine(unpacker));
  return {std::move(lines)};
}
void PrepareLines::packAnswer(Packer& packer, const Answer& answer) {
  terrane::pack(packer, *answer);
}
PrepareLines::Answer PrepareLines::unpackAnswer(Unpacker& unpacker) {
  return unpackPreparedLines(unpacker);
}

}  // namespace terrane
