// How the angles that scans were taken at make a pose uncertain (docs/methods/uncertainty.md, angles of scans).
#pragma once

#include <vector>

#include "metrology/registration/machine_calibration.h"
#include "metrology/registration/pose_fit.h"
#include "metrology/registration/scan_portion.h"

namespace sixpoint::metrology {

// The distinct angles of those axes that are uncertain, a before b, each in the order of the portions; without their
// influence on a pose.
std::vector<AngleInfluence> UncertainAngles(const std::vector<ScanPortion>& portions,
                                            const RotaryPositioning& positioning);

// Of all that maps these portions (columns of MappingSensitivity): the calibrations, and the angles.
Eigen::MatrixXd MappingCovariance(const MachineCalibration& calibration, const std::vector<ScanPortion>& portions);

// What each of these angles does to a pose that was found from these portions: all scans at it are turned alike.
std::vector<AngleInfluence> InfluencesOf(std::vector<AngleInfluence> angles, const std::vector<ScanPortion>& portions,
                                         const PlacedPose& placed);

}  // namespace sixpoint::metrology
