#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace terrane {

/// Where long work reports what it is doing. The work calls it from any thread; what becomes of it (a line
/// on a terminal, JSON, nothing) is the caller's choice. All calls are cheap and may be frequent.
class Progress {
 public:
  virtual ~Progress() = default;

  /// A new stage begins ("reading", "errors", "encoding"): `total` steps of `unit` ("tiles", "rows").
  /// Ends the stage before it.
  virtual void beginStage(std::string_view name, int64_t total, std::string_view unit) = 0;
  /// `steps` more of the current stage are done.
  virtual void advance(int64_t steps) = 0;
  /// Something that the user should know and that does not stop the work.
  virtual void warn(const std::string& message) = 0;
};

/// A Progress that says nothing.
class SilentProgress final : public Progress {
 public:
  void beginStage(std::string_view, int64_t, std::string_view) override {}
  void advance(int64_t) override {}
  void warn(const std::string&) override {}
};

}  // namespace terrane
