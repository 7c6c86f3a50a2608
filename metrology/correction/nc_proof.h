// That a written program does what was corrected, and nothing else: its moves (nc_reader.h), driven through the rotary axes, against the
// poses of the correction (docs/nc_template.md, proof).
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "metrology/correction/nc_reader.h"
#include "metrology/correction/nc_target.h"
#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

struct NcProof {
  int pose_count = 0;                 // at which a hole was reached or cut
  double greatest_difference_um = 0;  // of the hole's start on the part
  double greatest_tilt_deg = 0;       // of its direction
};

// What four decimals of a mm, and of a degree at half a metre, leave.
inline constexpr double kGreatestNcDifference_um = 1;
inline constexpr double kGreatestNcTilt_deg = 5e-4;

// INVALID_ARGUMENT, naming the line, unless
// - every target is reached: a marked block ends with all five axes at its pose, before another target's block comes;
// - every feed ends at a target's pose, comes down to it from above in a marked block, steps on from it along Z (G91), or leaves it
//   upwards;
// - no move is an arc, marked or not, and none has a path tolerance (G64 P) of more than 1 um;
// - an output is switched on (M62, M64) at a target's pose, or further along its Z by steps;
// - a target is left upwards before an unmarked block moves another axis, and no unmarked block goes down again but by steps;
// - a path (nc_target.h) is reached at its first pose from above along Z, followed by feeds in marked blocks from each pose to the next
//   one, all five axes at once; all its poses once, in their order, and nothing between. Its A and B are those commanded, not
//   whole turns beside them, and G1 was said. It is left upwards from its last pose, along Z alone, until it stands as high as it came down along
//   Z from; where the last pose is higher than that, as high above it as it came down to the first one.
// targets: refused as CheckPaths.
absl::StatusOr<NcProof> ProveProgram(const std::vector<NcMove>& moves, const std::map<std::string, NcTarget>& targets,
                                     const RotaryAxes& axes);

}  // namespace sixpoint::metrology
