#include "terrane/codec/imagery_codec.h"

#include <webp/decode.h>
#include <webp/encode.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "jpeg_image.h"
#include "payload_check.h"
#include "terrane/base/check.h"

// docs/format/imagery-v2.md specifies every byte that is written and read here.
namespace terrane {

namespace {

constexpr uint8_t kImageryVersion = 2;
constexpr uint8_t kHasMask = 1;
constexpr size_t kMostScanEnds = 32;
constexpr size_t kMaskBytes = kImageryTexels;
/// No mask is longer in zstd than its bytes and a frame's head.
constexpr size_t kMostMaskBytes = kMaskBytes + 1024;
constexpr int kMaskEffort = 3;
constexpr std::array<uint8_t, 2> kEndOfImage = {0xFF, 0xD9};
/// Beyond this one libwebp takes twice the time for a thirtieth of the bytes (decision 86).
constexpr int kWebpMethod = 2;
/// What JPEG needs more to look as WebP does: 80 for 75 (decision 86).
constexpr int kJpegMoreQuality = 5;

void putVarint(std::vector<uint8_t>& out, size_t value) {
  for (; value >= 0x80; value >>= 7) out.push_back(static_cast<uint8_t>(value | 0x80));
  out.push_back(static_cast<uint8_t>(value));
}

/// Reads a payload's head; a length is at most 28 bits.
class HeadReader {
 public:
  explicit HeadReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  bool byte(uint8_t& out) {
    if (at_ >= bytes_.size()) return false;
    out = bytes_[at_++];
    return true;
  }
  bool varint(size_t& out) {
    out = 0;
    for (int shift = 0; shift < 28; shift += 7) {
      uint8_t next = 0;
      if (!byte(next)) return false;
      out |= static_cast<size_t>(next & 0x7F) << shift;
      if ((next & 0x80) == 0) return true;
    }
    return false;
  }
  size_t at() const { return at_; }

 private:
  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
};

/// The head, and where the mask lies.
struct ImageryHead {
  ImageryLayout layout;
  size_t maskBytes = 0;
  size_t maskBegin() const { return layout.imageBegin - maskBytes; }
};

Result<ImageryHead> readHead(std::span<const uint8_t> bytes) {
  HeadReader reader(bytes);
  const auto cutShort = [&] { return makeError("imagery payload: its head is cut short or damaged"); };
  uint8_t version = 0, check = 0, format = 0, flags = 0, scans = 0;
  if (!reader.byte(version)) return cutShort();
  if (version != kImageryVersion)
    return makeError("imagery payload: has version {}, this program reads {}: {}", version, kImageryVersion,
                     version > kImageryVersion ? "update Terrane" : "build the dataset again");
  // The check is looked at when all of the payload is here.
  for (size_t i = kCheckOffset; i < kCheckedFrom; ++i)
    if (!reader.byte(check)) return cutShort();
  if (!reader.byte(format) || !reader.byte(flags) || !reader.byte(scans)) return cutShort();
  const bool jpeg = format == static_cast<uint8_t>(ImageryFormat::Jpeg);
  if (!jpeg && format != static_cast<uint8_t>(ImageryFormat::Webp))
    return makeError("imagery payload: has the unknown format {}", format);
  // WebP carries its alpha itself, and has no scans.
  if ((flags & ~kHasMask) != 0 || (!jpeg && flags != 0))
    return makeError("imagery payload: has unknown flags ({})", flags);
  if (scans > kMostScanEnds || (scans == 0) == jpeg)
    return makeError("imagery payload: says that it has {} scans", scans);

  ImageryHead head;
  head.layout.format = static_cast<ImageryFormat>(format);
  head.layout.hasMask = flags != 0;
  size_t end = 0;
  for (int i = 0; i < scans; ++i) {
    size_t length = 0;
    if (!reader.varint(length) || length == 0) return cutShort();
    head.layout.scanEnds.push_back(end += length);
  }
  if (head.layout.hasMask && (!reader.varint(head.maskBytes) || head.maskBytes > kMostMaskBytes))
    return cutShort();
  head.layout.imageBegin = reader.at() + head.maskBytes;
  for (size_t& scanEnd : head.layout.scanEnds) scanEnd += head.layout.imageBegin;
  return head;
}

std::vector<uint8_t> packMask(const ImageryTile& tile) {
  std::vector<uint8_t> mask(kMaskBytes);
  for (size_t i = 0; i < kMaskBytes; ++i) mask[i] = tile.rgba[4 * i + 3];
  std::vector<uint8_t> packed(ZSTD_compressBound(kMaskBytes));
  const size_t bytes = ZSTD_compress(packed.data(), packed.size(), mask.data(), mask.size(), kMaskEffort);
  TERRANE_CHECK(ZSTD_isError(bytes) == 0, "{}", ZSTD_getErrorName(bytes));
  packed.resize(bytes);
  return packed;
}

Status unpackMask(std::span<const uint8_t> packed, ImageryTile& tile) {
  std::vector<uint8_t> mask(kMaskBytes);
  const size_t bytes = ZSTD_decompress(mask.data(), mask.size(), packed.data(), packed.size());
  if (ZSTD_isError(bytes) != 0 || bytes != kMaskBytes)
    return makeError("imagery payload: its mask is damaged");
  for (size_t i = 0; i < kMaskBytes; ++i) tile.rgba[4 * i + 3] = mask[i];
  return {};
}

std::vector<uint8_t> encodeWebp(const ImageryTile& tile, int quality) {
  WebPConfig config;
  WebPPicture picture;
  TERRANE_CHECK(WebPConfigPreset(&config, WEBP_PRESET_DEFAULT, static_cast<float>(quality)) != 0 &&
                WebPPictureInit(&picture) != 0);
  config.method = kWebpMethod;
  picture.width = picture.height = kImageryTileSide;
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  const bool opaque = coverOf(tile) == ImageryCover::Full;
  const bool worked =
      (opaque ? WebPPictureImportRGBX(&picture, tile.rgba.data(), kImageryTileSide * 4)
              : WebPPictureImportRGBA(&picture, tile.rgba.data(), kImageryTileSide * 4)) != 0 &&
      WebPEncode(&config, &picture) != 0;
  std::vector<uint8_t> out(writer.mem, writer.mem + writer.size);
  WebPMemoryWriterClear(&writer);
  WebPPictureFree(&picture);
  TERRANE_CHECK(worked, "WebP error {}", static_cast<int>(picture.error_code));
  return out;
}

Status decodeWebp(std::span<const uint8_t> file, ImageryTile& tile) {
  WebPBitstreamFeatures features;
  const bool isTile = WebPGetFeatures(file.data(), file.size(), &features) == VP8_STATUS_OK &&
                      features.width == kImageryTileSide && features.height == kImageryTileSide &&
                      features.has_animation == 0;
  if (!isTile || WebPDecodeRGBAInto(file.data(), file.size(), tile.rgba.data(), tile.rgba.size(),
                                    kImageryTileSide * 4) == nullptr) {
    return makeError("imagery payload: its WebP is damaged");
  }
  return {};
}

/// A JPEG that ends at `end` of the payload, as if its last scan were that.
Result<ImageryTile> decodeJpegUpTo(std::span<const uint8_t> payload, const ImageryHead& head, size_t end) {
  std::vector<uint8_t> file(payload.begin() + static_cast<ptrdiff_t>(head.layout.imageBegin),
                            payload.begin() + static_cast<ptrdiff_t>(end));
  file.insert(file.end(), kEndOfImage.begin(), kEndOfImage.end());
  ImageryTile tile;
  if (const Status done = decodeJpeg(file, tile.rgba); !done.ok())
    return makeError("imagery payload: {}", done.error().message);
  if (head.layout.hasMask) TERRANE_TRY(unpackMask(payload.subspan(head.maskBegin(), head.maskBytes), tile));
  return tile;
}

}  // namespace

ImageryCover coverOf(const ImageryTile& tile) {
  uint8_t every = 255, any = 0;
  for (size_t i = 3; i < tile.rgba.size(); i += 4) {
    every &= tile.rgba[i];
    any |= tile.rgba[i];
  }
  return any == 0 ? ImageryCover::None : every == 255 ? ImageryCover::Full : ImageryCover::Partial;
}

void fillTransparent(ImageryTile& tile) {
  // Means over ever larger squares that have a colour, then down again to where none was.
  struct Level {
    int side;
    std::vector<float> rgbw;
  };
  std::vector<Level> levels;
  levels.push_back({kImageryTileSide, std::vector<float>(tile.rgba.size())});
  for (size_t i = 0; i < tile.rgba.size(); i += 4) {
    const float weight = tile.rgba[i + 3] > 0 ? 1.0F : 0.0F;
    for (size_t c = 0; c < 3; ++c) levels[0].rgbw[i + c] = weight * static_cast<float>(tile.rgba[i + c]);
    levels[0].rgbw[i + 3] = weight;
  }
  while (levels.back().side > 1) {
    const Level& fine = levels.back();
    const int side = fine.side / 2;
    Level coarse{side, std::vector<float>(static_cast<size_t>(side) * side * 4)};
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        float* out = &coarse.rgbw[static_cast<size_t>(y * side + x) * 4];
        for (const int at : {0, 1, fine.side, fine.side + 1}) {
          const float* in = &fine.rgbw[static_cast<size_t>(2 * y * fine.side + 2 * x + at) * 4];
          for (int c = 0; c < 4; ++c) out[c] += in[c];
        }
        if (out[3] > 0.0F) {
          for (int c = 0; c < 3; ++c) out[c] /= out[3];
          out[3] = 1.0F;
        }
      }
    }
    levels.push_back(std::move(coarse));
  }
  for (size_t l = levels.size() - 1; l-- > 0;) {
    Level& fine = levels[l];
    const Level& coarse = levels[l + 1];
    for (int y = 0; y < fine.side; ++y) {
      for (int x = 0; x < fine.side; ++x) {
        float* out = &fine.rgbw[static_cast<size_t>(y * fine.side + x) * 4];
        if (out[3] > 0.0F) continue;
        std::copy_n(&coarse.rgbw[static_cast<size_t>(y / 2 * coarse.side + x / 2) * 4], 4, out);
      }
    }
  }
  for (size_t i = 0; i < tile.rgba.size(); i += 4) {
    if (tile.rgba[i + 3] > 0) continue;
    for (size_t c = 0; c < 3; ++c)
      tile.rgba[i + c] = static_cast<uint8_t>(std::lround(levels[0].rgbw[i + c]));
  }
}

std::vector<uint8_t> encodeImagery(const ImageryTile& tile, ImageryFormat format, int quality) {
  TERRANE_CHECK(tile.rgba.size() == static_cast<size_t>(kImageryTexels) * 4, "{} bytes", tile.rgba.size());
  TERRANE_CHECK(quality >= 1 && quality <= 100, "quality {}", quality);
  const bool jpeg = format == ImageryFormat::Jpeg;
  const bool full = coverOf(tile) == ImageryCover::Full;
  const ImageryTile* source = &tile;
  ImageryTile filled;
  if (!full) {
    filled = tile;
    fillTransparent(filled);
    source = &filled;
  }
  const std::vector<uint8_t> image = jpeg ? encodeJpeg(source->rgba, quality) : encodeWebp(*source, quality);
  const std::vector<size_t> ends = jpeg ? jpegScanEnds(image) : std::vector<size_t>();

  std::vector<uint8_t> out(kCheckedFrom, 0);
  out[0] = kImageryVersion;
  out.push_back(static_cast<uint8_t>(format));
  out.push_back(jpeg && !full ? kHasMask : 0);
  out.push_back(static_cast<uint8_t>(ends.size()));
  size_t before = 0;
  for (const size_t end : ends) {
    putVarint(out, end - before);
    before = end;
  }
  if (jpeg && !full) {
    const std::vector<uint8_t> mask = packMask(tile);
    putVarint(out, mask.size());
    out.insert(out.end(), mask.begin(), mask.end());
  }
  out.insert(out.end(), image.begin(), image.end());
  sealPayload(out);
  return out;
}

std::vector<uint8_t> encodeImageryRoot(const ImageryTile& tile, ImageryFormat format, int quality) {
  const int more = format == ImageryFormat::Jpeg ? 0 : kJpegMoreQuality;
  return encodeImagery(tile, ImageryFormat::Jpeg, std::min(quality + more, 100));
}

Result<ImageryLayout> imageryLayout(std::span<const uint8_t> beginning) {
  TERRANE_ASSIGN(ImageryHead head, readHead(beginning));
  return std::move(head.layout);
}

Result<ImageryTile> decodeImagery(std::span<const uint8_t> payload) {
  TERRANE_ASSIGN(const ImageryHead head, readHead(payload));
  if (const Status sound = checkPayload(payload); !sound.ok())
    return makeError("imagery payload: {}", sound.error().message);
  if (head.layout.imageBegin > payload.size()) return makeError("imagery payload: is cut short");
  if (head.layout.format == ImageryFormat::Webp) {
    // note: a RIFF file says how long it is; more or fewer bytes are none of it.
    const auto file = payload.subspan(head.layout.imageBegin);
    const bool whole =
        file.size() >= 12 &&
        file.size() == 8 + (file[4] | size_t{file[5]} << 8 | size_t{file[6]} << 16 | size_t{file[7]} << 24);
    if (!whole) return makeError("imagery payload: its WebP is cut short, or too long");
    ImageryTile tile;
    TERRANE_TRY(decodeWebp(file, tile));
    return tile;
  }
  const size_t end = head.layout.scanEnds.back();
  if (payload.size() != end + kEndOfImage.size() ||
      !std::equal(kEndOfImage.begin(), kEndOfImage.end(), payload.begin() + static_cast<ptrdiff_t>(end))) {
    return makeError("imagery payload: has {} bytes, its scans end at {}: cut short, or too long",
                     payload.size(), end);
  }
  return decodeJpegUpTo(payload, head, end);
}

Result<ImageryTile> decodeImageryPrefix(std::span<const uint8_t> beginning) {
  TERRANE_ASSIGN(const ImageryHead head, readHead(beginning));
  if (head.layout.format == ImageryFormat::Webp) return decodeImagery(beginning);
  size_t end = 0;
  for (const size_t scanEnd : head.layout.scanEnds) {
    if (scanEnd <= beginning.size()) end = scanEnd;
  }
  if (end == 0) return makeError("imagery payload: cut short before the end of its first scan");
  return decodeJpegUpTo(beginning, head, end);
}

}  // namespace terrane
