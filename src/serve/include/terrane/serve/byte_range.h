#pragma once

#include <cstdint>
#include <string_view>

namespace terrane::serve {

/// What a `Range` field asks of something with `size` bytes (RFC 9110, section 14).
struct RangeAnswer {
  enum class Kind : uint8_t {
    Whole,  ///< the field is absent, not of bytes, malformed, or asks for several: 200 with everything
    Part,   ///< 206 with [offset, offset + length)
    Unsatisfiable,  ///< 416
  };
  Kind kind = Kind::Whole;
  uint64_t offset = 0;
  uint64_t length = 0;
};

/// Reads a `Range` field. A set of several ranges is answered whole, which section 14.2 allows: clients of
/// archives merge neighbouring ranges, and multipart answers are what no cache can use. Numbers that overflow
/// stand for "beyond the end". Any input, no allocation.
RangeAnswer readRange(std::string_view field, uint64_t size);

/// Does one of the entity tags in an `If-Match` or `If-None-Match` list (or "*") match `etag`, a strong tag
/// with its quotes? `weak`: W/"x" matches "x" too (If-None-Match, section 13.1.2).
bool matchesEtag(std::string_view list, std::string_view etag, bool weak);

/// Does this `Accept-Encoding` take gzip? (Named, or by "*", with a weight above 0.)
bool acceptsGzip(std::string_view field);

}  // namespace terrane::serve
