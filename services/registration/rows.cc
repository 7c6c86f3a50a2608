#include "services/registration/rows.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "services/registration/validate.h"
#include "services/runtime/computed_on.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/units.h"

namespace sixpoint::registration {
namespace {

constexpr double kGreatestFigure = 1e12;  // what a free direction's uncertainty is stored as

double Figure(double value) { return value < kGreatestFigure ? value : kGreatestFigure; }
std::optional<double> Micrometres(double determined_mm) {
  if (std::isnan(determined_mm)) return std::nullopt;
  return runtime::kUmPerMm * determined_mm;
}

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

absl::StatusOr<std::string> JsonOf(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto printed = google::protobuf::util::MessageToJsonString(message, &json, options);
  if (!printed.ok()) return absl::InternalError("registration as JSON: " + std::string(printed.message()));
  return json;
}

void AddAllowance(const metrology::AllowanceFinding& allowance, v1::Allowance* detail) {
  for (const metrology::AllowancePatch& in : allowance.holding) {
    v1::AllowancePatch* patch = detail->add_holding();
    runtime::ToProto(in.point_mm, patch->mutable_point_mm());
    runtime::ToProto(in.normal, patch->mutable_normal());
    patch->set_stock_mm(in.stock_mm);
    patch->set_standard_uncertainty_um(runtime::kUmPerMm * in.standard_uncertainty_mm);
    patch->set_share(in.share);
  }
  for (const metrology::SeenSide& in : allowance.sides) {
    v1::AllowanceSide* side = detail->add_sides();
    runtime::ToProto(in.direction, side->mutable_direction());
    side->set_area_mm2(in.area_mm2);
    side->set_seen_part(std::clamp(in.seen_part(), 0.0, 1.0));
    if (in.seen_part() < 1) runtime::ToProto(in.unseen_about_mm, side->mutable_unseen_about_mm());
  }
}

// What has no column: a registration without it, from before it was kept, has a detail without fields.
v1::Evidence DetailOf(const metrology::PoseFit& fit, const std::optional<metrology::AllowanceFinding>& allowance,
                      const std::optional<metrology::Disagreement>& disagreement) {
  const metrology::FitEvidence& evidence = fit.evidence;
  v1::Evidence detail;
  detail.set_patch_mm(evidence.patch_mm);
  if (!allowance.has_value()) {
    detail.set_correlation_widening(Figure(evidence.correlation_widening));
    detail.set_last_step_um(runtime::kUmPerMm * evidence.last_step_mm);
  }
  detail.set_drawn_hole_count(evidence.drawn_hole_count);
  if (evidence.left_out_count.has_value()) detail.set_left_out_count(*evidence.left_out_count);
  if (evidence.gap_point_count.has_value()) detail.set_gap_point_count(*evidence.gap_point_count);
  for (const metrology::RegionResidual& in : evidence.regions) {
    if (!std::isfinite(in.mean_mm)) continue;  // no weight there
    v1::RegionResidual* region = detail.add_regions();
    runtime::ToProto(in.centre_mm, region->mutable_centre_mm());
    region->set_point_count(in.point_count);
    region->set_mean_um(runtime::kUmPerMm * in.mean_mm);
    region->set_used_part(in.used_part);
  }
  if (allowance.has_value()) AddAllowance(*allowance, detail.mutable_allowance());
  if (evidence.merge.has_value()) {
    v1::MergeTest& merge = *detail.mutable_merge();
    merge.set_freedom(evidence.merge->freedom);
    merge.set_chi_squared(Figure(evidence.merge->chi_squared));
    merge.set_limit(evidence.merge->limit);
    merge.set_beyond(evidence.merge->beyond);
  }
  if (disagreement.has_value()) {
    v1::Disagreement& out = *detail.mutable_disagreement();
    runtime::ToProto(disagreement->point_mm, out.mutable_point_mm());
    out.set_standard_uncertainty_um(runtime::kUmPerMm * disagreement->standard_uncertainty_mm);
  }
  return detail;
}

// Pose, covariances, evidence and what was asked.
absl::StatusOr<storage::RegistrationRow> FitRowOf(const std::string& blade, const metrology::PoseFit& fit,
                                                  const v1::FitOptions& options,
                                                  const std::optional<metrology::AllowanceFinding>& allowance,
                                                  const std::optional<metrology::Disagreement>& disagreement) {
  storage::RegistrationRow row;
  row.outcome = OutcomeText(fit.outcome);
  if (fit.placed) {
    row.zero_from_part = runtime::RowMajor(fit.placed->zero_from_part.matrix().topRows<3>());
    row.reference_mm = runtime::RowMajor(fit.placed->covariance.reference_mm);
    row.covariance = runtime::RowMajor(fit.placed->covariance.values);
    row.noise_covariance = runtime::RowMajor(fit.placed->noise_covariance.values);
    row.calibration_sensitivity =
        runtime::RowMajor(fit.placed->calibration_sensitivity.leftCols<metrology::kCalibratedParameterCount>());
    for (const metrology::ErrorSource& source : fit.placed->sources) {
      storage::RegistrationErrorSourceRow& kept = row.error_sources.emplace_back();
      kept.source_name = source.name;
      // Another blade is held elsewhere, and deviates otherwise.
      if (metrology::IsOfBlade(source.name)) kept.source_name += ", " + blade;
      if (std::isfinite(source.degrees_of_freedom)) kept.degrees_of_freedom = source.degrees_of_freedom;
      kept.draw_count = static_cast<int>(source.pose_per_sigma.cols());
      kept.parameters_per_sigma = runtime::RowMajor(source.parameters_per_sigma);
      kept.pose_per_sigma = runtime::RowMajor(source.pose_per_sigma);
    }
  }
  const metrology::FitEvidence& evidence = fit.evidence;
  row.point_count = evidence.point_count;
  row.points_used = evidence.points_used;
  row.iteration_count = evidence.iteration_count;
  row.residual_rms_um = Micrometres(evidence.residual_rms_mm);
  row.residual_sigma_um = Micrometres(evidence.residual_sigma_mm);
  if (!std::isnan(evidence.condition_number)) {
    row.condition_number = std::max(1.0, Figure(evidence.condition_number));
    row.weakest_direction = runtime::RowMajor(evidence.weakest_direction);
    row.weakest_standard_uncertainty_um = Figure(runtime::kUmPerMm * evidence.weakest_standard_uncertainty_mm);
  }
  row.remark = evidence.remark;
  for (const metrology::PortionEvidence& portion : evidence.portions)
    row.scans.push_back(
        {portion.scan, portion.point_count, portion.points_used, Micrometres(portion.residual_median_mm)});
  for (const metrology::DatumDistance& datum : evidence.datums)
    if (datum.point_count > 0)
      row.datums.push_back({datum.name, runtime::kUmPerMm * datum.distance_mm,
                            runtime::kUmPerMm * datum.standard_uncertainty_mm, datum.point_count});
  row.weakest_direction_in_words = evidence.weakest_direction_in_words;
  for (const metrology::PortionAgreement& agreement : evidence.agreements)
    row.agreements.push_back({agreement.scan, agreement.other, agreement.patch_count,
                              Figure(runtime::kUmPerMm * agreement.difference_rms_mm),
                              Figure(runtime::kUmPerMm * agreement.expected_rms_mm)});
  if (allowance.has_value()) {
    row.least_stock_mm = allowance->least_stock_mm;
    row.lacking_mm = allowance->lacking_mm;
  } else {
    row.noise_sigma_um = runtime::kUmPerMm * evidence.noise_sigma_mm;
    row.model_sigma_um = runtime::kUmPerMm * evidence.model_sigma_mm;
    row.information_kept = std::clamp(evidence.information_kept, 0.0, 1.0);
  }
  row.surface_part = std::clamp(evidence.surface_part, 0.0, 1.0);
  if (disagreement.has_value()) {
    row.disagreement_um = runtime::kUmPerMm * disagreement->greatest_mm;
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

// letter: the machine's, of the angle's axis. has_pose: its influence on one is known.
storage::RegistrationAngleRow AngleRowOf(const metrology::AngleInfluence& angle, const std::string& letter,
                                         const std::string& characterisation_id, bool has_pose) {
  storage::RegistrationAngleRow row;
  row.axis = letter;
  row.characterisation_id = characterisation_id;
  row.commanded_deg = std::round(1e9 * angle.commanded_rad * runtime::kDegPerRad) / 1e9;  // as it was sent: in degrees
  row.reached_deg = angle.reached_rad * runtime::kDegPerRad;
  row.standard_uncertainty_deg = angle.standard_uncertainty_rad * runtime::kDegPerRad;
  row.half_reversal_deg = angle.half_reversal_rad * runtime::kDegPerRad;
  if (has_pose) row.pose_per_rad = runtime::RowMajor(angle.pose_per_rad);
  return row;
}

// A few figures for the journal.
std::string SummaryOf(const storage::RegistrationRow& row) {
  nlohmann::json summary = {{"outcome", row.outcome}, {"points_used", row.points_used}};
  if (row.residual_sigma_um) summary["residual_sigma_um"] = *row.residual_sigma_um;
  if (row.condition_number) summary["condition_number"] = *row.condition_number;
  if (!row.remark.empty()) summary["remark"] = row.remark;
  return summary.dump();
}

storage::RecordEntry EntryOf(const v1::RegisterRequest& request, const storage::RegistrationRow& row,
                             const Inputs& inputs) {
  storage::RecordEntry entry;
  entry.kind = "registration";
  entry.name = runtime::NameOf("registrations", row.registration_id);
  entry.inputs = {runtime::RevisedName("machines", row.machine_id, row.machine_revision),
                  runtime::RevisedName("parts", row.part_id, row.part_revision), request.blade(),
                  runtime::NameOf("calibrations", row.sensor_calibration_id),
                  runtime::NameOf("calibrations", row.rotation_calibration_id)};
  entry.inputs.insert(entry.inputs.end(), inputs.further_names.begin(), inputs.further_names.end());
  entry.inputs.insert(entry.inputs.end(), request.scans().begin(), request.scans().end());
  entry.blade = row.blade_serial;
  entry.machine = row.machine_id;
  entry.method = row.method;
  entry.software_version = row.software_version;
  entry.summary_json = SummaryOf(row);
  return entry;
}

}  // namespace

absl::StatusOr<runtime::Made<storage::RegistrationRow>> RecordOf(const v1::RegisterRequest& request,
                                                                 const Inputs& inputs,
                                                                 const metrology::Registered& registered,
                                                                 double seconds) {
  absl::StatusOr<storage::RegistrationRow> described =
      FitRowOf(request.blade(), registered.fit, FilledIn(request), registered.allowance, registered.disagreement);
  if (!described.ok()) return described.status();
  storage::RegistrationRow row = *std::move(described);
  row.registration_id = storage::NewUuid();
  row.blade_serial = runtime::LastSegment(request.blade());
  row.method = MethodText(request.method());
  row.for_inspection = request.for_inspection();
  row.clamping = inputs.clamping;
  row.station = inputs.station;
  row.thermal_stretch = inputs.thermal_stretch;
  row.scans_received_at = inputs.scans_received_at;
  row.sensor_calibration_asked = inputs.sensor.asked;
  row.machine_id = runtime::LastSegment(inputs.machine.name());
  row.machine_revision = inputs.machine.revision();
  row.part_id = runtime::LastSegment(inputs.part.name());
  row.part_revision = inputs.part.revision();
  row.sensor_calibration_id = runtime::LastSegment(inputs.sensor_calibration);
  row.rotation_calibration_id = runtime::LastSegment(inputs.rotation_calibration);
  for (const metrology::AngleInfluence& angle : registered.angles) {
    const std::size_t i = angle.axis == metrology::AngleInfluence::Axis::kA ? 0 : 1;
    row.angles.push_back(AngleRowOf(angle, inputs.letters[i], runtime::LastSegment(inputs.characterisations[i]),
                                    registered.fit.placed.has_value()));
  }
  row.compute_seconds = seconds;
  row.software_version = runtime::SoftwareVersion();
  row.computed_on = runtime::ComputedOn();
  storage::RecordEntry entry = EntryOf(request, row, inputs);
  return runtime::Made<storage::RegistrationRow>{std::move(row), std::move(entry)};
}

}  // namespace sixpoint::registration
