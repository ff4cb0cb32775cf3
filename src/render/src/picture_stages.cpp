#include "picture_stages.h"

#include <utility>

#include "shader_library.h"
#include "stage_units.h"

namespace terrane {

Status PictureStages::prepare(const Camera& camera) {
  if (shrink_ == nullptr) {
    TERRANE_ASSIGN(gpu::Program made, makeProgram(context_, ProgramRecipes{}.shrink));
    made.setSampler("uScene", kStageSceneUnit);
    shrink_ = std::make_unique<gpu::Program>(std::move(made));
  }
  // One picture, and a second one where passes read from one and draw into the other.
  for (size_t i = 0; i < (passes.size() > 0 ? 2 : 1); ++i) {
    auto& picture = pictures_[i];
    if (picture && picture->spec().width == camera.width && picture->spec().height == camera.height) continue;
    picture.reset();
    TERRANE_ASSIGN(gpu::Framebuffer made,
                   gpu::Framebuffer::create(
                       context_, {.width = camera.width, .height = camera.height, .color = gpu::kRgba16F}));
    picture.emplace(std::move(made));
  }
  return {};
}

Result<const gpu::Texture*> PictureStages::run(const gpu::Texture& scene, int shrink,
                                               const gpu::Texture& places, const Camera& camera,
                                               double exaggeration) {
  TERRANE_TRY(prepare(camera));
  size_t current = 0;
  pictures_[current]->bind();
  scene.bindToUnit(kStageSceneUnit);
  shrink_->setInt("uShrink", shrink);
  nothing_.bind();
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindVertexArray(0);
  if (!lines.isEmpty()) lines.draw(places, camera, *pictures_[current]);
  for (size_t i = 0; i < passes.size(); ++i) {
    const size_t next = 1 - current;
    passes.draw(i, pictures_[current]->color(), places, camera, exaggeration, *pictures_[next]);
    current = next;
  }
  return &pictures_[current]->color();
}

}  // namespace terrane
