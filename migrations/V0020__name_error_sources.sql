-- What makes results uncertain, source by source: of a machine and of how pins stand as stated, of a scan the series of its arm, of a
-- sensor's calibration its response to the scanner's field, of a registration all sources that act on its pose, and of every hole the
-- budget of its place. Everything new is nullable or a table of its own.

ALTER TABLE machine_revisions
  ADD COLUMN approach text,
  ADD COLUMN touch_offset_um double precision,
  ADD COLUMN scanner_field_um double precision,
  ADD CONSTRAINT machine_revisions_approach_known CHECK (approach IN ('UPWARDS', 'DOWNWARDS')),
  ADD CONSTRAINT machine_revisions_error_sources_finite CHECK (touch_offset_um > 0 AND touch_offset_um <= 1000
    AND scanner_field_um > 0 AND scanner_field_um <= 1000);
COMMENT ON COLUMN machine_revisions.approach IS 'How the rotary axes come to every pose; NULL: not the same way, or not known.';
COMMENT ON COLUMN machine_revisions.touch_offset_um IS
  'Standard uncertainty of what all touched coordinates are off alike, along each machine axis; NULL: not stated.';
COMMENT ON COLUMN machine_revisions.scanner_field_um IS
  'Standard uncertainty of what readings are off along z, smoothly over the measuring field; NULL: not stated.';

ALTER TABLE part_hole_groups
  ADD COLUMN pin_clearance_standard_uncertainty_um double precision,
  ADD COLUMN pin_tilt_standard_uncertainty_deg double precision,
  ADD CONSTRAINT part_hole_groups_pin_standing CHECK (num_nulls(pin_clearance_standard_uncertainty_um,
    pin_tilt_standard_uncertainty_deg) IN (0, 2) AND pin_clearance_standard_uncertainty_um BETWEEN 0 AND 1000
    AND pin_tilt_standard_uncertainty_deg BETWEEN 0 AND 10);
COMMENT ON COLUMN part_hole_groups.pin_clearance_standard_uncertainty_um IS
  'Of the distance between the axes of pin and hole at the surface, each way across; NULL: not stated.';

ALTER TABLE scans
  ADD COLUMN arm_series text,
  ADD CONSTRAINT scans_arm_series_named CHECK (arm_series <> '' AND octet_length(arm_series) <= 64);
COMMENT ON COLUMN scans.arm_series IS 'Between scans of one series the arm was not swung; NULL: not known.';

ALTER TABLE sensor_calibrations
  ADD COLUMN field_response double precision[],
  ADD COLUMN arm_series text,
  ADD COLUMN degrees_of_freedom double precision,
  ADD CONSTRAINT sensor_calibrations_freedom CHECK (degrees_of_freedom >= 1 AND degrees_of_freedom < 1e9),
  ADD CONSTRAINT sensor_calibrations_field_response_whole CHECK (array_position(field_response, NULL) IS NULL),
  ADD CONSTRAINT sensor_calibrations_field_response_sized CHECK (cardinality(field_response) = 54
    AND NOT field_response && ARRAY['NaN', 'Infinity', '-Infinity']::double precision[]),
  ADD CONSTRAINT sensor_calibrations_arm_series_named CHECK (arm_series <> '' AND octet_length(arm_series) <= 64);
COMMENT ON COLUMN sensor_calibrations.field_response IS
  '6 x 9, row-major: change of the parameters per field parameter of the scanner; NULL: not known.';
COMMENT ON COLUMN sensor_calibrations.arm_series IS 'Of its scans, where all are of one; NULL: not known.';

COMMENT ON COLUMN sensor_calibrations.degrees_of_freedom IS 'Of the covariance; NULL: it rests on what was stated, or was made before.';
ALTER TABLE rotation_calibrations
  ADD COLUMN degrees_of_freedom double precision,
  ADD CONSTRAINT rotation_calibrations_freedom CHECK (degrees_of_freedom >= 1 AND degrees_of_freedom < 1e9);
COMMENT ON COLUMN rotation_calibrations.degrees_of_freedom IS 'Of the covariance; NULL: it rests on what was stated, or was made before.';

CREATE TABLE registration_error_sources (
  registration_id uuid NOT NULL,
  position_index integer NOT NULL,
  source_name text NOT NULL,
  degrees_of_freedom double precision,
  draw_count integer NOT NULL,
  parameters_per_sigma double precision[] NOT NULL,
  pose_per_sigma double precision[] NOT NULL,
  CONSTRAINT registration_error_sources_pk PRIMARY KEY (registration_id, position_index),
  CONSTRAINT registration_error_sources_once UNIQUE (registration_id, source_name),
  CONSTRAINT registration_error_sources_registration_fk FOREIGN KEY (registration_id) REFERENCES registrations (registration_id),
  CONSTRAINT registration_error_sources_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT registration_error_sources_named CHECK (source_name <> '' AND octet_length(source_name) <= 200),
  CONSTRAINT registration_error_sources_freedom CHECK (degrees_of_freedom > 0 AND degrees_of_freedom < 1e9),
  CONSTRAINT registration_error_sources_sized CHECK (draw_count >= 0 AND draw_count <= 64
    AND cardinality(parameters_per_sigma) = 23 * draw_count AND cardinality(pose_per_sigma) = 6 * draw_count),
  CONSTRAINT registration_error_sources_parameters_per_sigma_whole CHECK (array_position(parameters_per_sigma, NULL) IS NULL),
  CONSTRAINT registration_error_sources_pose_per_sigma_whole CHECK (array_position(pose_per_sigma, NULL) IS NULL),
  CONSTRAINT registration_error_sources_finite CHECK (NOT (parameters_per_sigma || pose_per_sigma
    && ARRAY['NaN', 'Infinity', '-Infinity']::double precision[]))
) PARTITION BY RANGE (registration_id);
COMMENT ON TABLE registration_error_sources IS
  'What makes a pose uncertain beside the noise of its scans and their angles. Of two results a source is the same one where its name is.';
COMMENT ON COLUMN registration_error_sources.degrees_of_freedom IS 'NULL: it is taken as known.';
COMMENT ON COLUMN registration_error_sources.parameters_per_sigma IS
  '23 x draws, row-major: what a standard deviation of each draw does to the parameters that map a scan to the part.';
COMMENT ON COLUMN registration_error_sources.pose_per_sigma IS '6 x draws, row-major: the same of the pose, about registrations.reference_mm.';

-- The names once, and a number each in every hole.
ALTER TABLE corrections
  ADD COLUMN budget_sources text[],
  ADD CONSTRAINT corrections_budget_sources_whole CHECK (array_position(budget_sources, NULL) IS NULL),
  ADD CONSTRAINT corrections_budget_sources_bounded CHECK (cardinality(budget_sources) BETWEEN 1 AND 64);
COMMENT ON COLUMN corrections.budget_sources IS 'What makes its holes'' starts uncertain, in the order of their budget_um; NULL: made before it was kept.';
ALTER TABLE correction_holes
  ADD COLUMN budget_um real[],
  ADD CONSTRAINT correction_holes_budget_um_whole CHECK (array_position(budget_um, NULL) IS NULL),
  ADD CONSTRAINT correction_holes_budget_um_counts CHECK (cardinality(budget_um) BETWEEN 1 AND 64 AND 0 <= ALL (budget_um));
COMMENT ON COLUMN correction_holes.budget_um IS
  'Standard uncertainty that each of corrections.budget_sources contributes to the start''s distance; NULL: made before it was kept.';
ALTER TABLE inspections
  ADD COLUMN budget_sources text[],
  ADD CONSTRAINT inspections_budget_sources_whole CHECK (array_position(budget_sources, NULL) IS NULL),
  ADD CONSTRAINT inspections_budget_sources_bounded CHECK (cardinality(budget_sources) BETWEEN 1 AND 64);
COMMENT ON COLUMN inspections.budget_sources IS 'What makes its holes'' positions uncertain, in the order of their budget_um; NULL: none, or made before it was kept.';
ALTER TABLE inspection_holes
  ADD COLUMN budget_um real[],
  ADD CONSTRAINT inspection_holes_budget_um_whole CHECK (array_position(budget_um, NULL) IS NULL),
  ADD CONSTRAINT inspection_holes_budget_um_counts CHECK (cardinality(budget_um) BETWEEN 1 AND 64 AND 0 <= ALL (budget_um));
COMMENT ON COLUMN inspection_holes.budget_um IS
  'Standard uncertainty that each of inspections.budget_sources contributes to the position; NULL: not measured, or made before it was kept.';

SELECT make_append_only('registration_error_sources');
GRANT SELECT, INSERT ON registration_error_sources TO sixpoint_registration;
SELECT make_partitions(3);
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid,
     (SELECT * FROM partitioned_tables WHERE name = 'registration_error_sources' ORDER BY depth, name) t
WHERE i.inhparent = 'registrations'::regclass;
