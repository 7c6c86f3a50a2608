// A registration as kernels take it: the pose with all that made it uncertain.
#pragma once

#include <absl/status/statusor.h>

#include "metrology/correction/registered_pose.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/scanner/line_scanner.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::clients {

// FAILED_PRECONDITION (REGISTRATION_NOT_CONVERGED), with the registration's evidence, unless its outcome is CONVERGED.
absl::Status CheckConverged(const registration::v1::Registration& registration);

// sensor and axes_covariance: of the calibrations that the registration names. Refuses what is missing or not finite.
absl::StatusOr<metrology::RegisteredPose> RegisteredPoseOf(const registration::v1::Registration& registration,
                                                           const metrology::SensorPose& sensor,
                                                           const metrology::Matrix8d& axes_covariance);

}  // namespace sixpoint::clients
