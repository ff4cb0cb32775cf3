#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "input_gdal.h"
#include "input_raster.h"
#include "terrane/bake/imagery.h"
#include "terrane/base/result.h"

namespace terrane {

/// One band of one of a picture's files.
struct PictureBand {
  int file = 0;
  int band = 0;                  ///< 0: none
  std::optional<double> noData;  ///< a value that means nothing is there
};

/// One picture: bands of one file, or of several on the same grid, that make colours.
struct PictureInput {
  std::vector<std::string> paths;     ///< as GDAL opens them
  std::vector<InputRecord> records;   ///< for the manifest, one a file
  InputRaster raster;                 ///< where it lies; its path is the first file's
  std::vector<PictureBand> channels;  ///< one (grey or palette) or three
  PictureBand alpha;
  bool mask = false;  ///< the first channel's mask says what is there
  std::vector<std::array<uint8_t, 4>> palette;
  bool bytes = false;  ///< all channels are 8 bits
  /// The values of each channel that become 0 and 255; empty: values are colours already.
  std::vector<std::array<double, 2>> stretch;

  std::string bandsText() const;
};

/// Opens the files of a picture ("A" or "A+B+C", already split) and finds its bands. Errors name the file.
Result<PictureInput> describePicture(const std::vector<std::string>& paths,
                                     const ImageryLayerOptions& options);

/// A sample of each channel's values that mean something, from an overview, appended to `values`.
Status sampleValues(const PictureInput& picture, std::vector<std::vector<float>>& values);

/// A picture's open files, for one thread.
class PictureReader {
 public:
  static Result<PictureReader> open(const PictureInput& picture);

  /// Reads a window of pixels, which must lie inside, as colours: red, green, blue (not multiplied by
  /// alpha), alpha, row by row.
  Status read(int col, int row, int cols, int rows, std::vector<uint8_t>& rgba);
  GDALDataset& dataset() const { return *files_.front(); }

 private:
  explicit PictureReader(const PictureInput& picture) : picture_(&picture) {}
  Status readColors(int col, int row, int cols, int rows, std::vector<uint8_t>& rgba);
  Status readStretched(int col, int row, int cols, int rows, std::vector<uint8_t>& rgba);
  Status readAlpha(int col, int row, int cols, int rows, std::vector<uint8_t>& rgba);
  GDALRasterBand& bandOf(const PictureBand& band) const {
    return *files_[static_cast<size_t>(band.file)]->GetRasterBand(band.band);
  }

  const PictureInput* picture_;
  std::vector<GdalDataset> files_;
  std::vector<float> values_;
  std::vector<uint8_t> bytes_;
  std::vector<uint8_t> none_;  ///< channels that have nothing, a pixel
};

}  // namespace terrane
