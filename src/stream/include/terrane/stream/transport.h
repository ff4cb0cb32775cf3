#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// Some bytes of one of a dataset's files.
struct FetchRequest {
  std::string file;  ///< "manifest.json", "elevation.pmtiles"
  uint64_t offset = 0;
  uint64_t bytes = 0;      ///< 0: the whole file, kLargestWholeFile at most
  bool fresh = false;      ///< past all caches on the way: what came before was damaged
  uint64_t fileBytes = 0;  ///< that the whole file has, by the manifest: else it is another one. 0: not known
};
inline constexpr uint64_t kLargestWholeFile = 64U << 20;

/// Why bytes did not come, as far as it decides what to do next.
enum class FetchProblem : uint8_t {
  Unreachable,  ///< no connection, or it broke: another try may succeed
  Busy,         ///< the server says that it cannot now (5xx, 429)
  Missing,      ///< there is no such file or range: no other try will help
  Malformed,    ///< an answer that is none: too short, too long, another range
  Fatal,  ///< nothing can come from here any more, and no other try will help: another build of the dataset
          ///< is there now, the server knows no ranges, its certificate is not to be trusted
};
struct FetchFailure {
  FetchProblem problem = FetchProblem::Unreachable;
  std::string message;             ///< what, where
  double retryAfterSeconds = 0.0;  ///< at least so long, where the server said so
};

/// The answer to one request: all its bytes, or a failure.
struct FetchAnswer {
  uint64_t id = 0;
  std::vector<uint8_t> bytes;
  std::optional<FetchFailure> failure;
  /// How long it took, where that is not the time since start(): somebody had asked before.
  std::optional<double> tookSeconds{};
};

/// A way to a dataset's bytes: a directory, an HTTP address, a simulated line. Nothing here waits: requests
/// are started, and answers are picked up. One thread at a time.
class Transport {
 public:
  virtual ~Transport() = default;
  /// `id` is the caller's and must not be in use.
  virtual void start(uint64_t id, const FetchRequest& request) = 0;
  /// No answer will come for it. Nothing happens if it has come already.
  virtual void cancel(uint64_t id) = 0;
  /// The answers that have come. `nowSeconds` is the caller's clock, which must not run backwards; only
  /// simulated lines look at it.
  virtual std::vector<FetchAnswer> poll(double nowSeconds) = 0;
  /// Waits until poll() has something to give, for `seconds` at most. Lines in simulated time do not wait.
  virtual void wait(double /*seconds*/) {}
  /// The directory or address, for messages.
  virtual const std::string& where() const = 0;
};

/// Reads from a dataset's directory, in a thread of its own.
std::unique_ptr<Transport> openDirectoryTransport(const std::string& directory);
/// Reads over HTTP or HTTPS by ranges from `url`, which holds the dataset's files as a directory does:
/// `terrane serve`, or any static server that knows ranges. The address may end with a slash or
/// "manifest.json"; its query, if it has one, goes along with each file. Up to `connections` at once (HTTP/2
/// where the server has it shares one). A transfer that stands still for `stallSeconds` is given up.
std::unique_ptr<Transport> openHttpTransport(const std::string& url, int connections = 8,
                                             double stallSeconds = 10.0);
/// By its looks: an address with http:// or https://, else a directory.
std::unique_ptr<Transport> openTransport(const std::string& directoryOrUrl);
bool isUrl(const std::string& directoryOrUrl);

}  // namespace terrane
