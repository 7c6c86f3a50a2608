#include "services/inspection/exported.h"

#include <cmath>
#include <string>
#include <utility>

#include "services/inspection/profile_ends.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"

namespace sixpoint::inspection {
namespace {

using exchange::MeasuredValue;
using runtime::StoredWords;

exchange::Verdict FileVerdictAt(const std::string& stored, StoredWords* words) {
  return FileVerdictOf(words->Value<v1::Verdict>(stored));
}

// What all results have in common.
template <typename Row>
exchange::InspectedPart Named(const Row& row, const std::string& result, const plant::v1::Machine* machine,
                              StoredWords* words) {
  exchange::InspectedPart part;
  part.result = result;
  part.serial = row.blade_serial;
  part.part = row.part_id;
  part.part_revision = row.part_revision;
  part.machine = row.machine_id;
  part.machine_revision = row.machine_revision;
  if (machine != nullptr) {
    part.sensor_model = machine->sensor().model();
    part.sensor_serial_number = machine->sensor().serial_number();
  }
  part.work_order = row.work_order;
  part.operation = row.operation;
  part.requested_by = row.requested_by;
  part.software_version = row.software_version;
  part.recorded_at = row.recorded.recorded_at;
  part.verdict = FileVerdictAt(row.verdict, words);
  return part;
}

// What inspections and deviation maps have besides.
template <typename Row>
exchange::InspectedPart Begun(const Row& row, const std::string& result, const plant::v1::Machine* machine,
                              StoredWords* words) {
  exchange::InspectedPart part = Named(row, result, machine, words);
  part.decision_rule = row.decision_rule;
  part.method = row.method;
  part.registration = runtime::NameOf("registrations", row.registration_id);
  part.calibrations = {runtime::NameOf("calibrations", row.sensor_calibration_id),
                       runtime::NameOf("calibrations", row.rotation_calibration_id)};
  for (const std::string& scan : row.scan_ids) part.scans.push_back(runtime::NameOf("scans", scan));
  return part;
}

void Add(exchange::Characteristic characteristic, MeasuredValue value, exchange::InspectedPart* part) {
  part->characteristics.push_back(std::move(characteristic));
  part->values.push_back(std::move(value));
}

exchange::Characteristic::Kind ExportedKindOf(const storage::CharacteristicFindingRow& finding) {
  using Kind = exchange::Characteristic::Kind;
  if (finding.unit == "RATIO") return Kind::kRatio;
  if (finding.quantity == "HOLE_INCLINATION") return Kind::kInclination;
  if (finding.unit == "DEG") return Kind::kAngle;
  if (finding.quantity == "HOLE_POSITION") return Kind::kPosition;
  return finding.quantity.rfind("PROFILE_", 0) == 0 ? Kind::kProfile : Kind::kLength;
}

void AddFinding(const storage::CharacteristicFindingRow& finding, StoredWords* words, exchange::InspectedPart* part) {
  const double scale = finding.unit == "UM" ? 1e-3 : 1;
  const auto scaled = [&](const std::optional<double>& number) {
    return number ? std::optional<double>(scale * *number) : std::nullopt;
  };
  exchange::Characteristic characteristic;
  characteristic.name = finding.characteristic + (finding.feature.empty() ? "" : "/" + finding.feature);
  characteristic.kind = ExportedKindOf(finding);
  characteristic.unit = finding.unit == "RATIO" ? "1" : finding.unit == "DEG" ? "deg" : "mm";
  characteristic.nominal = scaled(finding.nominal).value_or(0);
  characteristic.lower = scaled(finding.lower_limit);
  characteristic.upper = scaled(finding.upper_limit);
  MeasuredValue value;
  value.verdict = FileVerdictAt(finding.verdict, words);
  value.reason = finding.reason;
  // Of a surface that was not seen as far as was wanted, what was seen of it is no value of the tolerance.
  if (value.verdict != exchange::Verdict::kNotMeasured) {
    value.value = scaled(finding.value);
    value.expanded_uncertainty = scaled(finding.expanded_uncertainty);
    // As a zone about the CAD has it: the greatest distance.
    const bool about_the_cad =
        characteristic.lower && characteristic.upper && *characteristic.lower == -*characteristic.upper;
    if (characteristic.kind == exchange::Characteristic::Kind::kProfile && about_the_cad)
      value.value = std::abs(*value.value);
  }
  Add(std::move(characteristic), std::move(value), part);
}

}  // namespace

ExportedPart Exported(const storage::AssessmentRow& row, const plant::v1::Machine* machine) {
  const std::string result = runtime::NameOf("assessments", row.assessment_id);
  StoredWords words(result);
  exchange::InspectedPart part = Named(row, result, machine, &words);
  part.decision_rule =
      "of each characteristic, by " + runtime::RevisedName("drawings", row.drawing_id, row.drawing_revision);
  for (const storage::CharacteristicFindingRow& finding : row.findings) AddFinding(finding, &words, &part);
  return words.Checked(std::optional(std::move(part)));
}

ExportedPart Exported(const storage::InspectionRow& row, const plant::v1::Machine* machine) {
  const std::string result = runtime::NameOf("inspections", row.inspection_id);
  StoredWords words(result);
  exchange::InspectedPart part = Begun(row, result, machine, &words);
  for (const storage::InspectionHoleRow& hole : row.holes) {
    const std::string name = hole.group_name + "/" + hole.hole_name;
    exchange::Characteristic position{name + "/position",        exchange::Characteristic::Kind::kPosition, "mm", 0, {},
                                      hole.position_tolerance_mm};
    exchange::Characteristic inclination{
        name + "/inclination",         exchange::Characteristic::Kind::kInclination, "deg", 0, {},
        hole.inclination_tolerance_deg};
    MeasuredValue at, leaning;
    at.verdict = FileVerdictAt(hole.position_verdict, &words);
    leaning.verdict = FileVerdictAt(hole.inclination_verdict, &words);
    at.reason = leaning.reason = hole.reason;
    if (hole.measured) {
      at.value = hole.measured->position_error_mm;
      at.expanded_uncertainty = hole.measured->position_expanded_uncertainty_um / 1e3;
      leaning.value = hole.measured->inclination_error_deg;
      leaning.expanded_uncertainty = hole.measured->inclination_expanded_uncertainty_deg;
    }
    Add(std::move(position), std::move(at), &part);
    Add(std::move(inclination), std::move(leaning), &part);
  }
  return words.Checked(std::optional(std::move(part)));
}

ExportedPart Exported(const storage::DeviationMapRow& row, const plant::v1::Machine* machine) {
  if (row.profiles.empty()) return std::nullopt;
  const std::string result = runtime::NameOf("deviations", row.deviation_id);
  StoredWords words(result);
  exchange::InspectedPart part = Begun(row, result, machine, &words);
  for (const storage::DeviationProfileRow& profile : row.profiles) {
    exchange::Characteristic characteristic{
        profile.characteristic, exchange::Characteristic::Kind::kProfile, "mm", 0, profile.lower_mm, profile.upper_mm};
    MeasuredValue value;
    value.verdict = FileVerdictAt(profile.verdict, &words);
    value.reason = profile.reason;
    // Of a surface that was not seen as far as was wanted, what was seen of it is no value of the tolerance.
    if (profile.lowest && profile.highest && value.verdict != exchange::Verdict::kNotMeasured) {
      value.worst_negative = profile.lowest->mean_um / 1e3;
      value.worst_positive = profile.highest->mean_um / 1e3;
      const bool above =
          UpperEndIsWorse({profile.lower_mm, profile.upper_mm}, *value.worst_negative, *value.worst_positive);
      const storage::DeviationPatchRow& worst = above ? *profile.highest : *profile.lowest;
      // As a zone about the CAD has it: the greatest distance; between other limits the deviation itself.
      const bool about_the_cad = profile.lower_mm == -profile.upper_mm;
      value.value = about_the_cad ? std::abs(worst.mean_um / 1e3) : worst.mean_um / 1e3;
      value.expanded_uncertainty = worst.expanded_uncertainty_um / 1e3;
    }
    Add(std::move(characteristic), std::move(value), &part);
  }
  return words.Checked(std::optional(std::move(part)));
}

}  // namespace sixpoint::inspection
