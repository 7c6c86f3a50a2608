#include "simulator/hole_comparison.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::simulator {
namespace {

bool IsOf(const inspection::v1::HoleResult& measured, const HoleComparison& comparison) {
  return measured.group() == comparison.truth.group && measured.hole() == comparison.truth.hole;
}

}  // namespace

void CompareHoles(const inspection::v1::Inspection& inspection, BladeRunResult* result) {
  for (HoleComparison& comparison : result->holes) {
    for (const auto& measured : inspection.holes()) {
      if (!IsOf(measured, comparison)) continue;
      comparison.measured = measured;
      comparison.is_measured = measured.has_position_error_mm() && measured.has_inclination_error_deg() &&
                               measured.verdict() != inspection::v1::VERDICT_NOT_MEASURED;
    }
    if (!comparison.is_measured) continue;
    ++result->measured_count;
    comparison.position_difference_um =
        1e3 * (comparison.measured.position_error_mm() - comparison.truth.position_error_mm);
    comparison.inclination_difference_deg =
        comparison.measured.inclination_error_deg() - comparison.truth.inclination_error_deg;
    result->worst_position_difference_um =
        std::max(result->worst_position_difference_um, std::abs(comparison.position_difference_um));
    result->worst_inclination_difference_deg =
        std::max(result->worst_inclination_difference_deg, std::abs(comparison.inclination_difference_deg));
  }
}

double WorstPositionDifference_um(const inspection::v1::Inspection& inspection,
                                  const std::vector<HoleComparison>& holes) {
  double worst_um = 0;
  for (const HoleComparison& comparison : holes)
    for (const auto& measured : inspection.holes())
      if (IsOf(measured, comparison))
        worst_um =
            std::max(worst_um, 1e3 * std::abs(measured.position_error_mm() - comparison.truth.position_error_mm));
  return worst_um;
}

}  // namespace sixpoint::simulator
