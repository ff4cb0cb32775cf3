#include "buddy_allocator.h"

#include <bit>

#include "terrane/base/check.h"

namespace terrane {

BuddyAllocator::BuddyAllocator(uint32_t units, uint32_t smallest) : smallest_(smallest) {
  TERRANE_CHECK(std::has_single_bit(units) && std::has_single_bit(smallest) && units >= smallest,
                "{} units in blocks of {}", units, smallest);
  top_ = std::countr_zero(units / smallest);
  free_.resize(static_cast<size_t>(top_) + 1);
  free_.back().insert(0);
}

std::optional<uint32_t> BuddyAllocator::take(uint32_t units) {
  int order = 0;
  while (order <= top_ && blockUnits(order) < units) ++order;
  // The smallest block that is free and large enough, halved as long as half suffices.
  int from = order;
  while (from <= top_ && free_[static_cast<size_t>(from)].empty()) ++from;
  if (from > top_) return std::nullopt;
  auto& blocks = free_[static_cast<size_t>(from)];
  const uint32_t first = *blocks.begin();
  blocks.erase(blocks.begin());
  for (; from > order; --from) free_[static_cast<size_t>(from - 1)].insert(first + blockUnits(from - 1));
  taken_[first] = order;
  used_ += blockUnits(order);
  return first;
}

void BuddyAllocator::giveBack(uint32_t first) {
  const auto at = taken_.find(first);
  TERRANE_CHECK(at != taken_.end(), "unit {} is no taken block", first);
  int order = at->second;
  taken_.erase(at);
  used_ -= blockUnits(order);
  for (; order < top_; ++order) {
    auto& blocks = free_[static_cast<size_t>(order)];
    const auto buddy = blocks.find(first ^ blockUnits(order));
    if (buddy == blocks.end()) break;
    first = first < *buddy ? first : *buddy;
    blocks.erase(buddy);
  }
  free_[static_cast<size_t>(order)].insert(first);
}

void BuddyAllocator::grow() {
  const uint32_t before = units();
  free_.emplace_back();
  ++top_;
  // note: if all of the old half is free, it and the new half are one block.
  auto& halves = free_[static_cast<size_t>(top_) - 1];
  if (halves.erase(0) != 0)
    free_.back().insert(0);
  else
    halves.insert(before);
}

}  // namespace terrane
