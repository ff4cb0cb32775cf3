#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "terrane/gpu/buffer.h"
#include "terrane/gpu/compute_program.h"
#include "terrane/gpu/context.h"
#include "terrane/gpu/framebuffer.h"
#include "terrane/gpu/program.h"
#include "terrane/gpu/storage_buffer.h"
#include "terrane/gpu/texture.h"
#include "terrane/gpu/timer.h"
#include "terrane/gpu/vertex_array.h"

namespace terrane::gpu {
namespace {

constexpr std::string_view kFullscreen = R"(
void main() {
  gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0.5, 1.0);
}
)";

/// Every test runs in both dialects.
class Gpu : public testing::TestWithParam<Api> {
 protected:
  void SetUp() override {
    auto context = Context::createHeadless({.api = GetParam()});
    ASSERT_TRUE(context.ok()) << context.error().message;
    context_ = std::move(context).value();
  }
  void drawFullscreen(const Program& program) {
    VertexArray empty;
    empty.bind();
    program.use();
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  std::unique_ptr<Context> context_;
};

TEST_P(Gpu, TellsWhatItIs) {
  EXPECT_FALSE(context_->rendererName().empty());
  EXPECT_EQ(context_->isGles(), GetParam() == Api::OpenGlEs);
  EXPECT_GE(context_->limits().maxTextureSize, 2048);
  EXPECT_GE(context_->limits().maxArrayLayers, 256);
  EXPECT_GE(context_->limits().maxSamples, 1);
  std::printf("%s, %s\n", context_->rendererName().c_str(), context_->versionName().c_str());
}

TEST_P(Gpu, SoftwareCanBeForced) {
  context_.reset();
  auto software = Context::createHeadless({.api = GetParam(), .forceSoftware = true});
  ASSERT_TRUE(software.ok()) << software.error().message;
  EXPECT_TRUE((*software)->isSoftware()) << (*software)->rendererName();
}

TEST_P(Gpu, ContextsSucceedEachOther) {
  for (int i = 0; i < 3; ++i) {
    context_.reset();
    auto next = Context::createHeadless({.api = GetParam()});
    ASSERT_TRUE(next.ok()) << next.error().message;
    context_ = std::move(next).value();
    EXPECT_TRUE(context_->checkErrors("starting").ok());
  }
}

TEST_P(Gpu, ReportsErrorsOfShadersWithFileAndLine) {
  const auto broken =
      Program::create(*context_, {.name = "a broken program",
                                  .vertex = {{"fullscreen.vert", kFullscreen}},
                                  .fragment = {{"first.glsl", "\n"}, {"second.frag", "\n\nnonsense;\n"}},
                                  .captured = {}});
  ASSERT_FALSE(broken.ok());
  EXPECT_NE(broken.error().message.find("second.frag"), std::string::npos) << broken.error().message;
  const bool tellsLine = broken.error().message.find("2:3") != std::string::npos ||
                         broken.error().message.find("2(3)") != std::string::npos;
  EXPECT_TRUE(tellsLine) << broken.error().message;
}

TEST_P(Gpu, DrawsIntoAndReadsBackBothFormats) {
  const auto program = Program::create(*context_, {.name = "gradient",
                                                   .vertex = {{"fullscreen.vert", kFullscreen}},
                                                   .fragment = {{"gradient.frag", R"(
layout(location = 0) out vec4 oColor;
void main() { oColor = vec4(gl_FragCoord.xy, 7.0, 255.0) / 255.0; }
)"}},
                                                   .captured = {}});
  ASSERT_TRUE(program.ok()) << program.error().message;
  auto bytes = Framebuffer::create(*context_, {.width = 20, .height = 10});
  ASSERT_TRUE(bytes.ok()) << bytes.error().message;
  bytes->bind();
  drawFullscreen(*program);
  const auto rgba8 = bytes->readRgba8();
  // The first pixel is the top left one, at x = 0.5, y = 9.5 from the bottom.
  EXPECT_NEAR(rgba8[0], 0.5, 0.6);
  EXPECT_NEAR(rgba8[1], 9.5, 0.6);
  EXPECT_EQ(rgba8[2], 7);
  EXPECT_EQ(rgba8[3], 255);

  auto floats = Framebuffer::create(*context_, {.width = 20, .height = 10, .color = kRgba32F, .depth = true});
  ASSERT_TRUE(floats.ok()) << floats.error().message;
  floats->bind();
  drawFullscreen(*program);
  const auto rgba32 = floats->readRgba32F();
  EXPECT_FLOAT_EQ(rgba32[0] * 255.0F, 0.5F);
  EXPECT_FLOAT_EQ(rgba32[1] * 255.0F, 9.5F);
  EXPECT_TRUE(context_->checkErrors("drawing").ok());
}

TEST_P(Gpu, ResolvesSamples) {
  // A diagonal edge: multi-sampling gives it intermediate colours.
  const auto program = Program::create(*context_, {.name = "half",
                                                   .vertex = {{"half.vert", R"(
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 1.0 : -1.0, gl_VertexID == 2 ? 1.0 : -1.0, 0.5, 1.0);
}
)"}},
                                                   .fragment = {{"white.frag", R"(
layout(location = 0) out vec4 oColor;
void main() { oColor = vec4(1.0); }
)"}},
                                                   .captured = {}});
  ASSERT_TRUE(program.ok()) << program.error().message;
  const int samples = context_->limits().maxSamples;
  ASSERT_GE(samples, 2);
  auto many = Framebuffer::create(*context_, {.width = 33, .height = 31, .samples = samples, .depth = true});
  auto one = Framebuffer::create(*context_, {.width = 33, .height = 31});
  ASSERT_TRUE(many.ok() && one.ok());
  many->bind();
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT);
  drawFullscreen(*program);
  many->resolveInto(*one);
  int between = 0;
  for (const uint8_t value : one->readRgba8()) between += value != 0 && value != 255;
  EXPECT_GT(between, 0);
}

TEST_P(Gpu, ArraysKeepTheirLayersWhenTheyGrow) {
  TextureArray heights(kR32F, 5, 3, Filter::Nearest);
  TextureArray masks(kR8Ui, 4, 2, Filter::Nearest);
  const int layers = 40;
  for (int layer = 0; layer < layers; ++layer) {
    ASSERT_TRUE(heights.reserve(*context_, layer + 1).ok());
    ASSERT_TRUE(masks.reserve(*context_, layer + 1).ok());
    std::array<float, 15> texels{};
    std::iota(texels.begin(), texels.end(), static_cast<float>(100 * layer));
    heights.uploadLayer(layer, texels.data());
    std::array<uint8_t, 8> bytes{};
    bytes.fill(static_cast<uint8_t>(layer));
    masks.uploadLayer(layer, bytes.data());
  }
  const auto program = Program::create(*context_, {.name = "fetch",
                                                   .vertex = {{"fullscreen.vert", kFullscreen}},
                                                   .fragment = {{"fetch.frag", R"(
uniform sampler2DArray uHeights;
uniform usampler2DArray uMasks;
layout(location = 0) out vec4 oColor;
void main() {
  int layer = int(gl_FragCoord.x);
  oColor = vec4(texelFetch(uHeights, ivec3(4, 2, layer), 0).r, float(texelFetch(uMasks, ivec3(3, 1, layer), 0).r), 0.0, 1.0);
}
)"}},
                                                   .captured = {}});
  ASSERT_TRUE(program.ok()) << program.error().message;
  auto target = Framebuffer::create(*context_, {.width = layers, .height = 1, .color = kRgba32F});
  ASSERT_TRUE(target.ok());
  target->bind();
  heights.bindToUnit(0);
  masks.bindToUnit(1);
  program->setSampler("uHeights", 0);
  program->setSampler("uMasks", 1);
  drawFullscreen(*program);
  const auto read = target->readRgba32F();
  for (int layer = 0; layer < layers; ++layer) {
    EXPECT_EQ(read[static_cast<size_t>(layer) * 4], static_cast<float>(100 * layer + 14));
    EXPECT_EQ(read[static_cast<size_t>(layer) * 4 + 1], static_cast<float>(layer));
  }
  EXPECT_TRUE(context_->checkErrors("growing").ok());
}

TEST_P(Gpu, RefusesWhatTheDriverCannotDo) {
  TextureArray heights(kR32F, 4, 4, Filter::Nearest);
  EXPECT_FALSE(heights.reserve(*context_, context_->limits().maxArrayLayers + 1).ok());
  EXPECT_FALSE(
      Framebuffer::create(*context_, {.width = context_->limits().maxTextureSize + 1, .height = 1}).ok());
  EXPECT_FALSE(Framebuffer::create(*context_, {.width = 0, .height = 1}).ok());
  EXPECT_TRUE(context_->checkErrors("refusing").ok());
}

TEST_P(Gpu, TimesWhatItDraws) {
  Timer timer(*context_);
  EXPECT_FALSE(timer.seconds().has_value());
  auto target = Framebuffer::create(*context_, {.width = 64, .height = 64});
  ASSERT_TRUE(target.ok());
  // note: the first answer of a context may be unknown.
  int known = 0;
  for (int i = 0; i < 3; ++i) {
    timer.begin();
    target->bind();
    glClear(GL_COLOR_BUFFER_BIT);
    timer.end();
    const auto seconds = timer.seconds();
    known += seconds.has_value();
    EXPECT_GE(seconds.value_or(0.0), 0.0);
    EXPECT_LT(seconds.value_or(0.0), 60.0);
  }
  EXPECT_EQ(known > 0, !context_->workarounds().noTimerQuery);
}

TEST_P(Gpu, ComputesOnDesktopOpenGlOnly) {
  constexpr std::string_view kDouble = R"(
layout(local_size_x = 4) in;
layout(std430, binding = 0) readonly buffer From { uint from[]; };
layout(std430, binding = 1) writeonly buffer To { uint to[]; };
void main() {
  uint i = gl_WorkGroupID.y * 8u + gl_GlobalInvocationID.x;
  to[i] = 2u * from[i];
}
)";
  const auto program = ComputeProgram::create(*context_, "doubling", {{"double.comp", kDouble}});
  ASSERT_EQ(program.ok(), !context_->isGles());
  if (!program.ok()) return;
  std::vector<uint32_t> values(24);
  std::iota(values.begin(), values.end(), 5U);
  StorageBuffer from;
  StorageBuffer to;
  EXPECT_GE(StorageBuffer::maxBytes(), size_t{1} << 24);
  // More, then less: the storage is kept, the size is told.
  from.upload(nullptr, 1000);
  from.upload(values.data(), values.size() * 4);
  EXPECT_EQ(from.sizeBytes(), values.size() * 4);
  to.upload(nullptr, values.size() * 4);
  from.bindTo(0);
  to.bindTo(1);
  program->dispatch(2, 3);
  std::vector<uint32_t> doubled(24);
  to.read(doubled.data(), doubled.size() * 4);
  for (size_t i = 0; i < values.size(); ++i) EXPECT_EQ(doubled[i], 2 * values[i]) << i;

  const auto broken =
      ComputeProgram::create(*context_, "broken", {{"first.glsl", ""}, {"second.comp", "\nnonsense;\n"}});
  ASSERT_FALSE(broken.ok());
  EXPECT_NE(broken.error().message.find("the compute shader of broken"), std::string::npos);
  EXPECT_NE(broken.error().message.find("second.comp"), std::string::npos);
  EXPECT_TRUE(context_->checkErrors("computing").ok());
}

std::string dialectName(const testing::TestParamInfo<Api>& dialect) {
  return dialect.param == Api::OpenGl ? "OpenGl" : "OpenGlEs";
}
INSTANTIATE_TEST_SUITE_P(BothDialects, Gpu, testing::Values(Api::OpenGl, Api::OpenGlEs), dialectName);

}  // namespace
}  // namespace terrane::gpu
