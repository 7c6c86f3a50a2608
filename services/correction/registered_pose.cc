#include "services/correction/registered_pose.h"

#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::clients {

absl::Status CheckConverged(const registration::v1::Registration& registration) {
  if (registration.evidence().outcome() == registration::v1::OUTCOME_CONVERGED && registration.has_zero_from_part())
    return absl::OkStatus();
  const std::string remark = registration.evidence().remark();
  return runtime::Failure(absl::StatusCode::kFailedPrecondition, "REGISTRATION_NOT_CONVERGED",
                          "registration: " + registration.name() + " has the outcome " +
                              registration::v1::Outcome_Name(registration.evidence().outcome()) +
                              (remark.empty() ? "" : " (" + remark + ")") + ", want OUTCOME_CONVERGED");
}

absl::StatusOr<metrology::RegisteredPose> RegisteredPoseOf(const registration::v1::Registration& registration,
                                                           const metrology::SensorPose& sensor,
                                                           const metrology::Matrix8d& axes_covariance) {
  metrology::RegisteredPose pose;
  const auto zero_from_part = runtime::FromProto("registration.zero_from_part", registration.zero_from_part());
  if (!zero_from_part.ok()) return zero_from_part.status();
  pose.zero_from_part = *zero_from_part;
  const auto noise = runtime::FromProto("registration.noise_covariance", registration.noise_covariance());
  if (!noise.ok()) return noise.status();
  pose.noise = *noise;
  const auto covariance = runtime::FromProto("registration.covariance", registration.covariance());
  if (!covariance.ok()) return covariance.status();
  pose.sensitivity_reference_mm = covariance->reference_mm;
  const auto sensitivity =
      runtime::FromProto("registration.calibration_sensitivity", registration.calibration_sensitivity());
  if (!sensitivity.ok()) return sensitivity.status();
  if (sensitivity->rows() != 6 || sensitivity->cols() != 14) {
    return runtime::Refuse("registration.calibration_sensitivity",
                           std::to_string(sensitivity->rows()) + " x " + std::to_string(sensitivity->cols()), "6 x 14");
  }
  pose.calibration_sensitivity = *sensitivity;
  pose.calibration_covariance.topLeftCorner<6, 6>() = sensor.covariance;
  pose.calibration_covariance.bottomRightCorner<8, 8>() = axes_covariance;
  return pose;
}

}  // namespace sixpoint::clients
