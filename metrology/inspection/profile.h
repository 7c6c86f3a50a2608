// Where a surface is out of its profile tolerance, and whether what was seen of it suffices to say so (docs/methods/deviation.md; ISO 1101, ISO
// 14253-1).
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "metrology/inspection/deviation_map.h"
#include "metrology/inspection/verdict.h"

namespace sixpoint::metrology {

enum class ProfileZone {
  kFormAndLocation,  // the zone lies about the CAD where the datums put it: as the part was registered
  kForm,             // it may be turned and shifted to fit these patches best (weighted least squares of their means)
};

struct ProfileTolerance {
  ProfileZone zone = ProfileZone::kFormAndLocation;
  double lower_mm = 0, upper_mm = 0;  // of the deviation, positive outside
  double least_coverage = 0.95;       // of the area, that must have been seen for a CONFORM
  DecisionRule rule = {};             // of each patch
};

// Patches side by side that are out the same way.
struct ProfileArea {
  bool above = false;
  double area_mm2 = 0;
  std::uint32_t patch_count = 0;
  std::uint32_t worst = 0;                                 // patch that is farthest out
  double worst_mm = 0, worst_expanded_uncertainty_mm = 0;  // its deviation in the zone
  Eigen::Vector3d minimum_mm, maximum_mm;                  // box of the patches' centres
};

struct ProfileFinding {
  Verdict verdict = Verdict::kNotMeasured;
  std::string reason;  // why it is not CONFORM or NOT_CONFORM
  double coverage = 0;
  double out_mm2 = 0, undecided_mm2 = 0;
  std::vector<ProfileArea> areas;  // the farthest out first
  // With the least and the greatest deviation in the zone: places in deviations_mm; none where nothing was seen.
  std::optional<std::size_t> lowest, highest;
  // Of the patches asked for, in their order: deviation in the zone; NaN where it was not seen.
  std::vector<double> deviations_mm, expanded_uncertainties_mm;
  // The motion of the part that a kForm zone takes off: turns (rad) about the patches' middle, then shift; 0 for kFormAndLocation, and in
  // directions that the patches do not hold.
  Vector6d motion = Vector6d::Zero();
};

// INVALID_ARGUMENT with the field's name: no patch, lower above upper, what is not finite, a coverage that is not 0 to 1.
absl::StatusOr<ProfileFinding> JudgeProfile(const DeviationField& field, const std::vector<std::uint32_t>& patches,
                                            const ProfileTolerance& tolerance);

}  // namespace sixpoint::metrology
