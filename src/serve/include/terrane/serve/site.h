#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "terrane/base/result.h"
#include "terrane/serve/http_server.h"
#include "terrane/serve/metrics.h"

namespace terrane::serve {

struct SiteOptions {
  std::vector<std::string> datasets;  ///< directories
  std::string corsOrigin;             ///< "*", one origin, or empty for none
  std::string viewerFolder;           ///< the viewer's files, read at the start; empty: a plain page instead
  uint64_t cacheBytes = uint64_t{256} << 20;  ///< decoded tiles for questions, all datasets together
};

/// What is served: a fixed table of datasets, their files and questions about them (docs/serving.md). A
/// function from requests to answers: it knows nothing of sockets. Paths of requests never become paths of
/// files.
class Site final : public HttpHandler {
 public:
  /// Opens every dataset. Errors: what Dataset::open says, or two of one name.
  static Result<std::unique_ptr<Site>> open(const SiteOptions& options, Metrics& metrics);
  ~Site() override;

  HttpResponse answer(const HttpRequest& request) override;
  /// Questions decode tiles and walk over them; all else is bytes that lie ready.
  bool takesLong(const HttpRequest& request) const override;
  void decorate(const HttpRequest& request, HttpResponse& response) const override;

  struct Listed {
    std::string name;
    std::string hash;
    std::string path;  ///< of its address, behind the server's: "d/alps/"
  };
  std::vector<Listed> datasets() const;

 private:
  struct State;
  explicit Site(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace terrane::serve
