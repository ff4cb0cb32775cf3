#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace terrane {

/// SHA-256 (FIPS 180-4) in pieces: OpenSSL's, or in browsers, where OpenSSL is not, our own.
class Sha256 {
 public:
  using Digest = std::array<uint8_t, 32>;

  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;

  void add(const void* bytes, size_t size);
  /// Of all that was added. The last call.
  Digest finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace terrane
