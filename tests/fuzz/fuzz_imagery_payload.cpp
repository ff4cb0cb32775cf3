#include <cstdint>
#include <vector>

#include "payload_check.h"
#include "terrane/base/check.h"
#include "terrane/codec/imagery_codec.h"

/// The input is a payload, or the beginning of one.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace terrane;
  // The check would keep out all that is not a whole payload: it is made right.
  std::vector<uint8_t> payload(data, data + size);
  if (payload.size() >= kCheckedFrom) sealPayload(payload);
  const Result<ImageryTile> whole = decodeImagery(payload);
  const Result<ImageryTile> prefix = decodeImageryPrefix(payload);
  if (!whole.ok()) return 0;

  // What is whole is a prefix of itself, and can be written and read again with the alpha that it has.
  TERRANE_CHECK(prefix.ok() && prefix->rgba == whole->rgba);
  const ImageryLayout layout = imageryLayout(payload).value();
  const Result<ImageryTile> again = decodeImagery(encodeImagery(*whole, layout.format, 50));
  TERRANE_CHECK(again.ok(), "{}", again.error().message);
  for (size_t i = 3; i < whole->rgba.size(); i += 4) TERRANE_CHECK(again->rgba[i] == whole->rgba[i]);
  return 0;
}
