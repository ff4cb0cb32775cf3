#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "terrane/stream/transport.h"

namespace terrane {

/// What a server says of the range that it sends: "bytes 100-199/5000".
struct ContentRange {
  uint64_t first = 0;
  uint64_t last = 0;
  std::optional<uint64_t> fileBytes;  ///< where it is told
};
/// Nothing where the field makes no sense.
std::optional<ContentRange> parseContentRange(std::string_view field);

/// The answer to a request for a file or a range of it, as far as it decides whether its bytes can be used.
struct HttpAnswer {
  int status = 0;
  std::optional<ContentRange> range;
  std::string etag;
  std::string lastModified;
  bool isEncoded = false;  ///< compressed on the way, and not by our wish
  uint64_t bodyBytes = 0;
  bool isCutOff = false;  ///< more came than was asked for, and was left
  double retryAfterSeconds = 0.0;
};

/// What earlier answers have told of a file.
struct KnownFile {
  std::string etag;
  std::string lastModified;
  bool hasAnswered = false;
  bool hasRanges = false;  ///< ranges of it have been sent
};

/// Are these the bytes that were asked for, and of the file that earlier ones were of? Nothing if so; `known`
/// then learns from it. `url` begins the failure's message. A pure function.
///
/// Two builds must never mix: a file whose entity tag (or date, where there is none) or size is another one
/// than before is Fatal, and so is one that has answered and is not there any more. A server that has never
/// sent a range and sends whole files instead is Fatal too: nobody wants the archive for each tile.
std::optional<FetchFailure> judgeHttpAnswer(const std::string& url, const FetchRequest& request,
                                            const HttpAnswer& answer, KnownFile& known);

}  // namespace terrane
