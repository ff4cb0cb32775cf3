#pragma once

#include <optional>
#include <string>
#include <vector>

#include "terrane/dataset/manifest.h"
#include "terrane/dataset/pmtiles_index.h"
#include "terrane/stream/tile_key.h"
#include "terrane/stream/transport.h"

namespace terrane {

/// A dataset's manifest and what is known of its archives' directories: where each tile's bytes lie. File 0
/// is the elevation's archive, 1 + i that of imagery layer i.
class Archives {
 public:
  /// The manifest came. Errors: it is none, or names no archive that a layer needs.
  Status setManifest(const std::vector<uint8_t>& bytes, const std::string& where);
  bool hasManifest() const { return manifest_.has_value(); }
  const Manifest& manifest() const { return *manifest_; }

  int count() const { return static_cast<int>(files_.size()); }
  static int fileOf(const TileKey& key) { return key.layer + 1; }
  /// A request for bytes of an archive.
  FetchRequest request(int file, uint64_t offset, uint64_t bytes) const;
  /// The archive's first bytes, which hold its root directory: so many, if these are more; tiles follow.
  FetchRequest firstBytes(int file, uint64_t bytes) const;
  Status setFirstBytes(int file, const std::vector<uint8_t>& bytes);
  bool isOpen(int file) const { return files_[static_cast<size_t>(file)].index.has_value(); }

  /// Only for open archives.
  PmtilesIndex::Found find(const TileKey& key) const;
  Status addDirectory(int file, PmtilesIndex::Place place, const std::vector<uint8_t>& bytes);

 private:
  struct File {
    std::string name;
    uint64_t bytes = 0;
    std::optional<PmtilesIndex> index;
  };
  std::optional<Manifest> manifest_;
  std::vector<File> files_;
};

}  // namespace terrane
