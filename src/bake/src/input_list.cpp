#include "input_list.h"

#include <cpl_string.h>
#include <cpl_vsi.h>
#include <gdal.h>
#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "input_gdal.h"

namespace terrane {
namespace {

namespace fs = std::filesystem;
constexpr int kMaxListDepth = 8;

std::string lowerExtension(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

// Files that stand beside a raster, or are no raster whatever GDAL may think of them.
bool isSidecar(const std::string& path) {
  static constexpr std::array<std::string_view, 28> kExtensions = {
      ".xml", ".prj", ".hdr", ".ovr", ".msk",  ".tfw",    ".tifw",    ".wld",   ".bpw", ".blw",
      ".rrd", ".aux", ".txt", ".md",  ".csv",  ".json",   ".gpkg",    ".shp",   ".shx", ".dbf",
      ".cpg", ".qgz", ".qgs", ".pdf", ".html", ".sqlite", ".geojson", ".sha256"};
  const std::string extension = lowerExtension(path);
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

bool identified(const std::string& path) {
  const GdalMessages messages;
  return GDALIdentifyDriverEx(path.c_str(), GDAL_OF_RASTER, nullptr, nullptr) != nullptr;
}

bool isZip(const std::string& path) {
  return lowerExtension(path) == ".zip";
}

class Expander {
 public:
  std::vector<InputPath> found;

  Status add(const std::string& input, const fs::path& listFolder, int depth) {
    if (input.empty()) return makeError("an input has an empty name; remove it");
    if (input.front() == '@') return addList(resolve(input.substr(1), listFolder), depth);

    // What exists under this very name is taken as it is, before it is looked at as a pattern.
    const std::string path = resolve(input, listFolder);
    std::error_code code;
    const fs::file_status status = fs::status(path, code);
    if (fs::is_directory(status)) return addFolder(path);
    if (fs::exists(status)) return addFile(path, false);
    if (input.find_first_of("*?[") != std::string::npos) return addGlob(path);

    // The rest is left to GDAL if it looks like one of its names.
    if (input.rfind("/vsi", 0) == 0 || input.find(':') != std::string::npos) {
      found.push_back({input, false});
      return {};
    }
    return makeError("{}: there is no such file or folder; check the path", input);
  }

 private:
  static std::string resolve(const std::string& input, const fs::path& listFolder) {
    std::error_code code;
    if (listFolder.empty() || fs::path(input).is_absolute() || fs::exists(input, code)) return input;
    const fs::path beside = listFolder / input;
    const bool pattern = input.find_first_of("*?[") != std::string::npos;
    return pattern || fs::exists(beside, code) ? beside.string() : input;
  }

  Status addFile(const std::string& path, bool fromFolder) {
    if (!isZip(path) || identified(path)) {
      found.push_back({path, fromFolder});
      return {};
    }

    // An archive stands for the rasters in it.
    const std::string root = "/vsizip/" + path;
    const GdalMessages messages;
    const CPLStringList entries(VSIReadDirRecursive(root.c_str()));
    std::vector<std::string> inside;
    for (int i = 0; i < entries.size(); ++i) {
      const std::string entry = root + "/" + entries[i];
      if (entry.back() != '/' && !isSidecar(entry) && identified(entry)) inside.push_back(entry);
    }
    std::sort(inside.begin(), inside.end());
    if (inside.empty() && !fromFolder) {
      return makeError("{}: no raster that GDAL can open inside; unpack it and name the file", path);
    }
    for (auto& entry : inside) found.push_back({std::move(entry), true});
    return {};
  }

  Status addFolder(const std::string& folder) {
    std::error_code code;
    // note: an Arc/Info grid is a folder itself.
    if (fs::exists(fs::path(folder) / "hdr.adf", code)) {
      found.push_back({folder, true});
      return {};
    }
    std::vector<std::string> files;
    std::vector<std::string> grids;
    fs::recursive_directory_iterator walk(folder, fs::directory_options::skip_permission_denied, code);
    if (code)
      return makeError("{}: cannot list the folder ({}); check its permissions", folder, code.message());
    for (const auto end = fs::recursive_directory_iterator(); walk != end; walk.increment(code)) {
      if (code)
        return makeError("{}: cannot list the folder ({}); check its permissions", folder, code.message());
      const std::string path = walk->path().string();
      if (walk->is_directory(code)) {
        if (fs::exists(walk->path() / "hdr.adf", code)) {
          files.push_back(path);
          walk.disable_recursion_pending();
        }
      } else if (walk->is_regular_file(code) && !isSidecar(path) && (isZip(path) || identified(path))) {
        files.push_back(path);
      }
    }
    std::sort(files.begin(), files.end());
    const size_t before = found.size();
    for (const auto& file : files) TERRANE_TRY(addFile(file, true));
    if (found.size() == before) {
      return makeError("{}: no raster that GDAL can open in this folder; name the files or another folder",
                       folder);
    }
    return {};
  }

  Status addGlob(const std::string& pattern) {
    glob_t matches{};
    const int status = ::glob(pattern.c_str(), 0, nullptr, &matches);
    std::vector<std::string> paths(matches.gl_pathv, matches.gl_pathv + (status == 0 ? matches.gl_pathc : 0));
    globfree(&matches);
    if (paths.empty()) return makeError("{}: no file matches this pattern; check the path", pattern);
    for (const auto& path : paths) {
      std::error_code code;
      if (fs::is_directory(path, code)) {
        TERRANE_TRY(addFolder(path));
      } else if (paths.size() == 1 || !isSidecar(path)) {
        TERRANE_TRY(addFile(path, false));
      }
    }
    return {};
  }

  Status addList(const std::string& path, int depth) {
    if (depth >= kMaxListDepth)
      return makeError("@{}: lists within lists, {} deep; does it name itself?", path, depth);
    std::ifstream file(path);
    if (!file) return makeError("@{}: cannot read this list of inputs; check the path", path);
    std::string line;
    const size_t before = found.size();
    while (std::getline(file, line)) {
      while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
      const size_t start = line.find_first_not_of(" \t");
      if (start == std::string::npos || line[start] == '#') continue;
      TERRANE_TRY(add(line.substr(start), fs::path(path).parent_path(), depth + 1));
    }
    if (found.size() == before) return makeError("@{}: the list names no input; write one a line", path);
    return {};
  }
};

}  // namespace

Result<std::vector<InputPath>> expandInputs(const std::vector<std::string>& inputs) {
  registerGdal();
  Expander expander;
  for (const auto& input : inputs) TERRANE_TRY(expander.add(input, {}, 0));
  if (expander.found.empty()) return makeError("no input; name at least one raster, folder or list");
  return std::move(expander.found);
}

std::string fileBehind(const std::string& path) {
  constexpr std::string_view kZip = "/vsizip/";
  if (path.rfind(kZip, 0) == 0) {
    const size_t end = path.find(".zip", kZip.size());
    return end == std::string::npos ? std::string() : path.substr(kZip.size(), end + 4 - kZip.size());
  }
  return path.rfind("/vsi", 0) == 0 ? std::string() : path;
}

}  // namespace terrane
