-- Whether corrections were right: the inspection service reads, of what other services recorded, what puts a hole as it was found beside the
-- hole as it was to be (docs/adr/0056). Columns, so that nothing else is read; nothing is written.

GRANT SELECT (correction_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, sensor_calibration_id,
  rotation_calibration_id, release) ON corrections TO sixpoint_inspection;
GRANT SELECT (correction_id, group_name, a_deg, b_deg, a_reached_deg, b_reached_deg) ON correction_groups TO sixpoint_inspection;
GRANT SELECT (correction_id, group_name, hole_name) ON correction_holes TO sixpoint_inspection;
GRANT SELECT (correction_id, group_name, hole_name) ON correction_cuts TO sixpoint_inspection;
GRANT SELECT (correction_id, event) ON correction_events TO sixpoint_inspection;
GRANT SELECT (registration_id, zero_from_part) ON registrations TO sixpoint_inspection;
GRANT SELECT (calibration_id, event) ON calibration_events TO sixpoint_inspection;
GRANT SELECT (calibration_id, a_direction, a_point_mm, b_direction, b_point_mm) ON rotation_calibrations TO sixpoint_inspection;
GRANT SELECT (part_id, revision, group_index, hole_group, axis_in_part) ON part_hole_groups TO sixpoint_inspection;
GRANT SELECT (part_id, revision, group_index, hole, start_in_part_mm) ON part_holes TO sixpoint_inspection;
