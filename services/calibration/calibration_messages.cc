#include "services/calibration/calibration_messages.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "services/calibration/axis_messages.h"
#include "services/calibration/probe_messages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::calibration {
namespace {

constexpr double kDegPerRad = 180 / M_PI;
constexpr double kUmPerMm = 1000;

template <typename Matrix>
std::vector<double> RowMajor(const Matrix& matrix) {
  std::vector<double> values;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) values.push_back(matrix(row, column));
  return values;
}

void SetPoint(const std::vector<double>& in, geometry::v1::Point* out) {
  out->set_x_mm(in.at(0));
  out->set_y_mm(in.at(1));
  out->set_z_mm(in.at(2));
}

void SetLine(const std::vector<double>& direction, const std::vector<double>& point, geometry::v1::Line* out) {
  out->mutable_direction()->set_x(direction.at(0));
  out->mutable_direction()->set_y(direction.at(1));
  out->mutable_direction()->set_z(direction.at(2));
  SetPoint(point, out->mutable_point_mm());
}

void SetMatrix(const std::vector<double>& values, int size, geometry::v1::Matrix* out) {
  out->set_row_count(size);
  out->set_column_count(size);
  out->mutable_values()->Add(values.begin(), values.end());
}

void SensorToProto(const storage::SensorCalibrationRow& row, v1::SensorCalibration* out) {
  out->mutable_machine_from_sensor_rotation()->Add(row.machine_from_sensor_rotation.begin(),
                                                   row.machine_from_sensor_rotation.end());
  SetPoint(row.t_sm_mm, out->mutable_t_sm_mm());
  out->set_alpha_deg(row.alpha_deg);
  out->set_beta_deg(row.beta_deg);
  out->set_gamma_deg(row.gamma_deg);
  SetMatrix(row.covariance, metrology::kSensorParameterCount, out->mutable_covariance());
  out->set_alpha_standard_uncertainty_deg(row.alpha_standard_uncertainty_deg);
  out->set_beta_standard_uncertainty_deg(row.beta_standard_uncertainty_deg);
  out->set_gamma_standard_uncertainty_deg(row.gamma_standard_uncertainty_deg);
  const auto sigma = [&](int k) { return std::sqrt(row.covariance.at(7 * k)); };
  SetPoint({sigma(3), sigma(4), sigma(5)}, out->mutable_t_sm_standard_uncertainty_mm());
  out->set_residual_rms_um(row.residual_rms_um);
  out->set_condition_number(row.condition_number);
  for (const storage::CentreResidualRow& c : row.centres) {
    v1::FeatureResidual* residual = c.is_check ? out->add_check() : out->add_fitted();
    residual->set_scan(runtime::NameOf("scans", c.scan_id));
    residual->set_feature(c.feature);
    residual->set_dx_um(c.dx_um);
    residual->set_dy_um(c.dy_um);
    residual->set_dz_um(c.dz_um);
  }
}

void RotationToProto(const storage::RotationCalibrationRow& row, v1::RotationCalibration* out) {
  SetLine(row.a_direction, row.a_point_mm, out->mutable_a_axis());
  SetLine(row.b_direction, row.b_point_mm, out->mutable_b_axis());
  SetPoint(row.point_c_mm, out->mutable_point_c_mm());
  SetPoint(row.point_c_standard_uncertainty_mm, out->mutable_point_c_standard_uncertainty_mm());
  SetMatrix(row.covariance, metrology::kAxisParameterCount, out->mutable_covariance());
  out->set_residual_rms_um(row.residual_rms_um);
  if (row.check_count > 0) out->set_check_rms_um(row.check_rms_um);
  out->set_check_count(row.check_count);
  out->set_condition_number(row.condition_number);
  for (const std::string& axis : row.axes) out->add_axes(axis);
  for (const storage::PoseResidualRow& p : row.poses) {
    v1::PoseResidual* residual = out->add_residuals();
    residual->set_a_deg(p.a_deg);
    residual->set_b_deg(p.b_deg);
    residual->set_distance_um(p.distance_um);
    residual->set_held_out(p.held_out);
    if (p.before_um) residual->set_before_um(*p.before_um);
  }
}

v1::CalibrationState ToProto(storage::CalibrationState state) {
  switch (state) {
    case storage::CalibrationState::kDraft:
      return v1::CALIBRATION_STATE_DRAFT;
    case storage::CalibrationState::kNotYetValid:
      return v1::CALIBRATION_STATE_NOT_YET_VALID;
    case storage::CalibrationState::kInForce:
      return v1::CALIBRATION_STATE_IN_FORCE;
    case storage::CalibrationState::kSuperseded:
      return v1::CALIBRATION_STATE_SUPERSEDED;
    case storage::CalibrationState::kExpired:
      return v1::CALIBRATION_STATE_EXPIRED;
    case storage::CalibrationState::kWithdrawn:
      return v1::CALIBRATION_STATE_WITHDRAWN;
  }
  return v1::CALIBRATION_STATE_UNSPECIFIED;
}

void EventToProto(const storage::CalibrationEvent& event, v1::CalibrationEvent* out) {
  out->set_reason(event.reason);
  out->set_requested_by(event.requested_by);
  runtime::ToProto(event.recorded.recorded_at, out->mutable_recorded_at());
  out->set_record_sequence(event.recorded.sequence);
}

void StateToProto(const storage::CalibrationRow& row, v1::Calibration* out) {
  out->set_state(ToProto(row.state));
  if (!row.superseded_by.empty()) out->set_superseded_by(runtime::NameOf("calibrations", row.superseded_by));
  if (row.release) EventToProto(*row.release, out->mutable_release());
  if (row.withdrawal) EventToProto(*row.withdrawal, out->mutable_withdrawal());
  const storage::EnvironmentRow& environment = row.environment;
  if (!environment.temperature_c && !environment.humidity_percent && environment.note.empty()) return;
  v1::Environment* message = out->mutable_environment();
  if (environment.temperature_c) message->set_temperature_c(*environment.temperature_c);
  if (environment.temperature_standard_uncertainty_c)
    message->set_temperature_standard_uncertainty_c(*environment.temperature_standard_uncertainty_c);
  if (environment.humidity_percent) message->set_humidity_percent(*environment.humidity_percent);
  message->set_note(environment.note);
}

}  // namespace

storage::EnvironmentRow RowOf(const v1::Environment& in) {
  storage::EnvironmentRow row;
  if (in.has_temperature_c()) row.temperature_c = in.temperature_c();
  if (in.has_temperature_standard_uncertainty_c())
    row.temperature_standard_uncertainty_c = in.temperature_standard_uncertainty_c();
  if (in.has_humidity_percent()) row.humidity_percent = in.humidity_percent();
  row.note = in.note();
  return row;
}

storage::SensorCalibrationRow RowOf(const metrology::SensorCalibration& result) {
  storage::SensorCalibrationRow row;
  row.machine_from_sensor_rotation = RowMajor(result.sensor.rotation);
  row.t_sm_mm = RowMajor(result.sensor.t_sm_mm);
  row.covariance = RowMajor(result.sensor.covariance);
  row.alpha_deg = result.angles.alpha * kDegPerRad;
  row.beta_deg = result.angles.beta * kDegPerRad;
  row.gamma_deg = result.angles.gamma * kDegPerRad;
  row.alpha_standard_uncertainty_deg = result.angle_uncertainty.alpha * kDegPerRad;
  row.beta_standard_uncertainty_deg = result.angle_uncertainty.beta * kDegPerRad;
  row.gamma_standard_uncertainty_deg = result.angle_uncertainty.gamma * kDegPerRad;
  row.noise_um = result.noise_mm * kUmPerMm;
  row.touch_rms_um = result.touch_rms_mm * kUmPerMm;
  row.residual_rms_um = result.residual_rms_mm * kUmPerMm;
  row.condition_number = result.condition_number;
  row.points_used = static_cast<std::int64_t>(result.points_used);
  for (const auto* centres : {&result.fitted, &result.check})
    for (const metrology::CentreResidual& c : *centres) {
      const Eigen::Vector3d d = kUmPerMm * c.laser_minus_touch_mm;
      row.centres.push_back({c.scan, c.feature, centres == &result.check, d.x(), d.y(), d.z()});
    }
  return row;
}

storage::RotationCalibrationRow RowOf(const metrology::RotationCalibration& result,
                                      const std::vector<metrology::SpherePose>& poses,
                                      const metrology::RotationOptions& options) {
  storage::RotationCalibrationRow row;
  row.a_direction = RowMajor(result.axes.a.direction);
  row.a_point_mm = RowMajor(result.axes.a.point_mm);
  row.b_direction = RowMajor(result.axes.b.direction);
  row.b_point_mm = RowMajor(result.axes.b.point_mm);
  row.covariance = RowMajor(result.covariance);
  row.point_c_mm = RowMajor(result.point_c_mm);
  const Eigen::Vector3d sigma = result.point_c_covariance_mm2.diagonal().cwiseMax(0).cwiseSqrt();
  row.point_c_standard_uncertainty_mm = RowMajor(sigma);
  row.noise_um = result.noise_mm * kUmPerMm;
  row.residual_rms_um = result.residual_rms_mm * kUmPerMm;
  row.check_rms_um = result.check_rms_mm * kUmPerMm;
  row.check_count = result.check_count;
  row.condition_number = result.condition_number;
  for (size_t i = 0; i < poses.size(); ++i)
    row.poses.push_back({poses[i].a_rad * kDegPerRad, poses[i].b_rad * kDegPerRad, result.distances_mm.at(i) * kUmPerMm,
                         poses[i].held_out, result.before_mm.at(i) * kUmPerMm});
  row.axes = {options.joints[0].axis, options.joints[1].axis};
  return row;
}

v1::Calibration ToProto(const storage::CalibrationRow& row) {
  v1::Calibration out;
  out.set_name(row.name());
  out.set_machine(runtime::NameOf("machines", row.machine_id));
  out.set_kind(row.sensor  ? v1::CALIBRATION_KIND_SENSOR
               : row.probe ? v1::CALIBRATION_KIND_PROBE
               : row.axis  ? v1::CALIBRATION_KIND_AXIS
                           : v1::CALIBRATION_KIND_ROTATION);
  out.set_method(row.method);
  for (const std::string& input : row.inputs) out.add_inputs(input);
  runtime::ToProto(row.valid_from, out.mutable_valid_from());
  runtime::ToProto(row.valid_until, out.mutable_valid_until());
  out.set_requested_by(row.requested_by);
  out.set_software_version(row.software_version);
  runtime::ToProto(row.recorded.recorded_at, out.mutable_recorded_at());
  out.set_record_sequence(row.recorded.sequence);
  if (row.sensor) SensorToProto(*row.sensor, out.mutable_sensor());
  if (row.rotation) RotationToProto(*row.rotation, out.mutable_rotation());
  if (row.probe) ProbeToProto(*row.probe, out.mutable_probe());
  if (row.axis) *out.mutable_axis() = ToProto(*row.axis);
  StateToProto(row, &out);
  return out;
}

std::string SummaryOf(const storage::CalibrationRow& row) {
  nlohmann::json summary{{"kind", row.kind()}};
  if (row.is_draft) summary["draft"] = true;
  if (row.environment.temperature_c) summary["temperature_c"] = *row.environment.temperature_c;
  if (row.sensor) {
    summary["alpha_deg"] = row.sensor->alpha_deg;
    summary["beta_deg"] = row.sensor->beta_deg;
    summary["gamma_deg"] = row.sensor->gamma_deg;
    summary["residual_rms_um"] = row.sensor->residual_rms_um;
  } else if (row.probe) {
    summary["approach"] = row.probe->approach;
    summary["offset_mm"] = row.probe->offset_mm;
    summary["residual_rms_um"] = row.probe->residual_rms_um;
  } else if (row.axis) {
    summary["axis"] = row.axis->axis;
    summary["reversal_deg"] = row.axis->reversal.value_deg;
    summary["greatest_error_deg"] = row.axis->greatest_error.value_deg;
    summary["standard_uncertainty_deg"] = row.axis->standard_uncertainty.value_deg;
    if (row.axis->periodic_order) summary["periodic_amplitude_deg"] = row.axis->periodic_amplitude.value_deg;
  } else {
    summary["point_c_mm"] = row.rotation->point_c_mm;
    summary["residual_rms_um"] = row.rotation->residual_rms_um;
    summary["check_rms_um"] = row.rotation->check_rms_um;
  }
  return summary.dump();
}

}  // namespace sixpoint::calibration
