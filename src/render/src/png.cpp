#include "terrane/render/png.h"

#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

namespace terrane {

namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// Writes and closes; an empty string, or what went wrong.
std::string writeTo(const std::string& path, std::span<const uint8_t> bytes) {
  std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "wb"));
  if (!file) return std::strerror(errno);
  if (std::fwrite(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) return std::strerror(errno);
  if (std::fflush(file.get()) != 0) return std::strerror(errno);
  if (std::fclose(file.release()) != 0) return std::strerror(errno);
  return {};
}

}  // namespace

std::vector<uint8_t> encodePng(int width, int height, std::span<const uint8_t> rgba) {
  const size_t pixelCount = static_cast<size_t>(width) * static_cast<size_t>(height);
  TERRANE_CHECK(width > 0 && height > 0 && rgba.size() == 4 * pixelCount, "{} x {} pixels, {} bytes", width,
                height, rgba.size());
  bool opaque = true;
  for (size_t i = 0; i < pixelCount && opaque; ++i) opaque = rgba[4 * i + 3] == 255;
  std::vector<uint8_t> rgb;
  if (opaque) {
    rgb.resize(3 * pixelCount);
    for (size_t i = 0; i < pixelCount; ++i) std::memcpy(&rgb[3 * i], &rgba[4 * i], 3);
  }

  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = opaque ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  const void* pixels = opaque ? rgb.data() : rgba.data();
  std::vector<uint8_t> out(PNG_IMAGE_PNG_SIZE_MAX(image));
  png_alloc_size_t size = out.size();
  const int isWritten =
      png_image_write_to_memory(&image, out.data(), &size, 0, pixels, width * (opaque ? 3 : 4), nullptr);
  TERRANE_CHECK(isWritten != 0, "{}", std::string(image.message));
  out.resize(size);
  return out;
}

Status writePng(const std::string& path, int width, int height, std::span<const uint8_t> rgba) {
  // Written aside, then renamed: a picture is whole or not there.
  const std::string aside = path + ".part";
  std::string problem = writeTo(aside, encodePng(width, height, rgba));
  if (problem.empty() && std::rename(aside.c_str(), path.c_str()) != 0) problem = std::strerror(errno);
  if (problem.empty()) return {};
  std::remove(aside.c_str());
  return makeError("{}: the picture cannot be written: {}", path, problem);
}

}  // namespace terrane
