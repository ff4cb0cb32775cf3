#include "tile_groups.h"

#include <limits>
#include <set>

namespace terrane {
namespace {

/// A group lies so many levels below its top: sixteen tiles, or more where they are small, as long as the
/// line needs no more than this for all of them.
constexpr int kGroupLevels = 2, kMostGroupLevels = 4;
constexpr double kGroupSeconds = 0.02;
/// Where so much of a group is here or wanted, the rest of it may come along.
constexpr double kGroupShare = 0.4;

}  // namespace

std::vector<TileKey> TileGroups::tilesOf(const Group& group) {
  const auto& [of, levels] = group;
  const int side = 1 << levels;
  std::vector<TileKey> out;
  out.reserve(static_cast<size_t>(side * side));
  for (int i = 0; i < side * side; ++i)
    out.push_back(
        {of.layer, {of.tile.level + levels, of.tile.col * side + i % side, of.tile.row * side + i / side}});
  return out;
}

/// The group that a smallest one belongs to: larger, as long as it has no more bytes than `mostBytes`.
TileGroups::Group TileGroups::groupAround(Group group, double mostBytes) {
  while (group.levels < kMostGroupLevels && !group.top.tile.isRoot()) {
    const Group larger{group.top.parent(), group.levels + 1};
    if (bytesOf(larger) > mostBytes) break;
    group = larger;
  }
  return group;
}

/// What its tiles have; infinite while not all directories are here. Asked for in every frame, so remembered.
double TileGroups::bytesOf(const Group& group) {
  const auto known = bytes_.find(group);
  if (known != bytes_.end()) return known->second;
  double bytes = 0.0;
  for (const TileKey& key : tilesOf(group)) {
    const PmtilesIndex::Found found = archives_.find(key);
    if (found.kind == PmtilesIndex::Kind::InDirectory) return std::numeric_limits<double>::infinity();
    if (found.kind == PmtilesIndex::Kind::Stored) bytes += static_cast<double>(found.place.bytes);
  }
  bytes_[group] = bytes;
  return bytes;
}

std::vector<TileGroups::Companion> TileGroups::companionsOf(std::span<const TileKey> fetched, uint64_t turn,
                                                            double bytesPerSecond) {
  std::set<Group> groups;
  std::map<TileKey, Group> groupOf;  // the top of a smallest group -> the group around it
  for (const TileKey& key : fetched) {
    if (key.tile.level < kGroupLevels) continue;
    const TileKey top{key.layer, key.tile.ancestor(key.tile.level - kGroupLevels)};
    const auto [at, isNew] = groupOf.try_emplace(top);
    if (isNew) at->second = groupAround({top, kGroupLevels}, kGroupSeconds * bytesPerSecond);
    groups.insert(at->second);
  }

  std::vector<Companion> out;
  for (const Group& group : groups) {
    int stored = 0, known = 0;
    std::vector<Companion> others;
    for (const TileKey& key : tilesOf(group)) {
      const PmtilesIndex::Found found = archives_.find(key);
      if (found.kind != PmtilesIndex::Kind::Stored) continue;
      ++stored;
      const ShelfEntry* entry = shelf_.find(key);
      const bool isHere =
          entry != nullptr && (entry->isDecoded() || entry->payload != nullptr || entry->request != 0);
      if (isHere || (entry != nullptr && entry->lastWanted == turn))
        ++known;
      else if (entry == nullptr || (entry->failures == 0 && !entry->lost))
        others.push_back({key, found.place});
    }
    if (known >= kGroupShare * stored) out.insert(out.end(), others.begin(), others.end());
  }
  return out;
}

}  // namespace terrane
