#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "terrane/base/result.h"

/// What every bench leaves behind: a table on the terminal and `build/bench/NAME.json`.
namespace terrane {

/// A number that must hold.
struct Bar {
  enum class Side { AtMost, AtLeast };
  std::string name;
  double value = 0.0;
  std::string unit;  ///< "" for ratios and counts
  double bar = 0.0;  ///< the value must be at most (or at least) this
  Side side = Side::AtMost;
  bool holds() const { return side == Side::AtMost ? value <= bar : value >= bar; }
};

/// The result of a bench. Rows are flat objects with the same members, one a line of the table.
struct BenchResult {
  std::string bench;
  std::vector<nlohmann::ordered_json> rows;
  std::vector<Bar> bars;

  bool allHold() const;
  /// {"bench", "machine", "rows": [...], "bars": [{"name", "value", "unit", "side", "bar",
  /// "holds"}]}; side is "at most" or "at least".
  nlohmann::ordered_json toJson() const;
  /// Rows and bars in aligned columns, for a terminal.
  std::string toTable() const;
};

/// The processor's name and its number of cores, and the operating system's name.
std::string describeMachine();

/// The paths of a folder's flights (all .json files), sorted. Error: there are none.
Result<std::vector<std::string>> flightsIn(const std::string& folder);

/// Writes a file whole: aside, then renamed into place.
Status writeTextFile(const std::string& path, const std::string& text);

/// How a bench ends: its table on the terminal, its JSON in a file, with these members besides. Error: a bar
/// does not hold, or the file cannot be written.
Status finishBench(const BenchResult& result, const std::string& path,
                   const nlohmann::ordered_json& besides = nlohmann::ordered_json::object());

/// The main() of a bench's program: gives `run` its arguments, says on standard error what went wrong.
int benchMain(const char* program, int argc, char** argv,
              const std::function<Status(const std::vector<std::string>&)>& run);

}  // namespace terrane
