#include "job_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>

namespace terrane {

namespace {

constexpr size_t kHeadBytes = 8;  // length and checksum

uint32_t checksumOf(const uint8_t* bytes, size_t size) {
  return static_cast<uint32_t>(crc32_z(0, bytes, size));
}

template <class T>
T valueAt(const std::vector<uint8_t>& bytes, size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof(value));
  return value;
}

template <class T>
void put(std::vector<uint8_t>& bytes, T value) {
  const size_t at = bytes.size();
  bytes.resize(at + sizeof(value));
  std::memcpy(bytes.data() + at, &value, sizeof(value));
}

}  // namespace

Result<JobLog> JobLog::open(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor < 0) return makeError("{}: cannot be opened: {}", path, std::strerror(errno));
  JobLog log(descriptor, path);
  struct stat status {};
  if (fstat(descriptor, &status) != 0) return makeError("{}: cannot be read: {}", path, std::strerror(errno));
  log.bytes_.resize(static_cast<size_t>(status.st_size));
  size_t done = 0;
  while (done < log.bytes_.size()) {
    const ssize_t count =
        pread(descriptor, log.bytes_.data() + done, log.bytes_.size() - done, static_cast<off_t>(done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return makeError("{}: cannot be read: {}", path, std::strerror(errno));
    if (count == 0) break;
    done += static_cast<size_t>(count);
  }
  log.bytes_.resize(done);

  const size_t whole = log.parse();
  if (whole < static_cast<size_t>(status.st_size) && ftruncate(descriptor, static_cast<off_t>(whole)) != 0)
    return makeError("{}: cannot be written: {}", path, std::strerror(errno));
  log.bytes_.resize(whole);
  log.size_ = whole;
  return log;
}

JobLog::JobLog(JobLog&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      path_(std::move(other.path_)),
      bytes_(std::move(other.bytes_)),
      stages_(std::move(other.stages_)),
      size_(other.size_) {}

JobLog::~JobLog() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

size_t JobLog::parse() {
  size_t at = 0;
  while (bytes_.size() - at >= kHeadBytes) {
    const size_t length = valueAt<uint32_t>(bytes_, at);
    const size_t body = at + kHeadBytes;
    if (length < 1 + sizeof(int64_t) || length > bytes_.size() - body) break;
    if (checksumOf(bytes_.data() + body, length) != valueAt<uint32_t>(bytes_, at + 4)) break;
    const size_t nameLength = bytes_[body];
    const size_t fixed = 1 + nameLength + sizeof(int64_t);
    if (fixed > length) break;
    std::string name(reinterpret_cast<const char*>(bytes_.data()) + body + 1, nameLength);
    const auto job = valueAt<int64_t>(bytes_, body + 1 + nameLength);
    stages_[std::move(name)].push_back({job, body + fixed, length - fixed});
    at = body + length;
  }
  return at;
}

std::vector<JobLog::Finished> JobLog::finished(std::string_view stage) const {
  std::vector<Finished> out;
  const auto found = stages_.find(stage);
  if (found == stages_.end()) return out;
  out.reserve(found->second.size());
  for (const Place& place : found->second)
    out.push_back({place.job, {bytes_.data() + place.begin, place.size}});
  return out;
}

std::vector<std::string> JobLog::stages() const {
  std::vector<std::string> out;
  for (const auto& [name, places] : stages_) out.push_back(name);
  return out;
}

bool JobLog::empty() const {
  const std::lock_guard lock(mutex_);
  return size_ == 0;
}

Status JobLog::append(std::string_view stage, int64_t job, std::span<const uint8_t> outcome) {
  TERRANE_CHECK(stage.size() < 256, "{}", stage);
  std::vector<uint8_t> record(kHeadBytes);
  record.reserve(kHeadBytes + 1 + stage.size() + sizeof(job) + outcome.size());
  record.push_back(static_cast<uint8_t>(stage.size()));
  record.insert(record.end(), stage.begin(), stage.end());
  put(record, job);
  record.insert(record.end(), outcome.begin(), outcome.end());
  const auto length = static_cast<uint32_t>(record.size() - kHeadBytes);
  const uint32_t checksum = checksumOf(record.data() + kHeadBytes, length);
  std::memcpy(record.data(), &length, sizeof(length));
  std::memcpy(record.data() + 4, &checksum, sizeof(checksum));

  const std::lock_guard lock(mutex_);
  size_t done = 0;
  while (done < record.size()) {
    const ssize_t count = ::write(descriptor_, record.data() + done, record.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int reason = count < 0 ? errno : ENOSPC;
      // Half a record would hide those that follow.
      static_cast<void>(ftruncate(descriptor_, static_cast<off_t>(size_)));
      return makeError("{}: cannot be written: {}; make room there", path_, std::strerror(reason));
    }
    done += static_cast<size_t>(count);
  }
  size_ += record.size();
  return {};
}

}  // namespace terrane
