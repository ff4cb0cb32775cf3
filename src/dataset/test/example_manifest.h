#pragma once

#include "terrane/dataset/manifest.h"

namespace terrane {

/// A manifest with something in every member.
inline Manifest exampleManifest() {
  Manifest manifest;
  manifest.name = "alps";
  manifest.crsWkt = "PROJCRS[\"WGS 84 / UTM zone 32N\",\"manifestSha256\": \"]";
  manifest.crsName = "WGS 84 / UTM zone 32N";
  manifest.frame = {411234.5, 5123456.25, 23.1, 23.1, 1.0, 3};
  manifest.extentCols = 1201;
  manifest.extentRows = 1533;
  manifest.minHeight = 187.0;
  manifest.maxHeight = 4173.0;
  manifest.maxErrorMeters = 0.1155;
  manifest.scale = {0.1, 1.0 / 3.0, 0.0123, 187.0, 3986.0 / 65535.0};
  manifest.scale.roughness = 0.27;
  manifest.tileCount = 0;
  manifest.coveredCells = 1234567.0;
  manifest.zeroShare = 0.125;
  manifest.verticalDatum = "EGM96";
  manifest.attribution = "Höhen: somebody \"quoted\"";
  manifest.inputs.push_back({"n46e008.tif", 2887021, std::string(64, 'a'), 1201, 1201, "Int16",
                             "GEOGCRS[...]", true, "cubic", 3, "-32767"});
  ImageryLayerRecord layer;
  layer.name = "photo";
  layer.archive = "imagery-photo.pmtiles";
  layer.format = ImageryFormat::Webp;
  layer.quality = 77;
  layer.finestLevel = 7;
  layer.tileCount = 5;
  layer.bounds = {411000.5, 5100000.0, 412000.25, 5101000.0};
  layer.attribution = "somebody else";
  layer.bands = "4,3,2";
  layer.stretch = {{7000.0, 12000.5}, {1.0, 2.0}, {0.0, 65535.0}};
  layer.inputs = manifest.inputs;
  manifest.imagery.push_back(layer);
  manifest.builtBy = "terrane 0.1.0";
  manifest.buildOptions = "--max-error 0.1155";
  return manifest;
}

}  // namespace terrane
