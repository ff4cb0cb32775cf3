#include "terrane/serve/request_target.h"

#include <algorithm>

namespace terrane::serve {
namespace {

constexpr size_t kMostUrlParts = 16;

int hexValue(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// Decodes percent escapes, once; `plusIsSpace` as in forms.
Result<std::string> decode(std::string_view text, bool plusIsSpace) {
  std::string out;
  out.reserve(text.size());
  for (size_t i = 0; i < text.size(); ++i) {
    auto c = static_cast<unsigned char>(text[i]);
    if (c == '%') {
      const int high = i + 2 < text.size() ? hexValue(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? hexValue(text[i + 2]) : -1;
      if (high < 0 || low < 0) return makeError("character {}: a '%' without two hexadecimal digits", i + 1);
      c = static_cast<unsigned char>(high * 16 + low);
      i += 2;
    } else if (c == '+' && plusIsSpace) {
      c = ' ';
    }
    if (c < 0x20 || c == 0x7f) return makeError("character {}: a control character", i + 1);
    out.push_back(static_cast<char>(c));
  }
  return out;
}

Status readPath(std::string_view path, RequestTarget& out) {
  path.remove_prefix(1);
  if (path == "/") return makeError("the path begins with an empty segment");
  if (!path.empty() && path.back() == '/') {
    out.trailingSlash = true;
    path.remove_suffix(1);
  }
  while (!path.empty()) {
    const size_t slash = std::min(path.find('/'), path.size());
    auto segment = decode(path.substr(0, slash), false);
    if (!segment.ok())
      return makeError("the path, segment {}, {}", out.path.size() + 1, segment.error().message);
    if (segment->empty() || *segment == "." || *segment == ".." ||
        segment->find_first_of("/\\") != std::string::npos)
      return makeError("the path, segment {}: nothing here has such a name", out.path.size() + 1);
    if (out.path.size() == kMostUrlParts)
      return makeError("the path has more than {} segments", kMostUrlParts);
    out.path.push_back(std::move(segment).value());
    if (slash + 1 == path.size()) return makeError("the path ends in an empty segment");
    path.remove_prefix(std::min(slash + 1, path.size()));
  }
  return {};
}

Status readQuery(std::string_view query, RequestTarget& out) {
  while (!query.empty()) {
    const size_t end = std::min(query.find('&'), query.size());
    const std::string_view pair = query.substr(0, end);
    query.remove_prefix(std::min(end + 1, query.size()));
    if (pair.empty()) continue;
    const size_t equals = std::min(pair.find('='), pair.size());
    auto name = decode(pair.substr(0, equals), true);
    if (!name.ok()) return makeError("the query, a parameter's name, {}", name.error().message);
    auto value = decode(pair.substr(std::min(equals + 1, pair.size())), true);
    if (!value.ok()) return makeError("the query, parameter {}, {}", *name, value.error().message);
    if (out.find(*name) != nullptr) return makeError("the query has the parameter {} twice", *name);
    if (out.query.size() == kMostUrlParts)
      return makeError("the query has more than {} parameters", kMostUrlParts);
    out.query.emplace_back(std::move(name).value(), std::move(value).value());
  }
  return {};
}

}  // namespace

const std::string* RequestTarget::find(std::string_view name) const {
  for (const auto& [key, value] : query)
    if (key == name) return &value;
  return nullptr;
}

Result<RequestTarget> readTarget(std::string_view target) {
  // The absolute form, which proxies send.
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (target.substr(0, scheme.size()) != scheme) continue;
    target.remove_prefix(std::min(target.find_first_of("/?", scheme.size()), target.size()));
    if (target.empty() || target.front() == '?') return makeError("the target has no path");
  }
  if (target.empty() || target.front() != '/') return makeError("the target is no path that begins with '/'");
  if (target.find('#') != std::string_view::npos) return makeError("the target has a fragment ('#')");
  RequestTarget out;
  const size_t mark = std::min(target.find('?'), target.size());
  TERRANE_TRY(readPath(target.substr(0, mark), out));
  TERRANE_TRY(readQuery(target.substr(std::min(mark + 1, target.size())), out));
  return out;
}

}  // namespace terrane::serve
