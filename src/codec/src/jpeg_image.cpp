#include "jpeg_image.h"

#include <csetjmp>
#include <cstdio>
#include <cstdlib>

// note: jpeglib.h needs stdio's types, and does not say so.
#include <jpeglib.h>

#include <array>

#include "terrane/base/check.h"
#include "terrane/codec/imagery_codec.h"

namespace terrane {

namespace {

/// A tile has a handful of scans; a file with thousands only keeps the decoder busy.
constexpr int kMostScans = 64;

/// libjpeg leaves a call that fails with a jump; nothing in the functions that it jumps over owns memory.
struct ErrorManager {
  jpeg_error_mgr base;
  std::jmp_buf jump;
  std::array<char, JMSG_LENGTH_MAX> message;
};

[[noreturn]] void leave(j_common_ptr info) {
  auto* manager = reinterpret_cast<ErrorManager*>(info->err);
  info->err->format_message(info, manager->message.data());
  std::longjmp(manager->jump, 1);
}
void leaveOnWarning(j_common_ptr info, int level) {
  if (level < 0) leave(info);
}
void saySilently(j_common_ptr /*info*/) {}

void prepare(ErrorManager& manager) {
  jpeg_std_error(&manager.base);
  manager.base.error_exit = leave;
  manager.base.emit_message = leaveOnWarning;
  manager.base.output_message = saySilently;
  manager.message[0] = '\0';
}

void limitScans(j_common_ptr info) {
  const auto* decoder = reinterpret_cast<j_decompress_ptr>(info);
  if (decoder->input_scan_number > kMostScans) leave(info);
}

/// The order of scans: means, then the coarse detail of lightness, colours, and the rest. Fewer scans than
/// libjpeg's own order: each costs time and tables of its own.
constexpr std::array<jpeg_scan_info, 5> kScans = {{{3, {0, 1, 2, 0}, 0, 0, 0, 0},
                                                   {1, {0, 0, 0, 0}, 1, 8, 0, 0},
                                                   {1, {1, 0, 0, 0}, 1, 63, 0, 0},
                                                   {1, {2, 0, 0, 0}, 1, 63, 0, 0},
                                                   {1, {0, 0, 0, 0}, 9, 63, 0, 0}}};

/// Whether it worked; nothing with a destructor lives here.
bool compress(const uint8_t* rgba, int quality, ErrorManager& manager, unsigned char** file,
              unsigned long* bytes) {
  jpeg_compress_struct encoder;
  encoder.err = &manager.base;
  if (setjmp(manager.jump) != 0) {
    jpeg_destroy_compress(&encoder);
    return false;
  }
  jpeg_create_compress(&encoder);
  jpeg_mem_dest(&encoder, file, bytes);
  encoder.image_width = kImageryTileSide;
  encoder.image_height = kImageryTileSide;
  encoder.input_components = 4;
  encoder.in_color_space = JCS_EXT_RGBX;
  jpeg_set_defaults(&encoder);
  jpeg_set_quality(&encoder, quality, TRUE);
  encoder.scan_info = kScans.data();
  encoder.num_scans = static_cast<int>(kScans.size());
  encoder.write_JFIF_header = TRUE;
  jpeg_start_compress(&encoder, TRUE);
  while (encoder.next_scanline < encoder.image_height) {
    auto* row =
        const_cast<JSAMPROW>(rgba + static_cast<size_t>(encoder.next_scanline) * kImageryTileSide * 4);
    jpeg_write_scanlines(&encoder, &row, 1);
  }
  jpeg_finish_compress(&encoder);
  jpeg_destroy_compress(&encoder);
  return true;
}

bool decompress(const uint8_t* file, unsigned long bytes, uint8_t* rgba, ErrorManager& manager) {
  jpeg_decompress_struct decoder;
  jpeg_progress_mgr progress{};
  decoder.err = &manager.base;
  if (setjmp(manager.jump) != 0) {
    jpeg_destroy_decompress(&decoder);
    return false;
  }
  jpeg_create_decompress(&decoder);
  progress.progress_monitor = limitScans;
  decoder.progress = &progress;
  jpeg_mem_src(&decoder, file, bytes);
  jpeg_read_header(&decoder, TRUE);
  const bool isTile = decoder.image_width == kImageryTileSide && decoder.image_height == kImageryTileSide &&
                      decoder.num_components == 3 && decoder.jpeg_color_space == JCS_YCbCr;
  if (!isTile) {
    std::snprintf(manager.message.data(), manager.message.size(), "is not %d x %d texels in colour",
                  kImageryTileSide, kImageryTileSide);
    jpeg_destroy_decompress(&decoder);
    return false;
  }
  decoder.out_color_space = JCS_EXT_RGBA;
  jpeg_start_decompress(&decoder);
  while (decoder.output_scanline < decoder.output_height) {
    JSAMPROW row = rgba + static_cast<size_t>(decoder.output_scanline) * kImageryTileSide * 4;
    jpeg_read_scanlines(&decoder, &row, 1);
  }
  jpeg_finish_decompress(&decoder);
  jpeg_destroy_decompress(&decoder);
  return true;
}

}  // namespace

std::vector<uint8_t> encodeJpeg(std::span<const uint8_t> rgba, int quality) {
  TERRANE_CHECK(rgba.size() == static_cast<size_t>(kImageryTexels) * 4, "{} bytes", rgba.size());
  ErrorManager manager;
  prepare(manager);
  unsigned char* file = nullptr;
  unsigned long bytes = 0;
  const bool worked = compress(rgba.data(), quality, manager, &file, &bytes);
  std::vector<uint8_t> out;
  if (worked) out.assign(file, file + bytes);
  std::free(file);
  TERRANE_CHECK(worked, "{}", manager.message.data());
  return out;
}

std::vector<size_t> jpegScanEnds(std::span<const uint8_t> file) {
  std::vector<size_t> ends;
  size_t at = 2;
  while (at + 4 <= file.size() && file[at] == 0xFF) {
    const uint8_t marker = file[at + 1];
    if (marker == 0xD9) break;
    at += 2 + (static_cast<size_t>(file[at + 2]) << 8 | file[at + 3]);
    if (marker != 0xDA) continue;
    // Coded data follow: up to a marker that is neither a stuffed zero nor a restart.
    while (at + 1 < file.size() &&
           !(file[at] == 0xFF && file[at + 1] != 0x00 && (file[at + 1] & 0xF8) != 0xD0))
      ++at;
    ends.push_back(at);
  }
  return ends;
}

Status decodeJpeg(std::span<const uint8_t> file, std::span<uint8_t> rgba) {
  TERRANE_CHECK(rgba.size() == static_cast<size_t>(kImageryTexels) * 4, "{} bytes", rgba.size());
  ErrorManager manager;
  prepare(manager);
  if (decompress(file.data(), static_cast<unsigned long>(file.size()), rgba.data(), manager)) return {};
  return makeError("its JPEG is damaged: {}", manager.message.data());
}

}  // namespace terrane
