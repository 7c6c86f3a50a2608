// The machining program as the simulated machine's control reads it.
#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <string>

#include "simulator/blade.h"
#include "simulator/machine.h"

namespace sixpoint::simulator {

// A program for the nominal part: one block for each hole, marked (SIXPOINT group/hole), absolute millimetres.
std::string NominalProgram(const DesignedPart& part, const MachineDesign& design);

// Where a program sends the tool, by "group/hole" of its marked blocks.
absl::StatusOr<std::map<std::string, DrillCommand>> ReadProgram(const std::string& program);

}  // namespace sixpoint::simulator
