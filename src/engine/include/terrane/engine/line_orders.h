#pragma once

#include <memory>
#include <vector>

#include "terrane/render/prepare_lines.h"
#include "terrane/stream/work.h"

namespace terrane {

/// The order that makes of lines what is drawn (stream/work.h): prepareLines().
struct PrepareLines {
  static constexpr uint32_t kKind = 18;
  using Answer = std::shared_ptr<const PreparedLines>;
  std::shared_ptr<const std::vector<GroundLine>> lines;

  Answer run() const { return prepareLines(*lines); }
  void pack(Packer& packer) const;
  static PrepareLines unpack(Unpacker& unpacker);
  static void packAnswer(Packer& packer, const Answer& answer);
  static Answer unpackAnswer(Unpacker& unpacker);
};

}  // namespace terrane
