#include "file_range.h"

#include <fstream>

namespace terrane {

std::variant<std::vector<uint8_t>, FetchFailure> readFileRange(const std::string& directory,
                                                               const FetchRequest& request) {
  const std::string path = directory + "/" + request.file;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return FetchFailure{FetchProblem::Missing, fmt::format("{}: cannot be opened", path)};
  const std::streamoff end = file.tellg();
  const auto size = static_cast<uint64_t>(std::max<std::streamoff>(end, 0));
  const uint64_t bytes = request.bytes == 0 ? size : request.bytes;
  if (request.bytes == 0 && size > kLargestWholeFile)
    return FetchFailure{FetchProblem::Malformed, fmt::format("{}: has {} bytes, too many", path, size)};
  if (request.fileBytes != 0 && request.fileBytes != size)
    return FetchFailure{FetchProblem::Fatal,
                        fmt::format("{}: has {} bytes, the manifest says {}: another build of the dataset is "
                                    "there now, or a broken copy; open it again",
                                    path, size, request.fileBytes)};
  if (request.offset > size || bytes > size - request.offset)
    return FetchFailure{FetchProblem::Missing, fmt::format("{}: ends before byte {}: copy the dataset again",
                                                           path, request.offset + bytes)};
  std::vector<uint8_t> out(static_cast<size_t>(bytes));
  file.seekg(static_cast<std::streamoff>(request.offset));
  file.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(bytes));
  if (file.gcount() != static_cast<std::streamsize>(bytes))
    return FetchFailure{FetchProblem::Unreachable, fmt::format("{}: cannot be read", path)};
  return out;
}

}  // namespace terrane
