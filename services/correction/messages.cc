#include "services/correction/messages.h"

#include "services/runtime/resource_name.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::correction {

v1::Correction ToProto(const storage::CorrectionRow& row) {
  v1::Correction correction;
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
    for (const storage::CorrectionHoleRow& hole_row : group_row.holes) {
      v1::CorrectedHole& hole = *group.add_holes();
      hole.set_hole(hole_row.hole_name);
      runtime::SetPoint(hole_row.start_mm, hole.mutable_start_mm());
      runtime::SetPoint(hole_row.nominal_start_mm, hole.mutable_nominal_start_mm());
      hole.set_expanded_uncertainty_um(hole_row.expanded_uncertainty_um);
    }
  }
  correction.set_nc_program(row.nc_program);
  correction.set_release(row.release == "AUTOMATIC" ? v1::RELEASE_AUTOMATIC : v1::RELEASE_AWAITING_PERSON);
  for (const std::string& reason : row.release_reasons) correction.add_release_reasons(reason);
  runtime::ToProto(row.valid_until, correction.mutable_valid_until());
  correction.set_requested_by(row.requested_by);
  correction.set_software_version(row.software_version);
  runtime::ToProto(row.recorded.recorded_at, correction.mutable_recorded_at());
  correction.set_record_sequence(row.recorded.sequence);
  for (const std::string& axis : row.axes) correction.add_axes(axis);
  for (const std::string& id : row.characterisation_ids)
    correction.add_axis_characterisations(runtime::NameOf("calibrations", id));
  if (row.proof) {
    v1::ProgramProof& proof = *correction.mutable_proof();
    proof.set_reader_version(row.proof->reader_version);
    proof.set_pose_count(row.proof->pose_count);
    proof.set_greatest_difference_um(row.proof->greatest_difference_um);
    proof.set_greatest_tilt_deg(row.proof->greatest_tilt_deg);
  }
  for (const storage::WorkOffsetRow& one : row.work_offsets) {
    v1::WorkOffset& out = *correction.add_work_offsets();
    out.set_code(one.code);
    out.set_x_mm(one.offset[0]);
    out.set_y_mm(one.offset[1]);
    out.set_z_mm(one.offset[2]);
    out.set_a_deg(one.offset[3]);
    out.set_b_deg(one.offset[4]);
  }
  return correction;
}

void LeaveBasic(v1::Correction* correction) { correction->clear_groups(); }

}  // namespace sixpoint::correction
