#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "terrane/base/result.h"

namespace terrane {

/// Which jobs are done, and the few bytes that came of each: a file to which a record is appended as a job
/// ends. It survives the death of the program at any moment (not that of the machine: nothing is synced), for
/// what the system was given it keeps. Each record has a checksum, so that one cut short is recognised and
/// dropped, with all that follows.
///
/// A record: length of what follows the checksum (uint32), its CRC-32 (uint32), length of the stage's name
/// (uint8), the name, the job's number (int64), the outcome. All little-endian.
class JobLog {
 public:
  /// One finished job of a stage.
  struct Finished {
    int64_t job = 0;
    std::span<const uint8_t> outcome;
  };

  /// Opens the log at `path`, or begins one. A torn end is cut off.
  static Result<JobLog> open(const std::string& path);
  ~JobLog();
  JobLog(JobLog&& other) noexcept;
  JobLog& operator=(JobLog&&) = delete;

  /// The jobs of a stage that were done when the log was opened, in the order in which they ended.
  std::vector<Finished> finished(std::string_view stage) const;
  /// The stages of which jobs were done then.
  std::vector<std::string> stages() const;
  /// Was any job of any stage done then?
  bool resumes() const { return !stages_.empty(); }
  /// Is any job done now?
  bool empty() const;

  /// Notes that a job is done; call it when all that it wrote was handed to the system. From any thread.
  Status append(std::string_view stage, int64_t job, std::span<const uint8_t> outcome);

 private:
  JobLog(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}
  size_t parse();

  int descriptor_ = -1;
  std::string path_;
  std::vector<uint8_t> bytes_;  ///< the records that were there
  struct Place {
    int64_t job;
    size_t begin;
    size_t size;
  };
  std::map<std::string, std::vector<Place>, std::less<>> stages_;
  mutable std::mutex mutex_;
  uint64_t size_ = 0;  ///< of the file
};

}  // namespace terrane
