#include "terrane/engine/run_order.h"

#include <array>

#include "terrane/engine/line_orders.h"
#include "terrane/engine/tile_orders.h"
#include "terrane/stream/decode_orders.h"

namespace terrane {
namespace {

struct Runner {
  uint32_t kind;
  Status (*run)(std::span<const uint8_t>, Packer&, KeptObjects*);
};
template <class Order>
constexpr Runner runnerOf() {
  return {Order::kKind, runPacked<Order>};
}
constexpr std::array kRunners = {runnerOf<DecodeElevation>(), runnerOf<RefineElevation>(),
                                 runnerOf<SketchElevation>(), runnerOf<DecodePicture>(),
                                 runnerOf<PrepareTile>(),     runnerOf<MakeMeshes>(),
                                 runnerOf<PrepareLines>()};

constexpr bool areKindsDifferent() {
  for (size_t i = 0; i < kRunners.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      if (kRunners[i].kind == kRunners[j].kind) return false;
  return true;
}
static_assert(areKindsDifferent());

}  // namespace

Status runOrder(uint32_t kind, std::span<const uint8_t> order, Packer& answer, KeptObjects* kept) {
  for (const Runner& runner : kRunners)
    if (runner.kind == kind) return runner.run(order, answer, kept);
  return makeError("there is no kind of order {}", kind);
}

}  // namespace terrane
