#include "terrane/stream/tile_stream.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "archives.h"
#include "back_off.h"
#include "line_pace.h"
#include "terrane/base/check.h"
#include "terrane/stream/decode_orders.h"
#include "terrane/stream/line_estimate.h"
#include "terrane/stream/plan_requests.h"
#include "tile_shelf.h"

namespace terrane {
namespace {

/// Bytes on the line that a request takes besides its answer's body.
constexpr double kRequestBytes = 500.0;
constexpr double kLostSeconds = 60.0;
/// The part of a root that comes first. So much shows mountains and coasts.
constexpr uint64_t kFirstPartBytes = 6000;
/// A part of a root should be here within this.
constexpr double kPartSeconds = 0.5;
/// Over a line thinner than that roots come in parts, their beginnings before all else. Of a quick line with
/// a latency of 0.2 s manifest and directories say twice as much.
constexpr double kThinBytesPerSecond = 32e3;
/// Over a line that brought the manifest at least as quickly, the coarsest tiles come along with directories:
/// so much is asked for first. note: of so small an answer a quick line looks much slower than it is.
constexpr double kQuickBytesPerSecond = 2.0 * kThinBytesPerSecond;
/// Groups are the tiles so many levels below one tile, which lie together in the archive: sixteen, or more
/// where they are small, as long as the line needs no more than this for all of them.
constexpr int kGroupLevels = 2, kMostGroupLevels = 4;
constexpr double kGroupSeconds = 0.02;
/// Where so much of a group is here or wanted, the rest of it may come along.
constexpr double kGroupShare = 0.4;
/// For so long a request may have the line: what is urgent by then waits for it.
constexpr double kHoldSeconds = 0.2;
/// Bytes that nobody wants and a request that brings as many are worth the same: the line's for so long.
constexpr double kGapSeconds = 0.004;
/// What may wait does so until a request would have the line for so long, but no longer than that.
constexpr double kWorthStartingSeconds = 0.03;
constexpr double kLongestWaitSeconds = 2.0;
/// So does what hardly misses its target, but for less long.
constexpr double kLittleExcess = 1.5;
constexpr double kLittleSeconds = 0.25;
/// Wishes with less chance than that are for later.
constexpr double kSoonChance = 0.4;
/// Of what a wish is worth at least, per pixel: once all else is here, targets are met as well.
constexpr double kLeastWorth = 0.01;

/// What the workers have made. They keep it alive, whatever happened to the stream meanwhile.
struct Made {
  TileKey key;
  std::shared_ptr<const Tile> tile;
  std::shared_ptr<const ImageryTile> picture;
  std::string problem;
  bool isSketch = false;
};
struct Finished {
  std::mutex mutex;
  std::vector<Made> made;
};

}  // namespace

class TileStream::State {
 public:
  State(std::unique_ptr<Transport> transport, Workers& workers, const StreamOptions& options)
      : transport_(std::move(transport)),
        options_(options),
        shelf_({options.compressedBytes, options.decodedBytes, options.pictureBytes}),
        finished_(std::make_shared<Finished>()),
        workers_(workers) {}

  void poll(double nowSeconds) {
    now_ = std::max(now_, nowSeconds);
    for (FetchAnswer& answer : transport_->poll(now_)) take(std::move(answer));
    takeMade();
    if (phase_ == StreamPhase::Opening) startOpening();
    if (phase_ != StreamPhase::Ready) return;
    pace_.update(now_, debt(), wishedBytes(), line_.bytesPerSecond());
    // Room first: what nobody wants any more makes place for what is wanted now.
    shelf_.keepWithinBudgets(turn_);
    startDecoding();
    // note: workers that do their jobs at once have finished by now, and their children can begin.
    for (uint64_t before = 0; before != statistics_.tilesDecoded;) {
      before = statistics_.tilesDecoded;
      takeMade();
      startDecoding();
    }
    startFetching();
  }

  void want(std::span<const StreamWish> wishes) {
    TERRANE_CHECK(phase_ == StreamPhase::Ready, "wishes before the dataset is open");
    ++turn_;
    wishes_.assign(wishes.begin(), wishes.end());
    rank();
    cancelUnwanted();
  }

  StreamPhase phase_ = StreamPhase::Opening;
  std::string problem_;
  Archives archives_;
  TileShelf& shelf() { return shelf_; }
  const TileShelf& shelf() const { return shelf_; }
  const Transport& transport() const { return *transport_; }
  std::vector<TileKey> takeNews() { return std::exchange(news_, {}); }
  bool isDecoding() const { return decoding_ > 0; }

  bool isIdle() const {
    if (phase_ == StreamPhase::Failed) return true;
    if (phase_ != StreamPhase::Ready || !underway_.empty() || decoding_ > 0) return false;
    return std::all_of(ranked_.begin(), ranked_.end(), [&](const Ranked& ranked) {
      const ShelfEntry* entry = shelf_.find(ranked.key);
      return (entry != nullptr && (entry->isDecoded() || entry->lost)) ||
             archives_.find(ranked.key).kind == PmtilesIndex::Kind::NotStored || isBelowLost(ranked.key);
    });
  }

  StreamStatistics statistics() const {
    StreamStatistics out = statistics_;
    out.requestsUnderway = underway_.size();
    for (const auto& [id, request] : underway_) out.bytesUnderway += request.plan.bytes;
    out.debt = phase_ == StreamPhase::Ready ? debt() : 0.0;
    out.wishedBytes = phase_ == StreamPhase::Ready ? wishedBytes() : 0;
    for (const Ranked& ranked : ranked_) {
      const ShelfEntry* entry = shelf_.find(ranked.key);
      out.wishes += entry == nullptr || (!entry->isDecoded() && !entry->lost) ? 1 : 0;
    }
    // Without a failure nothing is lost.
    if (statistics_.requestsFailed + statistics_.tilesDamaged > 0) out.tilesLost = shelf_.lostTiles();
    out.looseness = pace_.looseness();
    out.bytesPerSecond = line_.bytesPerSecond();
    out.latencySeconds = line_.latencySeconds();
    out.isOffline = offlineTries_ > 0;
    out.compressedBytes = shelf_.compressedBytes();
    out.decodedBytes = shelf_.decodedBytes();
    out.decodedTiles = shelf_.decodedTiles();
    out.pictureBytes = shelf_.pictureBytes();
    return out;
  }

 private:
  enum class What : uint8_t { Manifest, FirstBytes, Directory, Tiles };
  struct Underway {
    What what = What::Tiles;
    PlannedRequest plan;                      ///< file, bytes
    std::vector<TileKey> keys;                ///< Tiles
    std::vector<PmtilesIndex::Place> places;  ///< of these, without what has come before
    bool isPart = false;                      ///< of the one tile, and not its end
    double started = 0.0;
  };
  /// A wished tile, or one that it needs, in the order of what it is worth.
  struct Ranked {
    TileKey key;
    double worthPerByte = 0.0;  ///< of the wish
    bool isUrgent = true;       ///< of use now; else only perhaps, later
    double chance = 1.0;        ///< the wish's
    double excess = 1.0;        ///< of the wish: its error now, in targets
  };
  /// Manifest, first bytes and directories have their own few tries.
  struct Tries {
    int failures = 0;
    double notBefore = 0.0;
  };

  // ---------------------------------------------------------------------------------- what has come

  void take(FetchAnswer answer) {
    const auto at = underway_.find(answer.id);
    if (at == underway_.end()) return;
    // What made it fail is what it says, whatever comes after.
    if (phase_ == StreamPhase::Failed) return;
    const Underway request = std::move(at->second);
    underway_.erase(at);
    if (answer.failure) {
      ++statistics_.requestsFailed;
      problem_ = answer.failure->message;
      takeFailure(answer.id, request, *answer.failure);
      return;
    }
    offlineTries_ = 0;
    statistics_.bytesReceived += answer.bytes.size();
    line_.answered(answer.tookSeconds ? now_ - *answer.tookSeconds : request.started, now_,
                   answer.bytes.size());
    switch (request.what) {
      case What::Manifest:
        if (const Status status = archives_.setManifest(answer.bytes, transport_->where()); !status.ok())
          fail(status.error().message);
        break;
      case What::FirstBytes:
        if (const Status status = archives_.setFirstBytes(request.plan.file, answer.bytes); !status.ok())
          retryOrFail(request, status.error().message);
        else
          keepFirstTiles(request.plan.file, answer.bytes);
        break;
      case What::Directory:
        if (const Status status = archives_.addDirectory(request.plan.file, request.places[0], answer.bytes);
            !status.ok())
          retryDirectory(request);
        else if (request.plan.offset == 0)
          keepFirstTiles(request.plan.file, answer.bytes);
        break;
      case What::Tiles:
        takeTiles(request, answer.bytes);
        break;
    }
  }

  /// The root, and what else of the coarsest tiles came along with an archive's first bytes.
  void keepFirstTiles(int file, const std::vector<uint8_t>& bytes) {
    std::vector<TileId> tiles = {TileId{}};
    for (size_t i = 0; i < tiles.size(); ++i) {
      const TileKey key = archives_.keyOf(file, tiles[i]);
      const PmtilesIndex::Found found = archives_.find(key);
      if (found.kind != PmtilesIndex::Kind::Stored || found.place.offset + found.place.bytes > bytes.size())
        continue;
      const auto begin = bytes.begin() + static_cast<ptrdiff_t>(found.place.offset);
      shelf_.setPayload(key, {begin, begin + static_cast<ptrdiff_t>(found.place.bytes)},
                        fetchCost(found.place.bytes));
      ++statistics_.tilesReceived;
      for (int quadrant = 0; quadrant < 4; ++quadrant) tiles.push_back(key.tile.child(quadrant));
    }
  }

  void takeTiles(const Underway& request, const std::vector<uint8_t>& bytes) {
    uint64_t used = 0;
    for (size_t i = 0; i < request.keys.size(); ++i) {
      const TileKey& key = request.keys[i];
      const auto& place = request.places[i];
      ShelfEntry& entry = shelf_.at(key);
      entry.request = 0;
      const auto begin = bytes.begin() + static_cast<ptrdiff_t>(place.offset - request.plan.offset);
      const auto end = begin + static_cast<ptrdiff_t>(place.bytes);
      if (entry.lastWanted == turn_) used += place.bytes;
      if (!entry.beginning.empty() || request.isPart) {
        entry.beginning.insert(entry.beginning.end(), begin, end);
        if (request.isPart) continue;
        shelf_.setPayload(key, std::exchange(entry.beginning, {}), fetchCost(place.bytes));
      } else {
        shelf_.setPayload(key, {begin, end}, fetchCost(place.bytes));
      }
      ++statistics_.tilesReceived;
    }
    statistics_.bytesUnwanted += bytes.size() - used;
    if (request.isPart) sketch(request.keys[0]);
  }

  double fetchCost(uint64_t bytes) const {
    return line_.latencySeconds() * line_.bytesPerSecond() + kRequestBytes + static_cast<double>(bytes);
  }

  void takeFailure(uint64_t id, const Underway& request, const FetchFailure& failure) {
    if (failure.problem == FetchProblem::Fatal) return fail(failure.message);
    // Nobody there: not the tiles' fault. Ask again, ever more rarely, with one request at a time.
    if (failure.problem == FetchProblem::Unreachable) {
      ++offlineTries_;
      offlineUntil_ = now_ + std::min(5.0, backOff(offlineTries_, id));
      for (const TileKey& key : request.keys) shelf_.at(key).request = 0;
      return;
    }
    offlineTries_ = 0;
    if (request.what == What::Directory) return retryDirectory(request);
    if (request.what != What::Tiles) {
      if (failure.problem == FetchProblem::Missing) return fail(failure.message);
      return retryOrFail(request, failure.message);
    }
    for (const TileKey& key : request.keys) {
      ShelfEntry& entry = shelf_.at(key);
      entry.request = 0;
      // One of several may be the reason: each by itself, then.
      if (request.keys.size() > 1 && failure.problem != FetchProblem::Busy) {
        entry.alone = true;
        continue;
      }
      entry.fresh = failure.problem == FetchProblem::Malformed;
      failTile(key, entry, failure.problem, failure.retryAfterSeconds);
    }
  }

  void failTile(const TileKey& key, ShelfEntry& entry, FetchProblem problem, double atLeastSeconds) {
    ++entry.failures;
    if (problem != FetchProblem::Busy) ++entry.damages;
    if (problem == FetchProblem::Missing) {
      entry.lost = true;
      entry.notBefore = std::numeric_limits<double>::infinity();
    } else if (entry.failures >= kMostBusy || entry.damages >= kMostDamaged) {
      entry.lost = true;
      entry.notBefore = now_ + kLostSeconds;
    } else {
      entry.notBefore = now_ + std::max(atLeastSeconds, backOff(entry.failures, TileKeyHash{}(key)));
    }
  }

  void fail(const std::string& why) {
    problem_ = why;
    phase_ = StreamPhase::Failed;
  }
  void retryOrFail(const Underway& request, const std::string& why) {
    Tries& tries = openingTries_[request.what == What::Manifest ? -1 : request.plan.file];
    problem_ = why;
    if (++tries.failures >= kMostBusy) return fail(why);
    tries.notBefore = now_ + backOff(tries.failures, static_cast<uint64_t>(request.plan.file) + 7);
  }
  void retryDirectory(const Underway& request) {
    Tries& tries = directoryTries_[{request.plan.file, request.plan.offset}];
    ++tries.failures;
    tries.notBefore = now_ + backOff(tries.failures, request.plan.offset);
  }

  void takeMade() {
    std::vector<Made> made;
    {
      const std::lock_guard lock(finished_->mutex);
      made = std::exchange(finished_->made, {});
    }
    for (Made& done : made) {
      --decoding_;
      ShelfEntry& entry = shelf_.at(done.key);
      if (done.isSketch) {
        takeSketch(std::move(done), entry);
        continue;
      }
      entry.decoding = false;
      if (!done.problem.empty()) {
        // Damaged on its way, or in the archive: past caches, it may be sound.
        ++statistics_.tilesDamaged;
        problem_ = done.problem;
        shelf_.dropPayload(entry);
        entry.alone = entry.fresh = true;
        failTile(done.key, entry, FetchProblem::Malformed, 0.0);
        continue;
      }
      entry.failures = entry.damages = 0;
      entry.lost = entry.fresh = false;
      entry.sketch.reset();
      entry.pictureSketch.reset();
      ++statistics_.tilesDecoded;
      if (done.tile != nullptr)
        shelf_.setTile(done.key.tile, done.tile);
      else
        shelf_.setPicture(done.key, std::move(done.picture));
      news_.push_back(done.key);
    }
  }

  /// note: a beginning that gives nothing (too short, damaged) is not a problem yet: the rest will tell.
  void takeSketch(Made done, ShelfEntry& entry) {
    if (!done.problem.empty() || entry.isDecoded()) return;
    entry.sketch = std::move(done.tile);
    entry.pictureSketch = std::move(done.picture);
    news_.push_back(done.key);
  }

  // ------------------------------------------------------------------------------- what is to be done

  bool isOffline() const { return offlineTries_ > 0; }
  /// May anything be started now? Without a server, one request at a time finds out whether it is back.
  bool mayStart() const { return !isOffline() || (now_ >= offlineUntil_ && underway_.empty()); }

  void start(Underway request, const FetchRequest& what) {
    const uint64_t id = ++lastRequest_;
    request.started = now_;
    ++statistics_.requests;
    transport_->start(id, what);
    underway_.emplace(id, std::move(request));
  }
  bool isUnderway(What what, int file, uint64_t offset) const {
    return std::any_of(underway_.begin(), underway_.end(), [&](const auto& entry) {
      const Underway& request = entry.second;
      return request.what == what && request.plan.file == file && request.plan.offset == offset;
    });
  }

  void startOpening() {
    const auto isDue = [&](int which) {
      const auto at = openingTries_.find(which);
      return at == openingTries_.end() || now_ >= at->second.notBefore;
    };
    if (!archives_.hasManifest()) {
      if (underway_.empty() && mayStart() && isDue(-1))
        start({.what = What::Manifest, .plan = {}, .keys = {}, .places = {}},
              {"manifest.json", 0, 0, false, 0});
      return;
    }
    bool allOpen = true;
    const bool isQuick = line_.bytesPerSecond() >= kQuickBytesPerSecond;
    for (int file = 0; file < archives_.count(); ++file) {
      if (archives_.isOpen(file)) continue;
      // Nothing waits for refinements. Over a thin line, nothing coarser waits behind them, either.
      if (archives_.isRefinement(file)) {
        if (isQuick) startDirectory(archives_.keyOf(file, {}), options_.firstBytes);
        continue;
      }
      allOpen = false;
      if (!mayStart() || !isDue(file) || isUnderway(What::FirstBytes, file, 0)) continue;
      const FetchRequest request = archives_.firstBytes(file, isQuick ? options_.firstBytes : 0);
      start({.what = What::FirstBytes, .plan = {file, 0, request.bytes, {}}, .keys = {}, .places = {}},
            request);
    }
    if (allOpen) phase_ = StreamPhase::Ready;
  }

  uint64_t storedBytes(const TileKey& key) const {
    const PmtilesIndex::Found found = archives_.find(key);
    return found.kind == PmtilesIndex::Kind::Stored ? found.place.bytes : 0;
  }

  double worthOf(const StreamWish& wish) const {
    const double target = wish.targetPixels * pace_.looseness();
    const double gain = std::max(0.0, wish.nowPixels - target) - std::max(0.0, wish.afterPixels - target);
    const double least = kLeastWorth * std::min(wish.nowPixels, 4.0);
    return wish.chance * std::max(wish.areaPixels, 1.0) * std::max(gain, least);
  }

  /// Those of which a beginning is of use: not of refinements.
  std::vector<TileKey> roots() const {
    std::vector<TileKey> out;
    out.reserve(static_cast<size_t>(archives_.count()));
    for (int file = 0; file < archives_.count(); ++file)
      if (!archives_.isRefinement(file)) out.push_back(archives_.keyOf(file, TileId{}));
    return out;
  }

  /// Puts the wishes into order, each behind what it needs.
  void rank() {
    struct Scored {
      size_t index;
      double worthPerByte;
      bool isUrgent;
    };
    std::vector<Scored> scored;
    for (size_t i = 0; i < wishes_.size(); ++i) {
      const double bytes = static_cast<double>(storedBytes(wishes_[i].key)) + kRequestBytes;
      scored.push_back({i, worthOf(wishes_[i]) / bytes, wishes_[i].chance >= 1.0});
    }
    if (!options_.inOrder) {
      std::stable_sort(scored.begin(), scored.end(), [](const Scored& a, const Scored& b) {
        return a.isUrgent != b.isUrgent ? a.isUrgent : a.worthPerByte > b.worthPerByte;
      });
    }
    ranked_.clear();
    // What is only sketched is seen wherever nothing finer is.
    for (const TileKey& root : roots()) {
      ShelfEntry* entry = shelf_.find(root);
      if (entry == nullptr || !entry->isSketched() || entry->isDecoded()) continue;
      entry->lastWanted = turn_;
      ranked_.push_back({root, 0.0, true});
    }
    for (const Scored& wish : scored) {
      const StreamWish& of = wishes_[wish.index];
      rankWithNeeds({of.key, wish.worthPerByte, wish.isUrgent, of.chance, of.nowPixels / of.targetPixels});
    }
  }

  /// Pictures decode by themselves. Elevation needs its parents, and a refinement what it adds to: that stays
  /// wanted once it is decoded, or the tile might go while it is being refined.
  void rankWithNeeds(const Ranked& ranked) {
    const TileKey& key = ranked.key;
    ShelfEntry& entry = shelf_.at(key);
    if (entry.lastWanted == turn_) return;
    if (entry.lastWanted + 1 < turn_) entry.wantedSince = now_;
    entry.lastWanted = turn_;
    const auto rankNeed = [&](const TileKey& need) {
      Ranked before = ranked;
      before.key = need;
      rankWithNeeds(before);
    };
    if (key.isElevation() && !key.tile.isRoot()) {
      const ShelfEntry* parent = shelf_.find(key.parent());
      if (parent == nullptr || !parent->isDecoded()) rankNeed(key.parent());
    }
    if (key.isRefinement()) rankNeed(key.before());
    ranked_.push_back(ranked);
  }

  /// Requests of which nothing is wanted any more, and whose bytes are not on the way yet.
  void cancelUnwanted() {
    for (auto at = underway_.begin(); at != underway_.end();) {
      const Underway& request = at->second;
      const bool isWanted = request.what != What::Tiles ||
                            std::any_of(request.keys.begin(), request.keys.end(), [&](const TileKey& key) {
                              return shelf_.at(key).lastWanted == turn_;
                            });
      if (isWanted || now_ - request.started > line_.latencySeconds()) {
        ++at;
        continue;
      }
      ++statistics_.requestsCancelled;
      transport_->cancel(at->first);
      for (const TileKey& key : request.keys) shelf_.at(key).request = 0;
      at = underway_.erase(at);
    }
  }

  /// Is one of the tiles that it needs given up: an ancestor, or what it refines? Then it cannot be decoded.
  bool isBelowLost(const TileKey& key) const {
    if (!key.isElevation()) return false;
    for (TileKey layer = key;; layer = layer.before()) {
      for (TileKey need = layer;; need = need.parent()) {
        const ShelfEntry* entry = need == key ? nullptr : shelf_.find(need);
        if (entry != nullptr && entry->isDecoded()) break;
        if (entry != nullptr && entry->lost) return true;
        if (need.tile.isRoot()) break;
      }
      if (!layer.isRefinement()) return false;
    }
  }

  /// Hands what is here, and can be decoded, to the workers.
  void startDecoding() {
    for (const Ranked& ranked : ranked_) {
      if (decoding_ >= workers_.width()) return;
      ShelfEntry* entry = shelf_.find(ranked.key);
      if (entry == nullptr || entry->payload == nullptr || entry->decoding || entry->isDecoded()) continue;
      const bool isElevation = ranked.key.isElevation();
      if (isElevation && !shelf_.hasRoomToDecode(ranked.isUrgent, decoding_)) continue;
      if (ranked.key.isRefinement())
        refineElevation(ranked.key, *entry);
      else if (isElevation)
        decodeElevation(ranked.key, *entry);
      else
        decodePicture(ranked.key, *entry);
    }
  }

  void decodeElevation(const TileKey& key, ShelfEntry& entry) {
    DecodeElevation order{entry.payload, nullptr, 0, archives_.manifest().scale};
    if (!key.tile.isRoot()) {
      const ShelfEntry* above = shelf_.find(key.parent());
      if (above == nullptr || above->tile == nullptr) return;
      order.parent = {above->tile, &above->tile->samples};
      order.quadrant = key.tile.quadrant();
    }
    begin(entry);
    // note: before the root there is nothing to draw, and its way to a worker and back takes longer than it.
    if (key.tile.isRoot()) return takerOf(key, false)(order.run());
    workers_.order(std::move(order), takerOf(key, false));
  }

  void refineElevation(const TileKey& key, ShelfEntry& entry) {
    const ShelfEntry* before = shelf_.find(key.before());
    if (before == nullptr || before->tile == nullptr) return;
    RefineElevation order{
        entry.payload, {before->tile, &before->tile->samples}, nullptr, 0, archives_.manifest().scale};
    if (!key.tile.isRoot()) {
      const ShelfEntry* above = shelf_.find(key.parent());
      if (above == nullptr || above->tile == nullptr) return;
      order.parent = {above->tile, &above->tile->samples};
      order.quadrant = key.tile.quadrant();
    }
    begin(entry);
    Taker taker = takerOf(key, false);
    taker.before = before->tile;
    workers_.order(std::move(order), std::move(taker));
  }

  void decodePicture(const TileKey& key, ShelfEntry& entry) {
    begin(entry);
    workers_.order(DecodePicture{entry.payload, false}, takerOf(key, false));
  }

  /// Makes what can be made of the beginning of a root.
  void sketch(const TileKey& key) {
    ++decoding_;
    auto beginning = std::make_shared<const std::vector<uint8_t>>(shelf_.at(key).beginning);
    if (key.isElevation())
      workers_.order(SketchElevation{std::move(beginning), archives_.manifest().scale}, takerOf(key, true));
    else
      workers_.order(DecodePicture{std::move(beginning), true}, takerOf(key, true));
  }

  void begin(ShelfEntry& entry) {
    entry.decoding = true;
    ++decoding_;
    ++statistics_.compressedHits;
  }

  /// Puts what was decoded where takeMade() finds it; any thread.
  struct Taker {
    std::shared_ptr<Finished> finished;
    TileKey key;
    std::string where;
    bool isSketch = false;
    std::shared_ptr<const Tile> before = nullptr;  ///< of a refinement, which leaves all but samples as is

    void operator()(Result<TileSamples> samples) const {
      Made made = begun();
      if (samples.ok())
        made.tile = std::make_shared<const Tile>(Tile{std::move(*samples), before->nodes, before->children});
      else
        made.problem = fmt::format("{}: layer {} of tile {}: {}", where, key.significance(),
                                   toString(key.tile), samples.error().message);
      hand(std::move(made));
    }
    void operator()(Result<Tile> tile) const {
      Made made = begun();
      if (tile.ok())
        made.tile = std::make_shared<const Tile>(std::move(*tile));
      else
        made.problem = fmt::format("{}: tile {}: {}", where, toString(key.tile), tile.error().message);
      hand(std::move(made));
    }
    void operator()(Result<ImageryTile> picture) const {
      Made made = begun();
      if (picture.ok())
        made.picture = std::make_shared<const ImageryTile>(std::move(*picture));
      else
        made.problem =
            fmt::format("{}: imagery tile {}: {}", where, toString(key.tile), picture.error().message);
      hand(std::move(made));
    }

   private:
    Made begun() const {
      return {.key = key, .tile = {}, .picture = {}, .problem = {}, .isSketch = isSketch};
    }
    void hand(Made made) const {
      const std::lock_guard lock(finished->mutex);
      finished->made.push_back(std::move(made));
    }
  };
  Taker takerOf(const TileKey& key, bool isSketch) const {
    return {finished_, key, transport_->where(), isSketch, nullptr};
  }

  /// What of a tile is to be fetched next: all of it, or a part of a root that would take long.
  struct Missing {
    PmtilesIndex::Place place;
    bool isPart = false;
  };
  Missing missingOf(const TileKey& key, const ShelfEntry& entry, PmtilesIndex::Place place) const {
    Missing missing{place, false};
    missing.place.offset += entry.beginning.size();
    missing.place.bytes -= static_cast<decltype(place.bytes)>(entry.beginning.size());
    if (!key.tile.isRoot() || key.isRefinement() || options_.inOrder ||
        line_.bytesPerSecond() >= kThinBytesPerSecond)
      return missing;
    const uint64_t part =
        std::max(kFirstPartBytes, static_cast<uint64_t>(kPartSeconds * line_.bytesPerSecond()));
    missing.isPart = missing.place.bytes > part + part / 2;
    if (missing.isPart) missing.place.bytes = static_cast<decltype(place.bytes)>(part);
    return missing;
  }

  /// Over a thin line, or one that is not known yet, the beginnings of the roots come before all else: the
  /// ground's, without which nothing is seen, then those of pictures. Which of them next; none: all may come.
  std::optional<TileKey> nextBeginning() const {
    if (options_.inOrder || line_.bytesPerSecond() >= kThinBytesPerSecond) return std::nullopt;
    for (const TileKey& root : roots()) {
      const ShelfEntry* entry = shelf_.find(root);
      if (entry != nullptr && entry->lastWanted == turn_ && !hasBegun(*entry) && !entry->lost &&
          archives_.find(root).kind != PmtilesIndex::Kind::NotStored)
        return root;
    }
    return std::nullopt;
  }
  static bool hasBegun(const ShelfEntry& entry) {
    return entry.isDecoded() || entry.payload != nullptr || !entry.beginning.empty();
  }

  /// May a wish wait for others that share a request with it? What is for later may, as long as it is not
  /// old; what is of use now may for as long as an answer takes, while others are under way.
  bool mayWait(const Ranked& ranked, const ShelfEntry& entry) const {
    if (options_.inOrder) return false;
    const double waited = now_ - entry.wantedSince;
    if (ranked.chance < kSoonChance) return waited < kLongestWaitSeconds;
    if (ranked.excess < kLittleExcess && waited < kLittleSeconds) return true;
    return !underway_.empty() && waited < line_.latencySeconds();
  }

  static std::vector<TileKey> tilesBelow(const TileKey& of, int levels) {
    const int side = 1 << levels;
    std::vector<TileKey> out;
    out.reserve(static_cast<size_t>(side * side));
    for (int i = 0; i < side * side; ++i)
      out.push_back(
          {of.layer, {of.tile.level + levels, of.tile.col * side + i % side, of.tile.row * side + i / side}});
    return out;
  }
  /// The group that sixteen tiles below one belong to: the tile that it lies below, and so many levels.
  std::pair<TileKey, int> groupAround(TileKey of) {
    const double most = kGroupSeconds * line_.bytesPerSecond();
    int levels = kGroupLevels;
    while (levels < kMostGroupLevels && !of.tile.isRoot() && bytesBelow(of.parent(), levels + 1) <= most) {
      of = of.parent();
      ++levels;
    }
    return {of, levels};
  }
  /// What the tiles so many levels below one have; infinite while not all directories are here. Asked for in
  /// every frame, so remembered.
  double bytesBelow(const TileKey& of, int levels) {
    const auto known = bytesBelow_.find({of, levels});
    if (known != bytesBelow_.end()) return known->second;
    double bytes = 0.0;
    for (const TileKey& key : tilesBelow(of, levels)) {
      const PmtilesIndex::Found found = archives_.find(key);
      if (found.kind == PmtilesIndex::Kind::InDirectory) return std::numeric_limits<double>::infinity();
      if (found.kind == PmtilesIndex::Kind::Stored) bytes += static_cast<double>(found.place.bytes);
    }
    bytesBelow_[{of, levels}] = bytes;
    return bytes;
  }

  /// Tiles of one group lie together in the archive. Where enough of a group is here or wanted, the rest of
  /// it may come along: it will most likely be wanted next, and by itself each tile would take a request.
  void addGroups(std::vector<FetchCandidate>& candidates, std::vector<TileKey>& keys,
                 std::vector<Missing>& missing) {
    std::set<std::pair<TileKey, int>> groups;
    std::map<TileKey, std::pair<TileKey, int>> groupOf;  // of sixteen
    for (size_t i = 0; i < keys.size(); ++i) {
      if (keys[i].tile.level < kGroupLevels || candidates[i].alone) continue;
      const TileKey sixteen{keys[i].layer, keys[i].tile.ancestor(keys[i].tile.level - kGroupLevels)};
      const auto [at, isNew] = groupOf.try_emplace(sixteen);
      if (isNew) at->second = groupAround(sixteen);
      groups.insert(at->second);
    }
    for (const auto& [group, levels] : groups) {
      int stored = 0, known = 0;
      std::vector<std::pair<TileKey, PmtilesIndex::Place>> others;
      for (const TileKey& key : tilesBelow(group, levels)) {
        const PmtilesIndex::Found found = archives_.find(key);
        if (found.kind != PmtilesIndex::Kind::Stored) continue;
        ++stored;
        const ShelfEntry* entry = shelf_.find(key);
        const bool isHere =
            entry != nullptr && (entry->isDecoded() || entry->payload != nullptr || entry->request != 0);
        if (isHere || (entry != nullptr && entry->lastWanted == turn_))
          ++known;
        else if (entry == nullptr || (entry->failures == 0 && !entry->lost))
          others.emplace_back(key, found.place);
      }
      if (known < kGroupShare * stored) continue;
      for (const auto& [key, place] : others) {
        candidates.push_back({archives_.fileOf(key), place.offset, place.bytes, 0.0, false, true, true});
        keys.push_back(key);
        missing.push_back({place, false});
      }
    }
  }

  /// Asks for what is wanted and not here, as much as the line can use.
  void startFetching() {
    if (!mayStart()) return;
    const std::optional<TileKey> first = nextBeginning();
    std::vector<FetchCandidate> candidates;
    std::vector<TileKey> keys;
    std::vector<Missing> missing;
    for (const Ranked& ranked : ranked_) {
      ShelfEntry& entry = shelf_.at(ranked.key);
      if (entry.isDecoded() || entry.payload != nullptr || entry.request != 0 || entry.decoding) continue;
      if (now_ < entry.notBefore || isBelowLost(ranked.key)) continue;
      const PmtilesIndex::Found found = archives_.find(ranked.key);
      // Over a thin line, not before all that comes first.
      if (found.kind == PmtilesIndex::Kind::InDirectory && !(first && ranked.key.isRefinement()))
        startDirectory(ranked.key);
      if (found.kind != PmtilesIndex::Kind::Stored) continue;
      if (first && !(ranked.key == *first)) continue;
      missing.push_back(missingOf(ranked.key, entry, found.place));
      const bool isByItself = entry.alone || missing.back().isPart || !entry.beginning.empty();
      candidates.push_back({archives_.fileOf(ranked.key), missing.back().place.offset,
                            missing.back().place.bytes, ranked.worthPerByte, isByItself,
                            mayWait(ranked, entry), false});
      keys.push_back(ranked.key);
    }

    if (!first && !options_.inOrder) addGroups(candidates, keys, missing);
    uint64_t underway = 0;
    for (const auto& [id, request] : underway_) underway += request.plan.bytes;
    const uint64_t useful = options_.inOrder ? UINT64_MAX : line_.usefulBytesUnderway();
    if (underway >= useful) return;
    RequestLimits limits;
    limits.bytes = useful - underway;
    limits.requests = (isOffline() ? 1 : options_.mostRequests) - static_cast<int>(underway_.size());
    // A request should not hold up what becomes urgent while it is on its way.
    const auto bytesOf = [&](double seconds) {
      return static_cast<uint64_t>(seconds * line_.bytesPerSecond());
    };
    limits.bytesARequest =
        std::clamp<uint64_t>(std::min(useful, bytesOf(kHoldSeconds)), 16U << 10, 512U << 10);
    limits.easyBytes = bytesOf(kHoldSeconds);
    limits.largestGap = std::clamp<uint64_t>(bytesOf(kGapSeconds), 4U << 10, 64U << 10);
    limits.worthStarting = bytesOf(kWorthStartingSeconds);
    for (PlannedRequest& plan : planRequests(candidates, limits)) {
      Underway request;
      FetchRequest fetch = archives_.request(plan.file, plan.offset, plan.bytes);
      for (const size_t index : plan.candidates) {
        request.keys.push_back(keys[index]);
        request.places.push_back(missing[index].place);
        request.isPart = missing[index].isPart;
        ShelfEntry& entry = shelf_.at(keys[index]);
        entry.request = lastRequest_ + 1;
        entry.lost = false;
        fetch.fresh = fetch.fresh || entry.fresh;
      }
      request.plan = std::move(plan);
      start(std::move(request), fetch);
    }
  }

  /// Asks for the directory that find() needs to tell of a tile, if it does.
  /// `firstBytes`: of an archive that is not open, at least so many, tiles among them.
  void startDirectory(const TileKey& key, uint64_t firstBytes = 0) {
    auto [kind, place] = archives_.find(key);
    if (kind != PmtilesIndex::Kind::InDirectory) return;
    const int file = archives_.fileOf(key);
    if (!archives_.isOpen(file))
      place.bytes = static_cast<decltype(place.bytes)>(archives_.firstBytes(file, firstBytes).bytes);
    const auto tries = directoryTries_.find({file, place.offset});
    if (tries != directoryTries_.end() && now_ < tries->second.notBefore) return;
    if (!mayStart() || isUnderway(What::Directory, file, place.offset)) return;
    start({.what = What::Directory,
           .plan = {file, place.offset, place.bytes, {}},
           .keys = {},
           .places = {place}},
          archives_.request(file, place.offset, place.bytes));
  }

  /// The part of the wishes that the picture misses now.
  double debt() const {
    double sum = 0.0;
    for (const StreamWish& wish : wishes_) {
      if (wish.chance < 1.0) continue;
      const ShelfEntry* entry = shelf_.find(wish.key);
      if (entry != nullptr && (entry->isDecoded() || entry->lost)) continue;
      sum += wish.areaPixels * std::max(0.0, wish.nowPixels - wish.targetPixels);
    }
    return sum;
  }
  uint64_t wishedBytes() const {
    uint64_t sum = 0;
    for (const StreamWish& wish : wishes_) {
      if (wish.chance < 1.0) continue;
      const ShelfEntry* entry = shelf_.find(wish.key);
      if (entry != nullptr && (entry->isDecoded() || entry->payload != nullptr || entry->lost)) continue;
      sum += storedBytes(wish.key);
    }
    return sum;
  }

  std::unique_ptr<Transport> transport_;
  StreamOptions options_;
  TileShelf shelf_;
  LineEstimate line_;
  LinePace pace_;
  double now_ = 0.0;
  uint64_t turn_ = 0;  ///< counts calls of want()
  uint64_t lastRequest_ = 0;
  std::map<uint64_t, Underway> underway_;
  std::vector<StreamWish> wishes_;
  std::vector<Ranked> ranked_;
  std::map<int, Tries> openingTries_;
  std::map<std::pair<int, uint64_t>, Tries> directoryTries_;
  std::map<std::pair<TileKey, int>, double> bytesBelow_;
  int offlineTries_ = 0;
  double offlineUntil_ = 0.0;
  int decoding_ = 0;
  std::vector<TileKey> news_;
  StreamStatistics statistics_;
  std::shared_ptr<Finished> finished_;
  Workers& workers_;
};

TileStream::TileStream(std::unique_ptr<Transport> transport, Workers& workers, const StreamOptions& options)
    : state_(std::make_unique<State>(std::move(transport), workers, options)) {}
TileStream::~TileStream() = default;

StreamPhase TileStream::phase() const {
  return state_->phase_;
}
const std::string& TileStream::problem() const {
  return state_->problem_;
}
const Manifest& TileStream::manifest() const {
  TERRANE_CHECK(state_->phase_ == StreamPhase::Ready, "the dataset is not open");
  return state_->archives_.manifest();
}
void TileStream::poll(double nowSeconds) {
  state_->poll(nowSeconds);
}
void TileStream::want(std::span<const StreamWish> wishes) {
  state_->want(wishes);
}
void TileStream::hold(std::span<const TileId> tiles) {
  state_->shelf().hold(tiles);
}
bool TileStream::isStored(const TileKey& key) const {
  return state_->archives_.find(key).kind != PmtilesIndex::Kind::NotStored;
}
bool TileStream::isLost(const TileKey& key) const {
  const ShelfEntry* entry = state_->shelf().find(key);
  return entry != nullptr && entry->lost;
}
std::shared_ptr<const Tile> TileStream::elevation(TileId id) const {
  const ShelfEntry* entry = state_->shelf().find(TileKey::elevation(id));
  if (entry == nullptr) return nullptr;
  return entry->tile != nullptr ? entry->tile : entry->sketch;
}
std::shared_ptr<const ImageryTile> TileStream::picture(const TileKey& key) const {
  const ShelfEntry* entry = state_->shelf().find(key);
  if (entry == nullptr) return nullptr;
  return entry->picture != nullptr ? entry->picture : entry->pictureSketch;
}
bool TileStream::isSketch(const TileKey& key) const {
  const ShelfEntry* entry = state_->shelf().find(key);
  return entry != nullptr && entry->isSketched() && !entry->isDecoded();
}
std::vector<TileKey> TileStream::takeNews() {
  return state_->takeNews();
}
bool TileStream::isIdle() const {
  return state_->isIdle();
}
bool TileStream::isDecoding() const {
  return state_->isDecoding();
}
StreamStatistics TileStream::statistics() const {
  return state_->statistics();
}
const std::string& TileStream::where() const {
  return state_->transport().where();
}

}  // namespace terrane
