-- The verdict on a machined blade: one row for each inspection, its scans in order, and each hole.

CREATE TABLE inspections (
  inspection_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  registration_id uuid NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  sensor_calibration_id uuid NOT NULL,
  rotation_calibration_id uuid NOT NULL,
  verdict text NOT NULL,
  decision_rule text NOT NULL,
  deviation_minimum_um double precision NOT NULL,
  deviation_maximum_um double precision NOT NULL,
  deviation_rms_um double precision NOT NULL,
  deviation_p05_um double precision NOT NULL,
  deviation_p50_um double precision NOT NULL,
  deviation_p95_um double precision NOT NULL,
  deviation_point_count bigint NOT NULL,
  deviation_excluded_count bigint NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  method text NOT NULL,
  disagreement_um double precision,
  disagreement_ratio double precision,
  positioning_disagrees boolean NOT NULL,
  positioning_covered boolean NOT NULL,
  CONSTRAINT inspections_pk PRIMARY KEY (inspection_id),
  CONSTRAINT inspections_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT inspections_registration_fk FOREIGN KEY (registration_id) REFERENCES record_names (record_id),
  CONSTRAINT inspections_machine_fk FOREIGN KEY (machine_id, machine_revision)
    REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT inspections_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT inspections_sensor_calibration_fk FOREIGN KEY (sensor_calibration_id) REFERENCES calibrations
      (calibration_id),
  CONSTRAINT inspections_rotation_calibration_fk FOREIGN KEY (rotation_calibration_id)
    REFERENCES calibrations (calibration_id),
  CONSTRAINT inspections_record_fk FOREIGN KEY (inspection_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT inspections_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0),
  CONSTRAINT inspections_verdict_known CHECK (verdict IN ('CONFORM', 'NOT_CONFORM', 'UNDECIDABLE', 'NOT_MEASURED')),
  CONSTRAINT inspections_rule_stated CHECK (decision_rule <> ''),
  CONSTRAINT inspections_deviation_ordered CHECK (deviation_minimum_um > -1e9 AND deviation_maximum_um < 1e9
    AND deviation_minimum_um <= deviation_p05_um AND deviation_p05_um <= deviation_p50_um
    AND deviation_p50_um <= deviation_p95_um AND deviation_p95_um <= deviation_maximum_um AND deviation_rms_um >= 0
    AND deviation_rms_um < 1e9),
  CONSTRAINT inspections_points_counted CHECK (deviation_point_count > 0 AND deviation_excluded_count >= 0),
  CONSTRAINT inspections_software_named CHECK (software_version <> ''),
  CONSTRAINT inspections_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS')),
  CONSTRAINT inspections_covered_where_disagreeing CHECK (positioning_disagrees OR NOT positioning_covered),
  CONSTRAINT inspections_requested_by_length CHECK (octet_length(requested_by) <= 200),
  CONSTRAINT inspections_texts CHECK (octet_length(decision_rule) <= 1000 AND octet_length(software_version) <= 200)
) PARTITION BY RANGE (inspection_id);
CREATE INDEX inspections_by_registration ON inspections (registration_id);
COMMENT ON TABLE inspections IS 'The verdict is the worst of the holes; a hole that was not measured is never a pass.';
COMMENT ON COLUMN inspections.registration_id IS 'The registration of the same scans that the verdict rests on.';
COMMENT ON COLUMN inspections.decision_rule IS 'As it was when the verdict was made.';
COMMENT ON COLUMN inspections.deviation_minimum_um IS 'Signed distance of the points from the CAD, positive outside.';
COMMENT ON COLUMN inspections.deviation_excluded_count IS 'Points set aside: near holes (pins), or too far from the CAD.';
COMMENT ON COLUMN inspections.disagreement_um IS
  'Greatest displacement between the best fit of the scans and a positioning by datum points or a region; NULL: not '
  'compared.';
COMMENT ON COLUMN inspections.disagreement_ratio IS 'That, by its standard uncertainty.';
COMMENT ON COLUMN inspections.positioning_disagrees IS
  'That ratio was beyond the limit then in force, or the surface deviates from its CAD beside the holes'' tolerances.';
COMMENT ON COLUMN inspections.positioning_covered IS
  'The holes'' expanded uncertainties hold what other positionings would move them '
  '(inspection_holes.positioning_difference_um).';

CREATE TABLE inspection_scans (
  inspection_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_key uuid NOT NULL,
  CONSTRAINT inspection_scans_pk PRIMARY KEY (inspection_id, position_index),
  CONSTRAINT inspection_scans_once UNIQUE (inspection_id, scan_key),
  CONSTRAINT inspection_scans_inspection_fk FOREIGN KEY (inspection_id) REFERENCES inspections (inspection_id),
  CONSTRAINT inspection_scans_scan_fk FOREIGN KEY (scan_key) REFERENCES record_names (record_id),
  CONSTRAINT inspection_scans_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT inspection_scans_at_most_64 CHECK (position_index < 64)
) PARTITION BY RANGE (inspection_id);
CREATE INDEX inspection_scans_by_scan ON inspection_scans (scan_key);
COMMENT ON TABLE inspection_scans IS 'The scans of an inspection, in the order used.';

CREATE TABLE inspection_holes (
  inspection_id uuid NOT NULL,
  position_index integer NOT NULL,
  group_name text NOT NULL,
  hole_name text NOT NULL,
  verdict text NOT NULL,
  position_verdict text NOT NULL,
  inclination_verdict text NOT NULL,
  position_error_mm double precision,
  inclination_error_deg double precision,
  position_expanded_uncertainty_um double precision,
  inclination_expanded_uncertainty_deg double precision,
  start_in_part_mm double precision[],
  axis_in_part double precision[],
  position_tolerance_mm double precision NOT NULL,
  inclination_tolerance_deg double precision NOT NULL,
  point_count integer NOT NULL,
  pin_residual_rms_um double precision NOT NULL,
  pin_diameter_mm double precision,
  reason text NOT NULL,
  positioning_difference_um double precision NOT NULL,
  CONSTRAINT inspection_holes_pk PRIMARY KEY (inspection_id, position_index),
  CONSTRAINT inspection_holes_once UNIQUE (inspection_id, group_name, hole_name),
  CONSTRAINT inspection_holes_inspection_fk FOREIGN KEY (inspection_id) REFERENCES inspections (inspection_id),
  CONSTRAINT inspection_holes_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT inspection_holes_verdict_known CHECK (verdict IN ('CONFORM', 'NOT_CONFORM', 'UNDECIDABLE', 'NOT_MEASURED')
    AND position_verdict IN ('CONFORM', 'NOT_CONFORM', 'UNDECIDABLE', 'NOT_MEASURED')
    AND inclination_verdict IN ('CONFORM', 'NOT_CONFORM', 'UNDECIDABLE', 'NOT_MEASURED')),
  CONSTRAINT inspection_holes_measured_or_reason CHECK (CASE WHEN verdict = 'NOT_MEASURED' THEN reason <> ''
    AND num_nonnulls(position_error_mm, inclination_error_deg, position_expanded_uncertainty_um,
      inclination_expanded_uncertainty_deg, start_in_part_mm, axis_in_part, pin_diameter_mm) = 0
    ELSE num_nulls(position_error_mm, inclination_error_deg, position_expanded_uncertainty_um,
      inclination_expanded_uncertainty_deg, start_in_part_mm, axis_in_part, pin_diameter_mm) = 0 END),
  CONSTRAINT inspection_holes_errors_finite CHECK (position_error_mm >= 0 AND position_error_mm < 1e6
    AND inclination_error_deg >= 0 AND inclination_error_deg <= 90 AND position_expanded_uncertainty_um >= 0
    AND position_expanded_uncertainty_um < 1e9 AND inclination_expanded_uncertainty_deg >= 0
    AND inclination_expanded_uncertainty_deg < 1e6),
  CONSTRAINT inspection_holes_start_three CHECK (cardinality(start_in_part_mm) = 3
    AND array_position(start_in_part_mm, NULL) IS NULL AND 1e6 > ALL (start_in_part_mm) AND -1e6 < ALL (start_in_part_mm)),
  CONSTRAINT inspection_holes_axis_unit CHECK (cardinality(axis_in_part) = 3 AND array_position(axis_in_part, NULL) IS NULL
    AND abs(sqrt(axis_in_part[1] * axis_in_part[1] + axis_in_part[2] * axis_in_part[2] + axis_in_part[3] * axis_in_part[3])
      - 1) < 1e-9),
  CONSTRAINT inspection_holes_tolerances_finite CHECK (position_tolerance_mm >= 0 AND position_tolerance_mm < 1e6
    AND inclination_tolerance_deg >= 0 AND inclination_tolerance_deg <= 90),
  CONSTRAINT inspection_holes_evidence_finite CHECK (point_count >= 0 AND pin_residual_rms_um >= 0
    AND pin_residual_rms_um < 1e9 AND pin_diameter_mm > 0 AND pin_diameter_mm < 1e6),
  CONSTRAINT inspection_holes_positioning_finite CHECK (positioning_difference_um >= 0 AND positioning_difference_um <
      1e9),
  CONSTRAINT inspection_holes_texts CHECK (octet_length(group_name) <= 200 AND octet_length(hole_name) <= 200
    AND octet_length(reason) <= 1000),
  CONSTRAINT inspection_holes_start_in_part_mm_whole CHECK (array_position(start_in_part_mm, NULL) IS NULL),
  CONSTRAINT inspection_holes_axis_in_part_whole CHECK (array_position(axis_in_part, NULL) IS NULL)
) PARTITION BY RANGE (inspection_id);
COMMENT ON TABLE inspection_holes IS
  'Each hole from the pin that stood in it, judged against the part revision''s tolerances.';
COMMENT ON COLUMN inspection_holes.position_expanded_uncertainty_um IS 'k = 2, as inclination_expanded_uncertainty_deg.';
COMMENT ON COLUMN inspection_holes.start_in_part_mm IS 'Where the pin''s axis meets the CAD surface; part frame.';
COMMENT ON COLUMN inspection_holes.axis_in_part IS 'Of the pin, out of the part, unit; part frame.';
COMMENT ON COLUMN inspection_holes.pin_diameter_mm IS 'As fitted: pins need not have the drawing''s hole diameter.';
COMMENT ON COLUMN inspection_holes.positioning_difference_um IS
  'How far another positioning of the same scans would move the hole on the surface; 0 where none disagrees.';

SELECT make_append_only('inspections');
SELECT make_append_only('inspection_scans');
SELECT make_append_only('inspection_holes');
