#include "services/inspection/hole_value_rows.h"

#include <utility>

#include "services/clients/error_sources.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/units.h"

namespace sixpoint::inspection {
namespace {

using metrology::UncertaintyComponent;
using storage::StatedValueRow;

const char* SurfaceReferenceText(metrology::SurfaceReference reference) {
  switch (reference) {
    case metrology::SurfaceReference::kPartZ:
      return "PART_Z";
    case metrology::SurfaceReference::kPartX:
      return "PART_X";
    case metrology::SurfaceReference::kHoleAxis:
      break;
  }
  return "AXIS_IN_SURFACE";
}

StatedValueRow Lengths(const metrology::StatedLength& length) {
  return {runtime::kUmPerMm * length.value_mm, runtime::kUmPerMm * length.expanded_uncertainty_mm};
}
StatedValueRow Degrees(const metrology::StatedAngle& angle) {
  return {runtime::kDegPerRad * angle.value_rad, runtime::kDegPerRad * angle.expanded_uncertainty_rad};
}

storage::StatedPositioningRow StatedRowOf(const metrology::HoleFinding& finding) {
  const metrology::SurfaceUncertainty& lies = finding.displacement->in_stated_positioning;
  const Eigen::Matrix2d covariance_um2 = runtime::kUmPerMm * runtime::kUmPerMm * lies.covariance_mm2;
  return {runtime::kUmPerMm * finding.position_stated_expanded_uncertainty_mm,
          runtime::kDegPerRad * finding.inclination_stated_expanded_uncertainty_rad,
          runtime::kDegPerRad * finding.positioning_difference_rad,
          covariance_um2(0, 0),
          covariance_um2(1, 1),
          covariance_um2(0, 1),
          lies.coverage_factor};
}

storage::HoleDetailRow ValuesRowOf(const metrology::HoleFinding& finding) {
  const metrology::HoleDisplacement& displacement = *finding.displacement;
  storage::HoleDetailRow row;
  row.measured_by = finding.instrument == metrology::HoleInstrument::kBore ? "BORE" : "PIN";
  row.along_is = SurfaceReferenceText(displacement.directions.reference);
  row.along_in_part = runtime::ThreeOf(displacement.directions.along);
  row.across_in_part = runtime::ThreeOf(displacement.directions.across);
  row.along_um = Lengths(displacement.along);
  row.across_um = Lengths(displacement.across);
  row.inclination_along_deg = Degrees(displacement.inclination_along);
  row.inclination_across_deg = Degrees(displacement.inclination_across);
  row.in_stated_positioning = StatedRowOf(finding);
  if (finding.pin_diameter)
    row.pin_diameter_expanded_uncertainty_um = runtime::kUmPerMm * finding.pin_diameter->seen.expanded_uncertainty_mm;
  if (finding.hole_diameter.found) {
    const metrology::StatedLength& diameter = finding.hole_diameter.found->diameter;
    row.diameter_mm = diameter.value_mm;
    row.diameter_expanded_uncertainty_um = runtime::kUmPerMm * diameter.expanded_uncertainty_mm;
  } else {
    row.diameter_reason = finding.hole_diameter.reason;
  }
  return row;
}

storage::HolePitchRow PitchRowOf(const metrology::HolePitch& pitch) {
  storage::HolePitchRow row;
  row.hole_index = static_cast<int>(pitch.hole);
  row.next_index = static_cast<int>(pitch.next);
  row.nominal_pitch_mm = pitch.nominal_mm;
  if (pitch.values)
    row.measured = storage::HolePitchRow::Measured{
        {pitch.values->along_row.value_mm, runtime::kUmPerMm * pitch.values->along_row.expanded_uncertainty_mm},
        pitch.values->over_nominal_diameter.value,
        pitch.values->over_nominal_diameter.expanded_uncertainty};
  else
    row.reason = pitch.reason;
  return row;
}

void Fill(const StatedValueRow& row, v1::SignedValue* out) {
  out->set_value(row.value);
  out->set_expanded_uncertainty(row.expanded_uncertainty);
}

void Fill(const storage::StatedPositioningRow& row, v1::StatedPositioning* out) {
  out->set_position_expanded_uncertainty_um(row.position_expanded_uncertainty_um);
  out->set_inclination_expanded_uncertainty_deg(row.inclination_expanded_uncertainty_deg);
  out->set_positioning_difference_deg(row.positioning_difference_deg);
  out->set_along_variance_um2(row.along_variance_um2);
  out->set_across_variance_um2(row.across_variance_um2);
  out->set_covariance_um2(row.covariance_um2);
  out->set_displacement_coverage_factor(row.coverage_factor);
}

absl::Status AddBudget(const storage::InspectionRow& row, const std::vector<double>& budget_um,
                       google::protobuf::RepeatedPtrField<uncertainty::v1::UncertaintyComponent>* out) {
  const auto budget = clients::BudgetOf("inspection " + row.inspection_id, row.budget_sources, budget_um);
  if (!budget.ok()) return budget.status();
  out->Add(budget->begin(), budget->end());
  return absl::OkStatus();
}

absl::Status Fill(const storage::InspectionRow& inspection, const storage::HoleDetailRow& row, v1::HoleResult* hole) {
  const std::string what = "inspection " + inspection.inspection_id;
  const auto by = runtime::StoredEnum<v1::HoleMeasuredBy>(row.measured_by, what);
  if (!by.ok()) return by.status();
  hole->set_measured_by(*by);
  v1::HoleDisplacement& displacement = *hole->mutable_displacement();
  const auto along_is = runtime::StoredEnum<v1::AlongIs>(row.along_is, what);
  if (!along_is.ok()) return along_is.status();
  displacement.set_along_is(*along_is);
  runtime::SetDirection(row.along_in_part, displacement.mutable_along_in_part());
  runtime::SetDirection(row.across_in_part, displacement.mutable_across_in_part());
  Fill(row.along_um, displacement.mutable_along_um());
  Fill(row.across_um, displacement.mutable_across_um());
  Fill(row.inclination_along_deg, displacement.mutable_inclination_along_deg());
  Fill(row.inclination_across_deg, displacement.mutable_inclination_across_deg());
  if (row.in_stated_positioning) Fill(*row.in_stated_positioning, hole->mutable_in_stated_positioning());
  if (row.pin_diameter_expanded_uncertainty_um)
    hole->set_pin_diameter_expanded_uncertainty_um(*row.pin_diameter_expanded_uncertainty_um);
  if (row.diameter_mm) {
    hole->mutable_diameter()->set_diameter_mm(*row.diameter_mm);
    hole->mutable_diameter()->set_expanded_uncertainty_um(*row.diameter_expanded_uncertainty_um);
  }
  hole->set_diameter_reason(row.diameter_reason);
  absl::Status status =
      AddBudget(inspection, row.along_um.budget_um, displacement.mutable_along_um()->mutable_budget());
  if (status.ok())
    status = AddBudget(inspection, row.across_um.budget_um, displacement.mutable_across_um()->mutable_budget());
  return status;
}

}  // namespace

void SetHoleValues(const metrology::BladeFindings& findings, storage::InspectionRow* row) {
  // The names once for all: of the holes' positions, then of both displacements, then of the pitches.
  std::vector<const std::vector<UncertaintyComponent>*> components;
  const std::vector<UncertaintyComponent> none;
  for (const metrology::HoleFinding& finding : findings.holes) components.push_back(&finding.components);
  for (const metrology::HoleFinding& finding : findings.holes) {
    components.push_back(finding.displacement ? &finding.displacement->along.budget.components : &none);
    components.push_back(finding.displacement ? &finding.displacement->across.budget.components : &none);
  }
  for (const metrology::HolePitch& pitch : findings.pitches)
    components.push_back(pitch.values ? &pitch.values->along_row.budget.components : &none);
  clients::KeptBudgets kept = clients::Kept(components);
  for (std::size_t i = 0; i < row->holes.size(); ++i)
    if (findings.holes[i].displacement) row->holes[i].values = ValuesRowOf(findings.holes[i]);
  for (const metrology::HolePitch& pitch : findings.pitches) row->pitches.push_back(PitchRowOf(pitch));
  if (kept.sources.empty()) return;
  row->budget_sources = std::move(kept.sources);
  auto budget = kept.standard_uncertainties_um.begin();
  for (storage::InspectionHoleRow& hole : row->holes) {
    if (hole.measured) hole.budget_um = std::move(*budget);
    ++budget;
  }
  for (storage::InspectionHoleRow& hole : row->holes)
    for (const auto value : {&storage::HoleDetailRow::along_um, &storage::HoleDetailRow::across_um}) {
      if (hole.values) ((*hole.values).*value).budget_um = std::move(*budget);
      ++budget;
    }
  for (storage::HolePitchRow& pitch : row->pitches) {
    if (pitch.measured) pitch.measured->pitch_mm.budget_um = std::move(*budget);
    ++budget;
  }
}

absl::Status HoleValuesToProto(const storage::InspectionRow& row, v1::Inspection* inspection) {
  for (std::size_t i = 0; i < row.holes.size(); ++i)
    if (row.holes[i].values)
      if (absl::Status status = Fill(row, *row.holes[i].values, inspection->mutable_holes(static_cast<int>(i)));
          !status.ok())
        return status;
  for (const storage::HolePitchRow& pitch_row : row.pitches) {
    const storage::InspectionHoleRow& from = row.holes[static_cast<std::size_t>(pitch_row.hole_index)];
    v1::HolePitch& pitch = *inspection->add_pitches();
    pitch.set_group(from.group_name);
    pitch.set_from(from.hole_name);
    pitch.set_to(row.holes[static_cast<std::size_t>(pitch_row.next_index)].hole_name);
    pitch.set_nominal_pitch_mm(pitch_row.nominal_pitch_mm);
    pitch.set_reason(pitch_row.reason);
    if (!pitch_row.measured) continue;
    pitch.set_pitch_mm(pitch_row.measured->pitch_mm.value);
    pitch.set_expanded_uncertainty_um(pitch_row.measured->pitch_mm.expanded_uncertainty);
    pitch.set_pitch_over_diameter(pitch_row.measured->pitch_over_diameter);
    pitch.set_pitch_over_diameter_expanded_uncertainty(pitch_row.measured->pitch_over_diameter_expanded_uncertainty);
    if (absl::Status status = AddBudget(row, pitch_row.measured->pitch_mm.budget_um, pitch.mutable_budget());
        !status.ok())
      return status;
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::inspection
