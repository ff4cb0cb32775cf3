#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace terrane {

/// Something that is to be fetched: bytes of a file, and what they are worth.
struct FetchCandidate {
  int file = 0;
  uint64_t offset = 0;
  uint64_t bytes = 0;
  double worthPerByte = 0.0;
  bool alone = false;    ///< not together with others
  bool mayWait = false;  ///< not needed before others that may join it
  bool along = false;    ///< not wanted by itself: joins others at most
};

/// One request for several neighbours.
struct PlannedRequest {
  int file = 0;
  uint64_t offset = 0;
  uint64_t bytes = 0;
  std::vector<size_t> candidates;  ///< by offset
};

struct RequestLimits {
  uint64_t bytes = 0;  ///< that may be started now; the first request may exceed it
  int requests = 0;    ///< that may be started now
  uint64_t bytesARequest = 128U << 10;
  uint64_t largestGap = 4096;  ///< bytes that nobody wants, fetched along to save a request
  double leastShare = 0.1;     ///< of the first one's worth a byte that a neighbour must have
  uint64_t easyBytes = 0;      ///< up to so many in a request a neighbour joins whatever it is worth
  uint64_t worthStarting = 0;  ///< bytes without which a request is not started if all in it may wait
};

/// Which requests to start, most urgent first. `candidates` stand in the order in which they are wanted;
/// neighbours in the file that are wanted as well come along in the same request. A pure function.
std::vector<PlannedRequest> planRequests(std::span<const FetchCandidate> candidates,
                                         const RequestLimits& limits);

}  // namespace terrane
