#include "services/inspection/rows.h"

#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "services/clients/registered_row.h"
#include "services/inspection/hole_value_rows.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/units.h"

namespace sixpoint::inspection {
namespace {

// Verdicts, decision rule, holes and deviation. The holes are those that the findings were made for, in their order.
void SetFindings(const std::vector<metrology::InspectedHole>& holes, const metrology::BladeFindings& findings,
                 storage::InspectionRow* row) {
  row->verdict = TextOf(findings.verdict);
  row->decision_rule = metrology::kDecisionRule;
  const metrology::DeviationSummary& deviation = findings.deviation;
  row->deviation_minimum_um = deviation.minimum_um;
  row->deviation_maximum_um = deviation.maximum_um;
  row->deviation_rms_um = deviation.rms_um;
  row->deviation_p05_um = deviation.p05_um;
  row->deviation_p50_um = deviation.p50_um;
  row->deviation_p95_um = deviation.p95_um;
  row->deviation_point_count = deviation.point_count;
  row->deviation_excluded_count = deviation.excluded_count;
  for (std::size_t i = 0; i < holes.size(); ++i) {
    const metrology::HoleFinding& finding = findings.holes[i];
    storage::InspectionHoleRow& hole = row->holes.emplace_back();
    hole.group_name = holes[i].group;
    hole.hole_name = holes[i].name;
    hole.verdict = TextOf(finding.verdict);
    hole.position_verdict = TextOf(finding.position_verdict);
    hole.inclination_verdict = TextOf(finding.inclination_verdict);
    if (finding.verdict != metrology::Verdict::kNotMeasured) {
      hole.measured =
          storage::InspectionHoleRow::Measured{finding.error.position_mm,
                                               finding.error.inclination_rad / runtime::kRadPerDeg,
                                               finding.position_expanded_uncertainty_mm * 1e3,
                                               finding.inclination_expanded_uncertainty_rad / runtime::kRadPerDeg,
                                               runtime::ThreeOf(finding.error.start_in_part_mm),
                                               runtime::ThreeOf(finding.error.axis_in_part),
                                               2 * finding.pin_radius_mm};
    }
    hole.position_tolerance_mm = holes[i].position_tolerance_mm;
    hole.inclination_tolerance_deg = holes[i].inclination_tolerance_rad / runtime::kRadPerDeg;
    hole.point_count = finding.point_count;
    hole.pin_residual_rms_um = finding.pin_residual_rms_um;
    hole.reason = finding.reason;
    hole.positioning_difference_um = finding.positioning_difference_mm * 1e3;
    if (hole.measured) hole.pin_half_play_um = finding.pin_half_play_mm * 1e3;
  }
  SetHoleValues(findings, row);
}

std::string SummaryOf(const storage::InspectionRow& row) {
  nlohmann::json counts = {{"CONFORM", 0}, {"NOT_CONFORM", 0}, {"UNDECIDABLE", 0}, {"NOT_MEASURED", 0}};
  for (const storage::InspectionHoleRow& hole : row.holes) counts[hole.verdict] = counts[hole.verdict].get<int>() + 1;
  return nlohmann::json{{"verdict", row.verdict}, {"hole_counts", counts}, {"deviation_rms_um", row.deviation_rms_um}}
      .dump();
}

}  // namespace

runtime::Made<storage::InspectionRow> RecordOf(const Inputs& inputs, const metrology::BladeFindings& findings) {
  const registration::v1::Registration& registration = inputs.registration;
  storage::InspectionRow row;
  row.inspection_id = storage::NewUuid();
  clients::SetRegistered(registration, &row);
  if (inputs.compared.disagreement) {
    row.disagreement_um = inputs.compared.disagreement->greatest_um();
    row.disagreement_ratio = inputs.compared.disagreement->ratio();
  }
  row.positioning_disagrees = inputs.compared.disagrees;
  row.positioning_covered = inputs.compared.covered;
  SetFindings(inputs.holes, findings, &row);
  storage::RecordEntry entry = clients::EntryOf("inspection", runtime::NameOf("inspections", row.inspection_id),
                                                registration, inputs.compared.names);
  entry.summary_json = SummaryOf(row);
  return {std::move(row), std::move(entry)};
}

}  // namespace sixpoint::inspection
