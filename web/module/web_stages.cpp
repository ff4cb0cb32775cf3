#include <algorithm>
#include <utility>

#include "terrane/engine/line_orders.h"
#include "web_view.h"

/// Lines and passes of pages. Both may come before the dataset is open; where it lies is known only then.
namespace terrane {
namespace {

/// Numbers of each line in setLines(): corners, colour and opacity, width, its unit.
constexpr size_t kLineNumbers = 7;
/// So many are prepared in a few milliseconds.
constexpr size_t kCornersAtOnce = 1000;

}  // namespace

void WebView::setLines(const emscripten::val& corners, const emscripten::val& lines) {
  const auto places = emscripten::convertJSArrayToNumberVector<double>(corners);
  const auto numbers = emscripten::convertJSArrayToNumberVector<float>(lines);
  lines_.clear();
  size_t next = 0;
  for (size_t i = 0; i + kLineNumbers <= numbers.size(); i += kLineNumbers) {
    WantedLine wanted;
    const auto count = static_cast<size_t>(std::max(numbers[i], 0.0F));
    for (size_t k = 0; k < count && next + 1 < places.size(); ++k, next += 2)
      wanted.cornersCrs.emplace_back(places[next], places[next + 1]);
    wanted.line.srgba = {numbers[i + 1], numbers[i + 2], numbers[i + 3], numbers[i + 4]};
    wanted.line.width = static_cast<double>(numbers[i + 5]);
    wanted.line.isWidthInMeters = numbers[i + 6] != 0.0F;
    if (wanted.line.width > 0.0) lines_.push_back(std::move(wanted));
  }
  hasNewLines_ = true;
  giveStages();
}

std::string WebView::setPass(const std::string& name, const std::string& fragment, double originEast,
                             double originNorth, double originHeight) {
  if (!renderer_) return problem_.empty() ? "there is no canvas to draw on" : problem_;
  const WantedPass pass{name, fragment, {originEast, originNorth, originHeight}};
  if (isReady()) return givePass(pass);
  // What is wrong with it is told at once; its origin is set when the dataset is open.
  context_->makeCurrent();
  const Status set = renderer_->setPass(name, fragment, {});
  if (!set.ok()) return set.error().message;
  passes_.push_back(pass);
  return {};
}

std::string WebView::givePass(const WantedPass& pass) {
  context_->makeCurrent();
  const glm::dvec3 origin = view_->manifest().frame.localFromCrs(pass.originCrs);
  const Status set = renderer_->setPass(pass.name, pass.fragment, origin);
  view_->requestRender();
  return set.ok() ? std::string() : set.error().message;
}

void WebView::removePass(const std::string& name) {
  passes_.erase(std::remove_if(passes_.begin(), passes_.end(),
                               [&](const WantedPass& pass) { return pass.name == name; }),
                passes_.end());
  if (!renderer_) return;
  context_->makeCurrent();
  renderer_->removePass(name);
  view_->requestRender();
}

void WebView::setPassUniform(const std::string& name, const std::string& uniform,
                             const emscripten::val& values) {
  if (!renderer_) return;
  context_->makeCurrent();
  const auto numbers = emscripten::convertJSArrayToNumberVector<float>(values);
  // note: a uniform that the pass does not have is the page's mistake, and no reason to stop drawing.
  (void)renderer_->setPassUniform(name, uniform, numbers);
  view_->requestRender();
}

void WebView::giveStages() {
  if (!isReady() || !renderer_) return;
  for (const WantedPass& pass : std::exchange(passes_, {})) {
    const glm::dvec3 origin = view_->manifest().frame.localFromCrs(pass.originCrs);
    renderer_->movePass(pass.name, origin);
  }
  if (const auto prepared = std::exchange(preparedLines_, nullptr)) showLines(*prepared);
  if (arePreparing_ || !std::exchange(hasNewLines_, false)) return;
  auto lines = std::make_shared<std::vector<GroundLine>>();
  size_t corners = 0;
  for (WantedLine& wanted : std::exchange(lines_, {})) {
    GroundLine& line = lines->emplace_back(std::move(wanted.line));
    for (const glm::dvec2 crs : wanted.cornersCrs)
      line.corners.emplace_back(view_->manifest().frame.localFromCrs({crs, 0.0}));
    corners += line.corners.size();
  }
  // A few are seen in this frame; many would hold it up.
  if (corners <= kCornersAtOnce) return showLines(*prepareLines(*lines));
  arePreparing_ = true;
  workers_.order(PrepareLines{std::move(lines)}, [this](PrepareLines::Answer prepared) {
    arePreparing_ = false;
    preparedLines_ = std::move(prepared);
  });
}

void WebView::showLines(const PreparedLines& lines) {
  context_->makeCurrent();
  const Status set = renderer_->setPreparedLines(lines);
  stageTrouble_ = set.ok() ? std::string() : set.error().message;
  view_->requestRender();
}

}  // namespace terrane
