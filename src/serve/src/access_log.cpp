#include "terrane/serve/access_log.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>

namespace terrane::serve {
namespace {

constexpr size_t kLongestShown = 2000;

/// What a client sent, so that it neither ends the line nor the quotes around it.
std::string escape(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, kLongestShown)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte >= 0x7f || c == '"' || c == '\\')
      out += fmt::format("\\x{:02x}", byte);
    else
      out += c;
  }
  return out;
}

}  // namespace

Result<std::unique_ptr<AccessLog>> AccessLog::open(const std::string& path) {
  if (path == "-") return std::make_unique<AccessLog>(STDOUT_FILENO);
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor < 0)
    return makeError("{}: cannot write the access log: {}; choose another file", path, std::strerror(errno));
  return std::make_unique<AccessLog>(descriptor);
}

AccessLog::~AccessLog() {
  if (descriptor_ != STDOUT_FILENO) ::close(descriptor_);
}

void AccessLog::write(const Entry& entry) {
  const std::string line =
      fmt::format("{} - - [{:%d/%b/%Y:%H:%M:%S +0000}] \"{} {} HTTP/1.1\" {} {} {:.6f}\n", entry.peer,
                  fmt::gmtime(std::time(nullptr)), escape(entry.method), escape(entry.target), entry.status,
                  entry.bytes, entry.seconds);
  // A log that cannot be written is no reason to stop serving.
  [[maybe_unused]] const ssize_t written = ::write(descriptor_, line.data(), line.size());
}

}  // namespace terrane::serve
