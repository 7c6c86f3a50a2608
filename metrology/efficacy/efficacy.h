// Whether a machine cuts where corrections predict: bias and spread of as-cut against predicted holes, with confidence, and what of it may be
// offered as the machine's known offset (docs/methods/efficacy.md). Nothing here changes a program.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "metrology/efficacy/crossed_variance.h"
#include "metrology/efficacy/outcome.h"
#include "metrology/efficacy/theil_sen.h"
#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

// Blades are the independent units: what the holes of one have in common is one draw.
struct BladeOutcome {
  std::string blade;
  double time_days = 0;
  std::vector<HoleOutcome> holes;
};

struct EfficacyOptions {
  double confidence = 0.95;
  int least_blades = 5;  // 3 to 1000; fewer are told, and offer nothing
};

// X, Y, Z of the machine (mm), then the zeros of its rotary axes (rad): found less predicted.
enum class OffsetComponent { kX, kY, kZ, kA, kB };
inline constexpr int kOffsetComponentCount = 5;

struct OffsetEstimate {
  OffsetComponent component = OffsetComponent::kX;
  double value = 0;
  double standard_uncertainty =
      0;  // of the blades' scatter, of the holes' own deviations, and of what the inspections share
  double shared_standard_uncertainty = 0;
  double degrees_of_freedom = 0;               // Welch and Satterthwaite
  std::optional<double> expanded_uncertainty;  // Student's quantile for the confidence; none: a single blade
  std::optional<double> standard_deviation;    // of one blade's value; none: a single blade
  bool offered = false;
};

// Components tested together.
struct OffsetTest {
  std::optional<double> f, p;
  double level = 0;  // significant below it
  bool significant = false;
};

struct HoleBias {
  std::string hole;
  int blade_count = 0;
  Eigen::Vector3d mean_in_machine_mm = Eigen::Vector3d::Zero(), mean_in_part_mm = Eigen::Vector3d::Zero();
  // Beside the other holes of the same blades (their median): what is this hole's own. None: it never had others beside it.
  std::optional<Eigen::Vector3d> own_in_machine_mm;
  std::optional<double> own_expanded_uncertainty_mm;  // of the distance across the hole; none: too few blades
  std::optional<double> p, adjusted_p;                // own = 0; adjusted by Holm for all holes that were tested
  bool significant = false;
};

// X or Y: of one component across the holes.
struct ComponentSpread {
  OffsetComponent component = OffsetComponent::kX;
  CrossedVariance variance;
};
struct ComponentTrend {
  OffsetComponent component = OffsetComponent::kX;
  TheilSenSlope slope;  // mm a day
  bool significant = false;
};
struct BladeMean {
  std::string blade;
  double time_days = 0;
  int hole_count = 0;
  std::array<std::optional<double>, 3> position_mm;  // X, Y, Z
};

// Why nothing is offered.
enum class NotOffered { kTooFewBlades, kNotSignificant, kWithinUncertainty, kDrifts, kNewestBladeOff };

struct Efficacy {
  int blade_count = 0, hole_count = 0;
  std::vector<BladeMean> blades;        // in time
  std::vector<OffsetEstimate> offsets;  // of the identifiable components
  std::vector<OffsetComponent> not_determined;
  bool angles_used = false;  // the rotary zeros were significant: the offsets are beside what they explain
  std::optional<double>
      condition_number;  // of offsets and angles together, scaled columns; none: no angle is determined
  OffsetTest position, angles;
  std::vector<ComponentSpread> spreads;
  std::vector<HoleBias> holes;
  std::vector<ComponentTrend> trends;
  std::optional<double> newest_p;   // that the newest blade lies so far from those before, or farther
  bool newest_off = false;          // below 1 %
  std::vector<NotOffered> reasons;  // empty: something is offered
};

// Blades in time; each once, each hole of it once. INVALID_ARGUMENT naming the field for what is not finite, directions that are no unit
// vectors, uncertainties not above 0, times not in order, no blade, a blade without holes, or more than 1000 blades or 100,000 holes.
absl::StatusOr<Efficacy> AssessEfficacy(const std::vector<BladeOutcome>& blades, const RotaryAxes& axes,
                                        const EfficacyOptions& options = {});

}  // namespace sixpoint::metrology
