#pragma once

#include <optional>
#include <string>
#include <vector>

#include "terrane/dataset/manifest.h"
#include "terrane/dataset/pmtiles_index.h"
#include "terrane/stream/tile_key.h"
#include "terrane/stream/transport.h"

namespace terrane {

/// A dataset's manifest and what is known of its archives' directories: where each tile's bytes lie. The
/// files are the elevation's archives, one for each of its layers of significance, then one for each imagery
/// layer.
class Archives {
 public:
  /// The manifest came. Errors: it is none, or names no archive that a layer needs.
  Status setManifest(const std::vector<uint8_t>& bytes, const std::string& where);
  bool hasManifest() const { return manifest_.has_value(); }
  const Manifest& manifest() const { return *manifest_; }

  int count() const { return static_cast<int>(files_.size()); }
  /// Of a tile that may be there: an elevation's layer of significance that the dataset has.
  int fileOf(const TileKey& key) const {
    return key.isElevation() ? key.significance() : elevationFiles() + key.layer;
  }
  TileKey keyOf(int file, TileId tile) const {
    return file < elevationFiles() ? TileKey::elevation(tile, file) : TileKey{file - elevationFiles(), tile};
  }
  /// Does the file hold a later layer of significance? Such a one may be opened when it is needed.
  bool isRefinement(int file) const { return file > 0 && file < elevationFiles(); }
  /// Those roots of which a beginning is of use: not of refinements.
  std::vector<TileKey> roots() const;
  /// A request for bytes of an archive.
  FetchRequest request(int file, uint64_t offset, uint64_t bytes) const;
  /// The archive's first bytes, which hold its root directory: so many, if these are more; tiles follow.
  FetchRequest firstBytes(int file, uint64_t bytes) const;
  Status setFirstBytes(int file, const std::vector<uint8_t>& bytes);
  bool isOpen(int file) const { return files_[static_cast<size_t>(file)].index.has_value(); }

  /// Of a refinement whose archive is not open yet, the directory that is needed is its first bytes. Other
  /// archives must be open.
  PmtilesIndex::Found find(const TileKey& key) const;
  /// What find() said to be needed.
  Status addDirectory(int file, PmtilesIndex::Place place, const std::vector<uint8_t>& bytes);

 private:
  struct File {
    std::string name;
    uint64_t bytes = 0;
    std::optional<PmtilesIndex> index;
  };
  int elevationFiles() const { return manifest_->scale.layerCount; }

  std::optional<Manifest> manifest_;
  std::vector<File> files_;
};

}  // namespace terrane
