-- Where parts may stand in their fixtures, and where blades stood whose results rest on a registration, for programs that read SQL: a view, and
-- columns at the ends of four.

CREATE VIEW read_v1.stations WITH (security_barrier) AS
  SELECT s.part_id, s.revision, s.station, s.zero_from_part_nominal_rotation, s.zero_from_part_nominal_translation_mm, s.capture_mm
  FROM part_stations s
  WHERE s.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.stations IS 'Places in fixtures that hold several of a part, a row for each of each of its revisions.';
COMMENT ON COLUMN read_v1.stations.part_id IS 'The id in parts/{id}.';
COMMENT ON COLUMN read_v1.stations.revision IS 'Of the part; results name the revision that they used.';
COMMENT ON COLUMN read_v1.stations.station IS 'As scans name it.';
COMMENT ON COLUMN read_v1.stations.zero_from_part_nominal_rotation IS 'How a part nominally stands there at A = B = 0: from its CAD to the machine, 3 x 3 by rows.';
COMMENT ON COLUMN read_v1.stations.zero_from_part_nominal_translation_mm IS 'Millimetres, as the rotation: X, Y, Z of the CAD''s origin in the machine.';
COMMENT ON COLUMN read_v1.stations.capture_mm IS 'Millimetres: how far any of the part may stand from there.';
GRANT SELECT ON read_v1.stations TO sixpoint_reader;

CREATE OR REPLACE VIEW read_v1.corrections WITH (security_barrier) AS
  SELECT c.correction_id, c.registration_id, c.blade_serial, c.part_id, c.part_revision, c.machine_id, c.machine_revision,
         n.record_sequence, n.recorded_at, c.release, correction_state(c.correction_id) AS state, c.valid_until,
         coalesce(c.nc_program_sha256, c.nc_held_sha256) IS NOT NULL AS has_program, c.sensor_calibration_id,
         c.rotation_calibration_id, c.clamping, asker_for_reader(c.requested_by) AS requested_by, c.software_version,
         (SELECT g.station FROM registrations g WHERE g.registration_id = c.registration_id) AS station
  FROM corrections c JOIN record_names n ON n.record_id = c.correction_id
  WHERE c.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON COLUMN read_v1.corrections.station IS 'Where the blade stands, of its part''s stations; NULL: the part has none.';

CREATE OR REPLACE VIEW read_v1.inspections WITH (security_barrier) AS
  SELECT i.inspection_id, i.registration_id, i.blade_serial, i.part_id, i.part_revision, i.machine_id, i.machine_revision,
         n.record_sequence, n.recorded_at, i.verdict, i.decision_rule, i.method, i.rejudges AS rejudged_inspection_id,
         i.sensor_calibration_id, i.rotation_calibration_id, i.deviation_minimum_um, i.deviation_p05_um, i.deviation_p50_um,
         i.deviation_p95_um, i.deviation_maximum_um, i.deviation_rms_um, i.positioning_disagrees,
         asker_for_reader(i.requested_by) AS requested_by, i.software_version,
         (SELECT g.station FROM registrations g WHERE g.registration_id = i.registration_id) AS station
  FROM inspections i JOIN record_names n ON n.record_id = i.inspection_id
  WHERE i.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON COLUMN read_v1.inspections.station IS 'Where the blade stood when it was scanned, of its part''s stations; NULL: the part has none.';

CREATE OR REPLACE VIEW read_v1.deviations WITH (security_barrier) AS
  SELECT d.deviation_id, d.registration_id, d.blade_serial, d.part_id, d.part_revision, d.machine_id, d.machine_revision,
         n.record_sequence, n.recorded_at, d.method, d.patch_mm, r.region, r.area_mm2, r.seen_area_mm2, r.mean_um, r.rms_um, r.p05_um,
         r.p50_um, r.p95_um, r.lowest_um, r.lowest_expanded_uncertainty_um, r.lowest_in_part_mm, r.highest_um,
         r.highest_expanded_uncertainty_um, r.highest_in_part_mm,
         (SELECT g.station FROM registrations g WHERE g.registration_id = d.registration_id) AS station
  FROM deviation_maps d JOIN record_names n ON n.record_id = d.deviation_id JOIN deviation_regions r ON r.deviation_id = d.deviation_id
  WHERE d.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON COLUMN read_v1.deviations.station IS 'Where the blade stood, of its part''s stations; NULL: the part has none.';

CREATE OR REPLACE VIEW read_v1.sections WITH (security_barrier) AS
  SELECT m.section_measurement_id, m.registration_id, m.blade_serial, m.part_id, m.part_revision, m.machine_id, m.machine_revision,
         n.record_sequence, n.recorded_at, m.method, s.section, s.origin_in_part_mm, s.leading_end, s.trailing_end, v.parameter, v.unit,
         v.nominal, v.value, v.expanded_uncertainty, v.reason,
         (SELECT g.station FROM registrations g WHERE g.registration_id = m.registration_id) AS station
  FROM section_measurements m JOIN record_names n ON n.record_id = m.section_measurement_id
       JOIN sections s ON s.section_measurement_id = m.section_measurement_id
       JOIN section_values v ON v.section_measurement_id = s.section_measurement_id AND v.section_index = s.position_index
  WHERE m.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON COLUMN read_v1.sections.station IS 'Where the blade stood, of its part''s stations; NULL: the part has none.';
