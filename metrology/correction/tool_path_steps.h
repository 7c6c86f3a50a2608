// What a path does between its poses, where all five axes go straight in their commands: how far the tip leaves the straight line on the
// part, and the tool's axis the shortest turn (docs/methods/correction.md, tool paths).
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>
#include <string>
#include <vector>

#include "metrology/correction/tool_path.h"

namespace sixpoint::metrology {

// What is allowed between two poses, as shares of the path's tolerances.
struct PathDeviationShares {
  double position = 0.25, inclination = 0.25;
};

// From a pose to the next one.
struct PathStep {
  int from = 0;  // pose, from 0
  double chord_um =
      0;  // greatest distance of the tip from the straight line between both tips, on the part as warm as it is
  double axis_deg = 0;  // greatest angle of the tool's axis from the shortest turn between both axes
  // As many poses more between the two, evenly, bring both within what is allowed (both fall with the square of the step); 0: they are.
  int more_poses = 0;
};

// One for each pose but the last. Of either figure the bound is given that no place between exceeds; a place comes within a thousandth
// of it, or a nanometre and 1e-6 deg. INVALID_ARGUMENT, with field, value and wanted: a tolerance or a share of 0, paths of different lengths, or
// of too many poses. CANCELLED where keep_going (may be empty) says no.
// axes, positioning: those that it was corrected with.
absl::StatusOr<std::vector<PathStep>> MeasurePathSteps(const NominalToolPath& path, const CorrectedToolPath& corrected,
                                                       const RotaryAxes& axes, const RotaryPositioning& positioning,
                                                       const PathDeviationShares& shares = {},
                                                       const std::function<bool()>& keep_going = {});

// INVALID_ARGUMENT with "paths[NAME].poses[3]", what it deviates by, what is allowed and how many poses more do, of each step that goes beyond.
absl::Status CheckPathSteps(const NominalToolPath& path, const std::vector<PathStep>& steps,
                            const PathDeviationShares& shares = {});

}  // namespace sixpoint::metrology
