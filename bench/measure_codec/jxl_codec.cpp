#include <jxl/decode_cxx.h>
#include <jxl/encode_cxx.h>

#include "tile_codec.h"

namespace terrane {
namespace {

constexpr int kEffort = 7;
/// 512 samples a side: a tile is one group, not a large one and three slivers.
constexpr int kGroupSize = 2;
constexpr JxlPixelFormat kFormat = {1, JXL_TYPE_UINT16, JXL_NATIVE_ENDIAN, 0};

class JxlCodec final : public TileCodec {
 public:
  std::string_view name() const override { return "jxl"; }

  Result<std::vector<uint8_t>> encode(const TileContent& content) override {
    const std::vector<uint16_t> samples = asSixteenBits(content);
    JxlEncoderReset(encoder_.get());
    JxlEncoderFrameSettings* const settings = JxlEncoderFrameSettingsCreate(encoder_.get(), nullptr);

    JxlBasicInfo info;
    JxlEncoderInitBasicInfo(&info);
    info.xsize = static_cast<uint32_t>(content.cols);
    info.ysize = static_cast<uint32_t>(content.rows);
    info.bits_per_sample = 16;
    info.num_color_channels = 1;
    info.uses_original_profile = JXL_TRUE;
    JxlColorEncoding color;
    JxlColorEncodingSetToSRGB(&color, JXL_TRUE);

    const bool set = JxlEncoderSetBasicInfo(encoder_.get(), &info) == JXL_ENC_SUCCESS &&
                     JxlEncoderSetColorEncoding(encoder_.get(), &color) == JXL_ENC_SUCCESS &&
                     JxlEncoderSetFrameLossless(settings, JXL_TRUE) == JXL_ENC_SUCCESS &&
                     JxlEncoderFrameSettingsSetOption(settings, JXL_ENC_FRAME_SETTING_EFFORT, kEffort) ==
                         JXL_ENC_SUCCESS &&
                     JxlEncoderFrameSettingsSetOption(settings, JXL_ENC_FRAME_SETTING_MODULAR_GROUP_SIZE,
                                                      kGroupSize) == JXL_ENC_SUCCESS &&
                     JxlEncoderAddImageFrame(settings, &kFormat, samples.data(),
                                             samples.size() * sizeof(uint16_t)) == JXL_ENC_SUCCESS;
    if (!set) return makeError("JPEG XL refuses a tile of {} x {} samples", content.cols, content.rows);
    JxlEncoderCloseInput(encoder_.get());

    std::vector<uint8_t> bytes(samples.size() * 4 + 4096);
    uint8_t* next = bytes.data();
    size_t left = bytes.size();
    if (JxlEncoderProcessOutput(encoder_.get(), &next, &left) != JXL_ENC_SUCCESS)
      return makeError("JPEG XL cannot encode a tile");
    bytes.resize(bytes.size() - left);
    return bytes;
  }

  Status decode(std::span<const uint8_t> bytes, int cols, int rows) override {
    decoded_.resize(static_cast<size_t>(cols) * static_cast<size_t>(rows));
    JxlDecoder* const decoder = decoder_.get();
    JxlDecoderReset(decoder);
    if (JxlDecoderSubscribeEvents(decoder, JXL_DEC_FULL_IMAGE) != JXL_DEC_SUCCESS ||
        JxlDecoderSetInput(decoder, bytes.data(), bytes.size()) != JXL_DEC_SUCCESS)
      return makeError("JPEG XL cannot begin to decode a tile");
    JxlDecoderCloseInput(decoder);
    while (true) {
      const JxlDecoderStatus status = JxlDecoderProcessInput(decoder);
      if (status == JXL_DEC_FULL_IMAGE) return {};
      if (status != JXL_DEC_NEED_IMAGE_OUT_BUFFER ||
          JxlDecoderSetImageOutBuffer(decoder, &kFormat, decoded_.data(),
                                      decoded_.size() * sizeof(uint16_t)) != JXL_DEC_SUCCESS)
        return makeError("JPEG XL cannot decode a tile");
    }
  }

  bool holds(const TileContent& content) const override { return sameSixteenBits(content, decoded_); }

 private:
  JxlEncoderPtr encoder_ = JxlEncoderMake(nullptr);
  JxlDecoderPtr decoder_ = JxlDecoderMake(nullptr);
  std::vector<uint16_t> decoded_;
};

}  // namespace

std::unique_ptr<TileCodec> makeJxlCodec() {
  return std::make_unique<JxlCodec>();
}

}  // namespace terrane
