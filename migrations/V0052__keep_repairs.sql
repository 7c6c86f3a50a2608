-- Repairs: the target that continues a damaged blade above its repair line, the path around it, and what that would remove; and corrections whose tool
-- goes along such a path.

CREATE TABLE repairs (
  repair_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  registration_id uuid NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  sensor_calibration_id uuid NOT NULL,
  rotation_calibration_id uuid NOT NULL,
  method text NOT NULL,
  first_mm double precision NOT NULL,
  repair_line_mm double precision NOT NULL,
  target_mm double precision NOT NULL,
  line_width_mm double precision NOT NULL,
  mill_diameter_mm double precision NOT NULL,
  mill_length_mm double precision NOT NULL,
  extrapolation text NOT NULL,
  cornered_edges boolean NOT NULL,
  leading_in_part_mm double precision[],
  farthest_mm double precision NOT NULL,
  scallop_um double precision NOT NULL,
  lead_deg double precision NOT NULL,
  tilt_deg double precision NOT NULL,
  depth_of_cut_mm double precision NOT NULL,
  finish_allowance_mm double precision NOT NULL,
  roughing_step_mm double precision NOT NULL,
  guard_um double precision NOT NULL,
  chord_um double precision NOT NULL,
  greatest_turn_deg double precision NOT NULL,
  greatest_uncertainty_um double precision NOT NULL,
  camber_determination double precision,
  thickness_determination double precision,
  leading_determination double precision,
  trailing_determination double precision,
  below_line_count bigint NOT NULL,
  above_line_count bigint NOT NULL,
  left_out_count bigint NOT NULL,
  greatest_stock_mm double precision NOT NULL,
  step_over_mm double precision NOT NULL,
  roughing_layer_count integer NOT NULL,
  lap_count integer NOT NULL,
  place_count integer NOT NULL,
  path_length_mm double precision NOT NULL,
  greatest_lift_um double precision NOT NULL,
  place_count_below_line integer NOT NULL,
  deepest_below_line_um double precision NOT NULL,
  deepest_in_target_um double precision NOT NULL,
  deepest_beyond_uncertainty_um double precision NOT NULL,
  greatest_rest_um double precision NOT NULL,
  mean_rest_um double precision NOT NULL,
  contours_sha256 bytea NOT NULL,
  path_sha256 bytea NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  computed_on text NOT NULL,
  CONSTRAINT repairs_pk PRIMARY KEY (repair_id),
  CONSTRAINT repairs_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT repairs_registration_fk FOREIGN KEY (registration_id) REFERENCES record_names (record_id),
  CONSTRAINT repairs_machine_fk FOREIGN KEY (machine_id, machine_revision) REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT repairs_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT repairs_sensor_calibration_fk FOREIGN KEY (sensor_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT repairs_rotation_calibration_fk FOREIGN KEY (rotation_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT repairs_record_fk FOREIGN KEY (repair_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT repairs_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0),
  CONSTRAINT repairs_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS', 'ALLOWANCE')),
  CONSTRAINT repairs_extrapolation_known CHECK (extrapolation IN ('POLYNOMIAL', 'POLYNOMIAL_OF_DEVIATION', 'PROCESS_OF_DEVIATION')),
  CONSTRAINT repairs_heights CHECK (abs(first_mm) < 1e6 AND abs(target_mm) < 1e6 AND first_mm < repair_line_mm
    AND repair_line_mm < target_mm AND line_width_mm BETWEEN 0.1 AND 10),
  CONSTRAINT repairs_mill CHECK (mill_diameter_mm BETWEEN 0.5 AND 20 AND mill_length_mm BETWEEN 1 AND 300),
  CONSTRAINT repairs_asked CHECK (farthest_mm BETWEEN 0.5 AND 20 AND scallop_um BETWEEN 0.5 AND 200 AND lead_deg BETWEEN -75 AND 75
    AND tilt_deg BETWEEN -75 AND 75 AND depth_of_cut_mm BETWEEN 0.02 AND 10 AND finish_allowance_mm BETWEEN 0.005 AND 5
    AND roughing_step_mm BETWEEN 0.05 AND 10 AND guard_um BETWEEN 0 AND 500 AND chord_um BETWEEN 0.1 AND 20
    AND greatest_turn_deg BETWEEN 0.1 AND 10
    AND greatest_uncertainty_um BETWEEN 1 AND 5000),
  CONSTRAINT repairs_leading CHECK (leading_in_part_mm IS NULL OR cardinality(leading_in_part_mm) = 3
    AND array_position(leading_in_part_mm, NULL) IS NULL),
  CONSTRAINT repairs_determination CHECK (num_nulls(camber_determination, thickness_determination, leading_determination,
    trailing_determination) = CASE extrapolation WHEN 'PROCESS_OF_DEVIATION' THEN 4 ELSE 0 END),
  CONSTRAINT repairs_counts CHECK (below_line_count > 0 AND above_line_count >= 0 AND left_out_count >= 0 AND roughing_layer_count >= 0
    AND lap_count > 1 AND place_count > lap_count AND place_count_below_line > 0),
  CONSTRAINT repairs_found CHECK (greatest_stock_mm >= 0 AND step_over_mm > 0 AND path_length_mm > 0 AND path_length_mm < 1e9
    AND greatest_lift_um >= 0 AND deepest_below_line_um BETWEEN 0 AND 1 AND deepest_in_target_um >= 0
    AND deepest_beyond_uncertainty_um >= 0 AND abs(greatest_rest_um) < 1e9 AND abs(mean_rest_um) < 1e9),
  CONSTRAINT repairs_digests CHECK (octet_length(contours_sha256) = 32 AND octet_length(path_sha256) = 32),
  CONSTRAINT repairs_texts CHECK (requested_by <> '' AND octet_length(requested_by) <= 200 AND software_version <> ''
    AND octet_length(software_version) <= 200 AND octet_length(computed_on) BETWEEN 1 AND 200)
) PARTITION BY RANGE (repair_id);
CREATE INDEX repairs_by_registration ON repairs (registration_id);
COMMENT ON TABLE repairs IS 'How a blade whose worn tip was welded on again is machined: repairs/{id}.';
COMMENT ON COLUMN repairs.registration_id IS 'The fit of what was scanned.';
COMMENT ON COLUMN repairs.repair_line_mm IS 'Height of the part''s Z below which nothing is cut.';
COMMENT ON COLUMN repairs.farthest_mm IS 'Points farther outside the CAD are of something else.';
COMMENT ON COLUMN repairs.camber_determination IS 'Coefficients of determination, of polynomials alone, as the three that follow.';
COMMENT ON COLUMN repairs.place_count_below_line IS 'Places of the measured surface that the removal was looked at.';
COMMENT ON COLUMN repairs.deepest_below_line_um IS 'What the simulated path cuts of them.';
COMMENT ON COLUMN repairs.deepest_beyond_uncertainty_um IS 'Of deepest_in_target_um, beyond the place''s expanded uncertainty.';
COMMENT ON COLUMN repairs.contours_sha256 IS 'Of the columns of repair_contours, each little-endian, in their order; path_sha256 of repair_laps.';

CREATE TABLE repair_scans (
  repair_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_key uuid NOT NULL,
  CONSTRAINT repair_scans_pk PRIMARY KEY (repair_id, position_index),
  CONSTRAINT repair_scans_once UNIQUE (repair_id, scan_key),
  CONSTRAINT repair_scans_repair_fk FOREIGN KEY (repair_id) REFERENCES repairs (repair_id),
  CONSTRAINT repair_scans_scan_fk FOREIGN KEY (scan_key) REFERENCES record_names (record_id),
  CONSTRAINT repair_scans_position CHECK (position_index BETWEEN 0 AND 63)
) PARTITION BY RANGE (repair_id);
CREATE INDEX repair_scans_by_scan ON repair_scans (scan_key);
COMMENT ON TABLE repair_scans IS 'The scans of the welded blade, in the registration''s order.';

CREATE TABLE repair_sections (
  repair_id uuid NOT NULL,
  position_index integer NOT NULL,
  z_mm double precision NOT NULL,
  kind text NOT NULL,
  remark text NOT NULL,
  mean_expanded_uncertainty_um double precision,
  greatest_expanded_uncertainty_um double precision,
  greatest_rest_um double precision,
  deepest_cut_um double precision,
  CONSTRAINT repair_sections_pk PRIMARY KEY (repair_id, position_index),
  CONSTRAINT repair_sections_repair_fk FOREIGN KEY (repair_id) REFERENCES repairs (repair_id),
  CONSTRAINT repair_sections_few CHECK (position_index BETWEEN 0 AND 9999),
  CONSTRAINT repair_sections_kind_known CHECK (kind IN ('MEASURED', 'LEFT_OUT', 'TARGET')),
  CONSTRAINT repair_sections_reasoned CHECK ((kind = 'LEFT_OUT') = (remark <> '') AND octet_length(remark) <= 1000),
  CONSTRAINT repair_sections_target CHECK (num_nulls(mean_expanded_uncertainty_um, greatest_expanded_uncertainty_um, greatest_rest_um,
    deepest_cut_um) = CASE kind WHEN 'TARGET' THEN 0 ELSE 4 END),
  CONSTRAINT repair_sections_found CHECK (abs(z_mm) < 1e6 AND mean_expanded_uncertainty_um >= 0 AND greatest_expanded_uncertainty_um >= 0
    AND abs(greatest_rest_um) < 1e9 AND deepest_cut_um >= 0)
) PARTITION BY RANGE (repair_id);
COMMENT ON TABLE repair_sections IS 'Heights of the blade, upwards, and what each was taken for.';
COMMENT ON COLUMN repair_sections.mean_expanded_uncertainty_um IS '95 %, of the target''s contour along its normal; NULL: it is no target, as those that follow.';
COMMENT ON COLUMN repair_sections.greatest_rest_um IS 'What the simulated path leaves above the contour.';
COMMENT ON COLUMN repair_sections.deepest_cut_um IS 'How deep it cuts into the contour; 0: nowhere.';

CREATE TABLE repair_contours (
  repair_id uuid NOT NULL,
  position_index integer NOT NULL,
  points_in_part_mm double precision[] NOT NULL,
  expanded_uncertainties_um real[] NOT NULL,
  rest_um real[] NOT NULL,
  CONSTRAINT repair_contours_pk PRIMARY KEY (repair_id, position_index),
  CONSTRAINT repair_contours_repair_fk FOREIGN KEY (repair_id) REFERENCES repairs (repair_id),
  CONSTRAINT repair_contours_few CHECK (position_index BETWEEN 0 AND 9999),
  CONSTRAINT repair_contours_each CHECK (cardinality(rest_um) > 0 AND cardinality(points_in_part_mm) = 3 * cardinality(rest_um)
    AND cardinality(expanded_uncertainties_um) = cardinality(rest_um)),
  CONSTRAINT repair_contours_points_in_part_mm_whole CHECK (array_position(points_in_part_mm, NULL) IS NULL),
  CONSTRAINT repair_contours_expanded_uncertainties_um_whole CHECK (array_position(expanded_uncertainties_um, NULL) IS NULL),
  CONSTRAINT repair_contours_rest_um_whole CHECK (array_position(rest_um, NULL) IS NULL)
) PARTITION BY RANGE (repair_id);
COMMENT ON TABLE repair_contours IS 'The target, contour by contour upwards: X, Y, Z place by place around the blade.';
COMMENT ON COLUMN repair_contours.rest_um IS 'What the simulated path leaves above it; below 0: cuts into it.';

CREATE TABLE repair_laps (
  repair_id uuid NOT NULL,
  position_index integer NOT NULL,
  z_mm double precision NOT NULL,
  allowance_mm double precision NOT NULL,
  centres_in_part_mm double precision[] NOT NULL,
  axes_in_part double precision[] NOT NULL,
  CONSTRAINT repair_laps_pk PRIMARY KEY (repair_id, position_index),
  CONSTRAINT repair_laps_repair_fk FOREIGN KEY (repair_id) REFERENCES repairs (repair_id),
  CONSTRAINT repair_laps_few CHECK (position_index BETWEEN 0 AND 9999 AND abs(z_mm) < 1e6 AND allowance_mm BETWEEN 0 AND 1e3),
  CONSTRAINT repair_laps_each CHECK (cardinality(axes_in_part) > 0 AND cardinality(centres_in_part_mm) = cardinality(axes_in_part)),
  CONSTRAINT repair_laps_centres_in_part_mm_whole CHECK (array_position(centres_in_part_mm, NULL) IS NULL),
  CONSTRAINT repair_laps_axes_in_part_whole CHECK (array_position(axes_in_part, NULL) IS NULL)
) PARTITION BY RANGE (repair_id);
COMMENT ON TABLE repair_laps IS 'The path, lap by lap in the order of the cut: X, Y, Z of the ball''s centre and of the direction to the holder.';
COMMENT ON COLUMN repair_laps.allowance_mm IS 'Left on the target; 0: finishing.';

DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['repairs', 'repair_scans', 'repair_sections', 'repair_contours', 'repair_laps'] LOOP
    PERFORM make_append_only(held::regclass);
    EXECUTE format('GRANT SELECT, INSERT ON %I TO sixpoint_correction', held);
    EXECUTE format('GRANT SELECT ON %I TO sixpoint_ledger', held);
  END LOOP;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON repairs FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();
SELECT make_partitions(3);
-- And the months that inspections have already.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid, partitioned_tables t
WHERE i.inhparent = 'inspections'::regclass AND t.name LIKE 'repair%';

ALTER TABLE corrections ADD COLUMN repair_id uuid,
  ADD CONSTRAINT corrections_repair_fk FOREIGN KEY (repair_id) REFERENCES record_names (record_id),
  ADD CONSTRAINT corrections_repair_or_shape CHECK (repair_id IS NULL OR reconstruction_id IS NULL);
COMMENT ON COLUMN corrections.repair_id IS 'Along whose laps the tool goes; NULL: along the machining model''s holes and paths.';

CREATE OR REPLACE VIEW correction_states AS
  SELECT f.*, CASE
      WHEN f.is_refused THEN 'REFUSED'
      WHEN f.is_withdrawn THEN 'WITHDRAWN'
      WHEN f.is_cut THEN 'CUT'
      WHEN f.usable_until <= statement_timestamp() THEN 'EXPIRED'
      WHEN f.superseded_by IS NOT NULL THEN 'SUPERSEDED'
      WHEN NOT f.is_released THEN 'DRAFT'
      ELSE 'RELEASED' END AS state
  FROM (
    SELECT c.correction_id, l.correction_id IS NOT NULL AS is_released,
      EXISTS (SELECT 1 FROM correction_events r WHERE r.correction_id = c.correction_id AND r.event = 'REFUSED') AS is_refused,
      -- Whatever it was made from, however far back.
      EXISTS (WITH RECURSIVE up (input_id) AS (
                SELECT i.input_id FROM record_inputs i WHERE i.record_id = c.correction_id
                UNION SELECT i.input_id FROM up JOIN record_inputs i ON i.record_id = up.input_id)
              SELECT 1 FROM up JOIN calibration_events w ON w.calibration_id = up.input_id AND w.event = 'WITHDRAWN') AS is_withdrawn,
      (SELECT count(*) FROM correction_cuts k WHERE k.correction_id = c.correction_id)
        = (SELECT count(*) FROM correction_holes h WHERE h.correction_id = c.correction_id) AS is_cut,
      CASE WHEN coalesce(c.registration_age_h, 0) = 0 OR l.correction_id IS NULL THEN c.valid_until
           ELSE least(c.valid_until, CASE WHEN c.release = 'AUTOMATIC' THEN g.recorded_at ELSE l.released_at END
                                     + c.registration_age_h * interval '1 hour') END AS usable_until,
      coalesce(
        -- Another program has cut holes of it since it was made: it would cut them again.
        (SELECT k.correction_id FROM corrections o JOIN correction_cuts k ON k.correction_id = o.correction_id
         JOIN record_names m ON m.record_id = k.record_id
         JOIN correction_holes h ON h.correction_id = c.correction_id AND h.group_name = k.group_name AND h.hole_name = k.hole_name
         WHERE o.blade_serial = c.blade_serial AND o.correction_id <> c.correction_id
           AND (m.record_sequence > n.record_sequence
                -- What was cut before the pass or the repair that it goes by, that has measured.
                OR c.release = 'AUTOMATIC' AND m.record_sequence > coalesce(
                  (SELECT p.record_sequence FROM record_names p WHERE p.record_id = coalesce(c.machining_pass_id, c.repair_id)), 0))
         ORDER BY m.record_sequence DESC LIMIT 1),
        -- A draft too is over once another registration has brought forth a program.
        (SELECT s.correction_id FROM correction_releases s
         WHERE s.blade_serial = c.blade_serial AND s.has_program AND s.correction_id <> c.correction_id
           AND s.release_sequence > coalesce(l.release_sequence, n.record_sequence)
           AND (s.registration_id <> c.registration_id
                OR l.correction_id IS NOT NULL
                   AND EXISTS (SELECT 1 FROM correction_groups a JOIN correction_groups b ON b.group_name = a.group_name
                               WHERE a.correction_id = c.correction_id AND b.correction_id = s.correction_id))
         ORDER BY s.release_sequence DESC LIMIT 1)) AS superseded_by
    FROM corrections c
    JOIN record_names n ON n.record_id = c.correction_id
    JOIN record_names g ON g.record_id = c.registration_id
    LEFT JOIN correction_releases l ON l.correction_id = c.correction_id) f;

CREATE OR REPLACE VIEW read_v1.corrections WITH (security_barrier) AS
  SELECT c.correction_id, c.registration_id, c.blade_serial, c.part_id, c.part_revision, c.machine_id, c.machine_revision,
         n.record_sequence, n.recorded_at, c.release, correction_state(c.correction_id) AS state, c.valid_until,
         coalesce(c.nc_program_sha256, c.nc_held_sha256) IS NOT NULL AS has_program, c.sensor_calibration_id,
         c.rotation_calibration_id, c.clamping, asker_for_reader(c.requested_by) AS requested_by, c.software_version,
         (SELECT g.station FROM registrations g WHERE g.registration_id = c.registration_id) AS station, c.reconstruction_id, c.repair_id
  FROM corrections c JOIN record_names n ON n.record_id = c.correction_id
  WHERE c.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON COLUMN read_v1.corrections.repair_id IS 'Along whose laps the tool goes; NULL: along the machining model''s holes and paths.';

-- One kind more of what the journal has; the partitions that there are hold it by their own copy of the CHECK.
CREATE FUNCTION add_record_kind(added text) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
  held regclass;
  kinds text[] := record_kinds();
BEGIN
  IF cardinality(kinds) < 24 OR added = ANY (kinds) THEN
    RAISE EXCEPTION 'record_entries_kind_known: % kinds, want those that were, without %', cardinality(kinds), added;
  END IF;
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  EXECUTE format('ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN (%s))',
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || added) k));
END
$$;
REVOKE ALL ON FUNCTION add_record_kind(text) FROM PUBLIC;
COMMENT ON FUNCTION add_record_kind(text) IS 'For migrations: the journal has entries of one kind more.';
SELECT add_record_kind('repair');

CREATE VIEW read_v1.repairs WITH (security_barrier) AS
  SELECT r.repair_id, r.registration_id, r.blade_serial, r.part_id, r.part_revision, r.machine_id, r.machine_revision, n.record_sequence, n.recorded_at, r.repair_line_mm, r.extrapolation, r.greatest_stock_mm, r.path_length_mm, r.deepest_below_line_um, r.deepest_beyond_uncertainty_um, s.z_mm, s.kind, s.remark, s.mean_expanded_uncertainty_um, s.greatest_expanded_uncertainty_um, s.greatest_rest_um, s.deepest_cut_um
  FROM repairs r JOIN record_names n ON n.record_id = r.repair_id
       JOIN repair_sections s ON s.repair_id = r.repair_id
  WHERE r.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.repairs IS 'How blades whose tips were welded on again are machined: a row for each section of each.';
COMMENT ON COLUMN read_v1.repairs.repair_id IS 'The id in repairs/{id}.';
COMMENT ON COLUMN read_v1.repairs.registration_id IS 'The pose of what was scanned.';
COMMENT ON COLUMN read_v1.repairs.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.repairs.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.repairs.part_revision IS 'The revision beside whose CAD it was measured.';
COMMENT ON COLUMN read_v1.repairs.machine_id IS 'On which machine it was scanned.';
COMMENT ON COLUMN read_v1.repairs.machine_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.repairs.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.repairs.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.repairs.repair_line_mm IS 'Height of the part''s Z below which nothing is cut.';
COMMENT ON COLUMN read_v1.repairs.extrapolation IS 'POLYNOMIAL, POLYNOMIAL_OF_DEVIATION or PROCESS_OF_DEVIATION.';
COMMENT ON COLUMN read_v1.repairs.greatest_stock_mm IS 'Of the weld over the target.';
COMMENT ON COLUMN read_v1.repairs.path_length_mm IS 'Of all laps around the blade.';
COMMENT ON COLUMN read_v1.repairs.deepest_below_line_um IS 'Micrometres that the simulated path cuts of the blade''s own surface.';
COMMENT ON COLUMN read_v1.repairs.deepest_beyond_uncertainty_um IS 'Micrometres that it cuts into the target beyond its expanded uncertainty.';
COMMENT ON COLUMN read_v1.repairs.z_mm IS 'Height of a section.';
COMMENT ON COLUMN read_v1.repairs.kind IS 'What it was taken for: MEASURED, LEFT_OUT or TARGET.';
COMMENT ON COLUMN read_v1.repairs.remark IS 'Why it was left out; else empty.';
COMMENT ON COLUMN read_v1.repairs.mean_expanded_uncertainty_um IS 'Micrometres, 95 %, of the target''s contour; NULL: it is no target, as those that follow.';
COMMENT ON COLUMN read_v1.repairs.greatest_expanded_uncertainty_um IS 'As mean_expanded_uncertainty_um, the greatest.';
COMMENT ON COLUMN read_v1.repairs.greatest_rest_um IS 'Micrometres that the simulated path leaves above the contour.';
COMMENT ON COLUMN read_v1.repairs.deepest_cut_um IS 'Micrometres that it cuts into the contour.';
GRANT SELECT ON read_v1.repairs TO sixpoint_reader;

COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment, disposition, machining_model, deviation, section, drawing, assessment, measurement, reconstruction, machining_pass or repair; more may come.';
