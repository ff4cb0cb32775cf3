#include "terrane/dataset/hash.h"

#include <algorithm>
#include <vector>

#include "file.h"
#include "sha256.h"

namespace terrane {
namespace {

std::string hex(const Sha256::Digest& digest) {
  std::string text;
  for (const uint8_t byte : digest) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.add(bytes.data(), bytes.size());
  return hex(hash.finish());
}

Result<std::string> sha256OfFile(const std::string& path) {
  TERRANE_ASSIGN(const File file, File::openForReading(path));
  TERRANE_ASSIGN(const uint64_t size, file.size());
  Sha256 hash;
  std::vector<uint8_t> piece(1 << 20);
  for (uint64_t offset = 0; offset < size; offset += piece.size()) {
    const std::span<uint8_t> part(piece.data(),
                                  static_cast<size_t>(std::min<uint64_t>(piece.size(), size - offset)));
    TERRANE_TRY(file.read(offset, part));
    hash.add(part.data(), part.size());
  }
  return hex(hash.finish());
}

}  // namespace terrane
