// How uncertain the tip is at one pose of a tool path, by draws: beside the first order of CorrectToolPath
// (docs/methods/correction.md, budget by draws).
//
// Frames, units and bits as in start_draws.h.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "metrology/correction/start_draws.h"
#include "metrology/correction/tool_path.h"

namespace sixpoint::metrology {

// A path that was corrected, and by what.
struct DrawnPath {
  const NominalToolPath& nominal;
  const CorrectedToolPath& corrected;  // by CorrectToolPath with what follows
  const RegisteredPose& pose;
  const RotaryAxes& axes;
  PathContinuity steps = {};
  Drilling drilling = {};
  std::array<std::string, 2> letters = {"A", "B"};
};

// A pose of the path as a group of one hole, named by the pose's number.
NominalHoleGroup NominalPoseOf(const NominalToolPath& path, std::size_t pose);
CorrectedHoleGroup CorrectedPoseOf(const std::string& path, const CorrectedToolPose& pose);

// Poses that each draw solves anew: 1, where the pose alone decides its angles; all, where B is led between its neighbours.
std::size_t PosesPerDraw(const CorrectedToolPath& path, std::size_t pose);

// Statuses as DrawStarts; OUT_OF_RANGE as CorrectToolPath where a draw's way is not there.
absl::StatusOr<DrawnStart> DrawPose(const DrawnPath& path, std::size_t pose, const DrawOptions& options);

}  // namespace sixpoint::metrology
