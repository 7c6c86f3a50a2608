#include "services/correction/messages.h"

#include <optional>

#include "services/clients/error_sources.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::correction {

namespace {

void Fill(const std::optional<storage::CorrectionDecisionRow>& row, v1::CorrectionDecision* (*out)(v1::Correction*),
          v1::Correction* correction) {
  if (!row.has_value()) return;
  v1::CorrectionDecision& decision = *out(correction);
  decision.set_requested_by(row->requested_by);
  decision.set_reason(row->reason);
  runtime::ToProto(row->recorded_at, decision.mutable_recorded_at());
}

void AddChecks(const storage::CorrectionRow& row, v1::Correction* correction) {
  for (const storage::CorrectionCheckRow& in : row.checks) {
    v1::ReleaseCheck& check = *correction->add_checks();
    v1::ReleaseCheckKind kind = v1::RELEASE_CHECK_KIND_UNSPECIFIED;
    // One that a later release asked: this one does not know its name.
    if (v1::ReleaseCheckKind_Parse("RELEASE_CHECK_KIND_" + in.kind, &kind)) check.set_kind(kind);
    check.set_subject(in.subject);
    if (in.value) check.set_value(*in.value);
    check.set_limit(in.limit);
    check.set_passed(in.passed);
    check.set_failed_count(in.failed_count);
  }
}

void AddPath(const storage::CorrectionToolPathRow& path, v1::CorrectedGroup* group) {
  for (const storage::CorrectionToolPoseRow& row : path.poses) {
    v1::CorrectedToolPose& pose = *group->add_poses();
    runtime::SetPoint(row.tip_mm, pose.mutable_tip_mm());
    runtime::SetPoint(row.nominal_tip_mm, pose.mutable_nominal_tip_mm());
    pose.set_a_deg(row.commanded_deg[0]);
    pose.set_b_deg(row.commanded_deg[1]);
    pose.set_a_nominal_deg(row.nominal_deg[0]);
    pose.set_b_nominal_deg(row.nominal_deg[1]);
    if (row.reached_deg) {
      pose.set_a_reached_deg((*row.reached_deg)[0]);
      pose.set_b_reached_deg((*row.reached_deg)[1]);
    }
    pose.set_tilt_deg(row.tilt_deg);
    pose.set_a_standard_uncertainty_deg(row.standard_uncertainty_deg[0]);
    pose.set_b_standard_uncertainty_deg(row.standard_uncertainty_deg[1]);
    pose.set_expanded_uncertainty_um(row.expanded_uncertainty_um);
  }
  group->set_greatest_chord_um(path.greatest_chord_um);
  group->set_greatest_axis_deviation_deg(path.greatest_axis_deviation_deg);
  if (!path.adaptation) return;
  v1::PathAdaptation& adaptation = *group->mutable_adaptation();
  adaptation.set_greatest_shift_mm(path.adaptation->greatest_shift_mm);
  adaptation.set_greatest_turn_deg(path.adaptation->greatest_turn_deg);
  adaptation.set_gouge_um(path.adaptation->gouge_um);
  adaptation.set_rest_um(path.adaptation->rest_um);
  if (path.adaptation->deepest_compensation_um)
    adaptation.set_deepest_compensation_um(*path.adaptation->deepest_compensation_um);
}

void AddControlTables(const storage::CorrectionRow& row, v1::Correction* correction) {
  for (const storage::WorkOffsetRow& one : row.work_offsets) {
    v1::WorkOffset& out = *correction->add_work_offsets();
    out.set_code(one.code);
    out.set_x_mm(one.offset[0]);
    out.set_y_mm(one.offset[1]);
    out.set_z_mm(one.offset[2]);
    out.set_a_deg(one.offset[3]);
    out.set_b_deg(one.offset[4]);
  }
  for (const storage::ToolLengthRow& one : row.tool_lengths) {
    v1::ToolLength& out = *correction->add_tool_lengths();
    out.set_number(one.number);
    out.set_length_mm(one.length_mm);
  }
}

}  // namespace

absl::StatusOr<v1::Correction> ToProto(const storage::CorrectionRow& row) {
  v1::Correction correction;
  const auto state = runtime::StoredEnum<v1::CorrectionState>(row.state, "correction " + row.correction_id);
  if (!state.ok()) return state.status();
  correction.set_state(*state);
  correction.set_name(runtime::NameOf("corrections", row.correction_id));
  correction.set_blade(runtime::NameOf("blades", row.blade_serial));
  correction.set_registration(runtime::NameOf("registrations", row.registration_id));
  correction.set_machine(runtime::NameOf("machines", row.machine_id));
  correction.set_rotation_calibration(runtime::NameOf("calibrations", row.rotation_calibration_id));
  for (const storage::CorrectionGroupRow& group_row : row.groups) {
    v1::CorrectedGroup& group = *correction.add_groups();
    group.set_group(group_row.group_name);
    group.set_a_deg(group_row.a_deg);
    group.set_b_deg(group_row.b_deg);
    group.set_a_nominal_deg(group_row.a_nominal_deg);
    group.set_b_nominal_deg(group_row.b_nominal_deg);
    group.set_a_ideal_deg(group_row.a_ideal_deg);
    group.set_b_ideal_deg(group_row.b_ideal_deg);
    group.set_a_standard_uncertainty_deg(group_row.a_standard_uncertainty_deg);
    group.set_b_standard_uncertainty_deg(group_row.b_standard_uncertainty_deg);
    if (group_row.reached_deg) {
      group.set_a_reached_deg((*group_row.reached_deg)[0]);
      group.set_b_reached_deg((*group_row.reached_deg)[1]);
    }
    if (group_row.tilt_deg) group.set_tilt_deg(*group_row.tilt_deg);
    if (group_row.path) AddPath(*group_row.path, &group);
    for (const storage::CorrectionHoleRow& hole_row : group_row.holes) {
      v1::CorrectedHole& hole = *group.add_holes();
      hole.set_hole(hole_row.hole_name);
      runtime::SetPoint(hole_row.start_mm, hole.mutable_start_mm());
      runtime::SetPoint(hole_row.nominal_start_mm, hole.mutable_nominal_start_mm());
      hole.set_expanded_uncertainty_um(hole_row.expanded_uncertainty_um);
      if (hole_row.reported_cut_at) runtime::ToProto(*hole_row.reported_cut_at, hole.mutable_reported_cut_at());
      const auto budget = clients::BudgetOf(correction.name(), row.budget_sources, hole_row.budget_um);
      if (!budget.ok()) return budget.status();
      hole.mutable_budget()->Add(budget->begin(), budget->end());
    }
  }
  correction.set_release(row.release == "AUTOMATIC" ? v1::RELEASE_AUTOMATIC : v1::RELEASE_AWAITING_PERSON);
  for (const std::string& reason : row.release_reasons) correction.add_release_reasons(reason);
  runtime::ToProto(row.valid_until, correction.mutable_valid_until());
  correction.set_requested_by(row.requested_by);
  correction.set_software_version(row.software_version);
  correction.set_computed_on(row.computed_on);
  runtime::ToProto(row.recorded.recorded_at, correction.mutable_recorded_at());
  correction.set_record_sequence(row.recorded.sequence);
  for (const std::string& axis : row.axes) correction.add_axes(axis);
  for (const std::string& id : row.characterisation_ids)
    correction.add_axis_characterisations(runtime::NameOf("calibrations", id));
  if (row.proof) SetProof(*row.proof, correction.mutable_proof());
  AddControlTables(row, &correction);
  AddChecks(row, &correction);
  Fill(
      row.released, [](v1::Correction* out) { return out->mutable_released(); }, &correction);
  Fill(
      row.refused, [](v1::Correction* out) { return out->mutable_refused(); }, &correction);
  if (!row.superseded_by.empty() && row.state == "SUPERSEDED")
    correction.set_superseded_by(runtime::NameOf("corrections", row.superseded_by));
  runtime::ToProto(row.usable_until, correction.mutable_usable_until());
  correction.set_program_sha256(row.program_sha256);
  correction.set_clamping(row.clamping);
  if (!row.machining_model_id.empty())
    correction.set_machining_model(
        runtime::RevisedName("machining_models", row.machining_model_id, row.machining_model_revision));
  if (!row.reconstruction_id.empty())
    correction.set_reconstruction(runtime::NameOf("reconstructions", row.reconstruction_id));
  if (!row.machining_pass_id.empty())
    correction.set_machining_pass(runtime::NameOf("machining_passes", row.machining_pass_id));
  if (!row.repair_id.empty()) correction.set_repair(runtime::NameOf("repairs", row.repair_id));
  return correction;
}

void SetProof(const storage::ProgramProofRow& row, v1::ProgramProof* proof) {
  proof->set_reader_version(row.reader_version);
  proof->set_pose_count(row.pose_count);
  proof->set_greatest_difference_um(row.greatest_difference_um);
  proof->set_greatest_tilt_deg(row.greatest_tilt_deg);
}

absl::StatusOr<v1::Correction> WithProgram(const storage::CorrectionRow& row) {
  absl::StatusOr<v1::Correction> correction = ToProto(row);
  if (correction.ok() && correction->state() == v1::CORRECTION_STATE_RELEASED)
    correction->set_nc_program(row.nc_program);
  return correction;
}

void LeaveBasic(v1::Correction* correction) { correction->clear_groups(); }

}  // namespace sixpoint::correction
