#include "wish_order.h"

#include <algorithm>

namespace terrane {
namespace {

/// Of what a wish is worth at least, per pixel: once all else is here, targets are met as well.
constexpr double kLeastWorth = 0.01;

double worthOf(const StreamWish& wish, double looseness) {
  const double target = wish.targetPixels * looseness;
  const double gain = std::max(0.0, wish.nowPixels - target) - std::max(0.0, wish.afterPixels - target);
  const double least = kLeastWorth * std::min(wish.nowPixels, 4.0);
  return wish.chance * std::max(wish.areaPixels, 1.0) * std::max(gain, least);
}

}  // namespace

void WishOrder::replace(std::span<const StreamWish> wishes, double looseness, double nowSeconds) {
  ++turn_;
  wishes_.assign(wishes.begin(), wishes.end());
  struct Scored {
    size_t index;
    double worthPerByte;
    bool isUrgent;
  };
  std::vector<Scored> scored;
  for (size_t i = 0; i < wishes_.size(); ++i) {
    const double bytes = static_cast<double>(storedBytes(wishes_[i].key)) + kRequestBytes;
    scored.push_back({i, worthOf(wishes_[i], looseness) / bytes, wishes_[i].chance >= 1.0});
  }
  if (!inOrder_) {
    std::stable_sort(scored.begin(), scored.end(), [](const Scored& a, const Scored& b) {
      return a.isUrgent != b.isUrgent ? a.isUrgent : a.worthPerByte > b.worthPerByte;
    });
  }
  ranked_.clear();
  // What is only sketched is seen wherever nothing finer is.
  for (const TileKey& root : archives_.roots()) {
    ShelfEntry* entry = shelf_.find(root);
    if (entry == nullptr || !entry->isSketched() || entry->isDecoded()) continue;
    entry->lastWanted = turn_;
    ranked_.push_back({root, 0.0, true});
  }
  for (const Scored& wish : scored) {
    const StreamWish& of = wishes_[wish.index];
    rankWithNeeds({of.key, wish.worthPerByte, wish.isUrgent, of.chance, of.nowPixels / of.targetPixels},
                  nowSeconds);
  }
}

/// Pictures decode by themselves. Elevation needs its parents, and a refinement what it adds to: that stays
/// wanted once it is decoded, or the tile might go while it is being refined.
void WishOrder::rankWithNeeds(const RankedTile& ranked, double nowSeconds) {
  const TileKey& key = ranked.key;
  ShelfEntry& entry = shelf_.at(key);
  if (isWanted(entry)) return;
  if (entry.lastWanted + 1 < turn_) entry.wantedSince = nowSeconds;
  entry.lastWanted = turn_;
  const auto rankNeed = [&](const TileKey& need) {
    RankedTile before = ranked;
    before.key = need;
    rankWithNeeds(before, nowSeconds);
  };
  if (key.isElevation() && !key.tile.isRoot()) {
    const ShelfEntry* parent = shelf_.find(key.parent());
    if (parent == nullptr || !parent->isDecoded()) rankNeed(key.parent());
  }
  if (key.isRefinement()) rankNeed(key.before());
  ranked_.push_back(ranked);
}

uint64_t WishOrder::storedBytes(const TileKey& key) const {
  const PmtilesIndex::Found found = archives_.find(key);
  return found.kind == PmtilesIndex::Kind::Stored ? found.place.bytes : 0;
}

bool WishOrder::isHereOrLost(const TileKey& key) const {
  const ShelfEntry* entry = shelf_.find(key);
  return entry != nullptr && (entry->isDecoded() || entry->lost);
}

double WishOrder::debt() const {
  double sum = 0.0;
  for (const StreamWish& wish : wishes_) {
    if (wish.chance < 1.0 || isHereOrLost(wish.key)) continue;
    sum += wish.areaPixels * std::max(0.0, wish.nowPixels - wish.targetPixels);
  }
  return sum;
}

uint64_t WishOrder::wishedBytes() const {
  uint64_t sum = 0;
  for (const StreamWish& wish : wishes_) {
    if (wish.chance < 1.0) continue;
    const ShelfEntry* entry = shelf_.find(wish.key);
    if (entry != nullptr && (entry->isDecoded() || entry->payload != nullptr || entry->lost)) continue;
    sum += storedBytes(wish.key);
  }
  return sum;
}

uint64_t WishOrder::missingTiles() const {
  const auto missing = std::count_if(ranked_.begin(), ranked_.end(),
                                     [&](const RankedTile& ranked) { return !isHereOrLost(ranked.key); });
  return static_cast<uint64_t>(missing);
}

bool WishOrder::canMoreCome() const {
  return std::any_of(ranked_.begin(), ranked_.end(), [&](const RankedTile& ranked) {
    return !isHereOrLost(ranked.key) && archives_.find(ranked.key).kind != PmtilesIndex::Kind::NotStored &&
           !shelf_.isBelowLost(ranked.key);
  });
}

}  // namespace terrane
