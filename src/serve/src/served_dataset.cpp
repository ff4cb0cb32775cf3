#include "served_dataset.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace terrane::serve {
namespace {

/// Decoded pictures that are kept, 256 KiB each.
constexpr size_t kPicturesInMemory = 64;

Result<std::string> readManifestText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) return makeError("{}: cannot be read; check its permissions", path);
  return text.str();
}

Result<ServedArchive> openArchive(const std::filesystem::path& directory, const ArchiveRecord& record) {
  const std::string path = (directory / record.name).string();
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return makeError("{}: cannot open: {}", path, std::strerror(errno));
  ServedArchive archive;
  archive.file = std::make_shared<const ServedFile>(descriptor);
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || static_cast<uint64_t>(status.st_size) != record.bytes)
    return makeError("{}: does not have the {} bytes that the manifest says; copy the dataset again", path,
                     record.bytes);
  TERRANE_ASSIGN(PmtilesReader reader, PmtilesReader::open(path));
  archive.reader = std::make_unique<PmtilesReader>(std::move(reader));
  archive.fileName = record.name;
  archive.bytes = record.bytes;
  archive.etag = "\"" + record.sha256.substr(0, 32) + "\"";
  return archive;
}

}  // namespace

const ServedArchive* ServedDataset::findFile(std::string_view fileName) const {
  for (const ServedArchive& archive : archives)
    if (archive.fileName == fileName) return &archive;
  return nullptr;
}
const ServedArchive* ServedDataset::findElevation() const {
  for (const ServedArchive& archive : archives)
    if (!archive.isImagery) return &archive;
  return nullptr;
}
const ServedArchive* ServedDataset::findImagery(std::string_view layerName) const {
  for (const ServedArchive& archive : archives)
    if (archive.isImagery && archive.layerName == layerName) return &archive;
  return nullptr;
}

Result<std::unique_ptr<ServedDataset>> openServedDataset(const std::string& directory, uint64_t cacheBytes) {
  auto served = std::make_unique<ServedDataset>();
  std::filesystem::path path = std::filesystem::path(directory).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  const std::string manifestPath = (path / "manifest.json").string();

  TERRANE_ASSIGN(Dataset dataset, Dataset::open(path.string()));
  served->dataset = std::make_unique<Dataset>(std::move(dataset));
  TERRANE_ASSIGN(std::string text, readManifestText(manifestPath));
  const Manifest& manifest = served->dataset->manifest();
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || !json.value("manifestSha256", nlohmann::json()).is_string())
    return makeError("{}: was replaced while it was opened; try again", manifestPath);
  served->hash = json["manifestSha256"].get<std::string>();
  // "." and the like have no stem of their own.
  served->name = std::filesystem::absolute(path).lexically_normal().stem().string();

  for (const ArchiveRecord& record : manifest.archives) {
    TERRANE_ASSIGN(ServedArchive archive, openArchive(path, record));
    archive.layerName = "elevation";
    archive.finestLevel = manifest.frame.finestLevel;
    for (const ImageryLayerRecord& layer : manifest.imagery) {
      if (layer.archive != record.name) continue;
      archive.isImagery = true;
      archive.layerName = layer.name;
      archive.finestLevel = layer.finestLevel;
    }
    archive.tileType =
        archive.isImagery ? "application/vnd.terrane.imagery" : "application/vnd.terrane.elevation";
    served->archives.push_back(std::move(archive));
  }

  // A build may have put another dataset there in the meantime: then what was opened would not belong
  // together.
  TERRANE_ASSIGN(const std::string again, readManifestText(manifestPath));
  auto parsed = manifestFromJson(text, manifestPath);
  if (again != text || !parsed.ok() || manifestToJson(*parsed) != manifestToJson(manifest))
    return makeError("{}: was replaced while it was opened; try again", manifestPath);

  served->manifestText = makeTextEntity(std::move(text), served->hash.substr(0, 32), "application/json");
  served->tiles = std::make_unique<SurfaceTiles>(*served->dataset, cacheBytes);
  served->pictures = std::make_unique<PictureTiles>(*served->dataset, kPicturesInMemory);
  served->geographic = std::make_unique<Geographic>(manifest.crsWkt);
  served->xyzExtent = xyzExtentOf(manifest, *served->geographic);
  return served;
}

}  // namespace terrane::serve
