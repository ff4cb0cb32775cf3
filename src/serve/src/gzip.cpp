#include "gzip.h"

#include <zlib.h>

#include "terrane/base/check.h"

namespace terrane::serve {

std::string gzip(std::string_view bytes) {
  z_stream stream{};
  constexpr int kGzipWindow = 15 + 16;
  TERRANE_CHECK(deflateInit2(&stream, 6, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY) == Z_OK, "zlib");
  std::string out(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int result = deflate(&stream, Z_FINISH);
  TERRANE_CHECK(result == Z_STREAM_END, "deflate gave {}", result);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

}  // namespace terrane::serve
