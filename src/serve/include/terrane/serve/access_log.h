#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "terrane/base/result.h"

namespace terrane::serve {

/// One line for a request, in the Common Log Format with the seconds it took at the end. Any thread; a line
/// is one write, so that other programs may rotate the file. What clients send cannot break lines.
class AccessLog {
 public:
  /// A path, which is appended to, or "-" for standard output.
  static Result<std::unique_ptr<AccessLog>> open(const std::string& path);
  explicit AccessLog(int descriptor) : descriptor_(descriptor) {}
  ~AccessLog();
  AccessLog(const AccessLog&) = delete;
  AccessLog& operator=(const AccessLog&) = delete;

  struct Entry {
    std::string_view peer;
    std::string_view method;
    std::string_view target;
    int status = 0;
    uint64_t bytes = 0;
    double seconds = 0.0;
  };
  void write(const Entry& entry);

 private:
  int descriptor_;
};

}  // namespace terrane::serve
