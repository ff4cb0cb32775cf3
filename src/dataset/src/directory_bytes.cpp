#include <filesystem>
#include <map>
#include <utility>

#include "file.h"
#include "terrane/base/check.h"
#include "terrane/dataset/byte_source.h"

namespace terrane {
namespace {

class DirectoryBytes final : public ByteSource {
 public:
  explicit DirectoryBytes(std::string directory) : directory_(std::move(directory)) {}

  const std::string& where() const override { return directory_; }
  std::string where(const std::string& file) const override {
    return (std::filesystem::path(directory_) / file).string();
  }

  Result<std::string> readWhole(const std::string& file) override { return readTextFile(where(file)); }

  Status open(const std::string& name, uint64_t bytes) override {
    TERRANE_ASSIGN(File file, File::openForReading(where(name)));
    TERRANE_ASSIGN(const uint64_t size, file.size());
    if (size != bytes)
      return makeError("{}: has {} bytes, the manifest says {}: copy the dataset again, or build it again",
                       where(name), size, bytes);
    files_.insert_or_assign(name, std::move(file));
    return {};
  }

  Result<std::vector<std::vector<uint8_t>>> read(std::span<const FileRange> ranges) const override {
    std::vector<std::vector<uint8_t>> out;
    out.reserve(ranges.size());
    for (const FileRange& range : ranges) {
      const auto file = files_.find(range.file);
      TERRANE_CHECK(file != files_.end(), "{} is not open", range.file);
      out.emplace_back(static_cast<size_t>(range.bytes));
      TERRANE_TRY(file->second.read(range.offset, out.back()));
    }
    return out;
  }

 private:
  std::string directory_;
  std::map<std::string, File> files_;
};

}  // namespace

std::unique_ptr<ByteSource> openDirectoryBytes(const std::string& directory) {
  return std::make_unique<DirectoryBytes>(directory);
}

}  // namespace terrane
