#include "terrane/measure/fly.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace terrane {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295;
constexpr int64_t kMostFrames = 1000000;

}  // namespace

Camera cameraAt(const FittedFlight& flight, double seconds, const FlyOptions& options) {
  Camera camera = flight.at(seconds, options.width, options.height);
  if (options.fovyDegrees) camera.fovyRadians = *options.fovyDegrees * kRadiansPerDegree;
  return camera;
}

std::vector<double> frameTimes(double durationSeconds, const FlyOptions& options) {
  std::vector<double> times;
  if (options.frames) {
    const int64_t count = std::clamp<int64_t>(*options.frames, 1, kMostFrames);
    for (int64_t i = 0; i < count; ++i) {
      times.push_back(count > 1 ? durationSeconds * static_cast<double>(i) / static_cast<double>(count - 1)
                                : 0.0);
    }
    return times;
  }
  const double last = std::floor(durationSeconds * options.framesPerSecond + 1e-9);
  for (double i = 0; i <= std::min(last, static_cast<double>(kMostFrames)); i += 1.0) {
    times.push_back(i / options.framesPerSecond);
  }
  return times;
}

Result<FlightReport> fly(FlightScene& scene, const FittedFlight& flight, const FlyOptions& options,
                         const ReferenceSurface* reference, const ReferenceSurface::Cover* cover,
                         Progress& progress) {
  FlightReport report;
  const std::vector<double> times = frameTimes(flight.durationSeconds(), options);
  progress.beginStage("flying", static_cast<int64_t>(times.size()), "frames");
  for (size_t i = 0; i < times.size(); ++i) {
    FlightFrame frame;
    frame.seconds = times[i];
    const Camera camera = cameraAt(flight, frame.seconds, options);
    TERRANE_ASSIGN(frame.cost, scene.drawFrame(camera));

    // Hold some pictures against the truth.
    if (reference != nullptr && static_cast<int64_t>(i) % std::max<int64_t>(options.referenceEvery, 1) == 0) {
      TERRANE_ASSIGN(const auto places, scene.places(camera));
      frame.error = measureError(*reference, camera, places, options.tauPixels);
      frame.cracks = measureCracks(*reference, camera, places, options.tauPixels);
      if (frame.error->maxPixels > report.error.maxPixels) report.worstErrorSeconds = frame.seconds;
      report.error.add(*frame.error);
      report.cracks.add(*frame.cracks);
    }
    report.frames.push_back(std::move(frame));
    progress.advance(1);
  }

  if (options.loadingViews > 0 && cover != nullptr) {
    progress.beginStage("loading", options.loadingViews, "views");
    for (int view = 0; view < options.loadingViews; ++view) {
      const double seconds = flight.durationSeconds() * (view + 0.5) / options.loadingViews;
      TERRANE_ASSIGN(const CrackMeasure cracks,
                     measureLoading(scene, cameraAt(flight, seconds, options), *cover, options.loadingMoments,
                                    options.seed + static_cast<uint64_t>(view), report.loadingPictures));
      report.loading.add(cracks);
      progress.advance(1);
    }
  }
  return report;
}

Result<CrackMeasure> measureLoading(FlightScene& scene, const Camera& camera,
                                    const ReferenceSurface::Cover& cover, int moments, uint64_t seed,
                                    int64_t& pictures) {
  CrackMeasure total;
  std::mt19937_64 random(seed);

  // Load once in full to learn how many tiles there are, then again, with pictures at some of the counts.
  TERRANE_TRY(scene.unload());
  std::vector<int64_t> pictureCounts;
  for (const bool counting : {true, false}) {
    TERRANE_TRY(scene.unload());
    int64_t loaded = 0;
    while (true) {
      const auto due = std::count(pictureCounts.begin(), pictureCounts.end(), loaded);
      if (!counting && due > 0) {
        TERRANE_ASSIGN(const auto places, scene.places(camera));
        total.add(measureCracksWhileLoading(cover, camera, places));
        ++pictures;
      }
      TERRANE_ASSIGN(const auto wishes, scene.wishes(camera));
      if (wishes.empty()) break;
      TERRANE_TRY(scene.load(wishes[random() % wishes.size()]));
      ++loaded;
    }

    // More moments early on, where each tile changes the most.
    if (!counting) break;
    for (int i = 0; i < moments; ++i) {
      const double share = static_cast<double>(random() % 1000001) / 1e6;
      pictureCounts.push_back(static_cast<int64_t>(share * share * static_cast<double>(loaded)));
    }
  }
  return total;
}

}  // namespace terrane
