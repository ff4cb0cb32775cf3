#include "viewer_files.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "terrane/dataset/hash.h"

namespace terrane::serve {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostFiles = 500;
constexpr uint64_t kMostBytes = uint64_t{64} << 20;
constexpr std::string_view kPage = "index.html";
/// Where a build puts what is named for its own content.
constexpr std::string_view kHashedFolder = "assets/";

std::string_view typeOf(const fs::path& path) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kTypes = {{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".wasm", "application/wasm"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".json", "application/json"},
      {".webmanifest", "application/manifest+json"},
  }};
  const std::string extension = path.extension().string();
  for (const auto& [known, type] : kTypes)
    if (known == extension) return type;
  return "application/octet-stream";
}

}  // namespace

Result<ViewerFiles> ViewerFiles::read(const std::string& folder) {
  ViewerFiles out;
  uint64_t bytes = 0;
  std::error_code trouble;
  fs::recursive_directory_iterator at(folder, trouble);
  for (; !trouble && at != fs::recursive_directory_iterator(); at.increment(trouble)) {
    if (!at->is_regular_file(trouble)) continue;
    std::ifstream file(at->path(), std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!file) return makeError("{}: cannot be read", at->path().string());
    bytes += text.size();
    if (out.files_.size() >= kMostFiles || bytes > kMostBytes)
      return makeError("{}: more than {} files or {} MB; the viewer is a folder that ./dev build web makes",
                       folder, kMostFiles, kMostBytes >> 20);
    const std::string name = fs::relative(at->path(), folder, trouble).generic_string();
    const std::string hash = sha256(text).substr(0, 32);
    out.files_.emplace(name, makeTextEntity(std::move(text), hash, typeOf(at->path())));
  }
  if (trouble) return makeError("{}: {}", folder, trouble.message());
  if (out.files_.find(kPage) == out.files_.end())
    return makeError("{}: there is no {} in it; ./dev build web makes one in build/viewer", folder, kPage);
  return out;
}

std::optional<HttpResponse> ViewerFiles::answer(const HttpRequest& request, std::string_view path) const {
  const bool isPage = path.empty();
  const auto file = files_.find(isPage ? kPage : path);
  if (file == files_.end()) return std::nullopt;
  const bool isHashed = path.substr(0, kHashedFolder.size()) == kHashedFolder;
  HttpResponse response = answerText(request, Route::Page, file->second, isHashed ? kImmutable : kRevalidate);
  if (!isPage) return response;
  // Datasets and maps may come from elsewhere; code may not.
  response.add("Content-Security-Policy",
               "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
               "img-src 'self' data: blob:; connect-src *; worker-src 'self' blob:; object-src 'none'; "
               "base-uri 'none'");
  response.add("Referrer-Policy", "no-referrer");
  return response;
}

}  // namespace terrane::serve
