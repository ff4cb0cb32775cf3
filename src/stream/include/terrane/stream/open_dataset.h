#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "terrane/base/result.h"
#include "terrane/dataset/byte_source.h"
#include "terrane/dataset/dataset.h"
#include "terrane/stream/transport.h"

namespace terrane {

/// For those who can wait: how long, and what they hear meanwhile.
struct RemoteOptions {
  double openingSeconds = 3.0;    ///< without an answer, before the first one came
  double patienceSeconds = 30.0;  ///< without an answer, later
  std::function<void(uint64_t bytes)> received;
  std::function<void(const std::string& problem)> trouble;  ///< the server is away, and is asked again
};

/// Reads by ranges over a line, several at once, neighbours together; asks again where the line breaks, the
/// server is busy or an answer is damaged. Errors: what cannot be had, in words, and how much is missing.
std::unique_ptr<ByteSource> openRemoteBytes(std::unique_ptr<Transport> transport,
                                            const RemoteOptions& options = {});

/// Opens a dataset by its directory or, with http:// or https://, its address there.
Result<Dataset> openDataset(const std::string& directoryOrUrl, const RemoteOptions& options = {});

}  // namespace terrane
