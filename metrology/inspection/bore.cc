#include "metrology/inspection/bore.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

constexpr int kCells = 18;  // round the axis

// Of a bore's points the outermost in each direction stand on its wall; the floor's, and stray ones in the hole, lie within. Those within a
// fifth of the radius of it stay.
std::vector<std::size_t> NearWall(const NominalPin& hole, const Points& points_in_part_mm) {
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(hole.axis);
  std::vector<std::vector<double>> away(kCells);
  std::vector<std::pair<int, double>> at;
  for (const Eigen::Vector3d& point : points_in_part_mm) {
    const Eigen::Vector2d from = across.transpose() * (point - hole.start_mm);
    const double turn = (std::atan2(from.y(), from.x()) / kTurn_rad + 0.5) * kCells;
    at.emplace_back(std::clamp(static_cast<int>(turn), 0, kCells - 1), from.norm());
    away[static_cast<std::size_t>(at.back().first)].push_back(at.back().second);
  }
  std::vector<double> wall_mm(kCells, 0);
  for (std::size_t cell = 0; cell < kCells; ++cell)
    if (!away[cell].empty()) wall_mm[cell] = AtRank(away[cell].size() * 9 / 10, &away[cell]);
  std::vector<std::size_t> near;
  for (std::size_t i = 0; i < at.size(); ++i)
    if (at[i].second > wall_mm[static_cast<std::size_t>(at[i].first)] - 0.2 * hole.hole_diameter_mm / 2)
      near.push_back(i);
  return near;
}

}  // namespace

HoleRegion BoreRegionOf(const NominalPin& hole, double reach_mm, const PinLimits& pin, const BoreLimits& limits) {
  const double radius_mm = pin.greatest_diameter_ratio * hole.hole_diameter_mm / 2 + reach_mm;
  // Where the axis leans, the surface stands higher on one side of the hole than at its start; what is outside of it is no bore's.
  return {hole.start_mm, hole.axis, radius_mm, limits.above_floor_mm - hole.hole_depth_mm, 2 * radius_mm};
}

PinFit FitBore(const NominalPin& hole, const Points& points_in_part_mm, const PinLimits& pin,
               const BoreLimits& limits) {
  PinFit fit;
  fit.point_count = static_cast<int>(points_in_part_mm.size());
  if (!(hole.hole_diameter_mm > limits.narrowest_mm)) {
    fit.reason = ReasonText("a bore of %g mm is too narrow to be seen into, want more than %g", hole.hole_diameter_mm,
                            limits.narrowest_mm);
    return fit;
  }
  if (fit.point_count < limits.least_point_count) {
    fit.reason =
        ReasonText("%.0f points inside of the hole, want at least %.0f", fit.point_count, limits.least_point_count);
    return fit;
  }
  NominalPin bore = hole;
  bore.gauge.reset();
  bore.standing.reset();
  PinLimits wanted = pin;
  wanted.least_point_count = limits.least_point_count;
  wanted.least_height_mm = limits.least_height_ratio * hole.hole_diameter_mm;
  wanted.apart_mm = 0;  // floor and wall hang together
  wanted.held_step_count = 60;
  PinFit all = FitPin(bore, points_in_part_mm, wanted);
  if (all.measured) return all;
  const std::vector<std::size_t> near = NearWall(hole, points_in_part_mm);
  Points wall;
  for (const std::size_t i : near) wall.push_back(points_in_part_mm[i]);
  fit = FitPin(bore, wall, wanted);
  if (!fit.measured) return all;
  for (std::size_t& i : fit.used) i = near[i];
  return fit;
}

}  // namespace sixpoint::metrology
