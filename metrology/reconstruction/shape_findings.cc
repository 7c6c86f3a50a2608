// What a deformation makes of each region, and where its own limits contradict.
#include <algorithm>
#include <cmath>

#include "metrology/linear_algebra/least_squares.h"
#include "metrology/reconstruction/shape_problem.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kLeastForSlope = 6;

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
  const std::optional<SurfaceFoot>& foot = feet_[patch] ? feet_[patch] : first_feet_[patch];
  if (patch < measured_count_) holding.patch = patch;
  holding.region = region_of_patch_[patch];
  if (foot) {
    holding.place_mm = foot->place_mm;
    holding.normal = foot->design_normal;
  }
  return holding;
}

std::vector<std::pair<double, std::size_t>> ShapeProblem::Contradictions() const {
  std::vector<std::pair<double, std::size_t>> found;
  for (std::size_t j = 0; j < measured_count_; ++j) {
    if (!feet_[j] || region_of_patch_[j] == regions_.size()) continue;
    const ShapeRegion& region = regions_[region_of_patch_[j]];
    const double distance_mm = feet_[j]->distance_mm;
    double lacking_mm = 0;
    if (region.kind == RegionKind::kMachined)
      lacking_mm = region.lower_mm - (distance_mm - wanted_mm_[j]);
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
    if (!feet_[j]) continue;
    seen.Add(feet_[j]->place_mm, feet_[j]->design_normal);
    if (region_of_patch_[j] == regions_.size()) continue;
    RegionFinding& finding = findings[region_of_patch_[j]];
    const double distance_mm = feet_[j]->distance_mm;
    ++finding.patch_count;
    if (Is(j, RegionKind::kMachined)) {
      finding.least_allowance_mm = std::min(finding.least_allowance_mm.value_or(distance_mm), distance_mm);
      const double spare_mm = distance_mm - wanted_mm_[j];
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
    const double off_mm = bands_[i].off_mm;
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

ShapeTransition ShapeProblem::Transition() const {
  ShapeTransition transition;
  std::vector<std::size_t> beside, fixed;
  // The slope of the rest over three patches about each.
  PlaceGrid fixed_feet(3 * options_.patch_mm);
  for (std::size_t j = 0; j < measured_count_; ++j) {
    if (!Is(j, RegionKind::kFixed) || !feet_[j]) continue;
    fixed.push_back(j);
    fixed_feet.Add(feet_[j]->place_mm, feet_[j]->normal);
    if (about_machined_[j]) beside.push_back(j);
  }
  for (const std::size_t j : beside) {
    transition.step_mm = std::max(transition.step_mm, std::abs(feet_[j]->distance_mm));
    const Vector3d normal = feet_[j]->normal, one = normal.unitOrthogonal(), other = normal.cross(one);
    std::vector<std::array<double, 3>> rows;
    std::vector<double> rest_mm;
    fixed_feet.EachNear(feet_[j]->place_mm, normal, kSameWallCosine,
                        [&](std::size_t k, const Vector3d& place_mm, double) {
                          const Vector3d from_mm = place_mm - feet_[j]->place_mm;
                          rows.push_back({1, one.dot(from_mm), other.dot(from_mm)});
                          rest_mm.push_back(feet_[fixed[k]]->distance_mm);
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
    if (rows.size() < kLeastForSlope || !(mean - apart > 0.3 * options_.patch_mm * options_.patch_mm)) continue;
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()), 3);
    for (std::size_t k = 0; k < rows.size(); ++k)
      matrix.row(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::RowVector3d>(rows[k].data());
    const Eigen::Map<const Eigen::VectorXd> right(rest_mm.data(), static_cast<Eigen::Index>(rest_mm.size()));
    const Eigen::VectorXd plane = LeastSquares(matrix, right);
    const double kink_rad = std::atan(std::hypot(plane[1], plane[2]));
    if (kink_rad > transition.kink_rad) transition.kink_rad = kink_rad, transition.kink_region = region_of_patch_[j];
  }
  return transition;
}

}  // namespace sixpoint::metrology
