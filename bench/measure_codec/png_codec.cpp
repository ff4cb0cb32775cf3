#include <png.h>

#include <csetjmp>
#include <cstring>

#include "tile_codec.h"

namespace terrane {
namespace {

constexpr int kLevel = 9;

/// Bytes on their way in.
struct Cursor {
  std::span<const uint8_t> bytes;
  size_t at = 0;
};

void appendBytes(png_structp png, png_bytep data, size_t size) {
  auto* const bytes = static_cast<std::vector<uint8_t>*>(png_get_io_ptr(png));
  bytes->insert(bytes->end(), data, data + size);
}

void flushNothing(png_structp) {}

void takeBytes(png_structp png, png_bytep data, size_t size) {
  auto* const cursor = static_cast<Cursor*>(png_get_io_ptr(png));
  if (size > cursor->bytes.size() - cursor->at) png_error(png, "ends early");
  std::memcpy(data, cursor->bytes.data() + cursor->at, size);
  cursor->at += size;
}

/// 16-bit grey, the filter chosen line by line.
class PngCodec final : public TileCodec {
 public:
  std::string_view name() const override { return "png16"; }

  Result<std::vector<uint8_t>> encode(const TileContent& content) override {
    std::vector<uint16_t> samples = asSixteenBits(content);
    std::vector<uint8_t> bytes;
    bytes.reserve(2 * samples.size());
    if (!write(samples, content.cols, content.rows, bytes)) return makeError("PNG cannot encode a tile");
    return bytes;
  }

  Status decode(std::span<const uint8_t> bytes, int cols, int rows) override {
    decoded_.resize(static_cast<size_t>(cols) * static_cast<size_t>(rows));
    if (!read(bytes, cols, rows)) return makeError("PNG cannot decode a tile");
    return {};
  }

  bool holds(const TileContent& content) const override { return sameSixteenBits(content, decoded_); }

 private:
  // note: libpng leaves by longjmp(); nothing here owns anything that a destructor would have to free.
  static bool write(std::vector<uint16_t>& samples, int cols, int rows, std::vector<uint8_t>& bytes) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    if (setjmp(png_jmpbuf(png)) != 0) {
      png_destroy_write_struct(&png, &info);
      return false;
    }
    png_set_write_fn(png, &bytes, appendBytes, flushNothing);
    png_set_IHDR(png, info, static_cast<png_uint_32>(cols), static_cast<png_uint_32>(rows), 16,
                 PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png, kLevel);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_ALL_FILTERS);
    png_write_info(png, info);
    png_set_swap(png);
    for (int y = 0; y < rows; ++y)
      png_write_row(png, reinterpret_cast<png_bytep>(samples.data() + static_cast<ptrdiff_t>(y) * cols));
    png_write_end(png, nullptr);
    png_destroy_write_struct(&png, &info);
    return true;
  }

  bool read(std::span<const uint8_t> bytes, int cols, int rows) {
    Cursor cursor{bytes};
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    if (setjmp(png_jmpbuf(png)) != 0) {
      png_destroy_read_struct(&png, &info, nullptr);
      return false;
    }
    png_set_read_fn(png, &cursor, takeBytes);
    png_read_info(png, info);
    png_set_swap(png);
    for (int y = 0; y < rows; ++y)
      png_read_row(png, reinterpret_cast<png_bytep>(decoded_.data() + static_cast<ptrdiff_t>(y) * cols),
                   nullptr);
    png_destroy_read_struct(&png, &info, nullptr);
    return true;
  }

  std::vector<uint16_t> decoded_;
};

}  // namespace

std::unique_ptr<TileCodec> makePngCodec() {
  return std::make_unique<PngCodec>();
}

}  // namespace terrane
