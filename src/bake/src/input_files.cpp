#include "terrane/bake/input_files.h"

#include <algorithm>
#include <filesystem>

#include "input_list.h"

namespace terrane {
namespace {

namespace fs = std::filesystem;

InputFile lookedAt(const fs::path& path) {
  InputFile out;
  std::error_code code;
  out.path = fs::absolute(path, code).lexically_normal().string();
  if (fs::is_regular_file(path, code)) out.bytes = fs::file_size(path, code);
  const auto modified = fs::last_write_time(path, code);
  if (!code)
    out.modified = std::chrono::duration_cast<std::chrono::nanoseconds>(modified.time_since_epoch()).count();
  return out;
}

/// All files of a folder, for what is a raster as a whole (an Arc/Info grid), or those with the stem of a
/// file.
std::vector<fs::path> filesOf(const fs::path& raster) {
  std::vector<fs::path> out;
  std::error_code code;
  const bool isFolder = fs::is_directory(raster, code);
  for (fs::directory_iterator at(isFolder ? raster : fs::absolute(raster, code).parent_path(), code), end;
       !code && at != end; at.increment(code)) {
    const fs::path& path = at->path();
    const bool isSame = path.filename() == raster.filename();
    // note: "dem.tif.aux.xml" belongs to dem.tif, as "dem.tfw" does.
    const bool belongs = path.stem() == raster.stem() ||
                         path.filename().string().rfind(raster.filename().string() + ".", 0) == 0;
    std::error_code ignored;
    if (at->is_regular_file(ignored) && (isFolder || (belongs && !isSame))) out.push_back(path);
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

Result<std::vector<InputFile>> inputFiles(const std::vector<std::string>& inputs) {
  std::vector<std::string> names;
  for (const std::string& input : inputs) {
    std::error_code code;
    size_t begin = 0;
    // A plus sign may belong to a name.
    while (!fs::exists(input, code) && begin < input.size()) {
      const size_t end = std::min(input.find('+', begin), input.size());
      if (end > begin) names.push_back(input.substr(begin, end - begin));
      begin = end + 1;
    }
    if (begin == 0) names.push_back(input);
  }
  TERRANE_ASSIGN(const std::vector<InputPath> rasters, expandInputs(names));
  std::vector<InputFile> out;
  for (const InputPath& raster : rasters) {
    const std::string file = fileBehind(raster.path);
    std::error_code code;
    if (file.empty() || !fs::exists(file, code)) {
      out.push_back({raster.path, 0, 0});
      continue;
    }
    // note: of an archive with many rasters every one is named, the archive again and again.
    if (file != raster.path) out.push_back({raster.path, 0, 0});
    out.push_back(lookedAt(file));
    for (const fs::path& beside : filesOf(file)) out.push_back(lookedAt(beside));
  }
  return out;
}

}  // namespace terrane
