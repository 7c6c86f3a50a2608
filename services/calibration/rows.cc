#include "services/calibration/rows.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/units.h"

namespace sixpoint::calibration {
namespace {

constexpr double kMicroPerOne = 1e6;

storage::AngleEstimateRow Degrees(const metrology::Estimate& estimate) {
  return {estimate.value / runtime::kRadPerDeg, estimate.standard_uncertainty / runtime::kRadPerDeg};
}

std::vector<double> Scaled(const std::vector<double>& values, double factor) {
  std::vector<double> scaled;
  for (const double value : values) scaled.push_back(value * factor);
  return scaled;
}

storage::EnvironmentRow EnvironmentRowOf(const v1::Environment& in) {
  storage::EnvironmentRow row;
  if (in.has_temperature_c()) row.temperature_c = in.temperature_c();
  if (in.has_temperature_standard_uncertainty_c())
    row.temperature_standard_uncertainty_c = in.temperature_standard_uncertainty_c();
  if (in.has_humidity_percent()) row.humidity_percent = in.humidity_percent();
  row.note = in.note();
  return row;
}

// Each series with its response, row-major.
std::string KeptShares(const std::vector<metrology::ArmShare>& shares) {
  nlohmann::ordered_json kept = nlohmann::ordered_json::array();
  for (const metrology::ArmShare& share : shares)
    kept.push_back({{"series", share.arm_series}, {"response", runtime::RowMajor(share.response)}});
  return shares.empty() ? "" : kept.dump();
}

// How it stands, measured or stated.
storage::SensorCalibrationRow PoseRowOf(const metrology::SensorPose& sensor, const metrology::CardanAngles& angles,
                                        const metrology::CardanAngles& angle_uncertainty) {
  storage::SensorCalibrationRow row;
  row.machine_from_sensor_rotation = runtime::RowMajor(sensor.rotation);
  row.t_sm_mm = runtime::RowMajor(sensor.t_sm_mm);
  row.covariance = runtime::RowMajor(sensor.covariance);
  row.alpha_deg = angles.alpha * runtime::kDegPerRad;
  row.beta_deg = angles.beta * runtime::kDegPerRad;
  row.gamma_deg = angles.gamma * runtime::kDegPerRad;
  row.alpha_standard_uncertainty_deg = angle_uncertainty.alpha * runtime::kDegPerRad;
  row.beta_standard_uncertainty_deg = angle_uncertainty.beta * runtime::kDegPerRad;
  row.gamma_standard_uncertainty_deg = angle_uncertainty.gamma * runtime::kDegPerRad;
  return row;
}

storage::SensorCalibrationRow SensorRowOf(const SensorInputs& inputs, const CalibratedSensor& calibrated) {
  const metrology::SensorCalibration& result = calibrated.calibration;
  storage::SensorCalibrationRow row = PoseRowOf(result.sensor, result.angles, result.angle_uncertainty);
  row.noise_um = result.noise_mm * runtime::kUmPerMm;
  row.touch_rms_um = result.touch_rms_mm * runtime::kUmPerMm;
  row.residual_rms_um = result.residual_rms_mm * runtime::kUmPerMm;
  row.condition_number = result.condition_number;
  row.points_used = static_cast<std::int64_t>(result.points_used);
  if (result.field_response) row.field_response = runtime::RowMajor(*result.field_response);
  if (const auto& field = result.sensor.measured_field) {
    row.field_terms_um = Scaled(runtime::RowMajor(field->terms_mm), runtime::kUmPerMm);
    row.field_covariance_um2 = Scaled(runtime::RowMajor(field->covariance_mm2), runtime::kUmPerMm * runtime::kUmPerMm);
    row.field_stated_um = field->stated_mm * runtime::kUmPerMm;
  }
  row.arm_series = inputs.arm_series;
  row.arm_shares_json = KeptShares(calibrated.arm_shares);
  row.sensor_serial_number = inputs.sensor_serial_number;
  if (inputs.travel != ingest::v1::SCAN_TRAVEL_UNSPECIFIED)
    row.travel = ingest::v1::ScanTravel_Name(inputs.travel).substr(std::string("SCAN_TRAVEL_").size());
  if (std::isfinite(result.sensor.degrees_of_freedom)) row.degrees_of_freedom = result.sensor.degrees_of_freedom;
  for (const auto* centres : {&result.fitted, &result.check})
    for (const metrology::CentreResidual& c : *centres) {
      const Eigen::Vector3d d = runtime::kUmPerMm * c.laser_minus_touch_mm;
      row.centres.push_back({c.scan, c.feature, centres == &result.check, d.x(), d.y(), d.z()});
    }
  return row;
}

storage::RotationCalibrationRow RotationRowOf(const RotationInputs& inputs,
                                              const metrology::RotationCalibration& result) {
  const std::vector<metrology::SpherePose>& poses = inputs.poses;
  storage::RotationCalibrationRow row;
  row.a_direction = runtime::RowMajor(result.axes.a.direction);
  row.a_point_mm = runtime::RowMajor(result.axes.a.point_mm);
  row.b_direction = runtime::RowMajor(result.axes.b.direction);
  row.b_point_mm = runtime::RowMajor(result.axes.b.point_mm);
  row.covariance = runtime::RowMajor(result.covariance);
  row.point_c_mm = runtime::RowMajor(result.point_c_mm);
  const Eigen::Vector3d sigma = result.point_c_covariance_mm2.diagonal().cwiseMax(0).cwiseSqrt();
  row.point_c_standard_uncertainty_mm = runtime::RowMajor(sigma);
  row.noise_um = result.noise_mm * runtime::kUmPerMm;
  row.residual_rms_um = result.residual_rms_mm * runtime::kUmPerMm;
  row.check_rms_um = result.check_rms_mm * runtime::kUmPerMm;
  row.check_count = result.check_count;
  row.condition_number = result.condition_number;
  if (std::isfinite(result.degrees_of_freedom)) row.degrees_of_freedom = result.degrees_of_freedom;
  for (size_t i = 0; i < poses.size(); ++i)
    row.poses.push_back({poses[i].a_rad * runtime::kDegPerRad, poses[i].b_rad * runtime::kDegPerRad,
                         result.distances_mm.at(i) * runtime::kUmPerMm, poses[i].held_out,
                         result.before_mm.at(i) * runtime::kUmPerMm});
  row.linear_response = runtime::RowMajor(result.linear_response);
  row.axes = {inputs.options.joints[0].axis, inputs.options.joints[1].axis};
  return row;
}

storage::ProbeCalibrationRow ProbeRowOf(const v1::CalibrateProbeRequest& request, const CalibratedProbe& probe) {
  const metrology::ProbeCalibration& result = probe.calibration;
  storage::ProbeCalibrationRow row;
  row.block = request.block();
  row.approach.assign(result.approach.begin(), result.approach.end());
  row.offset_mm.assign(result.offset_mm.begin(), result.offset_mm.end());
  // Symmetric: column-major is row-major.
  row.covariance.assign(result.covariance.data(), result.covariance.data() + result.covariance.size());
  row.point_standard_uncertainty_mm.assign(result.point_standard_uncertainty_mm.begin(),
                                           result.point_standard_uncertainty_mm.end());
  row.scale = result.scale;
  row.scale_standard_uncertainty = result.scale_standard_uncertainty;
  row.direction_standard_uncertainty_urad = result.direction_standard_uncertainty_rad * kMicroPerOne;
  row.noise_um = request.noise_um();
  row.noise_factor = result.noise_factor;
  row.residual_rms_um = result.residual_rms_mm * runtime::kUmPerMm;
  row.touch_rms_um = result.touch_rms_mm * runtime::kUmPerMm;
  row.condition_number = result.condition_number;
  row.displacement_matrix_condition_number = result.paper_condition_number;
  row.worst_approach_angle_deg = result.worst_approach_angle_rad * runtime::kDegPerRad;
  for (int i = 0; i < request.readings_size(); ++i)
    row.readings.push_back({request.readings(i).face(), request.readings(i).displacement_mm(),
                            result.residuals_mm.at(static_cast<std::size_t>(i)) * runtime::kUmPerMm});
  for (const metrology::ProbeFaceCheck& c : probe.checks)
    row.checks.push_back({c.face, c.reading_count, c.angle_rad * kMicroPerOne, c.origin_distance_mm * runtime::kUmPerMm,
                          c.distance_mm * runtime::kUmPerMm, c.residual_range_mm * runtime::kUmPerMm});
  return row;
}

storage::AxisCharacterisationRow AxisRowOf(const metrology::AxisCharacterisation& result) {
  storage::AxisCharacterisationRow row;
  row.reading_count = result.reading_count;
  row.reversal = Degrees(result.reversal_rad);
  row.mean = Degrees(result.mean_rad);
  row.long_wave_order = result.long_wave.order;
  row.long_wave_amplitude = Degrees(result.long_wave.amplitude_rad);
  if (result.periodic) {
    row.periodic_order = result.periodic->order;
    row.periodic_amplitude = Degrees(result.periodic->amplitude_rad);
  }
  row.least_detectable_deg = result.least_detectable_rad / runtime::kRadPerDeg;
  row.greatest_error = Degrees(result.greatest_error_rad);
  row.greatest_error_at_deg = result.greatest_error_at_rad / runtime::kRadPerDeg;
  row.greatest_error_forward = result.greatest_error_travel == metrology::Travel::kForward;
  row.standard_uncertainty = Degrees(result.standard_uncertainty_rad);
  row.compensated_standard_uncertainty = Degrees(result.compensated_standard_uncertainty_rad);
  row.noise = Degrees(result.noise_rad);
  row.forward_error_deg = Scaled(result.table.forward_rad, 1 / runtime::kRadPerDeg);
  row.backward_error_deg = Scaled(result.table.backward_rad, 1 / runtime::kRadPerDeg);
  row.table_standard_uncertainty_deg = result.table_standard_uncertainty_rad / runtime::kRadPerDeg;
  return row;
}

// Readings that were commanded beyond the joint's limits: an encoder run wants a whole turn, for which a tilting axis has
// its limits lifted.
int BeyondLimits(const v1::AxisRun& run, const metrology::Joint& joint) {
  // Limits come from degrees: what is at a limit is within it.
  constexpr double kRounding = 1e-12;
  return static_cast<int>(std::count_if(run.commanded_deg().begin(), run.commanded_deg().end(), [&](double deg) {
    return deg * runtime::kRadPerDeg < joint.minimum - kRounding ||
           deg * runtime::kRadPerDeg > joint.maximum + kRounding;
  }));
}

template <typename Request>
const v1::Environment& EnvironmentOf(const Request& request) {
  return request.environment();
}
// What is stated was measured elsewhere, as its certificate says.
const v1::Environment& EnvironmentOf(const v1::StateSensorPoseRequest&) { return v1::Environment::default_instance(); }

// What every calibration has of its request.
template <typename Request>
storage::CalibrationRow Described(const Request& request, const Inputs& inputs, const std::string& method) {
  storage::CalibrationRow row;
  row.calibration_id = storage::NewUuid();
  row.machine_id = runtime::LastSegment(request.machine());
  row.method = method;
  row.inputs = inputs.names;
  row.valid_from = inputs.validity.from;
  row.valid_until = inputs.validity.until;
  row.software_version = runtime::SoftwareVersion();
  row.is_draft = request.draft();
  row.environment = EnvironmentRowOf(EnvironmentOf(request));
  return row;
}

// A few figures for the journal, as JSON.
std::string SummaryOf(const storage::CalibrationRow& row) {
  nlohmann::json summary{{"kind", row.kind()}};
  if (row.is_draft) summary["draft"] = true;
  if (row.environment.temperature_c) summary["temperature_c"] = *row.environment.temperature_c;
  if (row.sensor) {
    summary["alpha_deg"] = row.sensor->alpha_deg;
    summary["beta_deg"] = row.sensor->beta_deg;
    summary["gamma_deg"] = row.sensor->gamma_deg;
    if (row.sensor->residual_rms_um) summary["residual_rms_um"] = *row.sensor->residual_rms_um;
    if (!row.sensor->certificate.empty()) summary["certificate"] = row.sensor->certificate;
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
    if (row.rotation->check_count > 0) summary["check_rms_um"] = row.rotation->check_rms_um;
  }
  return summary.dump();
}

// What does not agree with its own uncertainty is in force only once a person has looked at it.
void Judge(const std::vector<metrology::ResidualJudgement>& judgements, storage::CalibrationRow* row) {
  nlohmann::json kept = nlohmann::json::array();
  for (const metrology::ResidualJudgement& judged : judgements) {
    kept.push_back({{"of", judged.of},
                    {"ratio", judged.ratio},
                    {"count", judged.count},
                    {"probability", judged.probability},
                    {"agrees", judged.agrees}});
    if (!judged.agrees) row->is_draft = true;
  }
  if (!kept.empty()) row->judgements_json = kept.dump();
}

}  // namespace

storage::CalibrationRow RowOf(const v1::CalibrateSensorRequest& request, const SensorInputs& inputs,
                              const CalibratedSensor& result) {
  const bool sequential = request.method() == v1::SENSOR_METHOD_SEQUENTIAL;
  storage::CalibrationRow row = Described(request, inputs, sequential ? "SEQUENTIAL" : "JOINT");
  row.sensor = SensorRowOf(inputs, result);
  if (result.calibration.judgement) Judge({*result.calibration.judgement}, &row);
  return row;
}

storage::CalibrationRow RowOf(const v1::StateSensorPoseRequest& request, const StatedInputs& inputs,
                              const StatedSensor& result) {
  storage::CalibrationRow row = Described(request, inputs, "STATED");
  row.sensor = PoseRowOf(result.sensor, result.angles, result.angle_uncertainty);
  row.sensor->certificate = request.certificate();
  row.sensor->sensor_serial_number = request.sensor_serial_number();
  return row;
}

storage::CalibrationRow RowOf(const v1::CalibrateRotationRequest& request, const RotationInputs& inputs,
                              const metrology::RotationCalibration& result) {
  const char* const method = request.method() == v1::ROTATION_METHOD_STANDARD  ? "STANDARD"
                             : request.method() == v1::ROTATION_METHOD_POINT_C ? "POINT_C"
                                                                               : "LINES";
  storage::CalibrationRow row = Described(request, inputs, method);
  row.rotation = RotationRowOf(inputs, result);
  Judge(result.judgements, &row);
  return row;
}

storage::CalibrationRow RowOf(const v1::CalibrateProbeRequest& request, const ProbeInputs& inputs,
                              const CalibratedProbe& result) {
  storage::CalibrationRow row =
      Described(request, inputs, request.method() == v1::PROBE_METHOD_LINEAR ? "LINEAR" : "WEIGHTED");
  row.probe = ProbeRowOf(request, result);
  return row;
}

storage::CalibrationRow RowOf(const v1::CharacteriseAxisRequest& request, const AxisInputs& inputs,
                              const metrology::AxisCharacterisation& result) {
  storage::CalibrationRow row = Described(request, inputs, "ENCODER_RUN");
  row.axis = AxisRowOf(result);
  row.axis->axis = request.axis();
  row.axis->beyond_limits_count = BeyondLimits(request.run(), inputs.joint);
  return row;
}

runtime::Made<storage::CalibrationRow> RecordOf(storage::CalibrationRow row) {
  storage::RecordEntry entry;
  entry.kind = "calibration";
  entry.name = row.name();
  entry.inputs = row.inputs;
  entry.machine = row.machine_id;
  entry.method = row.method;
  entry.software_version = row.software_version;
  entry.summary_json = SummaryOf(row);
  return {std::move(row), std::move(entry)};
}

}  // namespace sixpoint::calibration
