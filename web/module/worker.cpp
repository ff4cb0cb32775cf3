#include <emscripten.h>

#include <vector>

#include "terrane/engine/run_order.h"

/// What a Web Worker has of the engine: it runs orders that come as bytes. web/package/src/worker.ts calls
/// it.

namespace {

std::vector<uint8_t> order;
terrane::Packer answer;
terrane::KeptObjects kept;

}  // namespace

extern "C" {
/// Room for an order; the next one takes it again.
EMSCRIPTEN_KEEPALIVE uint8_t* terrane_order_room(size_t bytes) {
  order.resize(bytes);
  return order.data();
}
/// Runs the order that is there. Returns whether it is one; then terrane_answer() is its answer, else, in
/// UTF-8, why not. Both stay until the next call.
EMSCRIPTEN_KEEPALIVE bool terrane_run_order(uint32_t kind) {
  answer.clear();
  const terrane::Status done = terrane::runOrder(kind, order, answer, &kept);
  if (!done.ok()) answer.elements(done.error().message.data(), done.error().message.size());
  return done.ok();
}
EMSCRIPTEN_KEEPALIVE const uint8_t* terrane_answer() {
  return answer.bytes().data();
}
EMSCRIPTEN_KEEPALIVE size_t terrane_answer_bytes() {
  return answer.bytes().size();
}
}
