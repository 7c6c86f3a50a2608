#include "services/registration/messages.h"

#include <google/protobuf/util/json_util.h>

#include "metrology/kinematics/calibration_parameters.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::registration {
namespace {

absl::Status FromJson(const std::string& json, const std::string& registration_id, google::protobuf::Message* out) {
  if (google::protobuf::util::JsonStringToMessage(json, out).ok()) return absl::OkStatus();
  return absl::DataLossError("registration " + registration_id + ": its " + out->GetDescriptor()->name() +
                             " cannot be read");
}

absl::Status SetEvidence(const storage::RegistrationRow& row, v1::Evidence* out) {
  if (absl::Status status = FromJson(row.detail_json, row.registration_id, out); !status.ok()) return status;
  const auto outcome = runtime::StoredEnum<v1::Outcome>(row.outcome, "registration " + row.registration_id);
  if (!outcome.ok()) return outcome.status();
  out->set_outcome(*outcome);
  out->set_point_count(row.point_count);
  out->set_points_used(row.points_used);
  out->set_iteration_count(row.iteration_count);
  if (row.residual_rms_um) out->set_residual_rms_um(*row.residual_rms_um);
  if (row.residual_sigma_um) out->set_residual_sigma_um(*row.residual_sigma_um);
  out->set_overlap(row.point_count > 0 ? static_cast<double>(row.points_used) / static_cast<double>(row.point_count)
                                       : 0);
  if (row.condition_number) out->set_condition_number(*row.condition_number);
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
    if (scan.residual_median_um) evidence->set_residual_median_um(*scan.residual_median_um);
  }
  out->mutable_weakest_direction()->Add(row.weakest_direction.begin(), row.weakest_direction.end());
  if (row.weakest_standard_uncertainty_um)
    out->set_weakest_standard_uncertainty_um(*row.weakest_standard_uncertainty_um);
  out->set_remark(row.remark);
  out->set_weakest_direction_in_words(row.weakest_direction_in_words);
  if (row.noise_sigma_um) out->set_noise_sigma_um(*row.noise_sigma_um);
  if (row.model_sigma_um) out->set_model_sigma_um(*row.model_sigma_um);
  if (row.information_kept) out->set_information_kept(*row.information_kept);
  if (row.surface_part) out->set_surface_part(*row.surface_part);
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
  const auto method = runtime::StoredEnum<v1::Method>(row.method, "registration " + row.registration_id);
  if (!method.ok()) return method.status();
  out.set_method(*method);
  out.set_sensor_calibration(runtime::NameOf("calibrations", row.sensor_calibration_id));
  out.set_rotation_calibration(runtime::NameOf("calibrations", row.rotation_calibration_id));
  if (!row.zero_from_part.empty()) {
    runtime::SetTransform(row.zero_from_part, out.mutable_zero_from_part());
    runtime::SetCovariance(row.covariance, row.reference_mm, out.mutable_covariance());
    runtime::SetCovariance(row.noise_covariance, row.reference_mm, out.mutable_noise_covariance());
    runtime::SetMatrix(row.calibration_sensitivity, 6, metrology::kCalibratedParameterCount,
                       out.mutable_calibration_sensitivity());
  }
  for (const storage::RegistrationErrorSourceRow& in : row.error_sources) {
    uncertainty::v1::ErrorSource& source = *out.add_error_sources();
    source.set_name(in.source_name);
    if (in.degrees_of_freedom) source.set_degrees_of_freedom(*in.degrees_of_freedom);
    const int parameter_count =
        in.draw_count > 0 ? static_cast<int>(in.parameters_per_sigma.size()) / in.draw_count : 0;
    runtime::SetMatrix(in.parameters_per_sigma, parameter_count, in.draw_count, source.mutable_parameters_per_sigma());
    runtime::SetMatrix(in.pose_per_sigma, 6, in.draw_count, source.mutable_pose_per_sigma());
  }
  for (const storage::RegistrationAngleRow& in : row.angles) {
    v1::ScanAngle* angle = out.add_angles();
    angle->set_axis(in.axis);
    if (!in.characterisation_id.empty())
      angle->set_characterisation(runtime::NameOf("calibrations", in.characterisation_id));
    angle->set_commanded_deg(in.commanded_deg);
    angle->set_reached_deg(in.reached_deg);
    angle->set_standard_uncertainty_deg(in.standard_uncertainty_deg);
    angle->set_half_reversal_deg(in.half_reversal_deg);
    angle->mutable_pose_per_rad()->Add(in.pose_per_rad.begin(), in.pose_per_rad.end());
  }
  out.set_requested_by(row.requested_by);
  out.set_software_version(row.software_version);
  out.set_computed_on(row.computed_on);
  runtime::ToProto(row.recorded.recorded_at, out.mutable_recorded_at());
  out.set_record_sequence(row.recorded.sequence);
  out.set_for_inspection(row.for_inspection);
  out.set_clamping(row.clamping);
  out.set_station(row.station);
  if (row.thermal_stretch) out.set_thermal_stretch(*row.thermal_stretch);
  if (row.scans_received_at) runtime::ToProto(*row.scans_received_at, out.mutable_scans_received_at());
  out.set_sensor_calibration_asked(row.sensor_calibration_asked);
  return out;
}

void LeaveBasic(v1::Registration* registration) {
  registration->clear_covariance();
  registration->clear_noise_covariance();
  registration->clear_calibration_sensitivity();
  registration->clear_error_sources();
  for (v1::ScanAngle& angle : *registration->mutable_angles()) angle.clear_pose_per_rad();
  v1::Evidence& evidence = *registration->mutable_evidence();
  evidence.clear_datums();
  evidence.clear_scans();
  evidence.clear_weakest_direction();
  evidence.clear_agreements();
  evidence.clear_regions();
  if (!evidence.has_allowance()) return;
  evidence.mutable_allowance()->clear_holding();
  evidence.mutable_allowance()->clear_sides();
}

}  // namespace sixpoint::registration
