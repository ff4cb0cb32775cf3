#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "terrane/serve/http_message.h"

namespace terrane::serve {

inline constexpr std::string_view kImmutable = "public, max-age=31536000, immutable";
inline constexpr std::string_view kRevalidate = "no-cache";  ///< may be kept, is asked for each time

/// A piece of a file as a resource.
struct FileEntity {
  std::shared_ptr<const ServedFile> file;
  uint64_t offset = 0;
  uint64_t bytes = 0;
  std::string_view etag;  ///< strong, with its quotes
  std::string_view type;
  std::string_view cacheControl;
};

/// Answers GET or HEAD for a piece of a file: If-Match, If-None-Match, Range with If-Range, in the order of
/// RFC 9110, section 13.2.2.
HttpResponse answerFile(const HttpRequest& request, Route route, const FileEntity& entity);

/// A text as a resource, and the same compressed.
struct TextEntity {
  std::shared_ptr<const std::string> plain;
  std::shared_ptr<const std::string> compressed;  ///< gzip; null where it does not pay
  std::string etag;                               ///< strong, with its quotes, of the plain text
  std::string compressedEtag;
  std::string type;
};
/// `name` begins the entity tags and must change with the text.
TextEntity makeTextEntity(std::string text, std::string_view name, std::string_view type);

/// Answers GET, HEAD or POST with a text: preconditions and compression. Ranges of it are not offered.
HttpResponse answerText(const HttpRequest& request, Route route, const TextEntity& entity,
                        std::string_view cacheControl);

}  // namespace terrane::serve
