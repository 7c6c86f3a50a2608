// What a deformation makes of each region, and where its own limits contradict.
#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/linear_algebra/least_squares.h"
#include "metrology/reconstruction/shape_problem.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kSlopePatches = 3;  // so many patches' widths about one its slope is taken
constexpr std::size_t kLeastForSlope = 6;
constexpr double kNarrower = 0.75;  // than what is left about a kink

}  // namespace

HoldingPlace ShapeProblem::PlaceOf(std::size_t limit, bool most, const std::vector<DisplacementLimit>& limits) const {
  HoldingPlace holding;
  holding.most = most;
  holding.kind = most ? limits[limit].most_kind : limits[limit].least_kind;
  holding.limit_mm = most ? limits[limit].most_mm : limits[limit].least_mm;
  if (limit < design_.places.size()) {
    holding.place_mm = design_.places[limit].point_mm;
    holding.normal = design_.places[limit].normal;
    holding.region = region_of_[limit];
    return holding;
  }
  const std::size_t patch = (limit - design_.places.size()) / 2;
  const std::optional<SurfaceFoot>& foot = look_.feet[patch] ? look_.feet[patch] : first_feet_[patch];
  if (patch < measured_count_) holding.patch = patch;
  holding.region = look_.region_of_patch[patch];
  if (foot) {
    holding.place_mm = foot->place_mm;
    holding.normal = foot->design_normal;
  }
  return holding;
}

std::vector<std::pair<double, std::size_t>> ShapeProblem::Contradictions() const {
  std::vector<std::pair<double, std::size_t>> found;
  for (std::size_t j = 0; j < measured_count_; ++j) {
    if (!look_.feet[j] || look_.region_of_patch[j] == regions_.size()) continue;
    const ShapeRegion& region = regions_[look_.region_of_patch[j]];
    const double distance_mm = look_.feet[j]->distance_mm;
    double lacking_mm = 0;
    if (region.kind == RegionKind::kMachined)
      lacking_mm = region.lower_mm - (distance_mm - look_.wanted_mm[j]);
    else if (region.kind == RegionKind::kFixed)
      lacking_mm = std::max(distance_mm - region.upper_mm, region.lower_mm - distance_mm) - DoubtedTube_mm(j);
    if (lacking_mm > 0) found.emplace_back(lacking_mm, j);
  }
  std::sort(found.begin(), found.end(), [](const auto& one, const auto& other) {
    return one.first != other.first ? one.first > other.first : one.second < other.second;
  });
  return found;
}

std::vector<RegionFinding> ShapeProblem::Findings() const {
  std::vector<RegionFinding> findings(regions_.size());
  PlaceGrid seen(options_.patch_mm);
  for (std::size_t j = 0; j < measured_count_; ++j) {
    if (!look_.feet[j]) continue;
    seen.Add(look_.feet[j]->place_mm, look_.feet[j]->design_normal);
    if (look_.region_of_patch[j] == regions_.size()) continue;
    RegionFinding& finding = findings[look_.region_of_patch[j]];
    const double distance_mm = look_.feet[j]->distance_mm;
    ++finding.patch_count;
    if (Is(j, RegionKind::kMachined)) {
      finding.least_allowance_mm = std::min(finding.least_allowance_mm.value_or(distance_mm), distance_mm);
      const double spare_mm = distance_mm - look_.wanted_mm[j];
      finding.least_spare_mm = std::min(finding.least_spare_mm.value_or(spare_mm), spare_mm);
    } else if (Is(j, RegionKind::kFixed)) {
      finding.worst_fixed_mm = std::max(finding.worst_fixed_mm.value_or(0), std::abs(distance_mm));
    }
  }
  for (std::size_t i = 0; i < design_.places.size(); ++i) {
    const DesignPlace& place = design_.places[i];
    const ShapeRegion& region = regions_[region_of_[i]];
    RegionFinding& finding = findings[region_of_[i]];
    finding.area_mm2 += place.area_mm2;
    if (seen.Has(place.point_mm, place.normal, kSameWallCosine)) finding.seen_part += place.area_mm2;
    const double off_mm = look_.bands[i].off_mm;
    if (region.kind == RegionKind::kDatum) {
      finding.worst_datum_mm = std::max(finding.worst_datum_mm, std::abs(off_mm));
      continue;
    }
    // Limits of one sign have the middle of their band as where nothing is used.
    const double middle_mm = region.lower_mm < 0 && region.upper_mm > 0 ? 0 : (region.lower_mm + region.upper_mm) / 2;
    const double use = off_mm > middle_mm ? (off_mm - middle_mm) / (region.upper_mm - middle_mm)
                                          : (middle_mm - off_mm) / (middle_mm - region.lower_mm);
    finding.greatest_band_use = std::max(finding.greatest_band_use, use);
  }
  for (RegionFinding& finding : findings)
    if (finding.area_mm2 > 0) finding.seen_part /= finding.area_mm2;
  return findings;
}

ShapeProblem::FixedFeet ShapeProblem::FeetOfFixed() const {
  FixedFeet fixed{PlaceGrid(kSlopePatches * options_.patch_mm), {}};
  for (std::size_t j = 0; j < measured_count_; ++j) {
    if (!Is(j, RegionKind::kFixed) || !look_.feet[j]) continue;
    fixed.patch_of.push_back(j);
    fixed.grid.Add(look_.feet[j]->place_mm, look_.feet[j]->normal);
  }
  return fixed;
}

std::optional<double> ShapeProblem::SlopeAt(std::size_t patch, const FixedFeet& fixed) const {
  const SurfaceFoot& foot = *look_.feet[patch];
  const Vector3d one = foot.normal.unitOrthogonal(), other = foot.normal.cross(one);
  std::vector<std::array<double, 3>> rows;
  std::vector<double> rest_mm;
  fixed.grid.EachNear(foot.place_mm, foot.normal, kSameWallCosine,
                      [&](std::size_t k, const Vector3d& place_mm, double) {
                        const Vector3d from_mm = place_mm - foot.place_mm;
                        rows.push_back({1, one.dot(from_mm), other.dot(from_mm)});
                        rest_mm.push_back(look_.feet[fixed.patch_of[k]]->distance_mm);
                      });
  // A line of them holds no slope across.
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const auto& row : rows) middle += Eigen::Vector2d(row[1], row[2]) / static_cast<double>(rows.size());
  for (const auto& row : rows) {
    const Eigen::Vector2d from = Eigen::Vector2d(row[1], row[2]) - middle;
    spread += from * from.transpose() / static_cast<double>(rows.size());
  }
  const double mean = spread.trace() / 2, apart = std::sqrt(std::max(0.0, mean * mean - spread.determinant()));
  if (rows.size() < kLeastForSlope || !(mean - apart > 0.3 * options_.patch_mm * options_.patch_mm))
    return std::nullopt;
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t k = 0; k < rows.size(); ++k)
    matrix.row(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::RowVector3d>(rows[k].data());
  const Eigen::Map<const Eigen::VectorXd> right(rest_mm.data(), static_cast<Eigen::Index>(rest_mm.size()));
  const Eigen::VectorXd plane = LeastSquares(matrix, right);
  return std::atan(std::hypot(plane[1], plane[2]));
}

ShapeTransition ShapeProblem::Transition() const {
  ShapeTransition transition;
  const FixedFeet fixed = FeetOfFixed();
  for (const std::size_t j : fixed.patch_of) {
    if (!about_machined_[j]) continue;
    transition.step_mm = std::max(transition.step_mm, std::abs(look_.feet[j]->distance_mm));
    const std::optional<double> slope_rad = SlopeAt(j, fixed);
    if (slope_rad.value_or(0) > transition.kink_rad) {
      transition.kink_rad = *slope_rad;
      transition.kink_region = look_.region_of_patch[j];
    }
  }
  return transition;
}

bool ShapeProblem::NarrowAtKinks(double most_rad) {
  const FixedFeet fixed = FeetOfFixed();
  bool kinks = false;
  std::vector<double> narrowed_mm = narrowed_mm_;
  narrowed_mm.resize(measured_count_, std::numeric_limits<double>::infinity());
  for (const std::size_t j : fixed.patch_of) {
    if (!about_machined_[j] || !(SlopeAt(j, fixed).value_or(0) > most_rad)) continue;
    kinks = true;
    std::vector<std::size_t> about;
    double widest_mm = 0;
    fixed.grid.EachNear(look_.feet[j]->place_mm, look_.feet[j]->normal, kSameWallCosine,
                        [&](std::size_t k, const Vector3d&, double) {
                          about.push_back(fixed.patch_of[k]);
                          widest_mm = std::max(widest_mm, std::abs(look_.feet[about.back()]->distance_mm));
                        });
    for (const std::size_t k : about) narrowed_mm[k] = std::min(narrowed_mm[k], kNarrower * widest_mm);
  }
  if (kinks) narrowed_mm_ = std::move(narrowed_mm);
  return kinks;
}

}  // namespace sixpoint::metrology
