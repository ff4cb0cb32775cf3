#include "terrane/dataset/hash.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "file.h"

namespace terrane {
namespace {

/// SHA-256 in pieces, by OpenSSL.
class Sha256 {
 public:
  Sha256() {
    TERRANE_CHECK(context_ != nullptr && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1,
                  "OpenSSL has no SHA-256");
  }
  void add(const void* bytes, size_t size) {
    TERRANE_CHECK(EVP_DigestUpdate(context_.get(), bytes, size) == 1, "SHA-256 of {} bytes", size);
  }
  std::string hex() {
    std::array<unsigned char, 32> digest{};
    TERRANE_CHECK(EVP_DigestFinal_ex(context_.get(), digest.data(), nullptr) == 1, "SHA-256");
    std::string text;
    for (const unsigned char byte : digest) text += fmt::format("{:02x}", byte);
    return text;
  }

 private:
  struct Deleter {
    void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
  };
  std::unique_ptr<EVP_MD_CTX, Deleter> context_{EVP_MD_CTX_new()};
};

}  // namespace

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.add(bytes.data(), bytes.size());
  return hash.hex();
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
  return hash.hex();
}

}  // namespace terrane
