#include <openssl/evp.h>

#include "sha256.h"
#include "terrane/base/check.h"

namespace terrane {

struct Sha256::State {
  EVP_MD_CTX* context = EVP_MD_CTX_new();
  ~State() { EVP_MD_CTX_free(context); }
};

Sha256::Sha256() : state_(std::make_unique<State>()) {
  TERRANE_CHECK(state_->context != nullptr && EVP_DigestInit_ex(state_->context, EVP_sha256(), nullptr) == 1,
                "OpenSSL has no SHA-256");
}
Sha256::~Sha256() = default;

void Sha256::add(const void* bytes, size_t size) {
  TERRANE_CHECK(EVP_DigestUpdate(state_->context, bytes, size) == 1, "SHA-256 of {} bytes", size);
}

Sha256::Digest Sha256::finish() {
  Digest digest{};
  TERRANE_CHECK(EVP_DigestFinal_ex(state_->context, digest.data(), nullptr) == 1, "SHA-256");
  return digest;
}

}  // namespace terrane
