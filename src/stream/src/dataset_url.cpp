#include "dataset_url.h"

#include <algorithm>
#include <string_view>

namespace terrane {

DatasetUrl parseDatasetUrl(const std::string& url) {
  DatasetUrl out;
  out.folder = url.substr(0, url.find('#'));
  if (const size_t query = out.folder.find('?'); query != std::string::npos) {
    out.query = out.folder.substr(query);
    out.folder.resize(query);
  }
  const size_t scheme = out.folder.find("://");
  const size_t host = scheme == std::string::npos ? 0 : scheme + 3;
  const auto dropSlashes = [&] {
    while (out.folder.size() > host && out.folder.back() == '/') out.folder.pop_back();
  };
  dropSlashes();
  constexpr std::string_view kManifest = "/manifest.json";
  if (out.folder.size() > host + kManifest.size() &&
      out.folder.compare(out.folder.size() - kManifest.size(), kManifest.size(), kManifest) == 0)
    out.folder.resize(out.folder.size() - kManifest.size());
  dropSlashes();

  out.shown = out.folder;
  const size_t path = std::min(out.shown.find('/', host), out.shown.size());
  const size_t user = out.shown.rfind('@', path);
  if (user != std::string::npos && user >= host && user < path) out.shown.erase(host, user + 1 - host);
  return out;
}

}  // namespace terrane
