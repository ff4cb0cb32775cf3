#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "entity.h"
#include "geographic.h"
#include "picture_tiles.h"
#include "terrane/base/result.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/pmtiles.h"
#include "terrane/engine/surface.h"
#include "xyz_places.h"

namespace terrane::serve {

/// One archive of a served dataset: its open file, and where its tiles lie.
struct ServedArchive {
  std::string fileName;   ///< "elevation.pmtiles"
  std::string layerName;  ///< "elevation", or the imagery layer's name
  bool isImagery = false;
  int finestLevel = 0;
  std::string tileType;  ///< media type of its tiles
  std::string etag;
  std::shared_ptr<const ServedFile> file;
  uint64_t bytes = 0;
  std::unique_ptr<PmtilesReader> reader;
};

/// A dataset as it was when serving began: its files stay open, so a build that replaces them does not mix
/// with what is served. Immutable but for caches; any thread.
struct ServedDataset {
  std::string name;  ///< the directory's stem, what stands in URLs
  std::string hash;  ///< the manifest's own, 64 hexadecimal digits
  TextEntity manifestText;
  std::unique_ptr<Dataset> dataset;
  std::vector<ServedArchive> archives;
  std::unique_ptr<SurfaceTiles> tiles;
  std::unique_ptr<PictureTiles> pictures;
  std::unique_ptr<Geographic> geographic;
  std::optional<XyzExtent> xyzExtent;  ///< nothing: its CRS cannot be laid out on a web map

  const ServedArchive* findFile(std::string_view fileName) const;
  /// The layer "elevation" or an imagery layer.
  const ServedArchive* findElevation() const;
  const ServedArchive* findImagery(std::string_view layerName) const;
};

/// Opens a dataset for serving. `cacheBytes`: decoded tiles for questions about the surface. Errors name the
/// file and say what to do.
Result<std::unique_ptr<ServedDataset>> openServedDataset(const std::string& directory, uint64_t cacheBytes);

}  // namespace terrane::serve
