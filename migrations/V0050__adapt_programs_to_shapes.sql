-- Corrections whose tool paths go with the shape that a reconstruction found: which, and how each path goes otherwise than its template.

ALTER TABLE corrections ADD COLUMN reconstruction_id uuid,
  ADD CONSTRAINT corrections_reconstruction_fk FOREIGN KEY (reconstruction_id) REFERENCES record_names (record_id);
COMMENT ON COLUMN corrections.reconstruction_id IS 'Whose shape the paths go with; NULL: they go as their templates.';

ALTER TABLE correction_tool_paths ADD COLUMN adapted_shift_mm double precision,
  ADD COLUMN adapted_turn_deg double precision,
  ADD COLUMN shape_gouge_um double precision,
  ADD COLUMN shape_rest_um double precision,
  ADD CONSTRAINT correction_tool_paths_adapted_whole
    CHECK (num_nulls(adapted_shift_mm, adapted_turn_deg, shape_gouge_um, shape_rest_um) IN (0, 4)),
  ADD CONSTRAINT correction_tool_paths_adapted_finite CHECK (adapted_shift_mm >= 0 AND adapted_shift_mm <= 1e6
    AND adapted_turn_deg >= 0 AND adapted_turn_deg <= 180 AND shape_gouge_um >= 0 AND shape_gouge_um <= 1e6
    AND shape_rest_um >= 0 AND shape_rest_um <= 1e6);
COMMENT ON COLUMN correction_tool_paths.adapted_shift_mm IS 'Greatest way of a tip from the template''s, on the part; NULL: the path goes as its template.';
COMMENT ON COLUMN correction_tool_paths.adapted_turn_deg IS 'Greatest angle of the tool from the template''s.';
COMMENT ON COLUMN correction_tool_paths.shape_gouge_um IS 'How much deeper it cuts into the shape than the template into the design, by removal simulation.';
COMMENT ON COLUMN correction_tool_paths.shape_rest_um IS 'How much more it leaves where the template cuts to the design.';

CREATE OR REPLACE VIEW read_v1.corrections WITH (security_barrier) AS
  SELECT c.correction_id, c.registration_id, c.blade_serial, c.part_id, c.part_revision, c.machine_id, c.machine_revision,
         n.record_sequence, n.recorded_at, c.release, correction_state(c.correction_id) AS state, c.valid_until,
         coalesce(c.nc_program_sha256, c.nc_held_sha256) IS NOT NULL AS has_program, c.sensor_calibration_id,
         c.rotation_calibration_id, c.clamping, asker_for_reader(c.requested_by) AS requested_by, c.software_version,
         (SELECT g.station FROM registrations g WHERE g.registration_id = c.registration_id) AS station, c.reconstruction_id
  FROM corrections c JOIN record_names n ON n.record_id = c.correction_id
  WHERE c.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON COLUMN read_v1.corrections.reconstruction_id IS 'Whose shape its tool paths go with; NULL: they go as their templates.';
