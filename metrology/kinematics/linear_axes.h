// What a machine's linear axes read where they are not true: stretched, or not square to each other (ISO 230-1, 3.5 and 3.6; docs/methods/uncertainty.md,
// error sources).
#pragma once

#include <Eigen/Core>

#include "metrology/kinematics/calibration_parameters.h"
#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

// Change of what is read of a true machine position per parameter, in the order of kLinearParameters.
Eigen::Matrix<double, 3, kLinearParameterCount> LinearAxesJacobian(const Eigen::Vector3d& machine_mm);

// How both rotary axes are found off where every point of theirs is read so: of a calibration that did not keep its own response.
LinearResponse LineResponse(const RotaryAxes& axes);

}  // namespace sixpoint::metrology
