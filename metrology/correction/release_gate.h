// Whether a correction may be used without a person looking at it: what is asked, what was found, and where it is worst
// (docs/methods/release.md).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "metrology/correction/correct.h"

namespace sixpoint::metrology {

// The machine's record states these.
struct GateLimits {
  double translation_mm = 0;  // of a start from its nominal one; 0: always waits
  double rotation_rad = 0;    // of an axis from its nominal angle; 0: always waits
  double uncertainty_share = 0;
  double registration_age_h = 0;
  double keep_out_mm = 0;  // 0: not asked
  double interim_check_mm =
      0;  // greatest displacement of the scanner that its interim checks accept; 0: none is asked for
};
// Beyond it the stated uncertainty is not to be relied on (docs/adr/0016): one side of a smooth casting was three times as far off.
inline constexpr double kGreatestConditionNumber = 100;
inline constexpr double kLeastInformationKept = 0.5;
inline constexpr double kGreatestDisagreement = 4.1;  // as disagreement.h flags it
// What a surface's own curvature, which a deformation changes, lets a ball cut; fixed surface is held within as much.
inline constexpr double kGreatestShapeGouge_um = 5;

enum class GateCheckKind {
  kStartShift,         // mm
  kAxisChange,         // deg
  kStartUncertainty,   // um, expanded
  kAxisUncertainty,    // deg, expanded
  kDisagreement,       // standard uncertainties
  kMerge,              // chi squared
  kCondition,          // condition number
  kInformation,        // share kept; at least
  kHeldDirections,     // count
  kRegistrationAge,    // h
  kClamping,           // count of registrations that speak against it
  kTravel,             // mm beyond a limit
  kKeepOut,            // mm of clearance; at least
  kLineOfSight,        // mm of clearance; at least
  kCutBefore,          // count of holes
  kSensorCalibration,  // count of calibrations that were asked for, and not in force when the scans were taken
  kInterimCheck,       // count of accepted checks of the scanner that are missing in the scans' clamping
  kScrapped,           // count of dispositions by which the blade is scrap
  kToolCylinder,       // mm of clearance; at least
  kModelNotNamed,      // count of machining models of the part, where a template came without one
  kShapeGouge,         // um deeper into a reconstruction's shape than the template into the design
};
std::string NameOf(GateCheckKind kind);  // "START_SHIFT", as ReleaseCheckKind has it

struct GateCheck {
  GateCheckKind kind = GateCheckKind::kStartShift;
  std::string subject;          // where it is worst: "G1/H3", "A", "line 12"; empty: the whole
  std::optional<double> value;  // none: it could not be told, which does not pass
  double limit = 0;
  int failed_count = 0;  // of holes, axes, moves
  bool passed() const { return failed_count == 0; }
};
// "START_UNCERTAINTY of G1/H3: 119 um, want at most 26.7; 12 do not pass".
std::string TextOf(const GateCheck& check);

// Asked of the whole registration; a question that its method does not have is not among `asked`.
struct RegistrationEvidence {
  bool has_disagreement = false;       // the method can be compared with the best fit
  std::optional<double> disagreement;  // in standard uncertainties
  std::optional<double> merge_chi_squared;
  double merge_limit = 0;
  std::optional<double> condition_number;
  std::optional<double> information_kept;
  int held_directions = 0;
  double age_h = 0;
};

// Each question once, in the order of the kinds. groups and corrected go together; axes: the machine's letters.
std::vector<GateCheck> JudgeHoles(const std::vector<NominalHoleGroup>& groups,
                                  const std::vector<CorrectedHoleGroup>& corrected, const GateLimits& limits,
                                  const std::array<std::string, 2>& axes);
// Of each path by its name, um.
GateCheck JudgeShapeGouge(const std::vector<std::pair<std::string, double>>& gouge_um);
std::vector<GateCheck> JudgeRegistration(const RegistrationEvidence& evidence, const GateLimits& limits);

// A count of things that speak against a release; the first is named.
GateCheck CountAgainst(GateCheckKind kind, const std::vector<std::string>& against);

}  // namespace sixpoint::metrology
