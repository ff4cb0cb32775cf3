#include <cstdio>

#include "mesh_decoding.h"

/// How fast datasets decode to meshes, natively or in node.
///
/// usage: measure_mesh_decoding DATASET...
///
/// Prints a JSON object: for each dataset, by its path, the triangles of all its tiles and the CPU seconds.

namespace terrane {
namespace {

int run(int count, char** datasets) {
  std::printf("{");
  for (int i = 0; i < count; ++i) {
    const auto pyramid = StoredPyramid::open(datasets[i]);
    const auto decoding =
        pyramid.ok() ? measureMeshDecoding(*pyramid) : Result<MeshDecoding>(pyramid.error());
    if (!decoding.ok()) {
      std::fprintf(stderr, "measure_mesh_decoding: %s\n", decoding.error().message.c_str());
      return 1;
    }
    std::printf("%s\n \"%s\": {\"triangles\": %lld, \"seconds\": %.9f}", i == 0 ? "" : ",", datasets[i],
                static_cast<long long>(decoding->triangles), decoding->seconds);
  }
  std::printf("\n}\n");
  return 0;
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: measure_mesh_decoding DATASET...\n", stderr);
    return 2;
  }
  return terrane::run(argc - 1, argv + 1);
}
