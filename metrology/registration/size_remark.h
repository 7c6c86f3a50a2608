// Scans and CAD of different size: a part registered in another unit is the commonest wrong part.
#pragma once

#include <string>
#include <vector>

#include "metrology/registration/fit_options.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// What would explain that the scans are larger or smaller than the CAD, as seen along the nominal part's axes: a factor of
// 25.4 or 1000 with its units, or the factor alone; empty where the sizes go together. To be asked where the scans do not lie
// on the surface: a scan of a small region of a large part is smaller too.
std::string SizeRemark(const Surface& surface, const std::vector<ScanPortion>& portions,
                       const Eigen::Isometry3d& zero_from_part_nominal);

}  // namespace sixpoint::metrology
