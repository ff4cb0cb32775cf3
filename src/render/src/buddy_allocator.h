#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

namespace terrane {

/// Places of different sizes in one stretch of memory, by the buddy system (Knuth, The Art of Computer
/// Programming, 2.5): blocks are powers of two, a block that is given back joins its other half where that is
/// free. Knows numbers only. Up to half of a block is not used.
class BuddyAllocator {
 public:
  /// `units`, and the smallest block, are powers of two.
  BuddyAllocator(uint32_t units, uint32_t smallest);

  uint32_t units() const { return smallest_ << top_; }
  uint32_t usedUnits() const { return used_; }
  /// The first unit of a block with room for so many; nothing where there is none.
  std::optional<uint32_t> take(uint32_t units);
  /// What take() gave.
  void giveBack(uint32_t first);
  /// Twice as many units; the blocks that are taken stay.
  void grow();

 private:
  uint32_t blockUnits(int order) const { return smallest_ << order; }

  uint32_t smallest_;
  int top_ = 0;                              ///< order of the block that is all of it
  std::vector<std::set<uint32_t>> free_;     ///< by order: first units, so that low ones are taken first
  std::unordered_map<uint32_t, int> taken_;  ///< orders
  uint32_t used_ = 0;
};

}  // namespace terrane
