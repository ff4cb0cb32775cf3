#include <cstdint>
#include <string>

#include "manifest_seal.h"
#include "terrane/base/check.h"
#include "terrane/dataset/manifest.h"

/// The input is a manifest's text; its seal is set right first, for no fuzzer guesses a hash.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace terrane;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const Result<Manifest> manifest = manifestFromJson(sealManifest(text), "fuzz");
  if (!manifest.ok()) return 0;

  // What was accepted can be written and read again.
  const Result<Manifest> again = manifestFromJson(manifestToJson(*manifest), "again");
  TERRANE_CHECK(again.ok(), "{}", again.error().message);
  TERRANE_CHECK(manifestToJson(*again) == manifestToJson(*manifest));
  return 0;
}
