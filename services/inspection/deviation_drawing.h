// A deviation map as a report's picture: the part's surface in the colours of its patches.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/inspection/surface_patches.h"
#include "metrology/surface/surface.h"
#include "report/deviation_picture.h"
#include "sixpoint/inspection/v1/deviation.pb.h"

namespace sixpoint::inspection {

// Triangles of half a patch's edge at most, each in the colour of the patch of its middle; where that would be more than a million, coarser
// ones. means_um: of each patch; NaN: not seen.
report::DeviationSurface DeviationSurfaceOf(const metrology::Surface& surface, const metrology::SurfacePatches& patches,
                                            const std::vector<double>& means_um);

// surface: of the part that was mapped. DATA_LOSS where its patches are not the map's; else as report::DrawDeviation.
absl::StatusOr<report::DeviationPicture> DrawMap(const metrology::Surface& surface, const v1::DeviationMap& map,
                                                 const std::vector<double>& means_um);

}  // namespace sixpoint::inspection
