#include "terrane/serve/byte_range.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace terrane::serve {
namespace {

bool isSpace(char c) {
  return c == ' ' || c == '\t';
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && isSpace(text.front())) text.remove_prefix(1);
  while (!text.empty() && isSpace(text.back())) text.remove_suffix(1);
  return text;
}

bool equalsIgnoringCase(std::string_view a, std::string_view b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
           const auto lower = [](char c) {
             return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
           };
           return lower(x) == lower(y);
         });
}

/// Digits only; what does not fit is the largest number there is.
std::optional<uint64_t> readPlace(std::string_view digits) {
  if (digits.empty()) return {};
  constexpr uint64_t kMost = std::numeric_limits<uint64_t>::max();
  uint64_t number = 0;
  for (const char c : digits) {
    if (c < '0' || c > '9') return {};
    const auto digit = static_cast<uint64_t>(c - '0');
    number = number > (kMost - digit) / 10 ? kMost : number * 10 + digit;
  }
  return number;
}

/// The next element of a comma-separated list, trimmed; `rest` loses it.
std::string_view nextElement(std::string_view& rest) {
  const size_t comma = std::min(rest.find(','), rest.size());
  const std::string_view element = trim(rest.substr(0, comma));
  rest.remove_prefix(std::min(comma + 1, rest.size()));
  return element;
}

}  // namespace

RangeAnswer readRange(std::string_view field, uint64_t size) {
  const RangeAnswer whole;
  const size_t equals = field.find('=');
  if (equals == std::string_view::npos || !equalsIgnoringCase(trim(field.substr(0, equals)), "bytes"))
    return whole;
  const std::string_view spec = trim(field.substr(equals + 1));
  const size_t dash = spec.find('-');
  if (dash == std::string_view::npos || spec.find(',') != std::string_view::npos) return whole;
  const std::string_view firstText = spec.substr(0, dash), lastText = spec.substr(dash + 1);

  // The last bytes: "-500".
  const auto last = readPlace(lastText);
  if (firstText.empty()) {
    if (!last) return whole;
    if (*last == 0 || size == 0) return {RangeAnswer::Kind::Unsatisfiable, 0, 0};
    const uint64_t length = std::min(*last, size);
    return {RangeAnswer::Kind::Part, size - length, length};
  }

  // "500-" and "500-999"; one that ends before it begins is malformed, and a malformed field is ignored.
  const auto first = readPlace(firstText);
  if (!first || (!lastText.empty() && (!last || *last < *first))) return whole;
  if (*first >= size) return {RangeAnswer::Kind::Unsatisfiable, 0, 0};
  const uint64_t end = last ? std::min(*last, size - 1) : size - 1;
  return {RangeAnswer::Kind::Part, *first, end - *first + 1};
}

bool matchesEtag(std::string_view list, std::string_view etag, bool weak) {
  if (trim(list) == "*") return true;
  while (!list.empty()) {
    std::string_view element = nextElement(list);
    if (weak && element.substr(0, 2) == "W/") element.remove_prefix(2);
    if (element == etag) return true;
  }
  return false;
}

bool acceptsGzip(std::string_view field) {
  std::optional<bool> named, any;
  while (!field.empty()) {
    const std::string_view element = nextElement(field);
    const size_t semicolon = std::min(element.find(';'), element.size());
    const std::string_view coding = trim(element.substr(0, semicolon));
    const std::string_view weight = trim(element.substr(std::min(semicolon + 1, element.size())));
    // A weight of zero, "q=0" or "q=0.000", refuses.
    const bool refused = weight.size() >= 3 && (weight[0] == 'q' || weight[0] == 'Q') && weight[1] == '=' &&
                         weight.find_first_not_of("0.", 2) == std::string_view::npos;
    if (equalsIgnoringCase(coding, "gzip") || equalsIgnoringCase(coding, "x-gzip")) named = !refused;
    if (coding == "*") any = !refused;
  }
  return named.value_or(any.value_or(false));
}

}  // namespace terrane::serve
