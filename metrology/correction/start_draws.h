// How uncertain corrected starts are, by draws of every source through the whole chain: beside the first order of CorrectGroup
// (GUM S1; docs/methods/correction.md, budget by draws).
//
// Frames: machine. Units: mm, rad; distances in um. The same inputs give the same bits, on any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "metrology/correction/correct.h"

namespace sixpoint::metrology {

struct DrawnComponent {
  std::string source;  // as CorrectedHole's
  double rms_um = 0;   // root mean square distance, of draws of this source alone
};
struct DrawnStart {
  std::string name;
  // 95 % of all draws' distances from the estimate lie below; each source as widely drawn as its degrees of freedom have it (Student's t).
  double expanded_uncertainty_um = 0;
  double low_um = 0, high_um = 0;  // of that, with 95 %, by order statistics
  std::vector<DrawnComponent> components;
};

struct DrawOptions {
  int count = 10'000;
  std::uint64_t seed = 1;
  int threads = 1;
  std::function<bool()> keep_going = {};
};
inline constexpr int kLeastDraws = 1'000;

// What the rotary axes should reach for the part as one draw has it.
using DrawnAngles =
    std::function<absl::StatusOr<RotaryAngles>(const Eigen::Isometry3d& zero_from_part, const RotaryAxes& axes)>;

// corrected: of this group, by CorrectGroup with the same. A hole for a hole, in its order. angles: empty, the group's own by Orient.
// INVALID_ARGUMENT: too few draws, another group's correction. Statuses as Orient's where a draw has no angles; CANCELLED where keep_going says no.
absl::StatusOr<std::vector<DrawnStart>> DrawStarts(const NominalHoleGroup& group, const CorrectedHoleGroup& corrected,
                                                   const RegisteredPose& pose, const RotaryAxes& axes,
                                                   const Drilling& drilling, const DrawOptions& options,
                                                   const DrawnAngles& angles = {});

}  // namespace sixpoint::metrology
