// A valid drawing, for tests to break one field at a time, and the part that it is of.
#pragma once

#include <string>

#include "sixpoint/plant/v1/drawing.pb.h"
#include "storage/plant_store.h"

namespace sixpoint::plant {

// Of parts/vane@1 and @2, with a characteristic of each quantity and all that these name.
v1::CreateDrawingRequest SampleDrawing();
// The characteristic of that quantity in it.
v1::Characteristic* Of(v1::CreateDrawingRequest* request, v1::CharacteristicQuantity quantity);

// parts/vane with two revisions, alike in all that the sample names; and a third, whose G1 is another and lacks H2, whose six points are others.
// Box -10, -10, 0 to 10, 10, 100. Ends the program where it cannot.
void RegisterVane(const storage::PlantStores& plant);

}  // namespace sixpoint::plant
