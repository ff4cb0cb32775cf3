#include "site_pages.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "terrane/base/format_number.h"

namespace terrane::serve {
namespace {

std::string escapeHtml(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

}  // namespace

std::string escapeSegment(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || c == '.' || c == '~';
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return out;
}

std::string datasetsJson(const std::vector<std::unique_ptr<ServedDataset>>& datasets) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& served : datasets) {
    const Manifest& m = served->dataset->manifest();
    const std::string base = "/d/" + escapeSegment(served->name);
    nlohmann::ordered_json files = nlohmann::ordered_json::array();
    for (const ServedArchive& archive : served->archives)
      files.push_back({{"name", archive.fileName}, {"bytes", archive.bytes}});
    list.push_back({{"name", served->name},
                    {"hash", served->hash},
                    {"manifest", base + "/manifest.json"},
                    {"immutable", base + "/" + served->hash + "/"},
                    {"crs", m.crsName},
                    {"attribution", m.attribution},
                    {"minHeightMeters", m.minHeight},
                    {"maxHeightMeters", m.maxHeight},
                    {"maxErrorMeters", m.maxErrorMeters},
                    {"files", files}});
  }
  return nlohmann::ordered_json{{"datasets", list}}.dump(1, ' ', false,
                                                         nlohmann::ordered_json::error_handler_t::replace) +
         "\n";
}

std::string indexPage(const std::vector<std::unique_ptr<ServedDataset>>& datasets) {
  std::string rows;
  for (const auto& served : datasets) {
    const Manifest& m = served->dataset->manifest();
    const std::string base = "/d/" + escapeSegment(served->name);
    uint64_t bytes = 0;
    for (const ServedArchive& archive : served->archives) bytes += archive.bytes;
    const glm::dvec3 middle = m.frame.crsFromLocal(
        {m.frame.localFromSample(
             glm::dvec2(static_cast<double>(m.extentCols - 1), static_cast<double>(m.extentRows - 1)) * 0.5),
         0.0});
    rows += fmt::format(
        "<tr><td><a href=\"{0}/manifest.json\">{1}</a></td><td>{2}</td><td>{3:.0f} to {4:.0f} "
        "m</td><td>{5}</td>"
        "<td><a href=\"{0}/elevation?points={6:.3f},{7:.3f}\">height in the "
        "middle</a></td><td>{8}</td></tr>\n",
        base, escapeHtml(served->name), escapeHtml(m.crsName), m.minHeight, m.maxHeight, formatBytes(bytes),
        middle.x, middle.y, escapeHtml(m.attribution));
  }
  return "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Terrane</title>\n"
         "<meta name=\"viewport\" content=\"width=device-width\">\n"
         "<style>body{font:16px/1.5 sans-serif;margin:2em auto;max-width:60em;padding:0 1em}"
         "td,th{padding:.2em 1em .2em 0;text-align:left}</style>\n"
         "<h1>Terrane</h1>\n<p>The terrain that is served here, also as <a "
         "href=\"/datasets.json\">JSON</a>.</p>\n"
         "<table><tr><th>dataset<th>CRS<th>ground<th>size<th>ask<th>attribution</tr>\n" +
         rows + "</table>\n</html>\n";
}

}  // namespace terrane::serve
