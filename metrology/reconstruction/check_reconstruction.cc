#include "metrology/reconstruction/check_reconstruction.h"

#include <cmath>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {

absl::Status CheckOptions(const ReconstructionOptions& options) {
  Refusals refusals;
  const auto want = [&](const std::string& name, double value, double least, double most) {
    if (!(value >= least && value <= most))
      refusals.Add(Refuse("options." + name, value, NumberText(least) + " to " + NumberText(most)));
  };
  want("coverage_factor", options.coverage_factor, 0, 10);
  want("fixed_within_mm", options.fixed_within_mm, 1e-4, 1);
  want("step_mm", options.step_mm, 1e-4, 1);
  want("kink_rad", options.kink_rad, 1e-5, 1);
  want("datum_within_mm", options.datum_within_mm, 1e-4, 1);
  want("blend_mm", options.blend_mm, 0, 50);
  want("finest_spacing_mm", options.finest_spacing_mm, 0.1, 100);
  want("coarsest_spacing_mm", options.coarsest_spacing_mm, options.finest_spacing_mm, 100);
  want("reach_mm", options.reach_mm, 0.1, 50);
  want("patch_mm", options.patch_mm, 0.05, 20);
  want("least_seen_part", options.least_seen_part, 0, 1);
  want("greatest_stock_mm", options.greatest_stock_mm, 0.01, 50);
  want("threshold_mm", options.threshold_mm, 1e-5, 0.1);
  want("margin_mm", options.margin_mm, 0, options.datum_within_mm);
  want("stiffness_mm2", options.stiffness_mm2, 1e-8, 1e4);
  want("decay_mm", options.decay_mm, 0.1, 1e4);
  want("most_passes", options.most_passes, 1, 100);
  return refusals.status();
}

absl::Status CheckBlank(const std::vector<BlankPatch>& blank) {
  if (blank.empty()) return Refuse("blank", "no patch", "at least one");
  for (std::size_t j = 0; j < blank.size(); ++j) {
    const BlankPatch& patch = blank[j];
    if (!patch.point_mm.allFinite() || !(std::abs(patch.normal.norm() - 1) < 1e-6) ||
        !(patch.standard_uncertainty_mm >= 0 && patch.standard_uncertainty_mm < 10))
      return Refuse("blank[" + std::to_string(j) + "]", "not finite, no unit normal, or an uncertainty out of range",
                    "a point, a unit normal, and 0 to 10 mm");
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::metrology
