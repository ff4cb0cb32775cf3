#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "terrane/base/packing.h"
#include "terrane/base/result.h"

/// Work that can be done anywhere: in this thread, in another one, or in a memory of its own to which orders,
/// and from which answers, travel as bytes.
///
/// An *order* is a small value that holds all that its answer follows from. Its type has:
///
///     static constexpr uint32_t kKind = ...;            one number for each type of order
///     using Answer = ...;
///     Answer run() const;                               a pure function, any thread
///     void pack(Packer&) const;                         order and answer as bytes, and back; cheap,
///     static Order unpack(Unpacker&);                   whoever waits for the answer does half of it
///     static void packAnswer(Packer&, const Answer&);
///     static Answer unpackAnswer(Unpacker&);
namespace terrane {

/// An order of any type, and what becomes of its answer.
class Work {
 public:
  virtual ~Work() = default;
  /// Runs the order here and gives the answer away. Once.
  virtual void run() = 0;
  /// The order's type, and the order, for runOrder() elsewhere.
  virtual uint32_t kind() const = 0;
  virtual void pack(Packer& packer) const = 0;
  /// Gives away an answer that was made elsewhere. Error: the bytes are none, and nothing was given away.
  virtual Status takeAnswer(std::span<const uint8_t> bytes) = 0;
};

/// `take(Order::Answer)` is what becomes of the answer.
template <class Order, class Take>
class OrderedWork final : public Work {
 public:
  OrderedWork(Order order, Take take) : order_(std::move(order)), take_(std::move(take)) {}
  void run() override { take_(order_.run()); }
  uint32_t kind() const override { return Order::kKind; }
  void pack(Packer& packer) const override { order_.pack(packer); }
  Status takeAnswer(std::span<const uint8_t> bytes) override {
    Unpacker unpacker(bytes);
    typename Order::Answer answer = Order::unpackAnswer(unpacker);
    TERRANE_TRY(unpacker.status());
    take_(std::move(answer));
    return {};
  }

 private:
  Order order_;
  Take take_;
};

/// Runs an order of that type that came as bytes and packs the answer. `kept`: where what orders have in
/// common stays; null: nowhere. Error: the bytes are no order; then nothing is packed.
template <class Order>
Status runPacked(std::span<const uint8_t> bytes, Packer& answer, KeptObjects* kept = nullptr) {
  Unpacker unpacker(bytes, kept);
  const Order order = Order::unpack(unpacker);
  TERRANE_TRY(unpacker.status());
  Order::packAnswer(answer, order.run());
  return {};
}

}  // namespace terrane
