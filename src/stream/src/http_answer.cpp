#include "http_answer.h"

#include <algorithm>
#include <charconv>

namespace terrane {
namespace {

constexpr double kLongestRetrySeconds = 120.0;

/// An entity tag without the mark of a weak one: whatever it promises, another one is another file.
std::string_view opaqueTag(std::string_view etag) {
  return etag.substr(0, 2) == "W/" ? etag.substr(2) : etag;
}

bool isAnother(const HttpAnswer& answer, const KnownFile& known) {
  if (!answer.etag.empty() && !known.etag.empty()) return opaqueTag(answer.etag) != opaqueTag(known.etag);
  return !answer.lastModified.empty() && !known.lastModified.empty() &&
         answer.lastModified != known.lastModified;
}

}  // namespace

std::optional<ContentRange> parseContentRange(std::string_view field) {
  while (!field.empty() && field.front() == ' ') field.remove_prefix(1);
  if (field.substr(0, 6) != "bytes ") return std::nullopt;
  field.remove_prefix(6);
  ContentRange range;
  const char* end = field.data() + field.size();
  const auto first = std::from_chars(field.data(), end, range.first);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '-') return std::nullopt;
  const auto last = std::from_chars(first.ptr + 1, end, range.last);
  if (last.ec != std::errc() || last.ptr == end || *last.ptr != '/' || range.last < range.first)
    return std::nullopt;
  uint64_t fileBytes = 0;
  if (std::from_chars(last.ptr + 1, end, fileBytes).ec == std::errc()) range.fileBytes = fileBytes;
  return range;
}

std::optional<FetchFailure> judgeHttpAnswer(const std::string& url, const FetchRequest& request,
                                            const HttpAnswer& answer, KnownFile& known) {
  const auto failure = [&](FetchProblem problem, const std::string& why) {
    return FetchFailure{problem, fmt::format("{}: {}", url, why), 0.0};
  };
  const auto changed = [&](const std::string& why) {
    return failure(FetchProblem::Fatal,
                   why + ": another build of the dataset is there now, or none; open it again");
  };
  const int status = answer.status;

  // Refusals.
  if (status == 429 || status == 408 || status >= 500) {
    FetchFailure busy = failure(FetchProblem::Busy, fmt::format("the server answers {}", status));
    busy.retryAfterSeconds = std::clamp(answer.retryAfterSeconds, 0.0, kLongestRetrySeconds);
    return busy;
  }
  if (known.hasAnswered && (status == 404 || status == 410 || status == 416))
    return changed(fmt::format("the server answers {} where it had the file", status));
  // note: some servers say so when they are asked too often.
  if (known.hasAnswered && (status == 401 || status == 403))
    return failure(FetchProblem::Busy, fmt::format("the server answers {}", status));
  if (status != 200 && status != 206)
    return failure(FetchProblem::Missing, fmt::format("the server answers {}", status));

  // Is it still the file that it was?
  if (isAnother(answer, known)) return changed("is not the file that it was");
  if (request.bytes > 0 && request.fileBytes > 0 && answer.range && answer.range->fileBytes &&
      *answer.range->fileBytes != request.fileBytes)
    return changed(
        fmt::format("has {} bytes, the manifest says {}", *answer.range->fileBytes, request.fileBytes));

  // A file, or all of its range.
  const auto learn = [&](bool isRange) {
    known.etag = answer.etag;
    known.lastModified = answer.lastModified;
    known.hasAnswered = true;
    known.hasRanges = known.hasRanges || isRange;
    return std::nullopt;
  };
  if (request.bytes == 0) {
    if (status != 200)
      return failure(FetchProblem::Malformed, "the server sends a part where all was asked for");
    if (answer.isCutOff) return failure(FetchProblem::Malformed, "is too long");
    return learn(false);
  }
  const auto misfit = [&](const std::string& why) {
    return failure(known.hasRanges ? FetchProblem::Malformed : FetchProblem::Fatal, why);
  };
  if (answer.isEncoded)
    return misfit(
        "the server compresses it on the way, so its ranges are none; switch that off for archives");
  if (status == 200) {
    // A server that knows no ranges sends the whole file, which is right where all of it was asked for.
    const bool isAll = request.fileBytes == 0 || request.fileBytes == request.bytes;
    if (request.offset == 0 && isAll && !answer.isCutOff && answer.bodyBytes == request.bytes)
      return learn(false);
    return misfit(
        "the server sends the whole file where a range was asked for; use one that knows ranges, such as "
        "nginx or terrane serve");
  }
  if (!answer.range || answer.range->first != request.offset ||
      answer.range->last - answer.range->first + 1 != request.bytes)
    return failure(FetchProblem::Malformed, "the server sends another range than was asked for");
  if (answer.isCutOff || answer.bodyBytes != request.bytes)
    return failure(FetchProblem::Malformed,
                   answer.isCutOff ? std::string("more bytes come than were asked for")
                                   : fmt::format("has {} bytes, not {}", answer.bodyBytes, request.bytes));
  return learn(true);
}

}  // namespace terrane
