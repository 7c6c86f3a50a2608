// What an inspection said of the holes that the simulator drilled, beside what it knows of them.
#pragma once

#include <vector>

#include "simulator/blade_run.h"

namespace sixpoint::simulator {

// Into result->holes, each with its truth already there, and the worst of them.
void CompareHoles(const inspection::v1::Inspection& inspection, BladeRunResult* result);

// How far a position's error is from the true one, at most: of the holes that the inspection has.
double WorstPositionDifference_um(const inspection::v1::Inspection& inspection,
                                  const std::vector<HoleComparison>& holes);

}  // namespace sixpoint::simulator
