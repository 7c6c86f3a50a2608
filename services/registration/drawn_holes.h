// Holes that a part's CAD already shows as drilled.
#pragma once

#include "metrology/surface/surface.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::registration {

// Of the part's holes: those whose axis, half a diameter under the mouth, runs through the open.
int CountDrawnHoles(const plant::v1::Part& part, const metrology::Surface& surface);

}  // namespace sixpoint::registration
