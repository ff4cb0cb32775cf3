#include "terrane/dataset/manifest.h"

#include <gtest/gtest.h>

#include "example_manifest.h"
#include "manifest_seal.h"
#include "terrane/dataset/hash.h"

namespace terrane {
namespace {

std::string errorOf(const std::string& text) {
  const auto result = manifestFromJson(text, "here/manifest.json");
  if (result.ok()) return "no error";
  EXPECT_EQ(result.error().message.rfind("here/manifest.json: ", 0), 0U) << result.error().message;
  return result.error().message;
}

/// The example with one piece of its text exchanged, and sealed again as if it had been written so.
std::string errorAfter(const std::string& from, const std::string& to) {
  std::string text = manifestToJson(exampleManifest());
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return errorOf(sealManifest(text));
}

TEST(Hash, AsPublished) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Manifest, ComesBackWhole) {
  Manifest manifest = exampleManifest();
  manifest.archives.push_back({"elevation.pmtiles", 123456789012, std::string(64, '7')});
  const std::string text = manifestToJson(manifest);
  const auto again = manifestFromJson(text, "m");
  ASSERT_TRUE(again.ok()) << again.error().message;
  // The text has every member: if it comes back the same, all came back.
  EXPECT_EQ(manifestToJson(*again), text);
  EXPECT_EQ(again->scale.rangeUnit, 3986.0 / 65535.0);
  EXPECT_EQ(again->frame.originEasting, 411234.5);
  EXPECT_EQ(again->archives[0].bytes, 123456789012U);
  EXPECT_EQ(again->inputs[0].noData, "-32767");
  EXPECT_TRUE(again->inputs[0].warped);
  EXPECT_EQ(again->zeroShare, 0.125);
  EXPECT_EQ(again->crsWkt, manifest.crsWkt);
}

TEST(Manifest, EveryChangedByteIsSeen) {
  const std::string text = manifestToJson(exampleManifest());
  for (size_t i = 0; i < text.size(); ++i) {
    for (const int flip : {1, 0x20, 0x80}) {
      std::string changed = text;
      changed[i] = static_cast<char>(changed[i] ^ flip);
      ASSERT_NE(errorOf(changed), "no error") << i << " in " << changed.substr(i > 10 ? i - 10 : 0, 20);
    }
  }
}

TEST(Manifest, EveryTruncatedLengthAndEveryExtraByteIsSeen) {
  const std::string text = manifestToJson(exampleManifest());
  for (size_t length = 0; length < text.size(); ++length)
    ASSERT_NE(errorOf(text.substr(0, length)), "no error");
  EXPECT_NE(errorOf(text + "\n"), "no error");
  EXPECT_NE(errorOf(" " + text), "no error");
}

TEST(Manifest, NewerVersionsAskForAnUpdate) {
  EXPECT_NE(errorAfter("\"formatVersion\": 1", "\"formatVersion\": 2").find("update Terrane"),
            std::string::npos);
  // Whatever else such a version may have changed, its seal included.
  EXPECT_NE(errorOf(R"({"format": "terrane-dataset", "formatVersion": 77})").find("update Terrane"),
            std::string::npos);
  const std::string error = errorAfter("\"codecVersion\": 2", "\"codecVersion\": 4");
  EXPECT_NE(error.find("codec version 4"), std::string::npos) << error;
  EXPECT_NE(error.find("update Terrane"), std::string::npos) << error;
  EXPECT_EQ(error.find("build the dataset again"), std::string::npos) << error;
}

TEST(Manifest, AbsurdMembersAreNamed) {
  EXPECT_NE(errorOf("[]").find("not a JSON object"), std::string::npos);
  EXPECT_NE(errorOf("{}").find("\"format\" is missing"), std::string::npos);
  EXPECT_NE(errorAfter("terrane-dataset", "mbtiles").find("\"format\""), std::string::npos);
  EXPECT_NE(errorAfter("\"finestLevel\": 3", "\"finestLevel\": 22").find("frame.finestLevel"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"finestLevel\": 3", "\"finestLevel\": -1").find("frame.finestLevel"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"spacingX\": 23.1", "\"spacingX\": 0").find("frame.spacingX"), std::string::npos);
  EXPECT_NE(errorAfter("\"spacingX\": 23.1", "\"spacingX\": \"23\"").find("frame.spacingX"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"cols\": 1201", "\"cols\": 3000").find("extent.cols"), std::string::npos);
  EXPECT_NE(errorAfter("\"heightStep\": 0.1", "\"heightStep\": -0.1").find("layers.elevation.heightStep"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"minHeight\": 187", "\"minHeight\": 9000").find("layers.elevation.maxHeight"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"codecVersion\": 2", "\"codecVersion\": 1").find("no longer reads"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"codecVersion\": 2", "\"codecVersion\": 0").find("codecVersion"), std::string::npos);
  EXPECT_NE(errorAfter("\"warped\": true", "\"warped\": 1").find("inputs[0].warped"), std::string::npos);
  EXPECT_NE(errorAfter("aaaaaaaa", "AAAAAAAA").find("inputs[0].sha256"), std::string::npos);
  EXPECT_NE(errorAfter("\"attribution\"", "\"attributed\"").find("attribution\" is missing"),
            std::string::npos);
}

TEST(Manifest, AbsurdImageryIsNamed) {
  const auto again = manifestFromJson(manifestToJson(exampleManifest()), "m");
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->imagery[0].format, ImageryFormat::Webp);
  EXPECT_EQ(again->imagery[0].stretch[0][1], 12000.5);
  EXPECT_EQ(again->imagery[0].inputs[0].name, "n46e008.tif");
  const std::string at = "layers.imagery[0]";
  EXPECT_NE(errorAfter("\"name\": \"photo\"", "\"name\": \"../photo\"").find(at + ".name"),
            std::string::npos);
  EXPECT_NE(errorAfter("imagery-photo.pmtiles", "elevation.pmtiles").find(at + ".archive"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"format\": \"webp\"", "\"format\": \"gif\"").find(at + ".format"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"quality\": 77", "\"quality\": 0").find(at + ".quality"), std::string::npos);
  EXPECT_NE(errorAfter("\"finestLevel\": 7", "\"finestLevel\": 22").find(at + ".finestLevel"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"tileSide\": 256", "\"tileSide\": 512").find(at + ".tileSide"), std::string::npos);
  EXPECT_NE(errorAfter("\"east\": 412000.25", "\"east\": 1").find(at + ".bounds.east"), std::string::npos);
  EXPECT_NE(errorAfter("\"black\": 1.0", "\"black\": \"1\"").find(at + ".stretch.black"), std::string::npos);
  Manifest twice = exampleManifest();
  twice.imagery.push_back(twice.imagery[0]);
  EXPECT_NE(errorOf(manifestToJson(twice)).find("another layer's"), std::string::npos);
}

/// The example with layers of significance.
Manifest layeredManifest() {
  Manifest manifest = exampleManifest();
  manifest.scale.layerCount = 3;
  manifest.scale.layerErrors = {12.5, 3.25, manifest.maxErrorMeters};
  return manifest;
}

TEST(Manifest, LayersComeBack) {
  const std::string text = manifestToJson(layeredManifest());
  const auto again = manifestFromJson(text, "m");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(manifestToJson(*again), text);
  EXPECT_EQ(again->scale.layerCount, 3);
  EXPECT_EQ(again->scale.layerErrors, (std::array<double, 4>{12.5, 3.25, 0.1155, 0.0}));
  EXPECT_EQ(again->scale.layerOffset(1), 3.25 + 0.1155);
  EXPECT_NE(text.find("\"archive\": \"elevation-2.pmtiles\""), std::string::npos);
  EXPECT_NE(text.find("\"codecVersion\": 3"), std::string::npos);
}

TEST(Manifest, OfOneLayerNothingIsSaid) {
  const std::string text = manifestToJson(exampleManifest());
  EXPECT_EQ(text.find("refinements"), std::string::npos);
  EXPECT_EQ(text.find("layerErrors"), std::string::npos);
  EXPECT_NE(text.find("\"codecVersion\": 2"), std::string::npos);
  const auto again = manifestFromJson(text, "m");
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->scale.layerCount, 1);
}

TEST(Manifest, AbsurdLayersAreNamed) {
  const auto errorWith = [](const std::string& from, const std::string& to) {
    std::string text = manifestToJson(layeredManifest());
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
    return errorOf(sealManifest(text));
  };
  const std::string errors = "layers.elevation.layerErrorsMeters";
  const std::string refinements = "layers.elevation.refinements";
  EXPECT_NE(errorWith("elevation-2.pmtiles", "elevation-3.pmtiles").find(refinements + "[1].archive"),
            std::string::npos);
  EXPECT_NE(errorWith("elevation-1.pmtiles", "../elevation-1.pmtiles").find(refinements + "[0].archive"),
            std::string::npos);
  EXPECT_NE(errorWith("\"refinements\"", "\"refined\"").find(refinements + "\" is missing"),
            std::string::npos);
  EXPECT_NE(errorWith("\"layerErrorsMeters\"", "\"errors\"").find(errors + "\" is missing"),
            std::string::npos);
  // Layers come with version 3, and only with it: programs that know nothing of them read 2.
  EXPECT_NE(errorWith("\"codecVersion\": 3", "\"codecVersion\": 2").find(refinements), std::string::npos);
  EXPECT_NE(errorAfter("\"codecVersion\": 2", "\"codecVersion\": 3").find(refinements + "\" is missing"),
            std::string::npos);
  EXPECT_NE(errorAfter("\"codecVersion\": 2", "\"codecVersion\": 2, \"layerErrorsMeters\": [7]").find(errors),
            std::string::npos);
  for (const char* bad : {"3.25", "3.0", "1e300", "\"12\"", "null", "-12.5"})
    EXPECT_NE(errorWith("12.5", bad).find(errors), std::string::npos) << bad;
  for (const char* bad : {"12.5", "0.1155", "0.1", "0", "3.25, 1.0", "3.25, 2.0, 1.0"})
    EXPECT_NE(errorWith("3.25", bad).find(errors), std::string::npos) << bad;

  Manifest many = layeredManifest();
  many.scale.layerCount = 2;
  std::string text = manifestToJson(many);
  const size_t at = text.find("12.5");
  text.erase(at, 4);
  EXPECT_NE(errorOf(sealManifest(text)).find(errors), std::string::npos);
}

TEST(Manifest, WithoutImageryNothingIsSaidOfIt) {
  Manifest manifest = exampleManifest();
  manifest.imagery.clear();
  const std::string text = manifestToJson(manifest);
  EXPECT_EQ(text.find("imagery"), std::string::npos);
  const auto again = manifestFromJson(text, "m");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_TRUE(again->imagery.empty());
}

TEST(Manifest, ArchivesCannotLeadOutOfTheDirectory) {
  for (const char* name : {"../elevation.pmtiles", "/etc/passwd", "a/b", "", ".hidden", ".."}) {
    Manifest manifest = exampleManifest();
    manifest.archives.push_back({name, 1, std::string(64, '0')});
    EXPECT_NE(errorOf(manifestToJson(manifest)).find("archives[0].name"), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace terrane
