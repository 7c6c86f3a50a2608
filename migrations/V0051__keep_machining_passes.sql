-- Passes over blanks that were machined to a reconstruction's shape: what each left, region by region and patch by patch, and what is to be done now;
-- and corrections whose paths are commanded by what the pass before left.

CREATE TABLE machining_passes (
  pass_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  registration_id uuid NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  sensor_calibration_id uuid NOT NULL,
  rotation_calibration_id uuid NOT NULL,
  method text NOT NULL,
  correction_id uuid NOT NULL,
  reconstruction_id uuid NOT NULL,
  number integer NOT NULL,
  outcome text NOT NULL,
  remark text NOT NULL,
  taken_count bigint NOT NULL,
  far_off_count bigint NOT NULL,
  shapeless_count bigint NOT NULL,
  patch_count integer NOT NULL,
  patches_sha256 bytea NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  computed_on text NOT NULL,
  greatest_rest_mm double precision,
  CONSTRAINT machining_passes_pk PRIMARY KEY (pass_id),
  CONSTRAINT machining_passes_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT machining_passes_registration_fk FOREIGN KEY (registration_id) REFERENCES record_names (record_id),
  CONSTRAINT machining_passes_machine_fk FOREIGN KEY (machine_id, machine_revision) REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT machining_passes_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT machining_passes_sensor_calibration_fk FOREIGN KEY (sensor_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT machining_passes_rotation_calibration_fk FOREIGN KEY (rotation_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT machining_passes_correction_fk FOREIGN KEY (correction_id) REFERENCES record_names (record_id),
  CONSTRAINT machining_passes_reconstruction_fk FOREIGN KEY (reconstruction_id) REFERENCES record_names (record_id),
  CONSTRAINT machining_passes_record_fk FOREIGN KEY (pass_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT machining_passes_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0 AND number > 0),
  CONSTRAINT machining_passes_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS', 'ALLOWANCE')),
  CONSTRAINT machining_passes_outcome_known CHECK (outcome IN ('DONE', 'ANOTHER_PASS', 'SCRAP', 'NOT_DETERMINED')),
  CONSTRAINT machining_passes_reasoned CHECK ((outcome = 'DONE') = (remark = '') AND octet_length(remark) <= 1000),
  CONSTRAINT machining_passes_asked CHECK (greatest_rest_mm BETWEEN 0.001 AND 5),
  CONSTRAINT machining_passes_counts CHECK (taken_count > 0 AND far_off_count >= 0 AND shapeless_count >= 0 AND patch_count > 0),
  CONSTRAINT machining_passes_digests CHECK (octet_length(patches_sha256) = 32),
  CONSTRAINT machining_passes_texts CHECK (requested_by <> '' AND octet_length(requested_by) <= 200 AND software_version <> ''
    AND octet_length(software_version) <= 200 AND octet_length(computed_on) BETWEEN 1 AND 200)
) PARTITION BY RANGE (pass_id);
CREATE INDEX machining_passes_by_registration ON machining_passes (registration_id);
COMMENT ON TABLE machining_passes IS 'What is left of a blank that was machined to a shape: machining_passes/{id}.';
COMMENT ON COLUMN machining_passes.registration_id IS 'The fit of what was scanned after the cut.';
COMMENT ON COLUMN machining_passes.correction_id IS 'What was cut.';
COMMENT ON COLUMN machining_passes.reconstruction_id IS 'Whose shape its paths went with.';
COMMENT ON COLUMN machining_passes.number IS 'Its place among those of the shape, from 1 on.';
COMMENT ON COLUMN machining_passes.greatest_rest_mm IS 'How far a machined region may stand above the shape; NULL: as its profile tolerance lets it.';
COMMENT ON COLUMN machining_passes.patches_sha256 IS 'Of the columns of machining_pass_patches, each little-endian, in their order.';

CREATE TABLE machining_pass_scans (
  pass_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_key uuid NOT NULL,
  CONSTRAINT machining_pass_scans_pk PRIMARY KEY (pass_id, position_index),
  CONSTRAINT machining_pass_scans_once UNIQUE (pass_id, scan_key),
  CONSTRAINT machining_pass_scans_pass_fk FOREIGN KEY (pass_id) REFERENCES machining_passes (pass_id),
  CONSTRAINT machining_pass_scans_scan_fk FOREIGN KEY (scan_key) REFERENCES record_names (record_id),
  CONSTRAINT machining_pass_scans_position CHECK (position_index BETWEEN 0 AND 63)
) PARTITION BY RANGE (pass_id);
CREATE INDEX machining_pass_scans_by_scan ON machining_pass_scans (scan_key);
COMMENT ON TABLE machining_pass_scans IS 'The scans of the machined surface, in the registration''s order.';

CREATE TABLE machining_pass_regions (
  pass_id uuid NOT NULL,
  position_index integer NOT NULL,
  region text NOT NULL,
  patch_count integer NOT NULL,
  seen_part double precision NOT NULL,
  mean_rest_um double precision,
  least_rest_um double precision,
  greatest_rest_um double precision,
  least_lower_spare_um double precision,
  least_upper_spare_um double precision,
  offset_um double precision,
  deflection_share double precision,
  CONSTRAINT machining_pass_regions_pk PRIMARY KEY (pass_id, position_index),
  CONSTRAINT machining_pass_regions_once UNIQUE (pass_id, region),
  CONSTRAINT machining_pass_regions_pass_fk FOREIGN KEY (pass_id) REFERENCES machining_passes (pass_id),
  CONSTRAINT machining_pass_regions_few CHECK (position_index BETWEEN 0 AND 63),
  CONSTRAINT machining_pass_regions_text CHECK (octet_length(region) BETWEEN 1 AND 200),
  CONSTRAINT machining_pass_regions_seen CHECK (patch_count >= 0 AND seen_part BETWEEN 0 AND 1.000001),
  CONSTRAINT machining_pass_regions_groups CHECK (num_nulls(mean_rest_um, least_rest_um, greatest_rest_um) IN (0, 3)
    AND num_nulls(least_lower_spare_um, least_upper_spare_um) IN (0, 2) AND num_nulls(offset_um, deflection_share) IN (0, 2)),
  CONSTRAINT machining_pass_regions_found CHECK (abs(mean_rest_um) < 1e9 AND abs(least_rest_um) < 1e9 AND abs(greatest_rest_um) < 1e9
    AND abs(least_lower_spare_um) < 1e9 AND abs(least_upper_spare_um) < 1e9 AND abs(offset_um) < 1e9 AND deflection_share BETWEEN 0 AND 1)
) PARTITION BY RANGE (pass_id);
COMMENT ON TABLE machining_pass_regions IS 'What was found of each of the reconstruction''s regions.';
COMMENT ON COLUMN machining_pass_regions.seen_part IS 'Share of its area that the scans saw.';
COMMENT ON COLUMN machining_pass_regions.mean_rest_um IS 'Above the shape, as least_rest_um and greatest_rest_um; NULL: it is not machined, or was not seen.';
COMMENT ON COLUMN machining_pass_regions.least_lower_spare_um IS 'Of the deviation above the lower profile limit beyond its guard, as least_upper_spare_um below the upper; NULL: a datum, or not seen.';
COMMENT ON COLUMN machining_pass_regions.offset_um IS 'What the tool leaves where it removes nothing; NULL: too little was cut, as deflection_share.';
COMMENT ON COLUMN machining_pass_regions.deflection_share IS 'How much of what it removes it leaves besides, because it gives way.';

CREATE TABLE machining_pass_patches (
  pass_id uuid NOT NULL,
  points_in_part_mm double precision[] NOT NULL,
  normals_in_part real[] NOT NULL,
  expanded_uncertainties_um real[] NOT NULL,
  stock_um real[] NOT NULL,
  regions integer[] NOT NULL,
  CONSTRAINT machining_pass_patches_pk PRIMARY KEY (pass_id),
  CONSTRAINT machining_pass_patches_pass_fk FOREIGN KEY (pass_id) REFERENCES machining_passes (pass_id),
  CONSTRAINT machining_pass_patches_each CHECK (cardinality(stock_um) > 0 AND cardinality(points_in_part_mm) = 3 * cardinality(stock_um)
    AND cardinality(normals_in_part) = 3 * cardinality(stock_um) AND cardinality(expanded_uncertainties_um) = cardinality(stock_um)
    AND cardinality(regions) = cardinality(stock_um)),
  CONSTRAINT machining_pass_patches_points_in_part_mm_whole CHECK (array_position(points_in_part_mm, NULL) IS NULL),
  CONSTRAINT machining_pass_patches_normals_in_part_whole CHECK (array_position(normals_in_part, NULL) IS NULL),
  CONSTRAINT machining_pass_patches_expanded_uncertainties_um_whole CHECK (array_position(expanded_uncertainties_um, NULL) IS NULL),
  CONSTRAINT machining_pass_patches_stock_um_whole CHECK (array_position(stock_um, NULL) IS NULL),
  CONSTRAINT machining_pass_patches_regions_whole CHECK (array_position(regions, NULL) IS NULL)
) PARTITION BY RANGE (pass_id);
COMMENT ON TABLE machining_pass_patches IS 'What was measured of a machined surface: X, Y, Z patch by patch, outward normals, and what stands above the shape.';
COMMENT ON COLUMN machining_pass_patches.expanded_uncertainties_um IS '95 %, of the point along its normal.';
COMMENT ON COLUMN machining_pass_patches.stock_um IS 'Above the shape; NaN: no surface near it looks alike.';
COMMENT ON COLUMN machining_pass_patches.regions IS 'Places in machining_pass_regions; their number where stock_um is NaN.';

DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['machining_passes', 'machining_pass_scans', 'machining_pass_regions', 'machining_pass_patches'] LOOP
    PERFORM make_append_only(held::regclass);
    EXECUTE format('GRANT SELECT, INSERT ON %I TO sixpoint_correction', held);
    EXECUTE format('GRANT SELECT ON %I TO sixpoint_ledger', held);
  END LOOP;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON machining_passes FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();
SELECT make_partitions(3);
-- And the months that inspections have already.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid, partitioned_tables t
WHERE i.inhparent = 'inspections'::regclass AND t.name LIKE 'machining_pass%';

ALTER TABLE corrections ADD COLUMN machining_pass_id uuid,
  ADD CONSTRAINT corrections_machining_pass_fk FOREIGN KEY (machining_pass_id) REFERENCES record_names (record_id),
  ADD CONSTRAINT corrections_pass_of_a_shape CHECK (machining_pass_id IS NULL OR reconstruction_id IS NOT NULL);
ALTER TABLE correction_tool_paths ADD COLUMN deepest_compensation_um double precision,
  ADD CONSTRAINT correction_tool_paths_compensation CHECK (abs(deepest_compensation_um) <= 1e6
    AND (deepest_compensation_um IS NULL OR adapted_shift_mm IS NOT NULL));
COMMENT ON COLUMN correction_tool_paths.deepest_compensation_um IS 'How much deeper than the shape it is commanded by the pass before, at most; NULL: there was none.';
COMMENT ON COLUMN corrections.machining_pass_id IS 'By what that pass left its paths are commanded deeper or less deep; NULL: they are not.';

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
                -- What was cut before the pass that it goes by, the pass has measured.
                OR c.release = 'AUTOMATIC' AND m.record_sequence > coalesce(
                  (SELECT p.record_sequence FROM record_names p WHERE p.record_id = c.machining_pass_id), 0))
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

-- One kind more, as V0049 has it.
DO $$
DECLARE
  held regclass;
  kinds text[] := record_kinds();
BEGIN
  IF cardinality(kinds) < 24 THEN
    RAISE EXCEPTION 'record_entries_kind_known: % kinds, want those that were', cardinality(kinds);
  END IF;
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  EXECUTE format('ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN (%s))',
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || ARRAY['machining_pass']) k));
END
$$;

CREATE VIEW read_v1.machining_passes WITH (security_barrier) AS
  SELECT m.pass_id, m.registration_id, m.blade_serial, m.part_id, m.part_revision, m.machine_id, m.machine_revision, n.record_sequence, n.recorded_at, m.correction_id, m.reconstruction_id, m.number, m.outcome, m.remark, r.region, r.seen_part, r.mean_rest_um, r.least_rest_um, r.greatest_rest_um, r.least_lower_spare_um, r.least_upper_spare_um, r.offset_um, r.deflection_share
  FROM machining_passes m JOIN record_names n ON n.record_id = m.pass_id
       JOIN machining_pass_regions r ON r.pass_id = m.pass_id
  WHERE m.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.machining_passes IS 'What passes over blanks left, and what is to be done now: a row for each region of each.';
COMMENT ON COLUMN read_v1.machining_passes.pass_id IS 'The id in machining_passes/{id}.';
COMMENT ON COLUMN read_v1.machining_passes.registration_id IS 'The pose of what was scanned after the cut.';
COMMENT ON COLUMN read_v1.machining_passes.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.machining_passes.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.machining_passes.part_revision IS 'The revision whose CAD was deformed.';
COMMENT ON COLUMN read_v1.machining_passes.machine_id IS 'On which machine it was scanned.';
COMMENT ON COLUMN read_v1.machining_passes.machine_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.machining_passes.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.machining_passes.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.machining_passes.correction_id IS 'What was cut.';
COMMENT ON COLUMN read_v1.machining_passes.reconstruction_id IS 'Whose shape its paths went with.';
COMMENT ON COLUMN read_v1.machining_passes.number IS 'Its place among those of the shape, from 1 on.';
COMMENT ON COLUMN read_v1.machining_passes.outcome IS 'DONE, ANOTHER_PASS, SCRAP or NOT_DETERMINED.';
COMMENT ON COLUMN read_v1.machining_passes.remark IS 'Why it is not DONE; else empty.';
COMMENT ON COLUMN read_v1.machining_passes.region IS 'Of the surface.';
COMMENT ON COLUMN read_v1.machining_passes.seen_part IS 'Share of it that was seen, 0 to 1.';
COMMENT ON COLUMN read_v1.machining_passes.mean_rest_um IS 'Micrometres above the shape; NULL: it is not machined, or was not seen.';
COMMENT ON COLUMN read_v1.machining_passes.least_rest_um IS 'As mean_rest_um, the least.';
COMMENT ON COLUMN read_v1.machining_passes.greatest_rest_um IS 'As mean_rest_um, the greatest.';
COMMENT ON COLUMN read_v1.machining_passes.least_lower_spare_um IS 'Micrometres above the lower profile limit beyond the guard; NULL: a datum, or not seen.';
COMMENT ON COLUMN read_v1.machining_passes.least_upper_spare_um IS 'Micrometres below the upper profile limit, or the greatest rest that was asked for, beyond the guard.';
COMMENT ON COLUMN read_v1.machining_passes.offset_um IS 'Micrometres that the tool leaves where it removes nothing; NULL: too little was cut.';
COMMENT ON COLUMN read_v1.machining_passes.deflection_share IS 'How much of what it removes it leaves besides.';
GRANT SELECT ON read_v1.machining_passes TO sixpoint_reader;

COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment, disposition, machining_model, deviation, section, drawing, assessment, measurement, reconstruction or machining_pass; more may come.';

CREATE OR REPLACE FUNCTION record_verdict(of_record uuid, of_kind text) RETURNS text
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  RETURN CASE of_kind
    WHEN 'inspection' THEN (SELECT i.verdict FROM inspections i WHERE i.inspection_id = of_record)
    WHEN 'reconstruction' THEN (SELECT s.outcome FROM reconstructions s WHERE s.reconstruction_id = of_record)
    WHEN 'machining_pass' THEN (SELECT p.outcome FROM machining_passes p WHERE p.pass_id = of_record)
    WHEN 'assessment' THEN (SELECT a.verdict FROM assessments a WHERE a.assessment_id = of_record)
    WHEN 'deviation' THEN (SELECT d.verdict FROM deviation_maps d WHERE d.deviation_id = of_record)
    WHEN 'registration' THEN (SELECT r.outcome FROM registrations r WHERE r.registration_id = of_record)
    WHEN 'study' THEN (SELECT s.verdict FROM studies s WHERE s.study_id = of_record) END;
END
$$;
COMMENT ON FUNCTION record_verdict(uuid, text) IS
  'Of inspections, assessments, deviation maps with profile tolerances, registrations, reconstructions and machining passes (their outcomes) and studies; NULL: none.';

-- Events tell the outcomes of passes too, as V0049 has them.
DO $$
DECLARE
  told text;
  was CONSTANT text := '''inspection'', ''reconstruction'', ''assessment'', ''deviation'', ''registration'', ''study''';
  held regprocedure;
BEGIN
  FOREACH held IN ARRAY ARRAY['events_between(bigint, bigint, bigint, text[], text[], text, text, text, text[])'::regprocedure,
      'read_v1.events_after(bigint, integer)'::regprocedure, 'read_v1.recall(text, bigint, integer)'::regprocedure] LOOP
    told := pg_get_functiondef(held);
    IF position(was IN told) = 0 THEN
      RAISE EXCEPTION '%: tells verdicts of other kinds, want %', held, was;
    END IF;
    EXECUTE replace(told, was, '''inspection'', ''reconstruction'', ''machining_pass'', ''assessment'', ''deviation'', ''registration'', ''study''');
  END LOOP;
END
$$;
CREATE OR REPLACE VIEW read_v1.events WITH (security_barrier) AS
  SELECT n.record_sequence, n.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method,
         CASE WHEN e.kind IN ('inspection', 'reconstruction', 'machining_pass', 'assessment', 'deviation', 'registration', 'study')
              THEN record_verdict(e.record_id, e.kind) END AS verdict,
         e.measured_at, asker_for_reader(e.requested_by) AS requested_by, e.software_version, e.trace_id,
         e.work_order, e.operation
  FROM record_names n JOIN record_entries e ON e.record_id = n.record_id
  WHERE ((SELECT cardinality(hidden_from_reader())) = 0
         OR CASE WHEN e.blade_serial IS NULL
                 THEN coalesce(NOT parts_of_record(e.record_id) && (SELECT hidden_from_reader())::text[], false)
                 ELSE EXISTS (SELECT 1 FROM blades b WHERE b.blade_serial = e.blade_serial
                              AND b.part_id <> ALL ((SELECT hidden_from_reader())::text[])) END);
COMMENT ON COLUMN read_v1.events.verdict IS 'Of an inspection, an assessment, a deviation map with profile tolerances or a study; of a registration, a reconstruction and a machining pass its outcome; NULL of the others.';
