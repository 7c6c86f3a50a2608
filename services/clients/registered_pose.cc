#include "services/clients/registered_pose.h"

#include <cmath>
#include <set>
#include <string>

#include "refusal/message_text.h"
#include "services/clients/error_sources.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::clients {
namespace {

absl::StatusOr<metrology::AngleInfluence::Axis> AxisOf(const std::string& field, const std::string& letter,
                                                       const FetchedRotationCalibration& rotation) {
  if (letter == rotation.letters[0]) return metrology::AngleInfluence::Axis::kA;
  if (letter == rotation.letters[1]) return metrology::AngleInfluence::Axis::kB;
  return runtime::Refuse(field, letter,
                         rotation.letters[0] + " or " + rotation.letters[1] + ", as in " + rotation.name);
}

absl::StatusOr<metrology::AngleInfluence> AngleOf(const registration::v1::ScanAngle& in,
                                                  metrology::AngleInfluence::Axis axis) {
  if (in.pose_per_rad_size() != 6)
    return runtime::Refuse("registration.angles.pose_per_rad", std::to_string(in.pose_per_rad_size()) + " values", "6");
  metrology::AngleInfluence angle;
  angle.axis = axis;
  angle.commanded_rad = in.commanded_deg() * runtime::kRadPerDeg;
  angle.reached_rad = in.reached_deg() * runtime::kRadPerDeg;
  angle.standard_uncertainty_rad = in.standard_uncertainty_deg() * runtime::kRadPerDeg;
  angle.half_reversal_rad = in.half_reversal_deg() * runtime::kRadPerDeg;
  for (int i = 0; i < 6; ++i) angle.pose_per_rad(i) = in.pose_per_rad(i);
  if (!angle.pose_per_rad.allFinite() || !std::isfinite(angle.standard_uncertainty_rad + angle.half_reversal_rad))
    return runtime::Refuse("registration.angles", in.axis() + " " + NumberText(in.commanded_deg()),
                           "finite uncertainties and a finite influence");
  return angle;
}

// As it was kept; in registrations from before that the two calibrations' own noise.
absl::StatusOr<std::vector<metrology::ErrorSource>> SourcesOf(const registration::v1::Registration& registration,
                                                              const metrology::SensorPose& sensor,
                                                              const FetchedRotationCalibration& rotation) {
  if (registration.error_sources_size() > 0)
    return FromProto("registration.error_sources", registration.error_sources());
  const auto kept = runtime::FromProto("registration.calibration_sensitivity", registration.calibration_sensitivity());
  if (!kept.ok()) return kept.status();
  if (kept->rows() != 6 || kept->cols() != metrology::kCalibratedParameterCount)
    return runtime::Refuse("registration.calibration_sensitivity",
                           std::to_string(kept->rows()) + " x " + std::to_string(kept->cols()),
                           "6 x " + std::to_string(metrology::kCalibratedParameterCount));
  metrology::PoseSensitivity sensitivity = metrology::PoseSensitivity::Zero();
  sensitivity.leftCols<metrology::kCalibratedParameterCount>() = *kept;
  std::vector<metrology::ErrorSource> sources = {
      metrology::SensorCalibrationSource(sensor.covariance, sensor.degrees_of_freedom,
                                         registration.sensor_calibration()),
      metrology::RotationCalibrationSource(rotation.covariance, rotation.degrees_of_freedom,
                                           registration.rotation_calibration())};
  metrology::ActOnPose(sensitivity, &sources);
  return sources;
}

}  // namespace

absl::Status CheckConverged(const registration::v1::Registration& registration) {
  if (registration.evidence().outcome() == registration::v1::OUTCOME_CONVERGED && registration.has_zero_from_part())
    return absl::OkStatus();
  const std::string remark = registration.evidence().remark();
  return runtime::Failure(errors::v1::REGISTRATION_NOT_CONVERGED,
                          "registration: " + registration.name() + " has the outcome " +
                              registration::v1::Outcome_Name(registration.evidence().outcome()) +
                              (remark.empty() ? "" : " (" + remark + ")") + ", want OUTCOME_CONVERGED",
                          {{"resource", registration.name()},
                           {"outcome", registration::v1::Outcome_Name(registration.evidence().outcome())}});
}

absl::StatusOr<metrology::RegisteredPose> RegisteredPoseOf(const registration::v1::Registration& registration,
                                                           const metrology::SensorPose& sensor,
                                                           const FetchedRotationCalibration& rotation,
                                                           const std::vector<FetchedAxis>& tables,
                                                           const plant::v1::Machine& machine) {
  const auto zero_from_part = runtime::FromProto("registration.zero_from_part", registration.zero_from_part());
  if (!zero_from_part.ok()) return zero_from_part.status();
  const auto noise = runtime::FromProto("registration.noise_covariance", registration.noise_covariance());
  if (!noise.ok()) return noise.status();
  absl::StatusOr<std::vector<metrology::ErrorSource>> sources = SourcesOf(registration, sensor, rotation);
  if (!sources.ok()) return sources.status();
  metrology::RegisteredPose pose(*zero_from_part, *noise, *std::move(sources));
  for (const FetchedAxis& table : tables) {
    const absl::StatusOr<metrology::AngleInfluence::Axis> axis = AxisOf(table.name, table.axis, rotation);
    if (!axis.ok()) return axis.status();
    metrology::AxisPositioning& positioning =
        *axis == metrology::AngleInfluence::Axis::kA ? pose.positioning.a : pose.positioning.b;
    positioning = table.positioning;
    positioning.approach = ApproachOf(machine);
  }
  for (const registration::v1::ScanAngle& in : registration.angles()) {
    const absl::StatusOr<metrology::AngleInfluence::Axis> axis =
        AxisOf("registration.angles.axis", in.axis(), rotation);
    if (!axis.ok()) return axis.status();
    absl::StatusOr<metrology::AngleInfluence> angle = AngleOf(in, *axis);
    if (!angle.ok()) return angle.status();
    // Without a table all angles of an axis have one figure, and what is drilled has it too.
    metrology::AxisPositioning& positioning =
        *axis == metrology::AngleInfluence::Axis::kA ? pose.positioning.a : pose.positioning.b;
    if (!positioning.table) positioning.standard_uncertainty_rad = angle->standard_uncertainty_rad;
    pose.angles.push_back(*std::move(angle));
  }
  return pose;
}

absl::StatusOr<std::vector<FetchedAxis>> TablesOf(
    const registration::v1::Registration& registration, const CalibrationClient& calibrations,
    const std::function<std::unique_ptr<grpc::ClientContext>()>& context) {
  std::set<std::string> names;
  for (const registration::v1::ScanAngle& angle : registration.angles())
    if (!angle.characterisation().empty()) names.insert(angle.characterisation());
  std::vector<FetchedAxis> tables;
  for (const std::string& name : names) {
    absl::StatusOr<FetchedAxis> table = calibrations.Axis(name, context());
    if (!table.ok()) return table.status();
    tables.push_back(*std::move(table));
  }
  return tables;
}

}  // namespace sixpoint::clients
