#include "frame_sink.h"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "terrane/render/png.h"

namespace terrane::cli {

namespace {

/// Numbered PNG files.
class NumberedFrames final : public FrameSink {
 public:
  NumberedFrames(std::string before, int digits, std::string after, bool overwrite)
      : before_(std::move(before)), after_(std::move(after)), digits_(digits), overwrite_(overwrite) {}

  Status add(const Picture& picture) override {
    const std::string path = fmt::format("{}{:0{}}{}", before_, next_++, digits_, after_);
    if (!overwrite_ && std::filesystem::exists(path))
      return makeError("{}: exists already; pass --overwrite to replace it", path);
    return writePicture(path, picture);
  }
  Status finish() override { return {}; }

 private:
  std::string before_, after_;
  int digits_;
  bool overwrite_;
  int64_t next_ = 0;
};

/// Raw frames through a pipe into ffmpeg, which writes beside the output; renamed at the end.
class Video final : public FrameSink {
 public:
  Video(std::string output, std::FILE* pipe) : output_(std::move(output)), pipe_(pipe) {}
  ~Video() override {
    if (pipe_ == nullptr) return;
    pclose(pipe_);
    std::remove(partialOf(output_).c_str());
  }

  static std::string partialOf(const std::string& output) { return output + ".partial.mp4"; }

  Status add(const Picture& picture) override {
    if (std::fwrite(picture.rgba.data(), 1, picture.rgba.size(), pipe_) != picture.rgba.size())
      return makeError("{}: ffmpeg stopped reading; is the disk full?", output_);
    return {};
  }
  Status finish() override {
    const int status = pclose(std::exchange(pipe_, nullptr));
    if (status != 0 || std::rename(partialOf(output_).c_str(), output_.c_str()) != 0) {
      std::remove(partialOf(output_).c_str());
      return makeError("{}: ffmpeg could not write it (status {})", output_, status);
    }
    return {};
  }

 private:
  std::string output_;
  std::FILE* pipe_;
};

/// Quotes for a POSIX shell.
std::string shellQuoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

Result<std::unique_ptr<FrameSink>> openVideo(const std::string& output, int width, int height,
                                             double framesPerSecond) {
  if (std::system("command -v ffmpeg >/dev/null 2>&1") != 0)
    return makeError(
        "{}: needs the ffmpeg program, which is not installed (apt-get install ffmpeg); or write frames: "
        "-o frame_%05d.png",
        output);
  // The codec wants even sizes: the last row or column is cut off where needed.
  const std::string command = fmt::format(
      "ffmpeg -loglevel error -y -f rawvideo -pixel_format rgba -video_size {}x{} -framerate {} -i - -vf "
      "'crop=trunc(iw/2)*2:trunc(ih/2)*2' -c:v libx264 -pix_fmt yuv420p -crf 18 -movflags +faststart {}",
      width, height, framesPerSecond, shellQuoted(Video::partialOf(output)));
  std::FILE* pipe = popen(command.c_str(), "w");
  if (pipe == nullptr) return makeError("{}: ffmpeg could not be started", output);
  return std::unique_ptr<FrameSink>(std::make_unique<Video>(output, pipe));
}

}  // namespace

Status writePicture(const std::string& path, const Picture& picture) {
  return writePng(path, picture.width, picture.height, picture.rgba);
}

Result<std::unique_ptr<FrameSink>> openFrameSink(const std::string& output, int width, int height,
                                                 double framesPerSecond, bool overwrite) {
  if (output.size() > 4 && output.ends_with(".mp4")) return openVideo(output, width, height, framesPerSecond);
  // Only one plain integer may stand in the pattern: it is parsed here, never handed to printf.
  const size_t percent = output.find('%');
  const size_t d = percent == std::string::npos ? percent : output.find('d', percent);
  if (d == std::string::npos || output.find('%', percent + 1) != std::string::npos || d - percent > 3)
    return makeError(
        "{}: a whole flight goes to a pattern such as frame_%05d.png or to a .mp4; for one picture pass --at "
        "SECONDS",
        output);
  const std::string widthText = output.substr(percent + 1, d - percent - 1);
  const int digits = widthText.empty() ? 1 : std::atoi(widthText.c_str());
  return std::unique_ptr<FrameSink>(std::make_unique<NumberedFrames>(
      output.substr(0, percent), std::max(digits, 1), output.substr(d + 1), overwrite));
}

}  // namespace terrane::cli
