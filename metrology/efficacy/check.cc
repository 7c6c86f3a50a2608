#include "metrology/efficacy/check.h"

#include <cmath>
#include <set>
#include <string>

#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kMostBlades = 1000, kMostHoles = 100'000;

absl::Status CheckHole(const std::string& field, const HoleOutcome& hole) {
  if (hole.hole.empty()) return Refuse(field + ".hole", "", "its name");
  for (const auto& [name, vector] :
       {std::pair("predicted_start_mm", &hole.predicted_start_mm), std::pair("found_start_mm", &hole.found_start_mm)})
    if (!vector->allFinite()) return Refuse(field + "." + name, "not finite", "a point");
  for (const auto& [name, vector] :
       {std::pair("predicted_axis", &hole.predicted_axis), std::pair("found_axis", &hole.found_axis)})
    if (!(std::abs(vector->norm() - 1) < 1e-6)) return Refuse(field + "." + name, vector->norm(), "of length 1");
  if (!std::isfinite(hole.a_rad)) return Refuse(field + ".a_rad", "not finite", "an angle");
  if (!std::isfinite(hole.b_rad)) return Refuse(field + ".b_rad", "not finite", "an angle");
  if (!hole.zero_from_part.matrix().allFinite()) return Refuse(field + ".zero_from_part", "not finite", "a pose");
  for (const auto& [name, value] :
       {std::pair("position_standard_uncertainty_mm", hole.position_standard_uncertainty_mm),
        std::pair("inclination_standard_uncertainty_rad", hole.inclination_standard_uncertainty_rad)})
    if (!std::isfinite(value) || value <= 0) return Refuse(field + "." + name, value, "> 0");
  if (!(hole.shared_part >= 0 && hole.shared_part <= 1))
    return Refuse(field + ".shared_part", hole.shared_part, "0 to 1");
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckOutcomes(const std::vector<BladeOutcome>& blades, const EfficacyOptions& options) {
  if (!(options.confidence >= 0.5 && options.confidence <= 0.999))
    return Refuse("confidence", options.confidence, "0.5 to 0.999");
  if (options.least_blades < 3 || options.least_blades > 1000)
    return Refuse("least_blades", options.least_blades, "3 to 1000");
  if (blades.empty() || blades.size() > kMostBlades)
    return Refuse("blades", std::to_string(blades.size()) + " of them", "1 to " + std::to_string(kMostBlades));
  std::set<std::string> names;
  std::size_t holes = 0;
  for (std::size_t i = 0; i < blades.size(); ++i) {
    const BladeOutcome& blade = blades[i];
    const std::string field = "blades[" + std::to_string(i) + "]";
    if (blade.blade.empty() || !names.insert(blade.blade).second)
      return Refuse(field + ".blade", blade.blade, "a name, each once");
    if (!std::isfinite(blade.time_days) || (i > 0 && blade.time_days < blades[i - 1].time_days))
      return Refuse(field + ".time_days", blade.time_days, "in order");
    if (blade.holes.empty()) return Refuse(field + ".holes", "none", "one or more");
    holes += blade.holes.size();
    if (holes > kMostHoles)
      return Refuse("blades", std::to_string(holes) + " holes", "at most " + std::to_string(kMostHoles));
    std::set<std::string> hole_names;
    for (std::size_t j = 0; j < blade.holes.size(); ++j) {
      const std::string of_hole = field + ".holes[" + std::to_string(j) + "]";
      if (absl::Status s = CheckHole(of_hole, blade.holes[j]); !s.ok()) return s;
      if (!hole_names.insert(blade.holes[j].hole).second)
        return Refuse(of_hole + ".hole", blade.holes[j].hole, "each once");
    }
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::metrology
