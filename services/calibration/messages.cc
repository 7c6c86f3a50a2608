#include "services/calibration/messages.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "metrology/kinematics/calibration_parameters.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::calibration {
namespace {

constexpr int kMostResting = 1000;  // in one answer

absl::Status Damaged(const std::string& calibration, const char* what) {
  return absl::DataLossError(calibration + ": its " + what + " cannot be read");
}

// As rows.cc keeps them.
absl::Status ArmSharesToProto(const std::string& calibration, const std::string& json, v1::SensorCalibration* out) {
  const nlohmann::json shares = nlohmann::json::parse(json, nullptr, false);
  if (!shares.is_array()) return Damaged(calibration, "arm shares");
  for (const nlohmann::json& kept : shares) {
    const auto series = kept.find("series"), response = kept.find("response");
    if (series == kept.end() || !series->is_string() || response == kept.end() || !response->is_array() ||
        response->size() != metrology::kSensorParameterCount * metrology::kSensorParameterCount ||
        !std::all_of(response->begin(), response->end(), [](const auto& value) { return value.is_number(); }))
      return Damaged(calibration, "arm shares");
    v1::ArmShare* share = out->add_arm_shares();
    share->set_arm_series(series->get<std::string>());
    runtime::SetMatrix(response->get<std::vector<double>>(), metrology::kSensorParameterCount,
                       metrology::kSensorParameterCount, share->mutable_response());
  }
  return absl::OkStatus();
}

absl::Status SensorToProto(const std::string& calibration, const storage::SensorCalibrationRow& row,
                           v1::SensorCalibration* out) {
  out->mutable_machine_from_sensor_rotation()->Add(row.machine_from_sensor_rotation.begin(),
                                                   row.machine_from_sensor_rotation.end());
  runtime::SetPoint(row.t_sm_mm, out->mutable_t_sm_mm());
  out->set_alpha_deg(row.alpha_deg);
  out->set_beta_deg(row.beta_deg);
  out->set_gamma_deg(row.gamma_deg);
  runtime::SetMatrix(row.covariance, metrology::kSensorParameterCount, metrology::kSensorParameterCount,
                     out->mutable_covariance());
  out->set_alpha_standard_uncertainty_deg(row.alpha_standard_uncertainty_deg);
  out->set_beta_standard_uncertainty_deg(row.beta_standard_uncertainty_deg);
  out->set_gamma_standard_uncertainty_deg(row.gamma_standard_uncertainty_deg);
  const auto sigma = [&](int k) { return std::sqrt(row.covariance.at(7 * k)); };
  runtime::SetPoint({sigma(3), sigma(4), sigma(5)}, out->mutable_t_sm_standard_uncertainty_mm());
  if (row.residual_rms_um) out->set_residual_rms_um(*row.residual_rms_um);
  if (row.condition_number) out->set_condition_number(*row.condition_number);
  out->set_certificate(row.certificate);
  if (!row.field_response.empty())
    runtime::SetMatrix(row.field_response, metrology::kSensorParameterCount, metrology::kFieldParameterCount,
                       out->mutable_field_response());
  if (!row.field_terms_um.empty()) {
    out->mutable_field_terms_um()->Add(row.field_terms_um.begin(), row.field_terms_um.end());
    runtime::SetMatrix(row.field_covariance_um2, metrology::kFieldParameterCount, metrology::kFieldParameterCount,
                       out->mutable_field_covariance_um2());
    double left_um2 = 0;
    for (std::size_t k = 0; k < row.field_covariance_um2.size(); k += metrology::kFieldParameterCount + 1)
      left_um2 += row.field_covariance_um2[k];
    out->set_field_left_um(std::sqrt(left_um2));
  }
  if (row.field_stated_um) out->set_field_stated_um(*row.field_stated_um);
  if (!row.arm_shares_json.empty())
    if (absl::Status status = ArmSharesToProto(calibration, row.arm_shares_json, out); !status.ok()) return status;
  out->set_arm_series(row.arm_series);
  out->set_sensor_serial_number(row.sensor_serial_number);
  if (!row.travel.empty()) {
    const auto travel = runtime::StoredEnum<ingest::v1::ScanTravel>(row.travel, calibration);
    if (!travel.ok()) return travel.status();
    out->set_travel(*travel);
  }
  if (row.degrees_of_freedom) out->set_degrees_of_freedom(*row.degrees_of_freedom);
  for (const storage::CentreResidualRow& c : row.centres) {
    v1::FeatureResidual* residual = c.is_check ? out->add_check() : out->add_fitted();
    residual->set_scan(runtime::NameOf("scans", c.scan_id));
    residual->set_feature(c.feature);
    residual->set_dx_um(c.dx_um);
    residual->set_dy_um(c.dy_um);
    residual->set_dz_um(c.dz_um);
  }
  return absl::OkStatus();
}

void RotationToProto(const storage::RotationCalibrationRow& row, v1::RotationCalibration* out) {
  runtime::SetLine(row.a_direction, row.a_point_mm, out->mutable_a_axis());
  runtime::SetLine(row.b_direction, row.b_point_mm, out->mutable_b_axis());
  runtime::SetPoint(row.point_c_mm, out->mutable_point_c_mm());
  runtime::SetPoint(row.point_c_standard_uncertainty_mm, out->mutable_point_c_standard_uncertainty_mm());
  runtime::SetMatrix(row.covariance, metrology::kAxisParameterCount, metrology::kAxisParameterCount,
                     out->mutable_covariance());
  if (!row.linear_response.empty())
    runtime::SetMatrix(row.linear_response, metrology::kAxisParameterCount, metrology::kLinearParameterCount,
                       out->mutable_linear_response());
  out->set_residual_rms_um(row.residual_rms_um);
  if (row.check_count > 0) out->set_check_rms_um(row.check_rms_um);
  out->set_check_count(row.check_count);
  if (row.degrees_of_freedom) out->set_degrees_of_freedom(*row.degrees_of_freedom);
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

void SetEstimate(const storage::AngleEstimateRow& in, v1::AngleEstimate* out) {
  out->set_value_deg(in.value_deg);
  out->set_standard_uncertainty_deg(in.standard_uncertainty_deg);
}

void SetPeriodic(int order, const storage::AngleEstimateRow& amplitude, v1::PeriodicError* out) {
  out->set_period_deg(360.0 / order);
  SetEstimate(amplitude, out->mutable_amplitude());
}

void AxisToProto(const storage::AxisCharacterisationRow& row, v1::AxisCharacterisation* out) {
  out->set_axis(row.axis);
  out->set_reading_count(row.reading_count);
  if (row.beyond_limits_count) out->set_beyond_limits_count(*row.beyond_limits_count);
  SetEstimate(row.reversal, out->mutable_reversal());
  SetEstimate(row.mean, out->mutable_mean());
  SetPeriodic(row.long_wave_order, row.long_wave_amplitude, out->mutable_long_wave());
  if (row.periodic_order) SetPeriodic(*row.periodic_order, row.periodic_amplitude, out->mutable_periodic());
  out->set_least_detectable_deg(row.least_detectable_deg);
  SetEstimate(row.greatest_error, out->mutable_greatest_error());
  out->set_greatest_error_at_deg(row.greatest_error_at_deg);
  out->set_greatest_error_travel(row.greatest_error_forward ? v1::TRAVEL_FORWARD : v1::TRAVEL_BACKWARD);
  SetEstimate(row.standard_uncertainty, out->mutable_standard_uncertainty());
  SetEstimate(row.compensated_standard_uncertainty, out->mutable_compensated_standard_uncertainty());
  SetEstimate(row.noise, out->mutable_noise());
  v1::AngleErrorTable* table = out->mutable_table();
  table->set_standard_uncertainty_deg(row.table_standard_uncertainty_deg);
  if (row.forward_error_deg.empty()) return;
  table->set_step_deg(360.0 / static_cast<double>(row.forward_error_deg.size()));
  table->mutable_forward_error_deg()->Add(row.forward_error_deg.begin(), row.forward_error_deg.end());
  table->mutable_backward_error_deg()->Add(row.backward_error_deg.begin(), row.backward_error_deg.end());
}

void ProbeToProto(const storage::ProbeCalibrationRow& row, v1::ProbeCalibration* out) {
  out->set_block(row.block);
  out->mutable_approach()->Add(row.approach.begin(), row.approach.end());
  runtime::SetPoint(row.offset_mm, out->mutable_offset_mm());
  runtime::SetMatrix(row.covariance, 6, 6, out->mutable_covariance());
  out->set_scale(row.scale);
  out->set_scale_standard_uncertainty(row.scale_standard_uncertainty);
  out->set_direction_standard_uncertainty_urad(row.direction_standard_uncertainty_urad);
  runtime::SetPoint(row.point_standard_uncertainty_mm, out->mutable_point_standard_uncertainty_mm());
  out->set_noise_um(row.noise_um);
  out->set_noise_factor(row.noise_factor);
  out->set_residual_rms_um(row.residual_rms_um);
  out->set_touch_rms_um(row.touch_rms_um);
  out->set_condition_number(row.condition_number);
  out->set_displacement_matrix_condition_number(row.displacement_matrix_condition_number);
  out->set_worst_approach_angle_deg(row.worst_approach_angle_deg);
  for (const storage::ProbeResidualRow& r : row.readings) {
    v1::ProbeResidual* residual = out->add_residuals();
    residual->set_face(r.face);
    residual->set_displacement_mm(r.displacement_mm);
    residual->set_residual_um(r.residual_um);
  }
  for (const storage::ProbeFaceCheckRow& c : row.checks) {
    v1::ProbeFaceCheck* check = out->add_check();
    check->set_face(c.face);
    check->set_reading_count(c.reading_count);
    check->set_angle_urad(c.angle_urad);
    check->set_origin_distance_um(c.origin_distance_um);
    check->set_distance_um(c.distance_um);
    check->set_residual_range_um(c.residual_range_um);
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

// As rows.cc keeps them. What is no number there (JSON has none for NaN) is not one here.
absl::Status JudgementsToProto(const std::string& judgements_json, v1::Calibration* out) {
  if (judgements_json.empty()) return absl::OkStatus();
  const nlohmann::json judgements = nlohmann::json::parse(judgements_json, nullptr, false);
  if (!judgements.is_array()) return Damaged(out->name(), "judgements");
  for (const nlohmann::json& kept : judgements) {
    const auto of = kept.find("of"), agrees = kept.find("agrees");
    if (of == kept.end() || !of->is_string() || agrees == kept.end() || !agrees->is_boolean())
      return Damaged(out->name(), "judgements");
    const auto number = [&](const char* key) {
      const auto found = kept.find(key);
      return found != kept.end() && found->is_number() ? found->get<double>() : std::nan("");
    };
    v1::ResidualJudgement* judged = out->add_judgements();
    judged->set_of(of->get<std::string>());
    judged->set_ratio(number("ratio"));
    judged->set_count(number("count"));
    judged->set_probability(number("probability"));
    judged->set_agrees(agrees->get<bool>());
  }
  return absl::OkStatus();
}

absl::Status StateToProto(const storage::CalibrationRow& row, v1::Calibration* out) {
  out->set_state(ToProto(row.state));
  if (!row.superseded_by.empty()) out->set_superseded_by(runtime::NameOf("calibrations", row.superseded_by));
  if (row.release) EventToProto(*row.release, out->mutable_release());
  if (row.withdrawal) EventToProto(*row.withdrawal, out->mutable_withdrawal());
  if (absl::Status status = JudgementsToProto(row.judgements_json, out); !status.ok()) return status;
  if (row.interim) {
    v1::InterimState* interim = out->mutable_interim_check();
    interim->set_study(runtime::NameOf("studies", row.interim->study_id));
    const auto verdict = runtime::StoredEnum<v1::StudyVerdict>(row.interim->verdict, interim->study());
    if (!verdict.ok()) return verdict.status();
    interim->set_verdict(*verdict);
    if (row.interim->stood_until) runtime::ToProto(*row.interim->stood_until, interim->mutable_stood_until());
  }
  const storage::EnvironmentRow& environment = row.environment;
  if (!environment.temperature_c && !environment.humidity_percent && environment.note.empty()) return absl::OkStatus();
  v1::Environment* message = out->mutable_environment();
  if (environment.temperature_c) message->set_temperature_c(*environment.temperature_c);
  if (environment.temperature_standard_uncertainty_c)
    message->set_temperature_standard_uncertainty_c(*environment.temperature_standard_uncertainty_c);
  if (environment.humidity_percent) message->set_humidity_percent(*environment.humidity_percent);
  message->set_note(environment.note);
  return absl::OkStatus();
}

void AddResting(const std::vector<storage::JournalEntry>& derived, v1::WithdrawCalibrationResponse* response) {
  std::set<std::string> blades;
  for (const storage::JournalEntry& journal : derived) {
    const storage::RecordEntry& entry = journal.entry;
    if (entry.kind == "release" || entry.kind == "withdrawal") continue;  // decisions, not results
    response->set_resting_count(response->resting_count() + 1);
    const std::string blade = entry.blade ? runtime::NameOf("blades", *entry.blade) : "";
    if (!blade.empty() && blades.insert(blade).second) response->add_blades(blade);
    if (response->resting_size() == kMostResting) continue;
    v1::RestingResult* out = response->add_resting();
    out->set_name(entry.name);
    out->set_kind(entry.kind);
    out->set_blade(blade);
    out->set_requested_by(entry.requested_by);
    runtime::ToProto(journal.recorded.recorded_at, out->mutable_recorded_at());
  }
}

}  // namespace

absl::StatusOr<v1::Calibration> ToProto(const storage::CalibrationRow& row) {
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
  if (row.sensor)
    if (absl::Status status = SensorToProto(out.name(), *row.sensor, out.mutable_sensor()); !status.ok()) return status;
  if (row.rotation) RotationToProto(*row.rotation, out.mutable_rotation());
  if (row.probe) ProbeToProto(*row.probe, out.mutable_probe());
  if (row.axis) AxisToProto(*row.axis, out.mutable_axis());
  if (absl::Status status = StateToProto(row, &out); !status.ok()) return status;
  return out;
}

absl::StatusOr<v1::WithdrawCalibrationResponse> ToProto(const storage::WithdrawnCalibrationRow& row) {
  v1::WithdrawCalibrationResponse response;
  absl::StatusOr<v1::Calibration> calibration = ToProto(row.calibration);
  if (!calibration.ok()) return calibration.status();
  *response.mutable_calibration() = *std::move(calibration);
  AddResting(row.resting, &response);
  if (row.in_force) response.set_in_force(row.in_force->name());
  return response;
}

}  // namespace sixpoint::calibration
