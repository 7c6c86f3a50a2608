#include "metrology/registration/fit_options.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "refusal/refusal.h"

namespace sixpoint::metrology {

using Eigen::Isometry3d;
using Eigen::Vector3d;

bool InRegions(const FitOptions& options, const Vector3d& part_mm, double margin_mm) {
  const auto holds = [&](const Region& region) { return region.Holds(part_mm, margin_mm); };
  if (!options.regions_in.empty() && std::none_of(options.regions_in.begin(), options.regions_in.end(), holds))
    return false;
  return std::none_of(options.regions_out.begin(), options.regions_out.end(), holds);
}

Vector6d HeldUncertainty(const FitOptions& options, double radius_mm) {
  Vector6d held;
  held << Eigen::Vector3d::Constant(options.held_turn_rad * radius_mm),
      Eigen::Vector3d::Constant(options.held_shift_mm);
  for (int k = 0; k < 6; ++k)
    if (options.free[static_cast<std::size_t>(k)]) held[k] = 0;
  return held;
}

absl::Status CheckInputs(const std::vector<ScanPortion>& portions, const Isometry3d& zero_from_part,
                         const FitOptions& options) {
  std::size_t count = 0;
  for (const ScanPortion& portion : portions) {
    count += portion.sensor.size();
    if (portion.out_of_reach_count > 0)
      return Refuse("scans[" + portion.id + "]",
                    std::to_string(portion.out_of_reach_count) + " points metres away from the others",
                    "all within 2 m");
  }
  const auto free_count = static_cast<std::size_t>(std::count(options.free.begin(), options.free.end(), true));
  if (!(options.held_turn_rad >= 0 && options.held_shift_mm >= 0) || !std::isfinite(options.held_turn_rad) ||
      !std::isfinite(options.held_shift_mm))
    return Refuse("held", "a turn or shift that is no uncertainty", "both finite and not negative");
  if (free_count == 0) return Refuse("degrees_of_freedom", "none free", "at least one");
  if (count < free_count)
    return Refuse("scans", std::to_string(count) + " points", "at least " + std::to_string(free_count));
  if (!zero_from_part.matrix().allFinite()) return Refuse("zero_from_part_nominal", "not finite", "a rigid transform");
  if (!options.scan_weights.empty() && options.scan_weights.size() != portions.size())
    return Refuse("scan_weights", std::to_string(options.scan_weights.size()),
                  "one for each of " + std::to_string(portions.size()) + " scans");
  for (const double weight : options.scan_weights)
    if (!(weight > 0) || !std::isfinite(weight)) return Refuse("scan_weights", weight, "positive numbers");
  return absl::OkStatus();
}

}  // namespace sixpoint::metrology
