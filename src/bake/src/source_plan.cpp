#include "source_plan.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "input_crs.h"
#include "warp.h"

namespace terrane {
namespace {

/// By so much a map may be longer than the ground before anybody is told: national grids stay far below.
constexpr double kUnseenStretch = 1.02;

constexpr double kSquareTolerance = 0.01;   // x against y spacing, of an input that is taken sample by sample
constexpr double kSpacingTolerance = 1e-6;  // its spacing against the lattice's
constexpr double kPlaceTolerance = 0.01;    // samples off the lattice
// A warped input's spacing is a rule of thumb: this much finer than the grid at hand is no reason for a
// level.
constexpr double kWarpSlack = 0.03;
constexpr double kLargestQuantum = 8388608.0;  // 2^23

// An input with its own spacing in the dataset's CRS.
struct Candidate {
  bool gridLike = false;  // could be taken sample by sample: same CRS, north up, nearly square
  double spacingX = 0.0;
  double spacingY = 0.0;
  double west = 0.0;  // gridLike: outermost samples, else: pixel edges
  double east = 0.0;
  double south = 0.0;
  double north = 0.0;
};

Candidate candidateFromGrid(const InputRaster& raster) {
  const auto& g = raster.geoTransform;
  const auto x = [&](double col) { return g[0] + col * g[1]; };
  const auto y = [&](double row) { return g[3] + row * g[5]; };
  const auto [west, east] = std::minmax({x(0.5), x(raster.width - 0.5)});
  const auto [south, north] = std::minmax({y(0.5), y(raster.height - 0.5)});
  return {true, std::abs(g[1]), std::abs(g[5]), west, east, south, north};
}

Result<Candidate> makeCandidate(const InputRaster& raster, const OGRSpatialReference& crs,
                                const std::string& wkt) {
  // A rotation that moves no sample by a hundredth is rounding.
  const auto& g = raster.geoTransform;
  const bool northUp = std::abs(g[2]) * raster.height < kPlaceTolerance * std::abs(g[1]) &&
                       std::abs(g[4]) * raster.width < kPlaceTolerance * std::abs(g[5]);
  const bool square =
      std::abs(g[1] / g[5]) > 1.0 - kSquareTolerance && std::abs(g[1] / g[5]) < 1.0 + kSquareTolerance;
  if (raster.hasGeoTransform && northUp && square && sameCrs(raster.crs, crs))
    return candidateFromGrid(raster);

  TERRANE_ASSIGN(const GdalDataset dataset, openRaster(raster.path));
  TERRANE_ASSIGN(const WarpPlan plan, planWarp(raster, *dataset, wkt));
  return Candidate{false, plan.spacing, plan.spacing, plan.west, plan.east, plan.south, plan.north};
}

// The finest level's lattice: a sample of it and its spacing.
struct SampleGrid {
  double spacingX = 1.0;
  double spacingY = 1.0;
  double anchorX = 0.0;
  double anchorY = 0.0;
  double col(double x) const { return (x - anchorX) / spacingX; }
  double row(double y) const { return (anchorY - y) / spacingY; }
};

// The finest input's own grid; where that one is warped, multiples of its spacing.
SampleGrid chooseGrid(const std::vector<Candidate>& candidates) {
  const Candidate* finestGrid = nullptr;
  const Candidate* finestWarped = nullptr;
  for (const auto& candidate : candidates) {
    const Candidate*& finest = candidate.gridLike ? finestGrid : finestWarped;
    if (finest == nullptr || candidate.spacingX < finest->spacingX * (1.0 - kSpacingTolerance))
      finest = &candidate;
  }
  if (finestGrid != nullptr &&
      (finestWarped == nullptr || finestWarped->spacingX > finestGrid->spacingX * (1.0 - kWarpSlack))) {
    return {finestGrid->spacingX, finestGrid->spacingY, finestGrid->west, finestGrid->north};
  }
  const double spacing = finestWarped->spacingX;
  return {spacing, spacing, std::ceil(finestWarped->west / spacing) * spacing,
          std::floor(finestWarped->north / spacing) * spacing};
}

// How a grid-like input falls on the grid.
struct GridFit {
  int coarser = 0;
  int64_t col = 0;  // of its north-western sample, finest samples from the anchor
  int64_t row = 0;
};

std::optional<GridFit> fitGrid(const Candidate& candidate, const SampleGrid& grid) {
  const double ratio = candidate.spacingX / grid.spacingX;
  const int coarser = static_cast<int>(std::lround(std::log2(ratio)));
  if (coarser < 0 || coarser > kMaxLevel) return std::nullopt;
  const double scale = std::ldexp(1.0, coarser);
  if (std::abs(ratio / scale - 1.0) > kSpacingTolerance) return std::nullopt;
  if (std::abs(candidate.spacingY / grid.spacingY / scale - 1.0) > kSpacingTolerance) return std::nullopt;

  // Both ends must meet samples.
  for (const double place : {grid.col(candidate.west), grid.col(candidate.east), grid.row(candidate.north),
                             grid.row(candidate.south)}) {
    if (std::abs(place - std::round(place)) > kPlaceTolerance) return std::nullopt;
  }
  return GridFit{coarser, std::llround(grid.col(candidate.west)), std::llround(grid.row(candidate.north))};
}

// The grid that the user asks for: of an input where one has that spacing, else on multiples of it.
Result<SampleGrid> gridOfSpacing(double spacing, const std::vector<Candidate>& candidates) {
  if (!(spacing > 0.0 && std::isfinite(spacing)))
    return makeError("--spacing {}: must be a distance in units of the dataset's CRS, above 0", spacing);
  const auto finest =
      std::min_element(candidates.begin(), candidates.end(),
                       [](const Candidate& a, const Candidate& b) { return a.spacingX < b.spacingX; });
  if (spacing < finest->spacingX * (1.0 - kWarpSlack)) {
    return makeError(
        "--spacing {:g}: the finest input has a sample every {:g} units of the dataset's CRS; closer ones "
        "would "
        "show nothing more. Give {:g} or more",
        spacing, finest->spacingX, finest->spacingX);
  }
  const auto same = [&](double other) { return std::abs(other / spacing - 1.0) <= kSpacingTolerance; };
  for (const Candidate& candidate : candidates) {
    if (candidate.gridLike && same(candidate.spacingX) && same(candidate.spacingY))
      return SampleGrid{candidate.spacingX, candidate.spacingY, candidate.west, candidate.north};
  }
  return SampleGrid{spacing, spacing, std::ceil(finest->west / spacing) * spacing,
                    std::floor(finest->north / spacing) * spacing};
}

int64_t floorMod(int64_t a, int64_t b) {
  return ((a % b) + b) % b;
}

// The height step, as a share of the bound, where samples may be left to interpolation (significance.h). A
// finer step costs bits for each sample that is coded, a coarser one leaves fewer to interpolation; the more
// the bound allows, the more that counts. docs/decisions/0031-step-of-a-bounded-dataset.md has the figures.
double stepShare(double boundInSpacings) {
  if (boundInSpacings >= 0.2) return 1.25;
  return boundInSpacings >= 0.1 ? 1.5 : 2.0;
}
// Below this bound nearly every sample has to be coded, and saying which costs more than leaving out the
// rest.
constexpr double kInterpolatesFrom = 0.01;

// Chooses the height step, the offset and the stated bound.
Status chooseHeights(PlacedSource& source, const SourceOptions& options) {
  SourcePlan& plan = source.plan;
  const InputRaster& first = source.inputs.front().raster;
  const PlacedInput* obstacle = nullptr;
  const char* why = "";
  for (const auto& input : source.inputs) {
    const InputRaster& raster = input.raster;
    if (!raster.integer)
      why = "its values are not integers";
    else if (input.warped)
      why = "it has to be warped onto the dataset's grid";
    else if (raster.heightScale != first.heightScale || raster.heightOffset != first.heightOffset)
      why = "its scale, offset or unit differs from the first input's";
    else
      continue;
    obstacle = &input;
    break;
  }
  if (options.lossless && options.maxErrorMeters) {
    return makeError("--lossless and --max-error exclude each other; give one of them");
  }
  if (options.lossless && obstacle != nullptr) {
    return makeError("--lossless: not possible, {}: {}; leave it away or give --max-error METRES",
                     obstacle->raster.path, why);
  }

  // Lossless: the integers themselves.
  if (obstacle == nullptr && !options.maxErrorMeters) {
    plan.heightStep = std::abs(first.heightScale);
    plan.heightOffset = first.heightOffset;
    plan.maxErrorMeters = 0.0;
    source.largestHeight = kLargestQuantum * plan.heightStep;
    return {};
  }

  const double spacing = std::min(plan.frame.spacingXMeters(), plan.frame.spacingYMeters());
  // What nobody asked for is neither finer than drones measure nor coarser than hills are high.
  constexpr double kFinestUsual = 0.002, kCoarsestUsual = 5.0;
  const double bound =
      options.maxErrorMeters.value_or(std::clamp(spacing / 200.0, kFinestUsual, kCoarsestUsual));
  constexpr double kLargestBound = 1e5;
  if (!(bound > 0.0 && bound <= kLargestBound)) {
    return makeError(
        "--max-error {}: must be a positive number of metres, {:g} at most (--lossless keeps integer sources "
        "exactly)",
        bound, kLargestBound);
  }
  // Heights are floats: rounding may take half of a float's step, which is held back from the bound. It pays
  // for heights up to 32 km where that costs little, else up to 16 km, else as far as an eighth of the bound
  // reaches.
  const double far = std::max(std::ldexp(1.0, -10), bound / 1024.0);
  const double rounding = far <= bound / 64.0 ? far : std::min(std::ldexp(1.0, -11), bound / 8.0);
  const auto native = [&](const PlacedInput& input) {
    return input.nativeLevel == source.inputs.front().nativeLevel;
  };
  plan.interpolates =
      bound >= kInterpolatesFrom * spacing && std::all_of(source.inputs.begin(), source.inputs.end(), native);
  const double share = plan.interpolates ? stepShare(bound / spacing) : 2.0;
  plan.heightStep = share < 2.0 ? share * bound : 2.0 * (bound - rounding);
  plan.heightOffset = 0.0;
  plan.maxErrorMeters = bound;
  source.largestHeight =
      std::min(std::exp2(std::floor(std::log2(rounding) + 25.0)), (kLargestQuantum - 1.0) * plan.heightStep);
  return {};
}

// What the manifest will say of an input.
InputRecord recordOf(const PlacedInput& input) {
  const InputRaster& raster = input.raster;
  return {.name = raster.name,
          .bytes = raster.bytes,
          .sha256 = {},
          .width = raster.width,
          .height = raster.height,
          .dataType = GDALGetDataTypeName(raster.type),
          .sourceCrs = crsWkt(raster.crs),
          .warped = input.warped,
          .resampling = input.warped ? input.kernel.resampling : "",
          .nativeLevel = input.nativeLevel,
          .noData = raster.voidText()};
}

// Sample by sample at a level's spacing; the raster may run against the lattice.
PlacedInput placeFitting(InputRaster raster, int64_t col, int64_t row) {
  PlacedInput placed;
  placed.firstCol = col;
  placed.firstRow = row;
  placed.cols = raster.width;
  placed.rows = raster.height;
  placed.mirroredX = raster.geoTransform[1] < 0.0;
  placed.mirroredY = raster.geoTransform[5] > 0.0;
  placed.raster = std::move(raster);
  return placed;
}

// Where an input's samples fall on a dataset's, or why they do not.
Result<GridFit> fitDataset(const InputRaster& raster, const Manifest& base, const OGRSpatialReference& crs) {
  if (!raster.hasGeoTransform || !sameCrs(raster.crs, crs))
    return makeError("it is not in the dataset's CRS ({}) and would have to be warped", base.crsName);
  TERRANE_ASSIGN(const Candidate candidate, makeCandidate(raster, crs, base.crsWkt));
  if (!candidate.gridLike) return makeError("its grid is turned or not square and would have to be warped");
  const Frame& frame = base.frame;
  const SampleGrid grid{frame.spacingX, frame.spacingY, frame.originEasting, frame.originNorthing};
  const auto same = [](double a, double b) { return std::abs(a / b - 1.0) <= kSpacingTolerance; };
  if (!same(candidate.spacingX, frame.spacingX) || !same(candidate.spacingY, frame.spacingY)) {
    return makeError("its samples are {:g} x {:g} apart, the dataset's {:g} x {:g}", candidate.spacingX,
                     candidate.spacingY, frame.spacingX, frame.spacingY);
  }
  const auto fit = fitGrid(candidate, grid);
  if (!fit) return makeError("its samples lie between the dataset's and would have to be warped");

  // The world is as large as it is.
  if (fit->col < 0 || fit->row < 0)
    return makeError("it reaches beyond the dataset's {} edge", fit->row < 0 ? "northern" : "western");
  const int64_t world = (int64_t{kTileCells} << frame.finestLevel) + 1;
  if (fit->col + raster.width > world || fit->row + raster.height > world) {
    return makeError("it reaches beyond the {} x {} samples that the dataset's {} levels have room for",
                     world, world, frame.finestLevel + 1);
  }
  return *fit;
}

}  // namespace

std::array<double, 6> PlacedSource::geoTransform(int level) const {
  const Frame& frame = plan.frame;
  const double x = std::ldexp(frame.spacingX, frame.finestLevel - level);
  const double y = std::ldexp(frame.spacingY, frame.finestLevel - level);
  return {frame.originEasting - 0.5 * x, x, 0.0, frame.originNorthing + 0.5 * y, 0.0, -y};
}

Result<PlacedSource> placeInputs(std::vector<InputRaster> inputs, const SourceOptions& options,
                                 Progress& progress) {
  PlacedSource source;
  SourcePlan& plan = source.plan;
  TERRANE_ASSIGN(const OGRSpatialReference crs, chooseCrs(options.crs, inputs));
  plan.crsWkt = crsWkt(crs);
  plan.crsName = crsDisplayName(crs);
  plan.frame.metersPerUnit = crs.GetLinearUnits();
  if (!(plan.frame.metersPerUnit > 0.0))
    return makeError("{}: a CRS without a unit of length; pass --crs", plan.crsName);

  // Every input's own extent and spacing in that CRS.
  progress.beginStage("placing inputs", static_cast<int64_t>(inputs.size()), "files");
  std::vector<Candidate> candidates(inputs.size());
  std::vector<std::string> errors(inputs.size());
  tbb::parallel_for(size_t{0}, inputs.size(), [&](size_t i) {
    auto candidate = makeCandidate(inputs[i], crs, plan.crsWkt);
    if (candidate.ok())
      candidates[i] = *candidate;
    else
      errors[i] = candidate.error().message;
    progress.advance(1);
  });
  for (const auto& error : errors) {
    if (!error.empty()) return Error{error};
  }
  SampleGrid grid;
  if (options.spacing) {
    TERRANE_ASSIGN(grid, gridOfSpacing(*options.spacing, candidates));
  } else {
    grid = chooseGrid(candidates);
  }
  plan.frame.spacingX = grid.spacingX;
  plan.frame.spacingY = grid.spacingY;

  // Who fits sample by sample. The coarsest of them decide on which samples the coarse levels' lie.
  std::vector<std::optional<GridFit>> fits(inputs.size());
  std::vector<size_t> coarsestFirst;
  for (size_t i = 0; i < inputs.size(); ++i) {
    if (candidates[i].gridLike) fits[i] = fitGrid(candidates[i], grid);
    if (fits[i]) coarsestFirst.push_back(i);
  }
  std::stable_sort(coarsestFirst.begin(), coarsestFirst.end(),
                   [&](size_t a, size_t b) { return fits[a]->coarser > fits[b]->coarser; });
  int64_t phaseCol = 0;
  int64_t phaseRow = 0;
  int64_t phaseStep = 1;
  if (!coarsestFirst.empty()) {
    const GridFit& coarsest = *fits[coarsestFirst.front()];
    phaseStep = int64_t{1} << coarsest.coarser;
    phaseCol = floorMod(coarsest.col, phaseStep);
    phaseRow = floorMod(coarsest.row, phaseStep);
  }
  for (const size_t i : coarsestFirst) {
    const int64_t step = int64_t{1} << fits[i]->coarser;
    if (floorMod(fits[i]->col - phaseCol, step) != 0 || floorMod(fits[i]->row - phaseRow, step) != 0)
      fits[i].reset();
  }

  // Whoever does not fit is warped, by its own transform where it is in the dataset's CRS already.
  for (size_t i = 0; i < inputs.size(); ++i) {
    if (!candidates[i].gridLike || fits[i]) continue;
    Candidate& candidate = candidates[i];
    candidate.gridLike = false;
    candidate.west -= 0.5 * candidate.spacingX;
    candidate.east += 0.5 * candidate.spacingX;
    candidate.south -= 0.5 * candidate.spacingY;
    candidate.north += 0.5 * candidate.spacingY;
    candidate.spacingX = std::min(candidate.spacingX, candidate.spacingY);
  }

  // The union's north-western sample is the world's corner.
  constexpr double kEdge = 1e-6;
  int64_t originCol = std::numeric_limits<int64_t>::max();
  int64_t originRow = std::numeric_limits<int64_t>::max();
  for (size_t i = 0; i < inputs.size(); ++i) {
    const auto& candidate = candidates[i];
    const double col =
        fits[i] ? static_cast<double>(fits[i]->col) : std::ceil(grid.col(candidate.west) - kEdge);
    const double row =
        fits[i] ? static_cast<double>(fits[i]->row) : std::ceil(grid.row(candidate.north) - kEdge);
    if (!(std::abs(col) < 4e9) || !(std::abs(row) < 4e9)) {
      return makeError("{}: lies too far from the others for their spacing; build it apart", inputs[i].path);
    }
    originCol = std::min(originCol, static_cast<int64_t>(col));
    originRow = std::min(originRow, static_cast<int64_t>(row));
  }
  originCol -= floorMod(originCol - phaseCol, phaseStep);
  originRow -= floorMod(originRow - phaseRow, phaseStep);
  plan.frame.originEasting = grid.anchorX + static_cast<double>(originCol) * grid.spacingX;
  plan.frame.originNorthing = grid.anchorY - static_cast<double>(originRow) * grid.spacingY;

  // Every input's rectangle on its native level.
  int deepest = 0;
  for (size_t i = 0; i < inputs.size(); ++i) {
    const auto& candidate = candidates[i];
    PlacedInput placed;
    if (fits[i]) {
      const int coarser = fits[i]->coarser;
      placed = placeFitting(std::move(inputs[i]), (fits[i]->col - originCol) >> coarser,
                            (fits[i]->row - originRow) >> coarser);
      placed.coarser = coarser;
    } else {
      placed.warped = true;
      const double ratio = candidate.spacingX / std::min(grid.spacingX, grid.spacingY);
      placed.coarser =
          std::clamp(static_cast<int>(std::floor(std::log2(ratio * (1.0 + kWarpSlack)))), 0, kMaxLevel);
      const double scale = std::ldexp(1.0, placed.coarser);
      const auto first = [&](double place, int64_t origin) {
        return std::max<int64_t>(
            0, static_cast<int64_t>(std::ceil((place - static_cast<double>(origin)) / scale - kEdge)));
      };
      const auto end = [&](double place, int64_t origin) {
        return static_cast<int64_t>(std::floor((place - static_cast<double>(origin)) / scale + kEdge)) + 1;
      };
      placed.kernel =
          planKernel(options.resampling,
                     {candidate.west, candidate.east, candidate.south, candidate.north, candidate.spacingX},
                     inputs[i], grid.spacingX, grid.spacingY);
      placed.firstCol = first(grid.col(candidate.west), originCol);
      placed.firstRow = first(grid.row(candidate.north), originRow);
      placed.cols = std::max<int64_t>(0, end(grid.col(candidate.east), originCol) - placed.firstCol);
      placed.rows = std::max<int64_t>(0, end(grid.row(candidate.south), originRow) - placed.firstRow);
    }
    if (placed.cols > 0 && placed.rows > 0) {
      plan.extentCols =
          std::max(plan.extentCols, ((placed.firstCol + placed.cols - 1) << placed.coarser) + 1);
      plan.extentRows =
          std::max(plan.extentRows, ((placed.firstRow + placed.rows - 1) << placed.coarser) + 1);
    }
    deepest = std::max(deepest, placed.coarser);
    if (!fits[i]) placed.raster = std::move(inputs[i]);
    source.inputs.push_back(std::move(placed));
  }
  if (plan.extentCols < 2 || plan.extentRows < 2) {
    return makeError("{}: too small, {} x {} samples on the dataset's grid; needs at least 2 x 2",
                     source.inputs.front().raster.path, plan.extentCols, plan.extentRows);
  }

  const auto stretch =
      stretchAt(crs, plan.frame.originEasting + 0.5 * static_cast<double>(plan.extentCols) * grid.spacingX,
                plan.frame.originNorthing - 0.5 * static_cast<double>(plan.extentRows) * grid.spacingY);
  const double most = stretch ? std::max(stretch->east, stretch->north) : 1.0;
  const double least = stretch ? std::min(stretch->east, stretch->north) : 1.0;
  if (most > kUnseenStretch || least < 1.0 / kUnseenStretch) {
    progress.warn(fmt::format(
        "{}: shows distances in the middle of this ground {} times as long as they are; slopes and lengths "
        "will be wrong by as much. --crs with a projection made for the place (a UTM zone) keeps them",
        plan.crsName,
        most - least < 0.01 * most ? fmt::format("{:.3g}", most)
                                   : fmt::format("{:.3g} to {:.3g}", least, most)));
  }

  // The smallest world that holds them all, with a level for the coarsest.
  int level = deepest;
  while (level <= kMaxLevel &&
         (static_cast<int64_t>(kTileCells) << level) < std::max(plan.extentCols, plan.extentRows) - 1)
    ++level;
  if (level > kMaxLevel) {
    return makeError(
        "{} x {} samples of {:g} units are more than a dataset holds; build fewer inputs, or leave out the "
        "one "
        "that lies far off or is much finer",
        plan.extentCols, plan.extentRows, plan.frame.spacingX);
  }
  plan.frame.finestLevel = level;
  for (auto& input : source.inputs) input.nativeLevel = level - input.coarser;

  TERRANE_TRY(chooseHeights(source, options));
  for (const auto& input : source.inputs) {
    const InputRaster& raster = input.raster;
    if (plan.verticalDatum.empty()) plan.verticalDatum = raster.verticalDatum;
    plan.inputs.push_back(recordOf(input));
  }
  return source;
}

Result<PlacedSource> placeOnto(std::vector<InputRaster> inputs, const Manifest& base,
                               const std::string& directory) {
  PlacedSource source;
  SourcePlan& plan = source.plan;
  plan.crsWkt = base.crsWkt;
  plan.crsName = base.crsName;
  plan.frame = base.frame;
  plan.extentCols = base.extentCols;
  plan.extentRows = base.extentRows;
  plan.heightStep = base.scale.heightStep;
  plan.heightOffset = base.scale.heightOffset;
  plan.verticalDatum = base.verticalDatum;
  source.largestHeight = kLargestQuantum * plan.heightStep;
  TERRANE_ASSIGN(const OGRSpatialReference crs, crsFromUser(base.crsWkt, directory + ": the dataset's CRS"));

  for (InputRaster& raster : inputs) {
    const auto refused = [&](const std::string& why) {
      return makeError("{}: cannot be appended to {}: {}; build the dataset anew, from all of its inputs",
                       raster.path, directory, why);
    };
    const auto fit = fitDataset(raster, base, crs);
    if (!fit.ok()) return refused(fit.error().message);
    if (!raster.integer) return refused("its values are not integers, which the dataset keeps exactly");
    if (raster.heightScale != plan.heightStep || raster.heightOffset != plan.heightOffset) {
      return refused(
          fmt::format("its heights are steps of {:g} m from {:g} m, the dataset's of {:g} m from {:g} m",
                      raster.heightScale, raster.heightOffset, plan.heightStep, plan.heightOffset));
    }
    PlacedInput placed = placeFitting(std::move(raster), fit->col, fit->row);
    placed.nativeLevel = plan.frame.finestLevel;
    plan.extentCols = std::max(plan.extentCols, placed.firstCol + placed.cols);
    plan.extentRows = std::max(plan.extentRows, placed.firstRow + placed.rows);
    if (plan.verticalDatum.empty()) plan.verticalDatum = placed.raster.verticalDatum;
    plan.inputs.push_back(recordOf(placed));
    source.inputs.push_back(std::move(placed));
  }
  return source;
}

}  // namespace terrane
