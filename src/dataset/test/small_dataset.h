#pragma once

#include <gtest/gtest.h>

#include "example_manifest.h"
#include "temporary_directory.h"
#include "terrane/dataset/dataset.h"
#include "terrane/dataset/hash.h"
#include "terrane/dataset/pmtiles.h"

namespace terrane {

/// A dataset of three tiles whose payloads are nothing in particular.
class DatasetTest : public testing::Test {
 protected:
  void SetUp() override {
    auto writer = PmtilesWriter::create(archive());
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    ASSERT_TRUE(writer->add({0, 0, 0}, std::vector<uint8_t>{1, 2, 3}).ok());
    ASSERT_TRUE(writer->add({1, 0, 0}, std::vector<uint8_t>{4, 5}).ok());
    ASSERT_TRUE(writer->add({1, 1, 1}, std::vector<uint8_t>{6}).ok());
    ASSERT_TRUE(writer->finish("{}").ok());
    manifest_ = exampleManifest();
    manifest_.imagery.clear();
    manifest_.tileCount = 3;
    const std::string bytes = readWholeFile(archive());
    manifest_.archives = {{"elevation.pmtiles", bytes.size(), sha256(bytes)}};
    writeManifest();
  }
  void writeManifest() { writeWholeFile(directory_.file("manifest.json"), manifestToJson(manifest_)); }
  std::string archive() const { return directory_.file("elevation.pmtiles"); }
  std::string openError() const {
    const auto dataset = Dataset::open(directory_.file(""));
    return dataset.ok() ? "no error" : dataset.error().message;
  }

  TemporaryDirectory directory_;
  Manifest manifest_;
};

}  // namespace terrane
