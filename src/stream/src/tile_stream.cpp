#include "terrane/stream/tile_stream.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "archives.h"
#include "line_pace.h"
#include "request_sizes.h"
#include "requests_underway.h"
#include "retries.h"
#include "root_parts.h"
#include "terrane/base/check.h"
#include "terrane/stream/line_estimate.h"
#include "terrane/stream/plan_requests.h"
#include "tile_decoding.h"
#include "tile_groups.h"
#include "tile_shelf.h"
#include "wish_order.h"

namespace terrane {
namespace {

/// Over a line that brought the manifest at least as quickly, the coarsest tiles come along with directories:
/// so much is asked for first. note: of so small an answer a quick line looks much slower than it is.
constexpr double kQuickBytesPerSecond = 2.0 * kThinBytesPerSecond;
/// What may wait for others does so no longer than that.
constexpr double kLongestWaitSeconds = 2.0;
/// So does what hardly misses its target, but for less long.
constexpr double kLittleExcess = 1.5;
constexpr double kLittleSeconds = 0.25;
/// Wishes with less chance than that are for later.
constexpr double kSoonChance = 0.4;

}  // namespace

class TileStream::State {
 public:
  State(std::unique_ptr<Transport> transport, Workers& workers, const StreamOptions& options)
      : transport_(std::move(transport)),
        underway_(*transport_),
        options_(options),
        shelf_({options.compressedBytes, options.decodedBytes, options.pictureBytes}),
        wishes_(archives_, shelf_, options.inOrder),
        groups_(archives_, shelf_),
        decoding_(workers, archives_, shelf_, transport_->where()) {}

  void poll(double nowSeconds) {
    now_ = std::max(now_, nowSeconds);
    for (FetchAnswer& answer : transport_->poll(now_)) take(std::move(answer));
    takeMade();
    if (phase_ == StreamPhase::Opening) startOpening();
    if (phase_ != StreamPhase::Ready) return;
    pace_.update(now_, wishes_.debt(), wishes_.wishedBytes(), line_.bytesPerSecond());
    // Room first: what nobody wants any more makes place for what is wanted now.
    shelf_.keepWithinBudgets(wishes_.turn());
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
    wishes_.replace(wishes, pace_.looseness(), now_);
    cancelUnwanted();
  }

  StreamPhase phase_ = StreamPhase::Opening;
  std::string problem_;
  Archives archives_;
  TileShelf& shelf() { return shelf_; }
  const TileShelf& shelf() const { return shelf_; }
  const Transport& transport() const { return *transport_; }
  std::vector<TileKey> takeNews() { return std::exchange(news_, {}); }
  bool isDecoding() const { return decoding_.underway() > 0; }

  bool isIdle() const {
    if (phase_ == StreamPhase::Failed) return true;
    if (phase_ != StreamPhase::Ready || !underway_.isEmpty() || isDecoding()) return false;
    return !wishes_.canMoreCome();
  }

  StreamStatistics statistics() const {
    StreamStatistics out = statistics_;
    out.requestsUnderway = static_cast<uint64_t>(underway_.count());
    out.bytesUnderway = underway_.bytes();
    out.debt = phase_ == StreamPhase::Ready ? wishes_.debt() : 0.0;
    out.wishedBytes = phase_ == StreamPhase::Ready ? wishes_.wishedBytes() : 0;
    out.wishes = wishes_.missingTiles();
    // Without a failure nothing is lost.
    if (statistics_.requestsFailed + statistics_.tilesDamaged > 0) out.tilesLost = shelf_.lostTiles();
    out.looseness = pace_.looseness();
    out.bytesPerSecond = line_.bytesPerSecond();
    out.latencySeconds = line_.latencySeconds();
    out.isOffline = retries_.isOffline();
    out.compressedBytes = shelf_.compressedBytes();
    out.decodedBytes = shelf_.decodedBytes();
    out.decodedTiles = shelf_.decodedTiles();
    out.pictureBytes = shelf_.pictureBytes();
    return out;
  }

 private:
  using What = RequestsUnderway::What;
  using Underway = RequestsUnderway::Request;

  // ---------------------------------------------------------------------------------- what has come

  void take(FetchAnswer answer) {
    // What made it fail is what it says, whatever comes after.
    if (phase_ == StreamPhase::Failed) return;
    const std::optional<Underway> finished = underway_.finish(answer.id);
    if (!finished) return;
    const Underway& request = *finished;
    if (answer.failure) {
      ++statistics_.requestsFailed;
      problem_ = answer.failure->message;
      takeFailure(answer.id, request, *answer.failure);
      return;
    }
    retries_.reached();
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
          retryDirectory(request, FetchProblem::Malformed);
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
      if (wishes_.isWanted(entry)) used += place.bytes;
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
    if (request.isPart) decoding_.startSketch(request.keys[0], shelf_.at(request.keys[0]));
  }

  double fetchCost(uint64_t bytes) const {
    return line_.latencySeconds() * line_.bytesPerSecond() + kRequestBytes + static_cast<double>(bytes);
  }

  void takeFailure(uint64_t id, const Underway& request, const FetchFailure& failure) {
    if (failure.problem == FetchProblem::Fatal) return fail(failure.message);
    // Nobody there: not the tiles' fault. Ask again, ever more rarely, with one request at a time.
    if (failure.problem == FetchProblem::Unreachable) {
      retries_.unreachable(id, now_);
      for (const TileKey& key : request.keys) shelf_.at(key).request = 0;
      return;
    }
    retries_.reached();
    if (request.what == What::Directory) return retryDirectory(request, failure.problem);
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
      tileFailed(key, entry, failure.problem, failure.retryAfterSeconds, now_);
    }
  }

  void fail(const std::string& why) {
    problem_ = why;
    phase_ = StreamPhase::Failed;
  }
  void retryOrFail(const Underway& request, const std::string& why) {
    problem_ = why;
    const int file = request.what == What::Manifest ? Retries::kManifest : request.plan.file;
    if (!retries_.openingFailed(file, now_)) fail(why);
  }
  void retryDirectory(const Underway& request, FetchProblem problem) {
    retries_.directoryFailed(request.plan.file, request.plan.offset, problem, now_);
  }

  void takeMade() {
    for (TileDecoding::Made& done : decoding_.takeMade()) {
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
        tileFailed(done.key, entry, FetchProblem::Malformed, 0.0, now_);
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
  void takeSketch(TileDecoding::Made done, ShelfEntry& entry) {
    if (!done.problem.empty() || entry.isDecoded()) return;
    entry.sketch = std::move(done.tile);
    entry.pictureSketch = std::move(done.picture);
    news_.push_back(done.key);
  }

  // ------------------------------------------------------------------------------- what is to be done

  /// May anything be started now? Without a server, one request at a time finds out whether it is back.
  bool mayStart() const { return !retries_.isOffline() || (retries_.mayAsk(now_) && underway_.isEmpty()); }

  void start(Underway request, const FetchRequest& fetch) {
    ++statistics_.requests;
    underway_.start(std::move(request), fetch, now_);
  }

  void startOpening() {
    if (!archives_.hasManifest()) {
      if (underway_.isEmpty() && mayStart() && retries_.isOpeningDue(Retries::kManifest, now_))
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
      if (!mayStart() || !retries_.isOpeningDue(file, now_) || underway_.has(What::FirstBytes, file, 0))
        continue;
      const FetchRequest request = archives_.firstBytes(file, isQuick ? options_.firstBytes : 0);
      start({.what = What::FirstBytes, .plan = {file, 0, request.bytes, {}}, .keys = {}, .places = {}},
            request);
    }
    if (allOpen) phase_ = StreamPhase::Ready;
  }

  /// Requests of which nothing is wanted any more, and whose bytes are not on the way yet.
  void cancelUnwanted() {
    const auto isUnwanted = [&](const Underway& request) {
      if (request.what != What::Tiles || now_ - request.started > line_.latencySeconds()) return false;
      return std::none_of(request.keys.begin(), request.keys.end(),
                          [&](const TileKey& key) { return wishes_.isWanted(shelf_.at(key)); });
    };
    for (const Underway& request : underway_.cancel(isUnwanted)) {
      ++statistics_.requestsCancelled;
      for (const TileKey& key : request.keys) shelf_.at(key).request = 0;
    }
  }

  /// Hands what is here, and can be decoded, to the workers.
  void startDecoding() {
    for (const RankedTile& ranked : wishes_.ranked()) {
      if (decoding_.isFull()) return;
      ShelfEntry* entry = shelf_.find(ranked.key);
      if (entry == nullptr || entry->payload == nullptr || entry->decoding || entry->isDecoded()) continue;
      if (ranked.key.isElevation() && !shelf_.hasRoomToDecode(ranked.isUrgent, decoding_.underway()))
        continue;
      if (!decoding_.start(ranked.key, *entry)) continue;
      entry->decoding = true;
      ++statistics_.compressedHits;
    }
  }

  /// May a wish wait for others that share a request with it? What is for later may, as long as it is not
  /// old; what is of use now may for as long as an answer takes, while others are under way.
  bool mayWait(const RankedTile& ranked, const ShelfEntry& entry) const {
    if (options_.inOrder) return false;
    const double waited = now_ - entry.wantedSince;
    if (ranked.chance < kSoonChance) return waited < kLongestWaitSeconds;
    if (ranked.excess < kLittleExcess && waited < kLittleSeconds) return true;
    return !underway_.isEmpty() && waited < line_.latencySeconds();
  }

  /// Others of their groups come along with tiles that need not be fetched by themselves.
  void addCompanions(std::vector<FetchCandidate>& candidates, std::vector<TileKey>& keys,
                     std::vector<MissingBytes>& missing) {
    std::vector<TileKey> sociable;
    for (size_t i = 0; i < keys.size(); ++i)
      if (!candidates[i].alone) sociable.push_back(keys[i]);
    for (const auto& [key, place] : groups_.companionsOf(sociable, wishes_.turn(), line_.bytesPerSecond())) {
      candidates.push_back({archives_.fileOf(key), place.offset, place.bytes, 0.0, false, true, true});
      keys.push_back(key);
      missing.push_back({place, false});
    }
  }

  /// Asks for what is wanted and not here, as much as the line can use.
  void startFetching() {
    if (!mayStart()) return;
    // In the order of the wishes all comes whole, as over a quick line.
    const double partSpeed =
        options_.inOrder ? std::numeric_limits<double>::infinity() : line_.bytesPerSecond();
    const std::optional<TileKey> first = nextBeginning(archives_, shelf_, wishes_.turn(), partSpeed);
    std::vector<FetchCandidate> candidates;
    std::vector<TileKey> keys;
    std::vector<MissingBytes> missing;
    for (const RankedTile& ranked : wishes_.ranked()) {
      ShelfEntry& entry = shelf_.at(ranked.key);
      if (entry.isDecoded() || entry.payload != nullptr || entry.request != 0 || entry.decoding) continue;
      if (now_ < entry.notBefore || shelf_.isBelowLost(ranked.key)) continue;
      const PmtilesIndex::Found found = archives_.find(ranked.key);
      if (found.kind == PmtilesIndex::Kind::InDirectory)
        entry.lost = retries_.isDirectoryLost(archives_.fileOf(ranked.key), found.place.offset);
      // Over a thin line, not before all that comes first.
      if (found.kind == PmtilesIndex::Kind::InDirectory && !(first && ranked.key.isRefinement()))
        startDirectory(ranked.key);
      if (found.kind != PmtilesIndex::Kind::Stored) continue;
      if (first && !(ranked.key == *first)) continue;
      missing.push_back(missingOf(ranked.key, entry, found.place, partSpeed));
      const bool isByItself = entry.alone || missing.back().isPart || !entry.beginning.empty();
      candidates.push_back({archives_.fileOf(ranked.key), missing.back().place.offset,
                            missing.back().place.bytes, ranked.worthPerByte, isByItself,
                            mayWait(ranked, entry), false});
      keys.push_back(ranked.key);
    }

    if (!first && !options_.inOrder) addCompanions(candidates, keys, missing);
    const uint64_t underway = underway_.bytes();
    const uint64_t useful = options_.inOrder ? UINT64_MAX : line_.usefulBytesUnderway();
    if (underway >= useful) return;
    RequestLimits limits = requestSizes(line_.bytesPerSecond(), useful);
    limits.bytes = useful - underway;
    limits.requests = (retries_.isOffline() ? 1 : options_.mostRequests) - underway_.count();
    for (PlannedRequest& plan : planRequests(candidates, limits)) {
      Underway request;
      FetchRequest fetch = archives_.request(plan.file, plan.offset, plan.bytes);
      for (const size_t index : plan.candidates) {
        request.keys.push_back(keys[index]);
        request.places.push_back(missing[index].place);
        request.isPart = missing[index].isPart;
        ShelfEntry& entry = shelf_.at(keys[index]);
        entry.request = underway_.nextId();
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
    if (!retries_.isDirectoryDue(file, place.offset, now_)) return;
    if (!mayStart() || underway_.has(What::Directory, file, place.offset)) return;
    start({.what = What::Directory,
           .plan = {file, place.offset, place.bytes, {}},
           .keys = {},
           .places = {place}},
          archives_.request(file, place.offset, place.bytes));
  }

  std::unique_ptr<Transport> transport_;
  RequestsUnderway underway_;
  StreamOptions options_;
  TileShelf shelf_;
  WishOrder wishes_;
  TileGroups groups_;
  TileDecoding decoding_;
  LineEstimate line_;
  LinePace pace_;
  double now_ = 0.0;
  Retries retries_;
  std::vector<TileKey> news_;
  StreamStatistics statistics_;
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
