#include "metrology/correction/path_motion.h"

#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

void AddBends(const AxisPositioning& positioning, double from_rad, double to_rad, std::vector<double>* bends) {
  if (!positioning.table || from_rad == to_rad) return;
  const double step_rad = kTurn_rad / static_cast<double>(positioning.table->forward_rad.size());
  const double low_rad = std::fmin(from_rad, to_rad), high_rad = std::fmax(from_rad, to_rad);
  for (double knot = std::ceil(low_rad / step_rad); knot * step_rad < high_rad; ++knot) {
    const double share = (knot * step_rad - from_rad) / (to_rad - from_rad);
    if (share > 0 && share < 1) bends->push_back(share);
  }
}

}  // namespace

PathMotion::PathMotion(const CorrectedToolPose& from, const CorrectedToolPose& to, const RotaryAxes& axes,
                       const RotaryPositioning& positioning)
    : axes_(axes),
      positioning_(positioning),
      from_mm_(from.start.start_mm),
      to_mm_(to.start.start_mm),
      from_(from.corrected),
      to_(to.corrected),
      on_a_mm_(axes.PointC()) {
  const Eigen::Vector3d along_b = axes.b.direction.normalized();
  on_b_mm_ = axes.b.point_mm + along_b.dot(on_a_mm_ - axes.b.point_mm) * along_b;
  bends_ = {0, 1};
  AddBends(positioning.a, from_.a_rad, to_.a_rad, &bends_);
  AddBends(positioning.b, from_.b_rad, to_.b_rad, &bends_);
  std::sort(bends_.begin(), bends_.end());
}

RotaryAngles PathMotion::Reached(double share) const {
  return {positioning_.a.Reached(from_.a_rad + share * (to_.a_rad - from_.a_rad)),
          positioning_.b.Reached(from_.b_rad + share * (to_.b_rad - from_.b_rad))};
}

PathMotion::Place PathMotion::At(double share) const {
  const RotaryAngles angles = Reached(share);
  const Eigen::Isometry3d zero_from_machine = axes_.MachineFromZero(angles.a_rad, angles.b_rad).inverse();
  return {zero_from_machine * TipInMachine(share), zero_from_machine.linear().col(2)};
}

// The part turns away under the tool, by A first: q = A^-1 x and p = B^-1 q. With x' and both angles' rates constant and r the distance from
// an axis, |q'| <= a' r_a + |x'| and |q''| <= a'^2 r_a + 2 a' |x'|; likewise p' and p'' of q.
PathMotion::Rates PathMotion::RatesBetween(double from_share, double to_share, double height_mm) const {
  const double share = to_share - from_share;
  if (!(share > 0)) return {};
  const RotaryAngles from = Reached(from_share), to = Reached(to_share);
  const double a_rate = std::abs(to.a_rad - from.a_rad) / share, b_rate = std::abs(to.b_rad - from.b_rad) / share;
  const double along_mm = (to_mm_ - from_mm_).norm();
  const Eigen::Vector3d above_mm = height_mm * Eigen::Vector3d::UnitZ();
  // A distance from a point is greatest at one of a line's ends.
  const double about_a_mm = std::fmax((TipInMachine(from_share) + above_mm - on_a_mm_).norm(),
                                      (TipInMachine(to_share) + above_mm - on_a_mm_).norm());
  const double about_b_mm = about_a_mm + (on_a_mm_ - on_b_mm_).norm();
  const double speed_mm = a_rate * about_a_mm + along_mm;
  Rates rates;
  rates.speed_mm = b_rate * about_b_mm + speed_mm;
  rates.bend_mm = b_rate * b_rate * about_b_mm + 2 * b_rate * speed_mm + a_rate * (a_rate * about_a_mm + 2 * along_mm);
  rates.turn_rad = a_rate + b_rate;
  return rates;
}

}  // namespace sixpoint::metrology
