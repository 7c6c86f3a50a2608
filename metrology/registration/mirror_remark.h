// Scans of the other hand: a CAD that was mirrored on its way, or a left blade in a right one's place.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/registration/fit_options.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// What to say where the scans fit the CAD's mirror image clearly, and the CAD itself nowhere near as well; empty otherwise.
// To be asked where a fit to the surface failed. A part with a plane of symmetry is its own mirror image: nothing is said of
// it. The image is looked for as the nominal part is turned and reflected in a plane of its axes or its principal axes; turned
// in any way where options.coarse_start says so. Clear is a spread below a part of options.greatest_spread_mm. Thinned scans,
// some tenths of a second. CANCELLED: keep_going said so.
//
// A blank hides its hand under its stock. With greatest_spread_mm 1, of 8 mirrored blanks each whose stock varies by half
// about 0.2, 0.5 and 1 mm it was said of 5, 3 and none; of 16 that were not mirrored never.
absl::StatusOr<std::string> MirrorRemark(const Surface& surface, const std::vector<ScanPortion>& portions,
                                         const Eigen::Isometry3d& zero_from_part_nominal,
                                         const MachineCalibration& calibration, const FitOptions& options);

}  // namespace sixpoint::metrology
