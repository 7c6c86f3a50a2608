// How much of a blank stands outside a shape, patch by patch.
#pragma once

#include <optional>
#include <vector>

#include "metrology/reconstruction/blank_patch.h"
#include "metrology/reconstruction/surface_foot.h"

namespace sixpoint::metrology {

// The foot of each patch on the deformed design: its distance, positive outside, is the stock there. deformation: null for the design itself. Unset: no
// surface within farthest_mm that looks as the patch does. The same bits on any number of threads.
std::vector<std::optional<SurfaceFoot>> FeetOfBlank(const Surface& design, const FreeFormDeformation* deformation,
                                                    const std::vector<BlankPatch>& blank, double farthest_mm,
                                                    int threads);

}  // namespace sixpoint::metrology
