// How much of a blank stands outside a shape, patch by patch.
#pragma once

#include <optional>
#include <vector>

#include "metrology/reconstruction/blank_patch.h"
#include "metrology/reconstruction/free_form_deformation.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// Signed distance of each patch from the deformed design, mm, positive outside; deformation: null for the design itself. Unset: no surface within
// farthest_mm that looks as the patch does. The same bits on any number of threads.
std::vector<std::optional<double>> StockOver(const Surface& design, const FreeFormDeformation* deformation,
                                             const std::vector<BlankPatch>& blank, double farthest_mm, int threads);

}  // namespace sixpoint::metrology
