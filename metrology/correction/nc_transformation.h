// What a control's five-axis transformation makes of a point and a direction on the part: the way back from nc_program.h, with which it
// shares no code.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>

#include "metrology/kinematics/rotary_axes.h"

namespace sixpoint::metrology {

// X, Y, Z of the tip in machine coordinates and both rotary axes in deg. Of two ways to stand so the control takes the one that is
// nearer to where the rotary axes stand (from_deg). Refused with `wrong`: a direction that is not of length 1 within 1e-3, that no
// angles reach, along which an axis is free, and two ways that are as near within 1 deg.
absl::StatusOr<std::array<double, 5>> AxesOfDirection(
    const RotaryAxes& axes, const Eigen::Vector3d& point_on_part_mm, const Eigen::Vector3d& direction_on_part,
    const std::array<double, 2>& from_deg, const std::function<absl::Status(const std::string& wanted)>& wrong);

}  // namespace sixpoint::metrology
