// Valid requests, for tests to break one field at a time.
#pragma once

#include <string>

#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::plant {

v1::CreateMachineRequest SampleMachine();
v1::CreateArtefactRequest SampleArtefact();
// A cylinder of radius 5 mm and height 20 mm, with `cad` as given.
v1::CreatePartRequest SamplePart(const std::string& cad);
// Of that part's three holes.
v1::CreateMachiningModelRequest SampleModel();

}  // namespace sixpoint::plant
