#include <fmt/format.h>

#include <string>
#include <unordered_map>
#include <utility>

#include "raster_source.h"
#include "stored_tiles.h"
#include "terrane/bake/source.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/hash.h"

namespace terrane {
namespace {

/// New samples where there are any, else the dataset's.
class AppendedReader final : public SourceReader {
 public:
  AppendedReader(std::unique_ptr<SourceReader> rasters, std::shared_ptr<const Dataset> dataset)
      : rasters_(std::move(rasters)), dataset_(std::move(dataset)), stored_(*dataset_) {}

  Result<bool> readTile(TileId id, std::span<float> heights, std::span<uint16_t> ranks) override {
    TERRANE_ASSIGN(bool any, rasters_->readTile(id, heights, ranks));
    const auto before = static_cast<uint16_t>(dataset_->manifest().inputs.size());
    int missing = 0;
    for (uint16_t& rank : ranks) {
      if (rank == 0)
        ++missing;
      else
        rank = static_cast<uint16_t>(rank + before);
    }
    if (missing == 0) return any;

    TERRANE_ASSIGN(const std::shared_ptr<const StoredTile> stored, stored_.read(id));
    const TileSamples& samples = stored->tile.samples;
    for (size_t i = 0; i < heights.size(); ++i) {
      if (ranks[i] != 0 || samples.states[i] == SampleState::Void) continue;
      // note: which of the dataset's inputs it was, nobody knows any more; the last one lies as high as any.
      heights[i] = samples.heights[i];
      ranks[i] = before;
      any = true;
    }
    return any;
  }

 private:
  std::unique_ptr<SourceReader> rasters_;
  std::shared_ptr<const Dataset> dataset_;
  StoredTiles stored_;
};

class AppendedSource final : public Source {
 public:
  AppendedSource(AppendBase base, std::unique_ptr<Source> rasters)
      : base_(std::move(base)), rasters_(std::move(rasters)), plan_(rasters_->plan()) {
    const std::vector<InputRecord>& before = base_.dataset->manifest().inputs;
    plan_.inputs.insert(plan_.inputs.begin(), before.begin(), before.end());
  }

  const SourcePlan& plan() const override { return plan_; }
  std::vector<int> nativeLevels() const override { return rasters_->nativeLevels(); }
  bool mayTouch(TileId id) const override {
    const Manifest& manifest = base_.dataset->manifest();
    if (id.level != manifest.frame.finestLevel) return false;
    return (int64_t{id.col} * kTileCells < manifest.extentCols &&
            int64_t{id.row} * kTileCells < manifest.extentRows) ||
           rasters_->mayTouch(id);
  }
  Result<std::unique_ptr<SourceReader>> openReader() const override {
    TERRANE_ASSIGN(auto reader, rasters_->openReader());
    return std::unique_ptr<SourceReader>(std::make_unique<AppendedReader>(std::move(reader), base_.dataset));
  }
  const AppendBase* base() const override { return &base_; }

 private:
  AppendBase base_;
  std::unique_ptr<Source> rasters_;
  SourcePlan plan_;
};

/// Can anything be laid over it so that the result is that of a full build?
Status checkBase(const Dataset& dataset) {
  const Manifest& manifest = dataset.manifest();
  const auto refused = [&](const std::string& why) {
    return makeError("{}: nothing can be appended to it: {}; build it anew, from all of its inputs",
                     dataset.directory(), why);
  };
  if (manifest.maxErrorMeters > 0.0 || manifest.scale.sampleError > 0.0) {
    return refused(fmt::format("its heights are within {:g} m of its inputs', not equal to them",
                               manifest.maxErrorMeters));
  }
  if (!manifest.imagery.empty() || manifest.archives.size() != 1)
    return refused("it has imagery, which would have to be laid anew over what is added");
  if (manifest.inputs.empty()) return refused("it does not say what it was built from");
  for (const InputRecord& input : manifest.inputs) {
    if (input.nativeLevel != manifest.frame.finestLevel) {
      return refused(
          fmt::format("its input {} is coarser than its finest level, and it is not kept which heights "
                      "came from there",
                      input.name));
    }
  }
  return {};
}

// Laying a file over itself changes nothing where it lies on top, and brings it back to the top where not.
void warnOfRepeats(const std::vector<InputRecord>& added, const Manifest& manifest, Progress& progress) {
  std::unordered_map<std::string, std::string> nameByHash;
  for (const InputRecord& input : manifest.inputs) nameByHash.emplace(input.sha256, input.name);
  for (const InputRecord& input : added) {
    if (input.sha256.empty()) continue;
    const auto [before, isNew] = nameByHash.emplace(input.sha256, input.name);
    if (isNew) continue;
    progress.warn(fmt::format("{}: is in the dataset already{}; it is laid on top again", input.name,
                              before->second == input.name ? "" : ", as " + before->second));
  }
}

}  // namespace

Result<std::unique_ptr<Source>> openAppendedSource(const SourceOptions& options, const std::string& directory,
                                                   Progress& progress) {
  TERRANE_CHECK(options.crs.empty() && !options.lossless && !options.maxErrorMeters && !options.spacing,
                "options of {}", directory);
  // note: the hash before the dataset. Should another one take its place in between, they do not agree, and
  // the build says so.
  AppendBase base;
  const std::string manifestPath = directory + "/manifest.json";
  if (auto hash = sha256OfFile(manifestPath); hash.ok()) base.manifestSha256 = std::move(hash).value();
  TERRANE_ASSIGN(Dataset opened, Dataset::open(directory));
  base.dataset = std::make_shared<const Dataset>(std::move(opened));
  const Manifest& manifest = base.dataset->manifest();
  TERRANE_TRY(checkBase(*base.dataset));

  TERRANE_ASSIGN(std::vector<InputRaster> rasters, describeRasters(options, progress));
  if (rasters.size() + manifest.inputs.size() > kMaxInputs) {
    return makeError(
        "{}: {} inputs and {} new ones are more than the {} that a dataset can have; join the new "
        "ones with gdalbuildvrt first",
        directory, manifest.inputs.size(), rasters.size(), kMaxInputs);
  }
  TERRANE_ASSIGN(PlacedSource placed, placeOnto(std::move(rasters), manifest, directory));
  TERRANE_TRY(hashInputs(placed, progress));
  warnOfRepeats(placed.plan.inputs, manifest, progress);
  // A fault that is built upon would be vouched for by the new dataset's hashes.
  TERRANE_TRY(checkArchives(*base.dataset, progress));
  return std::unique_ptr<Source>(
      std::make_unique<AppendedSource>(std::move(base), makeRasterSource(std::move(placed))));
}

}  // namespace terrane
