-- Where blades stood, for programs that read SQL: columns at the ends of two views.

CREATE OR REPLACE VIEW read_v1.scans WITH (security_barrier) AS
  SELECT s.scan_id, s.kind, s.machine_id, s.machine_revision, s.blade_serial, b.part_id, s.artefact_id, s.artefact_revision,
         n.record_sequence, n.recorded_at, s.measured_at, s.point_count, s.stored_bytes, s.sensor_serial_number, s.clamping,
         s.subject_temperature_c, s.a_deg, s.b_deg,
         CASE WHEN EXISTS (SELECT 1 FROM scan_deletions d WHERE d.scan_key = s.scan_key) THEN 'POINTS_DELETED' ELSE 'KEPT' END AS state,
         s.station
  FROM scans s JOIN record_names n ON n.record_id = s.scan_key LEFT JOIN blades b ON b.blade_serial = s.blade_serial
  WHERE s.blade_serial IS NULL OR b.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON COLUMN read_v1.scans.station IS 'Of its part, where the blade stood; NULL: the part has none.';

CREATE OR REPLACE VIEW read_v1.registrations WITH (security_barrier) AS
  SELECT g.registration_id, g.blade_serial, g.part_id, g.part_revision, g.machine_id, g.machine_revision, n.record_sequence,
         n.recorded_at, g.method, g.outcome, g.sensor_calibration_id, g.rotation_calibration_id, g.point_count, g.points_used,
         g.residual_sigma_um, g.condition_number, g.weakest_standard_uncertainty_um, g.disagreement_um, g.disagrees,
         g.for_inspection, g.clamping, g.compute_seconds AS compute_s, asker_for_reader(g.requested_by) AS requested_by,
         g.software_version, g.station
  FROM registrations g JOIN record_names n ON n.record_id = g.registration_id
  WHERE g.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON COLUMN read_v1.registrations.station IS 'Where the blade stood, of its part''s stations; NULL: the part has none.';
