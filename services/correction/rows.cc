#include "services/correction/rows.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "metrology/correction/path_draws.h"
#include "services/clients/error_sources.h"
#include "services/runtime/computed_on.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/server.h"
#include "services/runtime/units.h"
#include "storage/blobs.h"

namespace sixpoint::correction {
namespace {

storage::CorrectionGroupRow GroupRowOf(const metrology::CorrectedHoleGroup& group, bool tables_applied) {
  storage::CorrectionGroupRow row;
  row.group_name = group.name;
  row.a_deg = group.corrected.a_rad / runtime::kRadPerDeg;
  row.b_deg = group.corrected.b_rad / runtime::kRadPerDeg;
  row.a_nominal_deg = group.nominal.a_rad / runtime::kRadPerDeg;
  row.b_nominal_deg = group.nominal.b_rad / runtime::kRadPerDeg;
  row.a_ideal_deg = group.ideal.a_rad / runtime::kRadPerDeg;
  row.b_ideal_deg = group.ideal.b_rad / runtime::kRadPerDeg;
  row.a_standard_uncertainty_deg = group.a_standard_uncertainty_rad / runtime::kRadPerDeg;
  row.b_standard_uncertainty_deg = group.b_standard_uncertainty_rad / runtime::kRadPerDeg;
  row.tilt_deg = group.tilt_rad / runtime::kRadPerDeg;
  if (tables_applied)
    row.reached_deg = {group.reached.a_rad / runtime::kRadPerDeg, group.reached.b_rad / runtime::kRadPerDeg};
  for (const metrology::CorrectedHole& hole : group.holes) {
    storage::CorrectionHoleRow& hole_row = row.holes.emplace_back();
    hole_row.hole_name = hole.name;
    for (int i = 0; i < 3; ++i) {
      hole_row.start_mm[static_cast<std::size_t>(i)] = hole.start_mm[i];
      hole_row.nominal_start_mm[static_cast<std::size_t>(i)] = hole.nominal_start_mm[i];
    }
    hole_row.expanded_uncertainty_um = hole.expanded_uncertainty_um;
  }
  return row;
}

std::array<double, 2> Degrees(const metrology::RotaryAngles& angles) {
  return {angles.a_rad / runtime::kRadPerDeg, angles.b_rad / runtime::kRadPerDeg};
}

// A group of one hole, which stands at the first pose and is as uncertain as the worst.
storage::CorrectionGroupRow GroupRowOf(const CorrectedPath& corrected, bool tables_applied) {
  metrology::CorrectedHoleGroup group = metrology::CorrectedPoseOf(corrected.path.name, corrected.path.poses.front());
  group.ideal = corrected.ideal;
  metrology::CorrectedHole& hole = group.holes.front();
  hole.name = corrected.path.name;
  hole.expanded_uncertainty_um = corrected.WorstStart().expanded_uncertainty_um;
  storage::CorrectionGroupRow row = GroupRowOf(group, tables_applied);
  storage::CorrectionToolPathRow& path = row.path.emplace();
  path.greatest_chord_um = corrected.greatest_chord_um;
  path.greatest_axis_deviation_deg = corrected.greatest_axis_deviation_deg;
  if (const auto& adapted = corrected.adaptation)
    path.adaptation = {adapted->greatest_shift_mm, adapted->greatest_turn_rad / runtime::kRadPerDeg, adapted->gouge_um,
                       adapted->rest_um, adapted->deepest_compensation_um};
  for (const metrology::CorrectedToolPose& at : corrected.path.poses) {
    storage::CorrectionToolPoseRow& pose = path.poses.emplace_back();
    pose.tip_mm = runtime::ThreeOf(at.start.start_mm);
    pose.nominal_tip_mm = runtime::ThreeOf(at.start.nominal_start_mm);
    pose.commanded_deg = Degrees(at.corrected);
    pose.nominal_deg = Degrees(at.nominal_angles);
    if (tables_applied) pose.reached_deg = Degrees(at.reached);
    pose.tilt_deg = at.tilt_rad / runtime::kRadPerDeg;
    pose.standard_uncertainty_deg = {at.a_standard_uncertainty_rad / runtime::kRadPerDeg,
                                     at.b_standard_uncertainty_rad / runtime::kRadPerDeg};
    pose.expanded_uncertainty_um = at.start.expanded_uncertainty_um;
  }
  return row;
}

// Of all holes, in the row's order.
void SetBudgets(const Corrected& corrected, storage::CorrectionRow* row) {
  std::vector<const std::vector<metrology::UncertaintyComponent>*> components;
  for (const metrology::CorrectedHoleGroup& group : corrected.groups)
    for (const metrology::CorrectedHole& hole : group.holes) components.push_back(&hole.components);
  for (const CorrectedPath& path : corrected.paths) components.push_back(&path.WorstStart().components);
  clients::KeptBudgets kept = clients::Kept(components);
  if (kept.sources.empty()) return;
  row->budget_sources = std::move(kept.sources);
  std::size_t next = 0;
  for (storage::CorrectionGroupRow& group : row->groups)
    for (storage::CorrectionHoleRow& hole : group.holes)
      hole.budget_um = std::move(kept.standard_uncertainties_um[next++]);
}

std::string SummaryOf(const storage::CorrectionRow& row) {
  double greatest_shift_mm = 0, greatest_uncertainty_um = 0;
  int holes = 0;
  for (const storage::CorrectionGroupRow& group : row.groups) {
    for (const storage::CorrectionHoleRow& hole : group.holes) {
      const Eigen::Map<const Eigen::Vector3d> start(hole.start_mm.data()), nominal(hole.nominal_start_mm.data());
      greatest_shift_mm = std::max(greatest_shift_mm, (start - nominal).norm());
      greatest_uncertainty_um = std::max(greatest_uncertainty_um, hole.expanded_uncertainty_um);
      ++holes;
    }
  }
  return nlohmann::json{{"group_count", row.groups.size()},
                        {"hole_count", holes},
                        {"release", row.release},
                        {"greatest_shift_mm", greatest_shift_mm},
                        {"greatest_expanded_uncertainty_um", greatest_uncertainty_um}}
      .dump();
}

storage::RecordEntry EntryOf(const storage::CorrectionRow& row, const Inputs& inputs) {
  storage::RecordEntry entry;
  entry.kind = "correction";
  entry.name = runtime::NameOf("corrections", row.correction_id);
  entry.inputs = {inputs.registration.name(), runtime::RevisedName("machines", row.machine_id, row.machine_revision),
                  runtime::RevisedName("parts", row.part_id, row.part_revision), inputs.sensor.name,
                  inputs.rotation.name};
  for (const clients::FetchedAxis& table : inputs.tables) entry.inputs.push_back(table.name);
  if (!row.machining_model_id.empty())
    entry.inputs.push_back(
        runtime::RevisedName("machining_models", row.machining_model_id, row.machining_model_revision));
  if (!row.reconstruction_id.empty()) entry.inputs.push_back(runtime::NameOf("reconstructions", row.reconstruction_id));
  if (!row.machining_pass_id.empty())
    entry.inputs.push_back(runtime::NameOf("machining_passes", row.machining_pass_id));
  if (!row.repair_id.empty()) entry.inputs.push_back(runtime::NameOf("repairs", row.repair_id));
  entry.blade = row.blade_serial;
  entry.machine = row.machine_id;
  entry.method = registration::v1::Method_Name(inputs.registration.method());
  entry.software_version = row.software_version;
  entry.summary_json = SummaryOf(row);
  return entry;
}

}  // namespace

storage::ProgramProofRow RowOf(const metrology::NcProof& proof) {
  return {metrology::kNcReaderVersion, proof.pose_count, proof.greatest_difference_um, proof.greatest_tilt_deg};
}

runtime::Made<storage::CorrectionRow> RecordOf(const Inputs& inputs, const Corrected& corrected) {
  const registration::v1::Registration& registration = inputs.registration;
  const v1::CorrectRequest& request = inputs.asked;
  storage::CorrectionRow row;
  row.correction_id = storage::NewUuid();
  row.blade_serial = runtime::LastSegment(registration.blade());
  row.registration_id = runtime::LastSegment(registration.name());
  row.machine_id = runtime::LastSegment(registration.machine());
  row.machine_revision = registration.machine_revision();
  row.part_id = runtime::LastSegment(registration.part());
  row.part_revision = registration.part_revision();
  row.sensor_calibration_id = runtime::LastSegment(inputs.sensor.name);
  row.rotation_calibration_id = runtime::LastSegment(inputs.rotation.name);
  row.nc_template = request.nc_template();
  if (inputs.model.has_value()) {
    row.machining_model_id = runtime::LastSegment(inputs.model->name());
    row.machining_model_revision = inputs.model->revision();
  }
  if (!request.machining_pass().empty()) row.machining_pass_id = runtime::LastSegment(request.machining_pass());
  if (!request.repair().empty()) row.repair_id = runtime::LastSegment(request.repair());
  if (!request.reconstruction().empty()) row.reconstruction_id = runtime::LastSegment(request.reconstruction());
  (corrected.released ? row.nc_program : row.nc_held) = corrected.nc_program;
  row.release = corrected.released ? "AUTOMATIC" : "AWAITING_PERSON";
  row.state = corrected.released ? "RELEASED" : "DRAFT";
  for (const metrology::GateCheck& check : corrected.checks) {
    row.checks.push_back(
        {metrology::NameOf(check.kind), check.subject, check.value, check.limit, check.passed(), check.failed_count});
    if (!check.passed()) row.release_reasons.push_back(metrology::TextOf(check));
  }
  row.envelope_translation_mm = inputs.limits.translation_mm;
  row.envelope_rotation_deg = inputs.limits.rotation_rad / runtime::kRadPerDeg;
  row.registration_age_h = inputs.limits.registration_age_h;
  row.clamping = registration.clamping();
  row.valid_until = std::min(inputs.sensor.valid_until, inputs.rotation.valid_until);
  for (const clients::FetchedAxis& table : inputs.tables) {
    row.valid_until = std::min(row.valid_until, table.valid_until);
    row.characterisation_ids.push_back(runtime::LastSegment(table.name));
  }
  row.axes = {inputs.rotation.letters.begin(), inputs.rotation.letters.end()};
  for (const metrology::CorrectedHoleGroup& group : corrected.groups)
    row.groups.push_back(GroupRowOf(group, inputs.pose->positioning.Applies()));
  for (const CorrectedPath& path : corrected.paths)
    row.groups.push_back(GroupRowOf(path, inputs.pose->positioning.Applies()));
  SetBudgets(corrected, &row);
  if (const auto& proof = corrected.proof; proof.has_value()) row.proof = RowOf(*proof);
  for (const auto& [code, offset] : FrameOf(request).work_offsets) row.work_offsets.push_back({code, offset});
  for (const v1::ToolLength& tool : request.tool_lengths())
    row.tool_lengths.push_back({tool.number(), tool.length_mm()});
  row.usable_until = row.valid_until;
  if (!corrected.nc_program.empty()) row.program_sha256 = storage::Sha256Hex(corrected.nc_program);
  row.software_version = runtime::SoftwareVersion();
  row.computed_on = runtime::ComputedOn();
  storage::RecordEntry entry = EntryOf(row, inputs);
  return {std::move(row), std::move(entry)};
}

}  // namespace sixpoint::correction
