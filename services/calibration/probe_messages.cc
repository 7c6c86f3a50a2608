#include "services/calibration/probe_messages.h"

#include <cmath>

#include "services/calibration/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::calibration {
namespace {

using runtime::Refuse;

constexpr double kDegPerRad = 180 / M_PI;
constexpr double kUmPerMm = 1000;
constexpr double kMicroPerOne = 1e6;
constexpr int kMostFaces = 24;
constexpr int kMostReadings = 5000;
constexpr int kMostTouched = 1000;

absl::StatusOr<std::vector<metrology::ProbedFace>> FacesOf(
    const std::string& list, const google::protobuf::RepeatedPtrField<v1::ProbedFace>& in) {
  std::vector<metrology::ProbedFace> faces;
  for (int j = 0; j < in.size(); ++j) {
    const std::string field = Indexed(list, j);
    if (absl::Status s = runtime::CheckId(field + ".face", in[j].face()); !s.ok()) return s;
    if (absl::Status s = CheckCount(field + ".touched_mm", in[j].touched_mm_size(), 3, kMostTouched); !s.ok()) return s;
    metrology::ProbedFace& face = faces.emplace_back();
    face.face = in[j].face();
    const auto normal = runtime::FromProto(field + ".nominal_normal", in[j].nominal_normal());
    if (!normal.ok()) return normal.status();
    face.nominal_normal = *normal;
    for (int k = 0; k < in[j].touched_mm_size(); ++k) {
      const auto point = runtime::FromProto(Indexed(field + ".touched_mm", k), in[j].touched_mm(k));
      if (!point.ok()) return point.status();
      face.touched_mm.push_back(*point);
    }
  }
  return faces;
}

absl::StatusOr<std::vector<metrology::ProbeReading>> ReadingsOf(
    const std::string& list, const google::protobuf::RepeatedPtrField<v1::ProbeReading>& in) {
  std::vector<metrology::ProbeReading> readings;
  for (int i = 0; i < in.size(); ++i) {
    const std::string field = Indexed(list, i);
    if (absl::Status s = runtime::CheckId(field + ".face", in[i].face()); !s.ok()) return s;
    if (!in[i].has_position_mm()) return Refuse(field + ".position_mm", "", "a point");
    const auto position = runtime::FromProto(field + ".position_mm", in[i].position_mm());
    if (!position.ok()) return position.status();
    readings.push_back({in[i].face(), *position, in[i].displacement_mm()});
  }
  return readings;
}

}  // namespace

absl::Status CheckProbeRequest(const v1::CalibrateProbeRequest& request) {
  if (absl::Status s = CheckCaller(request.machine(), request.requested_by(), request.request_id()); !s.ok()) return s;
  if (absl::Status s = runtime::CheckId("block", request.block()); !s.ok()) return s;
  if (absl::Status s = CheckCount("faces", request.faces_size(), 1, kMostFaces); !s.ok()) return s;
  if (absl::Status s = CheckCount("readings", request.readings_size(), 1, kMostReadings); !s.ok()) return s;
  if (absl::Status s = CheckCount("moved_faces", request.moved_faces_size(), 0, kMostFaces); !s.ok()) return s;
  const int moved = request.moved_readings_size();
  if (absl::Status s = CheckCount("moved_readings", moved, 0, kMostReadings); !s.ok()) return s;
  if ((moved > 0) != (request.moved_faces_size() > 0))
    return Refuse("moved_readings", std::to_string(moved) + " of them", "both moved_faces and moved_readings, or none");
  if (!v1::ProbeMethod_IsValid(request.method()))
    return Refuse("method", std::to_string(request.method()), "WEIGHTED or LINEAR");
  return absl::OkStatus();
}

absl::StatusOr<ProbeInputs> ProbeInputsOf(const v1::CalibrateProbeRequest& request) {
  ProbeInputs inputs;
  auto faces = FacesOf("faces", request.faces());
  if (!faces.ok()) return faces.status();
  auto readings = ReadingsOf("readings", request.readings());
  if (!readings.ok()) return readings.status();
  auto moved_faces = FacesOf("moved_faces", request.moved_faces());
  if (!moved_faces.ok()) return moved_faces.status();
  auto moved_readings = ReadingsOf("moved_readings", request.moved_readings());
  if (!moved_readings.ok()) return moved_readings.status();
  inputs.faces = *std::move(faces);
  inputs.readings = *std::move(readings);
  inputs.moved_faces = *std::move(moved_faces);
  inputs.moved_readings = *std::move(moved_readings);
  inputs.options.noise_mm = request.noise_um() / kUmPerMm;
  if (request.touch_standard_uncertainty_um() != 0)
    inputs.options.touch_uncertainty_mm = request.touch_standard_uncertainty_um() / kUmPerMm;
  inputs.options.position_uncertainty_mm = request.position_standard_uncertainty_um() / kUmPerMm;
  inputs.options.least_displacement_mm = request.least_displacement_mm();
  inputs.options.greatest_displacement_mm = request.greatest_displacement_mm();
  if (request.greatest_approach_angle_deg() != 0)
    inputs.options.greatest_approach_angle_rad = request.greatest_approach_angle_deg() / kDegPerRad;
  return inputs;
}

storage::ProbeCalibrationRow RowOf(const metrology::ProbeCalibration& result,
                                   const std::vector<metrology::ProbeFaceCheck>& checks,
                                   const v1::CalibrateProbeRequest& request) {
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
  row.residual_rms_um = result.residual_rms_mm * kUmPerMm;
  row.touch_rms_um = result.touch_rms_mm * kUmPerMm;
  row.condition_number = result.condition_number;
  row.displacement_matrix_condition_number = result.paper_condition_number;
  row.worst_approach_angle_deg = result.worst_approach_angle_rad * kDegPerRad;
  for (int i = 0; i < request.readings_size(); ++i)
    row.readings.push_back({request.readings(i).face(), request.readings(i).displacement_mm(),
                            result.residuals_mm.at(static_cast<std::size_t>(i)) * kUmPerMm});
  for (const metrology::ProbeFaceCheck& c : checks)
    row.checks.push_back({c.face, c.reading_count, c.angle_rad * kMicroPerOne, c.origin_distance_mm * kUmPerMm,
                          c.distance_mm * kUmPerMm, c.residual_range_mm * kUmPerMm});
  return row;
}

void ProbeToProto(const storage::ProbeCalibrationRow& row, v1::ProbeCalibration* out) {
  const auto point = [](const std::vector<double>& in) { return Eigen::Vector3d(in.at(0), in.at(1), in.at(2)); };
  out->set_block(row.block);
  out->mutable_approach()->Add(row.approach.begin(), row.approach.end());
  runtime::ToProto(point(row.offset_mm), out->mutable_offset_mm());
  out->mutable_covariance()->set_row_count(6);
  out->mutable_covariance()->set_column_count(6);
  out->mutable_covariance()->mutable_values()->Add(row.covariance.begin(), row.covariance.end());
  out->set_scale(row.scale);
  out->set_scale_standard_uncertainty(row.scale_standard_uncertainty);
  out->set_direction_standard_uncertainty_urad(row.direction_standard_uncertainty_urad);
  runtime::ToProto(point(row.point_standard_uncertainty_mm), out->mutable_point_standard_uncertainty_mm());
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

}  // namespace sixpoint::calibration
