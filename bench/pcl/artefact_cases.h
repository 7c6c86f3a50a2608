// Scans of the artefact in which it is looked for, from clean to harsher than calibration's own benchmark, and where its
// cones truly stand in them.
#pragma once

#include <string>
#include <vector>

#include "bench/calibration/shop_scans.h"

namespace sixpoint::bench {

struct ArtefactCase {
  metrology::LineScan scan;
  metrology::Artefact artefact;
  Eigen::Affine3d sensor_from_artefact;  // sheared
};

// Sheared as the encoder's motion shears a scan.
Eigen::Affine3d SensorFromArtefact(const simulator::MachineTruth& truth, const Eigen::Vector3d& v0_mm);

// The names of the kinds of cases that CasesOf gives, in its order.
const std::vector<std::string>& ArtefactCaseKinds();

// One draw: a scan of each kind.
std::vector<ArtefactCase> ArtefactCases(int seed);

}  // namespace sixpoint::bench
