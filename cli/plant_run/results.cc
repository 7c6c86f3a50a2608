#include "cli/plant_run/results.h"

#include <nlohmann/json.hpp>

#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/reports.h"

namespace sixpoint::cli {
namespace {

using nlohmann::json;

json ToJson(const geometry::v1::Point& point) { return {point.x_mm(), point.y_mm(), point.z_mm()}; }
json ToJson(const geometry::v1::Line& line) {
  return {{"direction", {line.direction().x(), line.direction().y(), line.direction().z()}},
          {"point_mm", ToJson(line.point_mm())}};
}

// Rows of a square matrix given row by row; null where it is not there.
template <typename Values>
json Rows(const Values& values, int size) {
  if (values.size() != size * size) return nullptr;
  json rows = json::array();
  for (int r = 0; r < size; ++r) {
    json row = json::array();
    for (int c = 0; c < size; ++c) row.push_back(values[r * size + c]);
    rows.push_back(std::move(row));
  }
  return rows;
}

json Homogeneous(const geometry::v1::RigidTransform& transform) {
  json rows = Rows(transform.rotation(), 3);
  if (rows.is_null()) return rows;
  const json translation = ToJson(transform.translation_mm());
  for (std::size_t r = 0; r < 3; ++r) rows[r].push_back(translation[r]);
  rows.push_back({0, 0, 0, 1});
  return rows;
}

json ScanIds(const google::protobuf::RepeatedPtrField<std::string>& names) {
  json ids = json::array();
  for (const std::string& name : names) ids.push_back(IdText(name));
  return ids;
}

json SensorToJson(const calibration::v1::Calibration& calibration) {
  const auto& sensor = calibration.sensor();
  return {{"calibration", calibration.name()},
          {"machine_from_sensor_rotation", Rows(sensor.machine_from_sensor_rotation(), 3)},
          {"t_sm_mm", ToJson(sensor.t_sm_mm())},
          {"angles_deg", {{"alpha", sensor.alpha_deg()}, {"beta", sensor.beta_deg()}, {"gamma", sensor.gamma_deg()}}},
          {"standard_uncertainty",
           {{"alpha_deg", sensor.alpha_standard_uncertainty_deg()},
            {"beta_deg", sensor.beta_standard_uncertainty_deg()},
            {"gamma_deg", sensor.gamma_standard_uncertainty_deg()},
            {"t_sm_mm", ToJson(sensor.t_sm_standard_uncertainty_mm())}}},
          {"residual_rms_um", sensor.residual_rms_um()},
          {"condition_number", sensor.condition_number()}};
}

json RotationToJson(const calibration::v1::Calibration& calibration) {
  const auto& rotation = calibration.rotation();
  return {{"calibration", calibration.name()},
          {"point_c_mm", ToJson(rotation.point_c_mm())},
          {"a_axis", ToJson(rotation.a_axis())},
          {"b_axis", ToJson(rotation.b_axis())},
          {"residual_rms_um", rotation.residual_rms_um()},
          {"check_rms_um", rotation.has_check_rms_um() ? json(rotation.check_rms_um()) : json(nullptr)},
          {"check_count", rotation.check_count()}};
}

json RegistrationToJson(const RegisteredBlade& entry) {
  const auto& registration = entry.registration;
  const auto& evidence = registration.evidence();
  return {{"blade", entry.blade},
          {"method", entry.method},
          {"registration", registration.name()},
          {"outcome", OutcomeName(evidence.outcome())},
          {"scans", ScanIds(registration.scans())},
          {"zero_from_part", Homogeneous(registration.zero_from_part())},
          {"covariance", Rows(registration.covariance().values(), 6)},
          {"covariance_reference_mm", ToJson(registration.covariance().reference_mm())},
          {"residual_rms_um", evidence.residual_rms_um()},
          {"points_used", evidence.points_used()},
          {"point_count", evidence.point_count()},
          {"overlap", evidence.overlap()},
          {"condition_number", evidence.condition_number()},
          {"iterations", evidence.iteration_count()},
          {"seconds", entry.seconds}};
}

// Source to what it contributes, k = 1.
json BudgetToJson(const google::protobuf::RepeatedPtrField<uncertainty::v1::UncertaintyComponent>& budget) {
  json out = json::object();
  for (const auto& one : budget) out[one.source()] = one.standard_uncertainty_um();
  return out;
}

void AddCorrection(const CorrectedBlade& entry, json* out) {
  for (const auto& group : entry.correction.groups()) {
    json holes = json::array();
    for (const auto& hole : group.holes()) {
      holes.push_back({{"name", hole.hole()},
                       {"start_table_mm", ToJson(hole.start_mm())},
                       {"nominal_start_table_mm", ToJson(hole.nominal_start_mm())},
                       {"u95_um", hole.expanded_uncertainty_um()},
                       {"budget_um", BudgetToJson(hole.budget())}});
    }
    out->push_back({{"blade", entry.blade},
                    {"method", entry.method},
                    {"correction", entry.correction.name()},
                    {"registration", entry.correction.registration()},
                    {"release", Release_Name(entry.correction.release()).substr(8)},
                    {"group", group.group()},
                    {"a_deg", group.a_deg()},
                    {"b_deg", group.b_deg()},
                    {"a_nominal_deg", group.a_nominal_deg()},
                    {"b_nominal_deg", group.b_nominal_deg()},
                    {"a_standard_uncertainty_deg", group.a_standard_uncertainty_deg()},
                    {"b_standard_uncertainty_deg", group.b_standard_uncertainty_deg()},
                    {"holes", std::move(holes)}});
  }
}

json InspectionToJson(const InspectedBlade& entry) {
  json holes = json::array();
  for (const auto& hole : entry.inspection.holes()) {
    json out = {{"group", hole.group()},
                {"hole", hole.hole()},
                {"position_error_mm", nullptr},
                {"inclination_error_deg", nullptr},
                {"u95_position_um", nullptr},
                {"u95_inclination_deg", nullptr},
                {"verdict", VerdictName(hole.verdict())}};
    // "Not measured" is null, never zero.
    if (hole.has_position_error_mm()) {
      out["position_error_mm"] = hole.position_error_mm();
      out["u95_position_um"] = hole.position_expanded_uncertainty_um();
      out["budget_um"] = BudgetToJson(hole.budget());
    }
    if (hole.has_inclination_error_deg()) {
      out["inclination_error_deg"] = hole.inclination_error_deg();
      out["u95_inclination_deg"] = hole.inclination_expanded_uncertainty_deg();
    }
    if (!hole.reason().empty()) out["reason"] = hole.reason();
    holes.push_back(std::move(out));
  }
  const auto& deviation = entry.inspection.deviation();
  return {{"blade", entry.blade},
          {"inspection", entry.inspection.name()},
          {"registration", entry.inspection.registration()},
          {"scans", ScanIds(entry.inspection.scans())},
          {"verdict", VerdictName(entry.inspection.verdict())},
          {"holes", std::move(holes)},
          {"deviation_um",
           {{"min", deviation.minimum_um()},
            {"max", deviation.maximum_um()},
            {"rms", deviation.rms_um()},
            {"point_count", deviation.point_count()}}},
          {"seconds", entry.seconds}};
}

}  // namespace

json ResultsToJson(const PlantRunResult& result) {
  json out = {{"calibration", json::object()},
              {"registration", json::array()},
              {"correction", json::array()},
              {"inspection", json::array()},
              {"failures", json::array()},
              {"ingest",
               {{"scan_count", result.scan_count},
                {"already_stored_count", result.already_stored_count},
                {"point_count", result.point_count},
                {"payload_bytes", result.payload_bytes},
                {"stored_bytes", result.stored_bytes},
                {"proven_error_um", result.proven_error_um}}},
              {"setup_s", result.setup_s},
              {"timing_s",
               {{"ingest", result.ingest_s},
                {"calibration", result.calibration_s},
                {"registration", result.registration_s},
                {"correction", result.correction_s},
                {"inspection", result.inspection_s}}}};
  if (result.sensor) out["calibration"]["sensor"] = SensorToJson(*result.sensor);
  if (result.rotation) out["calibration"]["rotation"] = RotationToJson(*result.rotation);
  for (const RegisteredBlade& entry : result.registrations) out["registration"].push_back(RegistrationToJson(entry));
  for (const CorrectedBlade& entry : result.corrections) AddCorrection(entry, &out["correction"]);
  for (const InspectedBlade& entry : result.inspections) out["inspection"].push_back(InspectionToJson(entry));
  for (const FailedStep& failure : result.failures) {
    out["failures"].push_back({{"step", failure.step},
                               {"subject", failure.subject},
                               {"method", failure.method},
                               {"outcome", failure.outcome},
                               {"message", failure.message}});
  }
  return out;
}

std::string ResultsToText(const PlantRunResult& result) {
  std::string text;
  if (result.sensor) text += "\n" + CalibrationText(*result.sensor);
  if (result.rotation) text += "\n" + CalibrationText(*result.rotation);
  Table registrations = RegistrationTable();
  for (const RegisteredBlade& entry : result.registrations) {
    AddRegistrationRow(entry.blade, entry.method, entry.registration, &registrations);
  }
  if (!registrations.empty()) text += "\nregistrations\n" + registrations.ToText();
  std::string blade;
  Table corrections = CorrectionTable("method");
  const auto flush = [&] {
    if (!corrections.empty()) text += "\ncorrections of " + blade + " (mm, deg)\n" + corrections.ToText();
    corrections = CorrectionTable("method");
  };
  for (const CorrectedBlade& entry : result.corrections) {
    if (entry.blade != blade) flush();
    blade = entry.blade;
    AddCorrectionRows(entry.method, entry.correction, &corrections);
  }
  flush();
  for (const CorrectedBlade& entry : result.corrections) {
    if (entry.correction.release() != correction::v1::RELEASE_AWAITING_PERSON) continue;
    text += entry.blade + ", " + entry.method + ": waits for a person's release\n";
    for (const std::string& reason : entry.correction.release_reasons()) text += "  " + reason + "\n";
  }
  for (const InspectedBlade& entry : result.inspections) text += "\n" + InspectionText(entry.inspection);
  if (!result.failures.empty()) {
    Table failures({"failed step", "subject", "method", "outcome", "message"});
    for (const FailedStep& failure : result.failures) {
      failures.AddRow({failure.step, failure.subject, failure.method, failure.outcome, failure.message});
    }
    text += "\n" + failures.ToText();
  }
  Table timing({"stage", ">s"});
  timing.AddRow({"ingest of " + Grouped(result.point_count) + " points in " + std::to_string(result.scan_count) +
                     " scans (" + std::to_string(result.already_stored_count) + " stored before)",
                 Fixed(result.ingest_s, 2)});
  timing.AddRow({"calibration", Fixed(result.calibration_s, 2)});
  timing.AddRow({"registration", Fixed(result.registration_s, 2)});
  timing.AddRow({"correction", Fixed(result.correction_s, 2)});
  timing.AddRow({"inspection", Fixed(result.inspection_s, 2)});
  timing.AddRow({"after ingest, together",
                 Fixed(result.calibration_s + result.registration_s + result.correction_s + result.inspection_s, 2)});
  return text + "\n" + timing.ToText();
}

}  // namespace sixpoint::cli
