#include <cstdio>

#include "hills.h"

/// Builds the dataset of the stream tests for those in WebAssembly: `make_stream_dataset DIRECTORY`.
int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: make_stream_dataset DIRECTORY\n");
    return 2;
  }
  const terrane::Status built = terrane::buildHills(arguments[1]);
  if (!built.ok()) std::fprintf(stderr, "%s\n", built.error().message.c_str());
  return built.ok() ? 0 : 1;
}
