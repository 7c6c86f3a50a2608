// What the patches of a fit show: scan by scan, where two scans see the same, and region by region of the part.
#pragma once

#include <string>
#include <vector>

#include "metrology/registration/fit_evidence.h"
#include "metrology/registration/fit_options.h"
#include "metrology/registration/patch_fit.h"
#include "metrology/registration/patch_sums.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// Fills points, overlap, portions, agreements, regions and the part of the surface that was seen.
void DescribePatches(const Surface& surface, const std::vector<ScanPortion>& portions, const PatchSums& sums,
                     const PatchFit& patches, double patch_mm, const FitOptions& options, FitEvidence* evidence);

// Scans whose points the loss threw out far more than the others': a wrong calibration, a dent, or a part held there.
std::string StandingOff(const FitEvidence& evidence);

}  // namespace sixpoint::metrology
