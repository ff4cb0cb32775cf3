#include "terrane/measure/bench_result.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "terrane/base/format_number.h"

namespace terrane {
namespace {

using Json = nlohmann::ordered_json;

std::string cellText(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_integer()) return formatCount(value.get<int64_t>());
  if (value.is_number_float()) return fmt::format("{:.3g}", value.get<double>());
  return value.is_null() ? "-" : value.dump();
}

/// Lays out rows of cells in columns; text to the left, numbers to the right.
std::string alignColumns(const std::vector<std::vector<std::string>>& rows, const std::vector<bool>& isText) {
  std::vector<size_t> widths(isText.size(), 0);
  for (const auto& row : rows) {
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string table;
  for (const auto& row : rows) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) {
      if (i > 0) line += "  ";
      line += isText[i] ? fmt::format("{:<{}}", row[i], widths[i]) : fmt::format("{:>{}}", row[i], widths[i]);
    }
    table += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return table;
}

const char* sideText(const Bar& bar) {
  return bar.side == Bar::Side::AtMost ? "at most" : "at least";
}

}  // namespace

bool BenchResult::allHold() const {
  return std::all_of(bars.begin(), bars.end(), [](const Bar& bar) { return bar.holds(); });
}

Json BenchResult::toJson() const {
  Json out;
  out["bench"] = bench;
  out["machine"] = describeMachine();
  out["rows"] = rows;
  out["bars"] = Json::array();
  for (const Bar& bar : bars) {
    out["bars"].push_back({{"name", bar.name},
                           {"value", bar.value},
                           {"unit", bar.unit},
                           {"side", sideText(bar)},
                           {"bar", bar.bar},
                           {"holds", bar.holds()}});
  }
  return out;
}

std::string BenchResult::toTable() const {
  std::string text;
  if (!rows.empty()) {
    std::vector<std::vector<std::string>> cells(1);
    std::vector<bool> isText;
    for (const auto& item : rows.front().items()) {
      cells.front().push_back(item.key());
      isText.push_back(item.value().is_string());
    }
    for (const Json& row : rows) {
      cells.emplace_back();
      for (const auto& item : row.items()) cells.back().push_back(cellText(item.value()));
      cells.back().resize(isText.size());
    }
    text += alignColumns(cells, isText) + "\n";
  }

  std::vector<std::vector<std::string>> cells = {{"bar", "value", "must be", ""}};
  for (const Bar& bar : bars) {
    const std::string unit = bar.unit.empty() ? "" : " " + bar.unit;
    cells.push_back({bar.name, fmt::format("{:.4g}{}", bar.value, unit),
                     fmt::format("{} {:.4g}{}", sideText(bar), bar.bar, unit),
                     bar.holds() ? "holds" : "DOES NOT HOLD"});
  }
  return text + alignColumns(cells, {true, false, false, true});
}

std::string describeMachine() {
  std::string processor = "unknown processor";
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
      processor = line.substr(colon + 2);
      break;
    }
  }
  std::string system = "unknown system";
  std::ifstream release("/etc/os-release");
  for (std::string line; std::getline(release, line);) {
    if (line.rfind("PRETTY_NAME=\"", 0) == 0) system = line.substr(13, line.size() - 14);
  }
  const unsigned cores = std::thread::hardware_concurrency();
  return fmt::format("{}, {} cores, {}", processor, cores, system);
}

Result<std::vector<std::string>> flightsIn(const std::string& folder) {
  std::vector<std::string> flights;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    if (entry.path().extension() == ".json") flights.push_back(entry.path().string());
  }
  std::sort(flights.begin(), flights.end());
  if (failed || flights.empty()) return makeError("{}: has no flights", folder);
  return flights;
}

Status writeTextFile(const std::string& path, const std::string& text) {
  const std::string aside = path + ".part";
  std::FILE* file = std::fopen(aside.c_str(), "wb");
  if (file == nullptr) return makeError("{}: cannot be written: {}", path, std::strerror(errno));
  const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  const bool closed = std::fclose(file) == 0;
  if (!written || !closed || std::rename(aside.c_str(), path.c_str()) != 0) {
    const int reason = errno;
    std::remove(aside.c_str());
    return makeError("{}: cannot be written: {}", path, std::strerror(reason));
  }
  return {};
}

Status finishBench(const BenchResult& result, const std::string& path,
                   const nlohmann::ordered_json& besides) {
  std::fputs(result.toTable().c_str(), stdout);
  Json json = result.toJson();
  json.update(besides);
  TERRANE_TRY(writeTextFile(path, json.dump(1) + "\n"));
  return result.allHold() ? Status() : Status(makeError("a bar does not hold"));
}

int benchMain(const char* program, int argc, char** argv,
              const std::function<Status(const std::vector<std::string>&)>& run) {
  const Status done = run(std::vector<std::string>(argv + 1, argv + argc));
  if (done.ok()) return 0;
  std::fprintf(stderr, "%s: %s\n", program, done.error().message.c_str());
  return 1;
}

}  // namespace terrane
