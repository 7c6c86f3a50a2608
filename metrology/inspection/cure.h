// Whether a small rigid motion of a part, which is all that a correction of its program can make, brings its surface within its limits
// (docs/methods/assessment.md, cure). Where none does, the proof: patches whose pushes balance, so that what frees one hurts another
// (Farkas; at most seven).
//
// Frames: part. Units: mm, rad. The same patches give the same bits.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// A patch and its limits, which are narrower by the guard where a patch is to be inside them surely, and wider where it is to be outside
// surely.
struct LimitedPatch {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // outward
  double deviation_mm = 0, inside_guard_mm = 0, outside_guard_mm = 0;
  double lower_mm = 0, upper_mm = 0;  // of the deviation
};

enum class Cure {
  kPossible,  // by the motion found every patch is inside its limits by its inside guard
  kNone,      // no motion leaves every patch within its limits and its outside guard
  kUnknown,
};

struct CureFinding {
  Cure cure = Cure::kUnknown;
  struct Conflict {
    std::size_t patch = 0;  // of those given
    bool above = false;     // its upper limit
    double share = 0;       // of the pushes, 0 to 1
  };
  std::vector<Conflict> conflicts;     // of kNone: the greatest share first
  Vector6d motion = Vector6d::Zero();  // of kPossible: turns about the patches' middle, then shift, of the part
};

// Motions of at most these, for which deviations follow the motion in proportion.
inline constexpr double kGreatestCureTurn_rad = 0.01, kGreatestCureShift_mm = 1;

// INVALID_ARGUMENT: no patch, or what is not finite. CANCELLED: keep_going said so.
absl::StatusOr<CureFinding> FindCure(const std::vector<LimitedPatch>& patches,
                                     const std::function<bool()>& keep_going = nullptr);

}  // namespace sixpoint::metrology
