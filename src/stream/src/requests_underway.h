#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "terrane/dataset/pmtiles_index.h"
#include "terrane/stream/plan_requests.h"
#include "terrane/stream/tile_key.h"
#include "terrane/stream/transport.h"

namespace terrane {

/// The requests that are on the line, and what each of them is to bring.
class RequestsUnderway {
 public:
  enum class What : uint8_t { Manifest, FirstBytes, Directory, Tiles };
  struct Request {
    What what = What::Tiles;
    PlannedRequest plan;                      ///< file, bytes
    std::vector<TileKey> keys;                ///< Tiles
    std::vector<PmtilesIndex::Place> places;  ///< of these, without what has come before
    bool isPart = false;                      ///< of the one tile, and not its end
    double started = 0.0;                     ///< seconds
  };

  /// `transport` must outlive this.
  explicit RequestsUnderway(Transport& transport) : transport_(transport) {}

  /// The id that the next request will have.
  uint64_t nextId() const { return lastId_ + 1; }
  void start(Request request, const FetchRequest& fetch, double nowSeconds);
  /// What was to come with an answer, which is not under way any more; none: nothing, it was cancelled.
  std::optional<Request> finish(uint64_t id);
  /// Cancels all that are `unwanted`, and returns them.
  std::vector<Request> cancel(const std::function<bool(const Request&)>& unwanted);

  bool isEmpty() const { return requests_.empty(); }
  int count() const { return static_cast<int>(requests_.size()); }
  uint64_t bytes() const;
  bool has(What what, int file, uint64_t offset) const;

 private:
  Transport& transport_;
  uint64_t lastId_ = 0;
  std::map<uint64_t, Request> requests_;
};

}  // namespace terrane
