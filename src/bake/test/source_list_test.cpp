#include <gtest/gtest.h>

#include <cpl_vsi.h>

#include <fstream>

#include "input_list.h"
#include "source_support.h"

namespace terrane {
namespace {

using test::from;
using test::ListeningProgress;
using test::open;
using test::openError;
using test::TempFolder;
using test::writeRaster;

std::vector<std::string> namesOf(const Source& source) {
  std::vector<std::string> names;
  for (const auto& input : source.plan().inputs) names.push_back(input.name);
  return names;
}

TEST(SourceList, TakesFoldersGlobsAndLists) {
  TempFolder folder;
  std::filesystem::create_directories(folder / "deep/er");
  writeRaster(folder / "b.tif", {});
  writeRaster(folder / "deep/er/c.tif", {});
  writeRaster(folder / "a.tif", {});
  std::ofstream(folder / "notes.txt") << "not a raster";
  std::ofstream(folder / "a.tif.aux.xml") << "<PAMDataset></PAMDataset>";
  using Names = std::vector<std::string>;
  EXPECT_EQ(namesOf(*open(from({folder.str()}))), (Names{"a.tif", "b.tif", "c.tif"}));
  EXPECT_EQ(namesOf(*open(from({folder / "?.tif"}))), (Names{"a.tif", "b.tif"}));
  EXPECT_EQ(namesOf(*open(from({folder / "b.tif", folder / "a.tif"}))), (Names{"b.tif", "a.tif"}));

  std::ofstream(folder / "list.txt") << "# top last\n\nb.tif\r\n  deep/er\n" << (folder / "a.tif") << "\n";
  EXPECT_EQ(namesOf(*open(from({"@" + folder / "list.txt"}))), (Names{"b.tif", "c.tif", "a.tif"}));
  std::ofstream(folder / "self.txt") << "@self.txt\n";
  EXPECT_HAS(openError(from({"@" + folder / "self.txt"})), "does it name itself");
  EXPECT_HAS(openError(from({"@" + folder / "absent.txt"})), "cannot read this list");
  std::ofstream(folder / "empty.txt") << "# nothing\n";
  EXPECT_HAS(openError(from({"@" + folder / "empty.txt"})), "names no input");
  EXPECT_HAS(openError(from({folder / "*.png"})), "no file matches");
  EXPECT_HAS(openError(from({})), "no input");
  std::filesystem::create_directories(folder / "hollow");
  EXPECT_HAS(openError(from({folder / "hollow"})), "no raster that GDAL can open in this folder");
}

TEST(SourceList, LeavesPicturesInFoldersOut) {
  TempFolder folder;
  writeRaster(folder / "dem.tif", {});
  writeRaster(folder / "photo.tif", {.type = GDT_Byte, .creation = {"PHOTOMETRIC=RGB"}, .bands = 3});
  ListeningProgress listening;
  const auto source = openSource(from({folder.str()}), listening);
  ASSERT_TRUE(source.ok()) << source.error().message;
  EXPECT_EQ(namesOf(**source), std::vector<std::string>{"dem.tif"});
  EXPECT_HAS(listening.all(), "photo.tif: a picture");
}

TEST(SourceList, OpensWhatIsInAnArchive) {
  TempFolder folder;
  writeRaster(folder / "dem.tif", {});
  const std::string zip = "/vsizip/" + (folder / "all.zip") + "/inside/dem.tif";
  ASSERT_EQ(CPLCopyFile(zip.c_str(), (folder / "dem.tif").c_str()), 0);
  const auto source = open(from({folder / "all.zip"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(namesOf(*source), std::vector<std::string>{"dem.tif"});
  EXPECT_EQ(source->plan().inputs[0].sha256.size(), 64u);
  EXPECT_TRUE(test::read(*source, {0, 0, 0}).any);
}

TEST(SourceList, OpensRawSrtm) {
  // Big-endian, placed by its name alone.
  TempFolder folder;
  std::ofstream file(folder / "N46E008.hgt", std::ios::binary);
  for (int i = 0; i < 1201 * 1201; ++i) {
    const int height = i == 5 ? -32768 : i % 3000;
    file.put(static_cast<char>(height >> 8));
    file.put(static_cast<char>(height & 255));
  }
  file.close();
  const auto source = open(from({folder / "N46E008.hgt"}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().crsName, "WGS 84 / UTM zone 32N");
  EXPECT_EQ(source->plan().inputs[0].noData, "-32768");
}

TEST(SourceList, ManyInputsDoNotStayOpen) {
  // More files than a reader keeps open, read to and fro.
  TempFolder folder;
  constexpr int kSide = 12;
  for (int i = 0; i < kSide * kSide; ++i) {
    writeRaster(folder / ("t" + std::to_string(1000 + i) + ".tif"),
                {.width = 20,
                 .height = 20,
                 .type = GDT_Int16,
                 .geoTransform = {500000.0 + 200.0 * (i % kSide), 10.0, 0.0, 5000000.0 - 200.0 * (i / kSide),
                                  0.0, -10.0},
                 .heightAt = [i](int, int) { return i; }});
  }
  const auto source = open(from({folder.str()}));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->plan().inputs.size(), static_cast<size_t>(kSide * kSide));
  auto reader = source->openReader();
  ASSERT_TRUE(reader.ok());
  std::vector<float> heights(kTileSampleCount);
  std::vector<uint16_t> ranks(kTileSampleCount);
  for (int round = 0; round < 2; ++round) {
    const auto any = (*reader)->readTile({0, 0, 0}, heights, ranks);
    ASSERT_TRUE(any.ok()) << any.error().message;
    for (int row = 0; row < 20 * kSide; row += 7) {
      for (int col = 0; col < 20 * kSide; col += 7) {
        ASSERT_EQ(heights[static_cast<size_t>(row) * kTileSamples + static_cast<size_t>(col)],
                  static_cast<float>(row / 20 * kSide + col / 20));
      }
    }
  }
}

}  // namespace
}  // namespace terrane
