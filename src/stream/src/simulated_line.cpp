#include "terrane/stream/simulated_line.h"

#include <algorithm>

#include "file_range.h"

namespace terrane {
namespace {

/// What an answer without a body takes on the line.
constexpr double kHeaderBytes = 250.0;

/// FNV-1a: the same on every machine, as what a line does should be.
uint64_t hashOf(const std::string& text) {
  uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : text) hash = (hash ^ static_cast<uint8_t>(c)) * 0x100000001b3ULL;
  return hash;
}

}  // namespace

SimulatedLine::SimulatedLine(std::string directory, LineModel model, LineFaults faults)
    : directory_(std::move(directory)), model_(model), faults_(std::move(faults)), random_(faults_.seed) {}

FetchAnswer SimulatedLine::read(uint64_t id, const FetchRequest& request) const {
  FetchAnswer answer{.id = id, .bytes = {}, .failure = std::nullopt};
  auto read = readFileRange(directory_, request);
  if (auto* failure = std::get_if<FetchFailure>(&read))
    answer.failure = *failure;
  else
    answer.bytes = std::move(std::get<0>(read));
  return answer;
}

/// Lets an answer go wrong. Whatever happens, as many random numbers are drawn.
void SimulatedLine::spoil(Underway& underway, const FetchRequest& request) {
  const auto draw = [&] { return static_cast<double>(random_()) / 4294967296.0; };
  const double kind = draw(), amount = draw();
  FetchAnswer& answer = underway.answer;
  const auto fail = [&](FetchProblem problem, const char* why) {
    answer.bytes.clear();
    answer.failure = FetchFailure{problem, fmt::format("{}/{}: {}", directory_, request.file, why)};
    underway.bytesLeft = kHeaderBytes;
  };

  const bool isOut = std::any_of(faults_.outages.begin(), faults_.outages.end(),
                                 [&](const auto& span) { return now_ >= span.first && now_ < span.second; });
  uint64_t range = hashOf(request.file) ^ (request.offset * 0x9e3779b97f4a7c15ULL);
  range ^= range >> 32U;
  const double share = static_cast<double>((range * 0xff51afd7ed558ccdULL) >> 40U) / 16777216.0;
  double border = 0.0;
  const auto isKind = [&](double part) {
    border += part;
    return kind < border && kind >= border - part;
  };
  ++answersSpoilt_;
  if (isOut) {
    fail(FetchProblem::Unreachable, "connection refused");
    underway.takesLine = false;
  } else if (share < faults_.missingShare) {
    fail(FetchProblem::Missing, "404");
  } else if (isKind(faults_.busyShare)) {
    fail(FetchProblem::Busy, "500");
  } else if (isKind(faults_.truncatedShare)) {
    const double kept = amount * underway.bytesLeft;
    fail(FetchProblem::Malformed, "fewer bytes than it said");
    underway.bytesLeft += kept;
  } else if (isKind(faults_.corruptShare) && !answer.bytes.empty()) {
    for (int i = 0; i < 8; ++i)
      answer.bytes[random_() % answer.bytes.size()] ^= static_cast<uint8_t>(1U << (random_() % 8));
  } else if (isKind(faults_.slowShare)) {
    underway.lateSeconds = amount * faults_.slowSeconds;
  } else {
    --answersSpoilt_;
  }
}

void SimulatedLine::start(uint64_t id, const FetchRequest& request) {
  ++requestsStarted_;
  Underway underway;
  underway.answer = read(id, request);
  underway.readySeconds = now_ + model_.latencySeconds;
  underway.bytesLeft = kHeaderBytes + static_cast<double>(underway.answer.bytes.size());
  spoil(underway, request);
  line_.push_back(std::move(underway));
}

void SimulatedLine::cancel(uint64_t id) {
  const auto is = [&](const Underway& underway) { return underway.answer.id == id; };
  line_.erase(std::remove_if(line_.begin(), line_.end(), is), line_.end());
  late_.erase(std::remove_if(late_.begin(), late_.end(), is), late_.end());
}

void SimulatedLine::advance(double nowSeconds) {
  // One answer after the other, as far as the time reaches.
  double at = now_;
  while (!line_.empty()) {
    Underway& head = line_.front();
    const double begin = std::max(at, head.readySeconds);
    if (begin > nowSeconds) break;
    const double take = head.takesLine ? head.bytesLeft / model_.bytesPerSecond : 0.0;
    if (begin + take > nowSeconds) {
      head.bytesLeft -= (nowSeconds - begin) * model_.bytesPerSecond;
      break;
    }
    at = begin + take;
    bytesDelivered_ += head.answer.bytes.size();
    head.readySeconds = at + head.lateSeconds;
    late_.push_back(std::move(head));
    line_.pop_front();
  }
  now_ = nowSeconds;
}

std::vector<FetchAnswer> SimulatedLine::poll(double nowSeconds) {
  advance(std::max(now_, nowSeconds));
  std::vector<FetchAnswer> out;
  for (size_t i = 0; i < late_.size();) {
    if (late_[i].readySeconds > now_) {
      ++i;
      continue;
    }
    out.push_back(std::move(late_[i].answer));
    late_.erase(late_.begin() + static_cast<ptrdiff_t>(i));
  }
  return out;
}

}  // namespace terrane
