#include "services/inspection/messages.h"

#include <string>
#include <utility>

#include "services/clients/error_sources.h"
#include "services/inspection/hole_value_rows.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::inspection {
namespace {

absl::Status SetVerdicts(const storage::InspectionHoleRow& row, const std::string& inspection_id,
                         v1::HoleResult* hole) {
  for (const auto& [text, set] : {std::pair(&row.verdict, &v1::HoleResult::set_verdict),
                                  std::pair(&row.position_verdict, &v1::HoleResult::set_position_verdict),
                                  std::pair(&row.inclination_verdict, &v1::HoleResult::set_inclination_verdict)}) {
    const auto verdict = VerdictOf(*text, "inspection " + inspection_id);
    if (!verdict.ok()) return verdict.status();
    (hole->*set)(*verdict);
  }
  return absl::OkStatus();
}

void SetMeasured(const storage::InspectionHoleRow::Measured& measured, v1::HoleResult* hole) {
  hole->set_position_error_mm(measured.position_error_mm);
  hole->set_inclination_error_deg(measured.inclination_error_deg);
  hole->set_position_expanded_uncertainty_um(measured.position_expanded_uncertainty_um);
  hole->set_inclination_expanded_uncertainty_deg(measured.inclination_expanded_uncertainty_deg);
  runtime::SetPoint(measured.start_in_part_mm, hole->mutable_start_in_part_mm());
  runtime::SetDirection(measured.axis_in_part, hole->mutable_axis_in_part());
  hole->set_pin_diameter_mm(measured.pin_diameter_mm);
}

}  // namespace

absl::StatusOr<v1::Inspection> ToProto(const storage::InspectionRow& row) {
  v1::Inspection inspection;
  inspection.set_name(runtime::NameOf("inspections", row.inspection_id));
  inspection.set_blade(runtime::NameOf("blades", row.blade_serial));
  for (const std::string& scan : row.scan_ids) inspection.add_scans(runtime::NameOf("scans", scan));
  inspection.set_registration(runtime::NameOf("registrations", row.registration_id));
  const auto verdict = VerdictOf(row.verdict, "inspection " + row.inspection_id);
  if (!verdict.ok()) return verdict.status();
  inspection.set_verdict(*verdict);
  for (const storage::InspectionHoleRow& hole_row : row.holes) {
    v1::HoleResult& hole = *inspection.add_holes();
    hole.set_group(hole_row.group_name);
    hole.set_hole(hole_row.hole_name);
    if (absl::Status status = SetVerdicts(hole_row, row.inspection_id, &hole); !status.ok()) return status;
    if (hole_row.measured) SetMeasured(*hole_row.measured, &hole);
    const auto budget = clients::BudgetOf(inspection.name(), row.budget_sources, hole_row.budget_um);
    if (!budget.ok()) return budget.status();
    hole.mutable_budget()->Add(budget->begin(), budget->end());
    hole.set_position_tolerance_mm(hole_row.position_tolerance_mm);
    hole.set_inclination_tolerance_deg(hole_row.inclination_tolerance_deg);
    hole.set_point_count(hole_row.point_count);
    if (hole_row.measured) {
      hole.set_pin_residual_rms_um(hole_row.pin_residual_rms_um);
      if (row.positioning_covered || hole_row.positioning_difference_um > 0)
        hole.set_positioning_difference_um(hole_row.positioning_difference_um);
      if (hole_row.pin_half_play_um) hole.set_pin_half_play_um(*hole_row.pin_half_play_um);
    }
    hole.set_reason(hole_row.reason);
  }
  if (absl::Status status = HoleValuesToProto(row, &inspection); !status.ok()) return status;
  v1::DeviationSummary& deviation = *inspection.mutable_deviation();
  deviation.set_minimum_um(row.deviation_minimum_um);
  deviation.set_maximum_um(row.deviation_maximum_um);
  deviation.set_rms_um(row.deviation_rms_um);
  deviation.set_p05_um(row.deviation_p05_um);
  deviation.set_p50_um(row.deviation_p50_um);
  deviation.set_p95_um(row.deviation_p95_um);
  deviation.set_point_count(row.deviation_point_count);
  deviation.set_excluded_count(row.deviation_excluded_count);
  v1::Positioning& positioning = *inspection.mutable_positioning();
  const auto method = runtime::StoredEnum<registration::v1::Method>(row.method, "inspection " + row.inspection_id);
  if (!method.ok()) return method.status();
  positioning.set_method(*method);
  if (row.disagreement_um) positioning.set_disagreement_um(*row.disagreement_um);
  if (row.disagreement_ratio) positioning.set_disagreement_ratio(*row.disagreement_ratio);
  positioning.set_disagrees(row.positioning_disagrees);
  positioning.set_covered(row.positioning_covered);
  inspection.set_decision_rule(row.decision_rule);
  inspection.set_requested_by(row.requested_by);
  inspection.set_software_version(row.software_version);
  inspection.set_computed_on(row.computed_on);
  if (!row.rejudges_id.empty()) inspection.set_rejudges(runtime::NameOf("inspections", row.rejudges_id));
  runtime::ToProto(row.recorded.recorded_at, inspection.mutable_recorded_at());
  inspection.set_record_sequence(row.recorded.sequence);
  for (const storage::DispositionRow& disposition_row : row.dispositions) {
    const auto disposition = DispositionOf(disposition_row);
    if (!disposition.ok()) return disposition.status();
    *inspection.add_dispositions() = *disposition;
  }
  inspection.set_work_order(row.work_order);
  inspection.set_operation(row.operation);
  return inspection;
}

absl::StatusOr<v1::Disposition> DispositionOf(const storage::DispositionRow& row) {
  v1::Disposition disposition;
  disposition.set_name(runtime::NameOf("dispositions", row.disposition_id));
  disposition.set_inspection(runtime::NameOf("inspections", row.inspection_id));
  disposition.set_blade(runtime::NameOf("blades", row.blade_serial));
  const auto kind = runtime::StoredEnum<v1::DispositionKind>(row.disposition, "disposition " + row.disposition_id);
  if (!kind.ok()) return kind.status();
  disposition.set_kind(*kind);
  disposition.set_reason(row.reason);
  disposition.set_reference(row.reference);
  disposition.set_requested_by(row.requested_by);
  runtime::ToProto(row.recorded.recorded_at, disposition.mutable_recorded_at());
  disposition.set_record_sequence(row.recorded.sequence);
  return disposition;
}

void LeaveBasic(v1::Inspection* inspection) {
  inspection->clear_holes();
  while (inspection->dispositions_size() > 1) inspection->mutable_dispositions()->RemoveLast();
}

}  // namespace sixpoint::inspection
