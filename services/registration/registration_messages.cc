#include "services/registration/registration_messages.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "metrology/registration/direction_words.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::registration {
namespace {

constexpr double kUmPerMm = 1000;
constexpr double kDegPerRad = 180 / 3.14159265358979323846;
constexpr double kGreatestFigure = 1e12;  // what a free direction's uncertainty is stored as

template <typename Matrix>
std::vector<double> RowMajor(const Matrix& matrix) {
  std::vector<double> values;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) values.push_back(matrix(row, column));
  return values;
}

double Figure(double value) { return value < kGreatestFigure ? value : kGreatestFigure; }

std::string OutcomeText(metrology::Outcome outcome) {
  switch (outcome) {
    case metrology::Outcome::kConverged:
      return "CONVERGED";
    case metrology::Outcome::kNotConverged:
      return "NOT_CONVERGED";
    case metrology::Outcome::kNotDetermined:
      return "NOT_DETERMINED";
    case metrology::Outcome::kTooLittleOverlap:
      return "TOO_LITTLE_OVERLAP";
    case metrology::Outcome::kInfeasible:
      return "INFEASIBLE";
  }
  return "";
}

void SetPoint(double x, double y, double z, geometry::v1::Point* out) {
  out->set_x_mm(x);
  out->set_y_mm(y);
  out->set_z_mm(z);
}

void SetTransform(const std::vector<double>& in, geometry::v1::RigidTransform* out) {
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) out->add_rotation(in.at(4 * row + column));
  SetPoint(in.at(3), in.at(7), in.at(11), out->mutable_translation_mm());
}

void SetCovariance(const std::vector<double>& values, const std::vector<double>& reference,
                   geometry::v1::PoseCovariance* out) {
  out->mutable_values()->Add(values.begin(), values.end());
  SetPoint(reference.at(0), reference.at(1), reference.at(2), out->mutable_reference_mm());
}

absl::StatusOr<std::string> JsonOf(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto printed = google::protobuf::util::MessageToJsonString(message, &json, options);
  if (!printed.ok()) return absl::InternalError("registration as JSON: " + std::string(printed.message()));
  return json;
}

absl::Status FromJson(const std::string& json, const std::string& registration_id, google::protobuf::Message* out) {
  if (google::protobuf::util::JsonStringToMessage(json, out).ok()) return absl::OkStatus();
  return absl::DataLossError("registration " + registration_id + ": its " + out->GetDescriptor()->name() +
                             " cannot be read");
}

// What has no column: a registration without it, from before it was kept, has a detail without fields.
v1::Evidence DetailOf(const metrology::PoseFit& fit, const std::optional<metrology::AllowanceFit>& allowance,
                      const std::optional<metrology::Disagreement>& disagreement) {
  const metrology::FitEvidence& evidence = fit.evidence;
  v1::Evidence detail;
  detail.set_patch_mm(evidence.patch_mm);
  if (!allowance.has_value()) {
    detail.set_correlation_widening(Figure(evidence.correlation_widening));
    detail.set_last_step_um(kUmPerMm * evidence.last_step_mm);
  }
  for (const metrology::RegionResidual& in : evidence.regions) {
    if (!std::isfinite(in.mean_mm)) continue;  // no weight there
    v1::RegionResidual* region = detail.add_regions();
    runtime::ToProto(in.centre_mm, region->mutable_centre_mm());
    region->set_point_count(in.point_count);
    region->set_mean_um(kUmPerMm * in.mean_mm);
    region->set_used_part(in.used_part);
  }
  if (allowance.has_value())
    for (const metrology::AllowancePatch& in : allowance->holding) {
      v1::AllowancePatch* patch = detail.mutable_allowance()->add_holding();
      runtime::ToProto(in.point_mm, patch->mutable_point_mm());
      runtime::ToProto(in.normal, patch->mutable_normal());
      patch->set_stock_mm(in.stock_mm);
      patch->set_standard_uncertainty_um(kUmPerMm * in.standard_uncertainty_mm);
      patch->set_share(in.share);
    }
  if (disagreement.has_value()) {
    v1::Disagreement& out = *detail.mutable_disagreement();
    runtime::ToProto(disagreement->point_mm, out.mutable_point_mm());
    out.set_standard_uncertainty_um(kUmPerMm * disagreement->standard_uncertainty_mm);
  }
  return detail;
}

absl::Status SetEvidence(const storage::RegistrationRow& row, v1::Evidence* out) {
  if (absl::Status status = FromJson(row.detail_json, row.registration_id, out); !status.ok()) return status;
  const auto outcome =
      runtime::StoredEnum(v1::Outcome_Parse, "OUTCOME_" + row.outcome, "registration " + row.registration_id);
  if (!outcome.ok()) return outcome.status();
  out->set_outcome(*outcome);
  out->set_point_count(row.point_count);
  out->set_points_used(row.points_used);
  out->set_iteration_count(row.iteration_count);
  out->set_residual_rms_um(row.residual_rms_um);
  out->set_residual_sigma_um(row.residual_sigma_um);
  out->set_overlap(row.point_count > 0 ? static_cast<double>(row.points_used) / static_cast<double>(row.point_count)
                                       : 0);
  out->set_condition_number(row.condition_number);
  out->set_seconds(row.compute_seconds);
  for (const storage::RegistrationDatumRow& datum : row.datums) {
    v1::DatumResidual* residual = out->add_datums();
    residual->set_datum(datum.datum_name);
    residual->set_distance_um(datum.distance_um);
    residual->set_standard_uncertainty_um(datum.standard_uncertainty_um);
    residual->set_point_count(static_cast<int>(datum.point_count));
  }
  for (const storage::RegistrationScanRow& scan : row.scans) {
    v1::ScanEvidence* evidence = out->add_scans();
    evidence->set_scan(runtime::NameOf("scans", scan.scan_id));
    evidence->set_point_count(scan.point_count);
    evidence->set_points_used(scan.points_used);
    evidence->set_residual_median_um(scan.residual_median_um);
  }
  out->mutable_weakest_direction()->Add(row.weakest_direction.begin(), row.weakest_direction.end());
  out->set_weakest_standard_uncertainty_um(row.weakest_standard_uncertainty_um);
  out->set_remark(row.remark);
  out->set_weakest_direction_in_words(row.weakest_direction_in_words);
  out->set_noise_sigma_um(row.noise_sigma_um.value_or(0));
  out->set_model_sigma_um(row.model_sigma_um.value_or(0));
  out->set_information_kept(row.information_kept.value_or(0));
  out->set_surface_part(row.surface_part.value_or(0));
  for (const storage::RegistrationAgreementRow& in : row.agreements) {
    v1::ScanAgreement* agreement = out->add_agreements();
    agreement->set_scan(runtime::NameOf("scans", in.scan_id));
    agreement->set_other_scan(runtime::NameOf("scans", in.other_scan_id));
    agreement->set_patch_count(in.patch_count);
    agreement->set_difference_rms_um(in.difference_rms_um);
    agreement->set_expected_rms_um(in.expected_rms_um);
  }
  if (row.least_stock_mm.has_value() && row.lacking_mm.has_value()) {
    out->mutable_allowance()->set_least_stock_mm(*row.least_stock_mm);
    out->mutable_allowance()->set_lacking_mm(*row.lacking_mm);
  }
  if (row.disagreement_um.has_value() && row.disagreement_ratio.has_value()) {
    out->mutable_disagreement()->set_greatest_um(*row.disagreement_um);
    out->mutable_disagreement()->set_ratio(*row.disagreement_ratio);
    out->mutable_disagreement()->set_beyond(row.disagrees.value_or(false));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<storage::RegistrationRow> RowOf(const metrology::PoseFit& fit, const v1::FitOptions& options,
                                               const std::optional<metrology::AllowanceFit>& allowance,
                                               const std::optional<metrology::Disagreement>& disagreement) {
  storage::RegistrationRow row;
  row.outcome = OutcomeText(fit.outcome);
  if (fit.outcome == metrology::Outcome::kConverged) {
    row.zero_from_part = RowMajor(fit.zero_from_part.matrix().topRows<3>());
    row.reference_mm = RowMajor(fit.covariance.reference_mm);
    row.covariance = RowMajor(fit.covariance.values);
    row.noise_covariance = RowMajor(fit.noise_covariance.values);
    row.calibration_sensitivity = RowMajor(fit.calibration_sensitivity);
  }
  const metrology::FitEvidence& evidence = fit.evidence;
  row.point_count = evidence.point_count;
  row.points_used = evidence.points_used;
  row.iteration_count = evidence.iteration_count;
  row.residual_rms_um = kUmPerMm * evidence.residual_rms_mm;
  row.residual_sigma_um = kUmPerMm * evidence.residual_sigma_mm;
  row.condition_number = std::max(1.0, Figure(evidence.condition_number));
  row.weakest_direction = RowMajor(evidence.weakest_direction);
  row.weakest_standard_uncertainty_um = Figure(kUmPerMm * evidence.weakest_standard_uncertainty_mm);
  row.remark = evidence.remark;
  for (const metrology::PortionEvidence& portion : evidence.portions)
    row.scans.push_back(
        {portion.scan, portion.point_count, portion.points_used, kUmPerMm * portion.residual_median_mm});
  for (const metrology::DatumDistance& datum : evidence.datums)
    if (datum.point_count > 0)
      row.datums.push_back(
          {datum.name, kUmPerMm * datum.distance_mm, kUmPerMm * datum.standard_uncertainty_mm, datum.point_count});
  row.weakest_direction_in_words = metrology::DirectionInWords(evidence.weakest_direction, fit.zero_from_part);
  for (const metrology::PortionAgreement& agreement : evidence.agreements)
    row.agreements.push_back({agreement.scan, agreement.other, agreement.patch_count,
                              Figure(kUmPerMm * agreement.difference_rms_mm),
                              Figure(kUmPerMm * agreement.expected_rms_mm)});
  if (allowance.has_value()) {
    row.least_stock_mm = allowance->least_stock_mm;
    row.lacking_mm = allowance->lacking_mm;
  } else {
    row.noise_sigma_um = kUmPerMm * evidence.noise_sigma_mm;
    row.model_sigma_um = kUmPerMm * evidence.model_sigma_mm;
    row.information_kept = std::clamp(evidence.information_kept, 0.0, 1.0);
    row.surface_part = std::clamp(evidence.surface_part, 0.0, 1.0);
  }
  if (disagreement.has_value()) {
    row.disagreement_um = kUmPerMm * disagreement->greatest_mm;
    row.disagreement_ratio = Figure(disagreement->ratio);
    row.disagrees = disagreement->beyond;
  }
  absl::StatusOr<std::string> json = JsonOf(options);
  if (!json.ok()) return json.status();
  row.options_json = *std::move(json);
  json = JsonOf(DetailOf(fit, allowance, disagreement));
  if (!json.ok()) return json.status();
  row.detail_json = *std::move(json);
  return row;
}

storage::RegistrationAngleRow RowOf(const metrology::AngleInfluence& angle, const std::string& letter,
                                    const std::string& characterisation_id, bool has_pose) {
  storage::RegistrationAngleRow row;
  row.axis = letter;
  row.characterisation_id = characterisation_id;
  row.commanded_deg = std::round(1e9 * angle.commanded_rad * kDegPerRad) / 1e9;  // as it was sent: in degrees
  row.reached_deg = angle.reached_rad * kDegPerRad;
  row.standard_uncertainty_deg = angle.standard_uncertainty_rad * kDegPerRad;
  row.half_reversal_deg = angle.half_reversal_rad * kDegPerRad;
  if (has_pose) row.pose_per_rad = RowMajor(angle.pose_per_rad);
  return row;
}

absl::StatusOr<v1::Registration> ToProto(const storage::RegistrationRow& row) {
  v1::Registration out;
  if (absl::Status status = SetEvidence(row, out.mutable_evidence()); !status.ok()) return status;
  if (absl::Status status = FromJson(row.options_json, row.registration_id, out.mutable_options()); !status.ok())
    return status;
  out.set_name(runtime::NameOf("registrations", row.registration_id));
  out.set_blade(runtime::NameOf("blades", row.blade_serial));
  out.set_machine(runtime::NameOf("machines", row.machine_id));
  out.set_machine_revision(row.machine_revision);
  out.set_part(runtime::NameOf("parts", row.part_id));
  out.set_part_revision(row.part_revision);
  for (const storage::RegistrationScanRow& scan : row.scans) out.add_scans(runtime::NameOf("scans", scan.scan_id));
  const auto method =
      runtime::StoredEnum(v1::Method_Parse, "METHOD_" + row.method, "registration " + row.registration_id);
  if (!method.ok()) return method.status();
  out.set_method(*method);
  out.set_sensor_calibration(runtime::NameOf("calibrations", row.sensor_calibration_id));
  out.set_rotation_calibration(runtime::NameOf("calibrations", row.rotation_calibration_id));
  if (!row.zero_from_part.empty()) {
    SetTransform(row.zero_from_part, out.mutable_zero_from_part());
    SetCovariance(row.covariance, row.reference_mm, out.mutable_covariance());
    SetCovariance(row.noise_covariance, row.reference_mm, out.mutable_noise_covariance());
    geometry::v1::Matrix* sensitivity = out.mutable_calibration_sensitivity();
    sensitivity->set_row_count(6);
    sensitivity->set_column_count(metrology::kCalibrationParameterCount);
    sensitivity->mutable_values()->Add(row.calibration_sensitivity.begin(), row.calibration_sensitivity.end());
  }
  for (const storage::RegistrationAngleRow& in : row.angles) {
    v1::ScanAngle* angle = out.add_angles();
    angle->set_axis(in.axis);
    angle->set_characterisation(runtime::NameOf("characterisations", in.characterisation_id));
    angle->set_commanded_deg(in.commanded_deg);
    angle->set_reached_deg(in.reached_deg);
    angle->set_standard_uncertainty_deg(in.standard_uncertainty_deg);
    angle->set_half_reversal_deg(in.half_reversal_deg);
    angle->mutable_pose_per_rad()->Add(in.pose_per_rad.begin(), in.pose_per_rad.end());
  }
  out.set_requested_by(row.requested_by);
  out.set_software_version(row.software_version);
  runtime::ToProto(row.recorded.recorded_at, out.mutable_recorded_at());
  out.set_record_sequence(row.recorded.sequence);
  out.set_for_inspection(row.for_inspection);
  return out;
}

std::string SummaryOf(const storage::RegistrationRow& row) {
  nlohmann::json summary = {{"outcome", row.outcome},
                            {"residual_sigma_um", row.residual_sigma_um},
                            {"points_used", row.points_used},
                            {"condition_number", row.condition_number}};
  if (!row.remark.empty()) summary["remark"] = row.remark;
  return summary.dump();
}

}  // namespace sixpoint::registration
