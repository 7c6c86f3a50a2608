#include "metrology/reconstruction/shape_problem.h"

#include <algorithm>
#include <cmath>

#include "metrology/parallel/loops.h"
#include "metrology/reconstruction/smooth_step.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kDatumPull = 10;     // on a square millimetre of datum, beside 1 of fixed surface
constexpr double kBesidePatches = 4;  // so near a machined place, the blank's fixed surface is beside the cut
constexpr double kAnySide = -2;       // cosine
constexpr double kUncut = 0.25;       // of the strip beside fixed surface: there the shape is the blank's own
constexpr double kRimSpacings =
    3;  // spacings of the design's places: so far from what is cut, fixed surface is not next to it

}  // namespace

ShapeProblem::ShapeProblem(const DesignPlaces& design, const std::vector<BlankPatch>& blank,
                           const std::vector<ShapeRegion>& regions, std::vector<std::uint8_t> region_of,
                           const ReconstructionOptions& options)
    : design_(design),
      blank_(blank),
      measured_count_(blank.size()),
      regions_(regions),
      region_of_(std::move(region_of)),
      options_(options),
      fixed_places_(std::max(options.blend_mm, design.spacing_mm)),
      machined_places_(kBesidePatches * options.patch_mm) {
  PlaceGrid rim(kRimSpacings * design.spacing_mm);
  for (std::size_t i = 0; i < design_.places.size(); ++i) {
    if (regions_[region_of_[i]].kind != RegionKind::kMachined) continue;
    machined_places_.Add(design_.places[i].point_mm, design_.places[i].normal);
    rim.Add(design_.places[i].point_mm, design_.places[i].normal);
  }
  for (std::size_t i = 0; i < design_.places.size(); ++i) {
    const DesignPlace& place = design_.places[i];
    if (regions_[region_of_[i]].kind == RegionKind::kFixed && rim.Has(place.point_mm, place.normal, kAnySide))
      fixed_places_.Add(place.point_mm, place.normal);
  }
  Resize();
}

ControlLattice ShapeProblem::LatticeOf(double spacing_mm) const {
  const Vector3d reach = Vector3d::Constant(options_.reach_mm);
  const Vector3d least_mm = design_.surface->minimum_mm() - reach, most_mm = design_.surface->maximum_mm() + reach;
  ControlLattice lattice;
  lattice.spacing_mm.setConstant(spacing_mm);
  for (int axis = 0; axis < 3; ++axis)
    lattice.cells[static_cast<std::size_t>(axis)] =
        std::max(1, static_cast<int>(std::ceil((most_mm[axis] - least_mm[axis]) / spacing_mm)));
  const Vector3d size_mm = spacing_mm * Vector3d(lattice.cells[0], lattice.cells[1], lattice.cells[2]);
  lattice.corner_mm = (least_mm + most_mm - size_mm) / 2;
  return lattice;
}

std::vector<std::uint8_t> ShapeProblem::CoveredOf(const ControlLattice& lattice) const {
  std::vector<std::uint8_t> covered(lattice.cell_count(), 0);
  const double reach_mm = options_.reach_mm;
  for (const DesignPlace& place : design_.places) {
    std::array<int, 3> first = {}, last = {};
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      const double at = place.point_mm[axis] - lattice.corner_mm[axis], h = lattice.spacing_mm[axis];
      first[a] = std::clamp(static_cast<int>(std::floor((at - reach_mm) / h)), 0, lattice.cells[a] - 1);
      last[a] = std::clamp(static_cast<int>(std::floor((at + reach_mm) / h)), 0, lattice.cells[a] - 1);
    }
    for (int x = first[0]; x <= last[0]; ++x)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int z = first[2]; z <= last[2]; ++z) covered[lattice.CellIndex(x, y, z)] = 1;
  }
  return covered;
}

std::vector<LatticePull> ShapeProblem::Pulls(const FreeFormDeformation& still, const PullWeights& weights) const {
  std::vector<LatticePull> pulls;
  const double area_mm2 = options_.patch_mm * options_.patch_mm;
  for (std::size_t j = 0; j < measured_count_; ++j) {
    const std::optional<SurfaceFoot>& foot = look_.feet[j] ? look_.feet[j] : first_feet_[j];
    const double weight = Is(j, RegionKind::kMachined) ? weights.machined
                          : !Is(j, RegionKind::kFixed) ? 0
                          : about_machined_[j]         ? weights.beside
                                                       : 1;
    if (!(weight > 0) || !foot) continue;
    if (const auto at = still.WeightsAt(foot->place_mm))
      pulls.push_back(
          {*at, weight * area_mm2, foot->displacement_mm + foot->distance_mm * foot->normal, foot->normal, true});
  }
  for (std::size_t i = 0; i < design_.places.size(); ++i) {
    if (regions_[region_of_[i]].kind != RegionKind::kDatum) continue;
    if (const auto at = still.WeightsAt(design_.places[i].point_mm))
      pulls.push_back({*at, kDatumPull * design_.places[i].area_mm2});
  }
  return pulls;
}

ShapeProblem::Wanted ShapeProblem::WantedAt(const SurfaceFoot& foot, const ShapeRegion& region,
                                            double standard_uncertainty_mm) const {
  double cut_part = 1;
  if (options_.blend_mm > 0) {
    const double from_fixed_mm = fixed_places_.Nearest(foot.place_mm, foot.design_normal, 0);
    cut_part = SmoothStep((from_fixed_mm / options_.blend_mm - kUncut) / (1 - kUncut));
  }
  const double guard_mm = options_.coverage_factor * standard_uncertainty_mm;
  // What is not cut is the blank's own surface, as far as it is known.
  return {cut_part, cut_part * (region.allowance_mm + guard_mm) - (1 - cut_part) * guard_mm};
}

std::vector<DisplacementLimit> ShapeProblem::Limits(const FreeFormDeformation& still, double margin_mm) const {
  std::vector<DisplacementLimit> limits(design_.places.size() + 2 * blank_.size());
  const LatticeWeights anywhere = *still.WeightsAt(design_.places[0].point_mm);
  const auto band_limit = [&](const DisplacedPlace& band, const ShapeRegion& region, DisplacementLimit* limit) {
    limit->direction = band.direction;
    const double now_mm = band.direction.dot(band.displacement_mm) - band.off_mm;
    if (region.kind == RegionKind::kDatum) {
      limit->least_kind = limit->most_kind = LimitKind::kDatum;
      limit->least_mm = now_mm - options_.datum_within_mm + margin_mm / 2;
      limit->most_mm = now_mm + options_.datum_within_mm - margin_mm / 2;
      return;
    }
    limit->least_mm = now_mm + region.lower_mm + margin_mm;
    limit->most_mm = now_mm + region.upper_mm - margin_mm;
  };
  ForEachChunk(design_.places.size(), kChunk, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      limits[i].at = still.WeightsAt(design_.places[i].point_mm).value_or(anywhere);
      band_limit(look_.bands[i], regions_[region_of_[i]], &limits[i]);
    }
  });
  for (std::size_t j = 0; j < blank_.size(); ++j) {
    DisplacementLimit& own = limits[PatchLimit(j)];
    DisplacementLimit& band = limits[BandLimit(j)];
    own.at = band.at = anywhere;
    const bool is_fixed = Is(j, RegionKind::kFixed);
    const std::optional<SurfaceFoot>& foot = look_.feet[j] || !is_fixed ? look_.feet[j] : first_feet_[j];
    if (!foot || look_.region_of_patch[j] == regions_.size()) continue;
    const auto at = still.WeightsAt(foot->place_mm);
    if (!at) continue;
    own.at = band.at = *at;
    own.direction = foot->normal;
    const ShapeRegion& region = regions_[look_.region_of_patch[j]];
    // Along the shape's own normal there, so that one that slides along the wall meets its waves as they are.
    const double whole_mm = foot->distance_mm + foot->normal.dot(foot->displacement_mm);
    if (is_fixed) {
      own.least_kind = own.most_kind = LimitKind::kFixed;
      const double tube_mm = margin_mm > 0 ? Tube_mm(j) - std::min(margin_mm / 2, Tube_mm(j) / 4) : DoubtedTube_mm(j);
      own.least_mm = whole_mm - tube_mm;
      own.most_mm = whole_mm + tube_mm;
      band.direction = foot->design_normal;
      band.least_mm = region.lower_mm + margin_mm;
      band.most_mm = region.upper_mm - margin_mm;
    } else if (region.kind == RegionKind::kMachined) {
      own.most_kind = LimitKind::kStock;
      own.most_mm = whole_mm - look_.wanted_mm[j] - look_.cut_part[j] * margin_mm;
      band_limit(look_.patch_bands[j], region, &band);
    }
  }
  return limits;
}

ShapeMisses ShapeProblem::Misses() const {
  ShapeMisses misses;
  const auto take = [&](LimitKind kind, double missed_mm, std::size_t region) {
    const auto k = static_cast<std::size_t>(kind);
    if (!(missed_mm > misses.missed_mm[k])) return;
    misses.missed_mm[k] = missed_mm;
    misses.region[k] = region;
  };
  for (std::size_t i = 0; i < look_.bands.size(); ++i) {
    const ShapeRegion& region = regions_[region_of_[i]];
    const double off_mm = look_.bands[i].off_mm;
    if (region.kind == RegionKind::kDatum)
      take(LimitKind::kDatum, std::abs(off_mm) - options_.datum_within_mm, region_of_[i]);
    else
      take(LimitKind::kTolerance, std::max(region.lower_mm - off_mm, off_mm - region.upper_mm), region_of_[i]);
  }
  for (std::size_t j = 0; j < blank_.size(); ++j) {
    if (!look_.feet[j]) {
      misses.lost_count += look_.region_of_patch[j] == regions_.size() || Is(j, RegionKind::kMachined);
      continue;
    }
    const double distance_mm = look_.feet[j]->distance_mm;
    if (Is(j, RegionKind::kFixed))
      take(LimitKind::kFixed, std::abs(distance_mm) - Tube_mm(j), look_.region_of_patch[j]);
    else if (Is(j, RegionKind::kMachined))
      take(LimitKind::kStock, look_.wanted_mm[j] - distance_mm, look_.region_of_patch[j]);
  }
  return misses;
}

double ShapeProblem::GreatestBand_mm() const {
  double greatest_mm = 0;
  for (const ShapeRegion& region : regions_)
    if (region.kind != RegionKind::kDatum)
      greatest_mm = std::max({greatest_mm, std::abs(region.lower_mm), std::abs(region.upper_mm)});
  return greatest_mm;
}

}  // namespace sixpoint::metrology
