-- Shapes that blanks contain: what was asked, what was found region by region, what holds the shape or contradicts it, the blank's patches,
-- and the deformation itself as a blob.

-- Told where it stands: a session without a search path (a restored dump's, the ledger's check) did not find is_triple.
CREATE OR REPLACE FUNCTION is_unit(v double precision[]) RETURNS boolean LANGUAGE sql IMMUTABLE AS $$
  SELECT v IS NULL OR (public.is_triple(v) AND abs(sqrt(v[1] * v[1] + v[2] * v[2] + v[3] * v[3]) - 1) <= 1e-6)
$$;

CREATE TABLE reconstructions (
  reconstruction_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  registration_id uuid NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  sensor_calibration_id uuid NOT NULL,
  rotation_calibration_id uuid NOT NULL,
  method text NOT NULL,
  of_part_limits boolean NOT NULL,
  patch_mm double precision NOT NULL,
  farthest_mm double precision NOT NULL,
  coarsest_spacing_mm double precision NOT NULL,
  finest_spacing_mm double precision NOT NULL,
  blend_mm double precision NOT NULL,
  coverage_factor double precision NOT NULL,
  outcome text NOT NULL,
  remark text NOT NULL,
  worst_step_um double precision,
  worst_kink_deg double precision,
  taken_count bigint NOT NULL,
  far_off_count bigint NOT NULL,
  shapeless_count bigint NOT NULL,
  patch_count integer NOT NULL,
  spacing_mm double precision NOT NULL,
  control_count bigint NOT NULL,
  level_count integer NOT NULL,
  pass_count integer NOT NULL,
  of_any_shape boolean,
  lacking_um double precision,
  control_reach_mm double precision,
  tolerance_at_least_um double precision,
  tolerance_at_most_um double precision,
  stock_at_least_um double precision,
  stock_at_most_um double precision,
  patches_sha256 bytea NOT NULL,
  lattice_sha256 bytea,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  computed_on text NOT NULL,
  CONSTRAINT reconstructions_pk PRIMARY KEY (reconstruction_id),
  CONSTRAINT reconstructions_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT reconstructions_registration_fk FOREIGN KEY (registration_id) REFERENCES record_names (record_id),
  CONSTRAINT reconstructions_machine_fk FOREIGN KEY (machine_id, machine_revision) REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT reconstructions_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT reconstructions_sensor_calibration_fk FOREIGN KEY (sensor_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT reconstructions_rotation_calibration_fk FOREIGN KEY (rotation_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT reconstructions_record_fk FOREIGN KEY (reconstruction_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT reconstructions_lattice_fk FOREIGN KEY (lattice_sha256) REFERENCES blobs (sha256),
  CONSTRAINT reconstructions_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0),
  CONSTRAINT reconstructions_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS', 'ALLOWANCE')),
  CONSTRAINT reconstructions_asked CHECK (patch_mm BETWEEN 0.1 AND 20 AND farthest_mm BETWEEN 0.1 AND 5 AND finest_spacing_mm >= 0.5
    AND finest_spacing_mm <= coarsest_spacing_mm AND coarsest_spacing_mm <= 100 AND blend_mm BETWEEN 0.1 AND 50
    AND coverage_factor BETWEEN 1 AND 10),
  CONSTRAINT reconstructions_outcome_known CHECK (outcome IN ('RECONSTRUCTED', 'INFEASIBLE', 'NOT_DETERMINED')),
  CONSTRAINT reconstructions_reasoned CHECK ((outcome = 'RECONSTRUCTED' OR remark <> '') AND octet_length(remark) <= 1000),
  CONSTRAINT reconstructions_shape_or_none CHECK (num_nulls(lattice_sha256, worst_step_um, worst_kink_deg)
    = CASE WHEN outcome = 'RECONSTRUCTED' THEN 0 ELSE 3 END),
  CONSTRAINT reconstructions_transition CHECK (worst_step_um >= 0 AND worst_step_um < 1e6 AND worst_kink_deg >= 0 AND worst_kink_deg <= 180),
  CONSTRAINT reconstructions_proof_of_none CHECK (num_nulls(of_any_shape, lacking_um, control_reach_mm)
    = CASE WHEN outcome = 'INFEASIBLE' THEN 0 ELSE 3 END),
  CONSTRAINT reconstructions_relaxations CHECK (num_nulls(tolerance_at_least_um, tolerance_at_most_um) IN (0, 2)
    AND num_nulls(stock_at_least_um, stock_at_most_um) IN (0, 2)
    AND (outcome = 'INFEASIBLE' OR num_nulls(tolerance_at_least_um, stock_at_least_um) = 2)
    AND 0 <= tolerance_at_least_um AND tolerance_at_least_um <= tolerance_at_most_um AND tolerance_at_most_um < 1e9
    AND 0 <= stock_at_least_um AND stock_at_least_um <= stock_at_most_um AND stock_at_most_um < 1e9),
  CONSTRAINT reconstructions_lacking CHECK (lacking_um > 0 AND lacking_um < 1e9 AND control_reach_mm > 0 AND control_reach_mm < 1e6),
  CONSTRAINT reconstructions_counts CHECK (taken_count > 0 AND far_off_count >= 0 AND shapeless_count >= 0 AND patch_count > 0 AND spacing_mm >= 0
    AND spacing_mm < 1e6 AND control_count >= 0 AND level_count >= 0 AND pass_count >= 0),
  CONSTRAINT reconstructions_digests CHECK (octet_length(patches_sha256) = 32 AND octet_length(lattice_sha256) = 32),
  CONSTRAINT reconstructions_texts CHECK (requested_by <> '' AND octet_length(requested_by) <= 200 AND software_version <> ''
    AND octet_length(software_version) <= 200 AND octet_length(computed_on) BETWEEN 1 AND 200)
) PARTITION BY RANGE (reconstruction_id);
CREATE INDEX reconstructions_by_registration ON reconstructions (registration_id);
CREATE INDEX reconstructions_by_lattice ON reconstructions (lattice_sha256);
COMMENT ON TABLE reconstructions IS 'Shapes that blanks contain, or the proof that there is none: reconstructions/{id}.';
COMMENT ON COLUMN reconstructions.registration_id IS 'The fit, and whose scans.';
COMMENT ON COLUMN reconstructions.of_part_limits IS 'The regions'' limits are the part''s own; else it was a try.';
COMMENT ON COLUMN reconstructions.patch_mm IS 'Width of the blank''s patches; points beyond farthest_mm were of something else.';
COMMENT ON COLUMN reconstructions.coarsest_spacing_mm IS 'Cells of the first lattice, to finest_spacing_mm; spacing_mm: of the last that was tried.';
COMMENT ON COLUMN reconstructions.blend_mm IS 'Beside fixed surface the allowance rises from none over so much.';
COMMENT ON COLUMN reconstructions.coverage_factor IS 'So many standard uncertainties of a patch are its guard.';
COMMENT ON COLUMN reconstructions.worst_step_um IS 'Between shape and fixed surface about machined regions, as worst_kink_deg; NULL: no shape.';
COMMENT ON COLUMN reconstructions.of_any_shape IS 'Limits contradict each other at a place; else: none on the finest lattice. NULL: not INFEASIBLE.';
COMMENT ON COLUMN reconstructions.lacking_um IS 'By so much the limits are missed as long as no control moves farther than control_reach_mm.';
COMMENT ON COLUMN reconstructions.tolerance_at_least_um IS 'Were the profile tolerances to give way alone: proven, to tolerance_at_most_um, found; NULL: no cure. As stock_*.';
COMMENT ON COLUMN reconstructions.patches_sha256 IS 'Of the columns of blank_patches, each little-endian, in their order.';
COMMENT ON COLUMN reconstructions.lattice_sha256 IS 'The deformation (docs/methods/reconstruction.md, lattice); NULL: no shape.';

CREATE TABLE reconstruction_scans (
  reconstruction_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_key uuid NOT NULL,
  CONSTRAINT reconstruction_scans_pk PRIMARY KEY (reconstruction_id, position_index),
  CONSTRAINT reconstruction_scans_once UNIQUE (reconstruction_id, scan_key),
  CONSTRAINT reconstruction_scans_reconstruction_fk FOREIGN KEY (reconstruction_id) REFERENCES reconstructions (reconstruction_id),
  CONSTRAINT reconstruction_scans_scan_fk FOREIGN KEY (scan_key) REFERENCES record_names (record_id),
  CONSTRAINT reconstruction_scans_position CHECK (position_index BETWEEN 0 AND 63)
) PARTITION BY RANGE (reconstruction_id);
CREATE INDEX reconstruction_scans_by_scan ON reconstruction_scans (scan_key);
COMMENT ON TABLE reconstruction_scans IS 'The scans of the blank, in the registration''s order.';

CREATE TABLE reconstruction_regions (
  reconstruction_id uuid NOT NULL,
  position_index integer NOT NULL,
  region text NOT NULL,
  minimum_in_part_mm double precision[],
  maximum_in_part_mm double precision[],
  facing_in_part double precision[],
  facing_within_deg double precision,
  kind text NOT NULL,
  allowance_mm double precision,
  lower_mm double precision,
  upper_mm double precision,
  area_mm2 double precision NOT NULL,
  seen_part double precision NOT NULL,
  patch_count integer NOT NULL,
  least_allowance_um double precision,
  least_spare_um double precision,
  greatest_band_use double precision NOT NULL,
  worst_fixed_um double precision,
  worst_datum_um double precision,
  CONSTRAINT reconstruction_regions_pk PRIMARY KEY (reconstruction_id, position_index),
  CONSTRAINT reconstruction_regions_once UNIQUE (reconstruction_id, region),
  CONSTRAINT reconstruction_regions_reconstruction_fk FOREIGN KEY (reconstruction_id) REFERENCES reconstructions (reconstruction_id),
  CONSTRAINT reconstruction_regions_few CHECK (position_index BETWEEN 0 AND 63),
  CONSTRAINT reconstruction_regions_text CHECK (octet_length(region) BETWEEN 1 AND 200),
  CONSTRAINT reconstruction_regions_minimum CHECK (is_triple(minimum_in_part_mm) AND array_position(minimum_in_part_mm, NULL) IS NULL),
  CONSTRAINT reconstruction_regions_maximum CHECK (is_triple(maximum_in_part_mm) AND array_position(maximum_in_part_mm, NULL) IS NULL),
  CONSTRAINT reconstruction_regions_facing CHECK (is_unit(facing_in_part) AND array_position(facing_in_part, NULL) IS NULL),
  CONSTRAINT reconstruction_regions_within CHECK ((facing_in_part IS NULL) = (facing_within_deg IS NULL)
    AND (facing_within_deg IS NULL OR facing_within_deg > 0 AND facing_within_deg <= 180)),
  CONSTRAINT reconstruction_regions_kind_known CHECK (octet_length(kind) <= 64 AND kind IN ('MACHINED', 'FIXED', 'DATUM')),
  CONSTRAINT reconstruction_regions_allowance CHECK ((kind = 'MACHINED') = (allowance_mm IS NOT NULL)
    AND (allowance_mm IS NULL OR allowance_mm BETWEEN 0 AND 5)),
  CONSTRAINT reconstruction_regions_band CHECK (num_nulls(lower_mm, upper_mm) = CASE WHEN kind = 'DATUM' THEN 2 ELSE 0 END
    AND (lower_mm IS NULL OR lower_mm < upper_mm AND lower_mm >= -5 AND upper_mm <= 5)),
  CONSTRAINT reconstruction_regions_seen CHECK (area_mm2 >= 0 AND area_mm2 < 1e12 AND seen_part BETWEEN 0 AND 1.000001 AND patch_count >= 0),
  CONSTRAINT reconstruction_regions_of_kind CHECK ((kind = 'MACHINED' OR num_nulls(least_allowance_um, least_spare_um) = 2)
    AND (kind = 'FIXED' OR worst_fixed_um IS NULL) AND (kind = 'DATUM') = (worst_datum_um IS NOT NULL)),
  CONSTRAINT reconstruction_regions_found CHECK (least_allowance_um > -1e9 AND least_allowance_um < 1e9 AND least_spare_um > -1e9
    AND least_spare_um < 1e9 AND greatest_band_use >= 0 AND greatest_band_use < 1e9 AND worst_fixed_um >= 0 AND worst_fixed_um < 1e9
    AND worst_datum_um >= 0 AND worst_datum_um < 1e9)
) PARTITION BY RANGE (reconstruction_id);
COMMENT ON TABLE reconstruction_regions IS 'Parts of the surface as they were applied (part_shape_regions), and what was found of each.';
COMMENT ON COLUMN reconstruction_regions.seen_part IS 'Share of its area that the scans saw.';
COMMENT ON COLUMN reconstruction_regions.least_allowance_um IS 'Machined: least stock of a patch outside the shape; least_spare_um: beyond what is wanted with its guard; NULL: not seen.';
COMMENT ON COLUMN reconstruction_regions.greatest_band_use IS 'Greatest displacement as a part of the limit towards which it goes.';
COMMENT ON COLUMN reconstruction_regions.worst_fixed_um IS 'Fixed: greatest distance of the blank from the shape; NULL: not seen.';
COMMENT ON COLUMN reconstruction_regions.worst_datum_um IS 'Datum: greatest displacement.';

CREATE TABLE reconstruction_holds (
  reconstruction_id uuid NOT NULL,
  position_index integer NOT NULL,
  region_index integer NOT NULL,
  limit_kind text NOT NULL,
  upper boolean NOT NULL,
  limit_mm double precision NOT NULL,
  share double precision NOT NULL,
  place_in_part_mm double precision[] NOT NULL,
  normal_in_part double precision[] NOT NULL,
  patch integer,
  CONSTRAINT reconstruction_holds_pk PRIMARY KEY (reconstruction_id, position_index),
  CONSTRAINT reconstruction_holds_region_fk FOREIGN KEY (reconstruction_id, region_index)
    REFERENCES reconstruction_regions (reconstruction_id, position_index),
  CONSTRAINT reconstruction_holds_few CHECK (position_index BETWEEN 0 AND 99),
  CONSTRAINT reconstruction_holds_kind_known CHECK (octet_length(limit_kind) <= 64 AND limit_kind IN ('STOCK', 'TOLERANCE', 'FIXED', 'DATUM')),
  CONSTRAINT reconstruction_holds_size CHECK (limit_mm > -1e6 AND limit_mm < 1e6 AND share BETWEEN 0 AND 1.000001 AND patch >= 0),
  CONSTRAINT reconstruction_holds_place CHECK (is_triple(place_in_part_mm) AND array_position(place_in_part_mm, NULL) IS NULL),
  CONSTRAINT reconstruction_holds_normal CHECK (is_triple(normal_in_part) AND array_position(normal_in_part, NULL) IS NULL)
) PARTITION BY RANGE (reconstruction_id);
COMMENT ON TABLE reconstruction_holds IS 'Limits that hold the shape, or that contradict each other where there is none; the greatest share first.';
COMMENT ON COLUMN reconstruction_holds.limit_mm IS 'Of the displacement along the normal, its upper or its lower side.';
COMMENT ON COLUMN reconstruction_holds.patch IS 'Place in the arrays of blank_patches, from 0 on; NULL: a place of the design.';

CREATE TABLE blank_patches (
  reconstruction_id uuid NOT NULL,
  points_in_part_mm double precision[] NOT NULL,
  normals_in_part real[] NOT NULL,
  expanded_uncertainties_um real[] NOT NULL,
  stock_um real[] NOT NULL,
  regions integer[] NOT NULL,
  CONSTRAINT blank_patches_pk PRIMARY KEY (reconstruction_id),
  CONSTRAINT blank_patches_reconstruction_fk FOREIGN KEY (reconstruction_id) REFERENCES reconstructions (reconstruction_id),
  CONSTRAINT blank_patches_each CHECK (cardinality(stock_um) > 0 AND cardinality(points_in_part_mm) = 3 * cardinality(stock_um)
    AND cardinality(normals_in_part) = 3 * cardinality(stock_um) AND cardinality(expanded_uncertainties_um) = cardinality(stock_um)
    AND cardinality(regions) = cardinality(stock_um)),
  CONSTRAINT blank_patches_points_in_part_mm_whole CHECK (array_position(points_in_part_mm, NULL) IS NULL),
  CONSTRAINT blank_patches_normals_in_part_whole CHECK (array_position(normals_in_part, NULL) IS NULL),
  CONSTRAINT blank_patches_expanded_uncertainties_um_whole CHECK (array_position(expanded_uncertainties_um, NULL) IS NULL),
  CONSTRAINT blank_patches_stock_um_whole CHECK (array_position(stock_um, NULL) IS NULL),
  CONSTRAINT blank_patches_regions_whole CHECK (array_position(regions, NULL) IS NULL)
) PARTITION BY RANGE (reconstruction_id);
COMMENT ON TABLE blank_patches IS 'What was measured of a blank: X, Y, Z patch by patch, outward normals, and the stock of each.';
COMMENT ON COLUMN blank_patches.expanded_uncertainties_um IS '95 %, of the point along its normal.';
COMMENT ON COLUMN blank_patches.stock_um IS 'Outside the shape, or outside the CAD where there is none; NaN: no surface near it looks alike.';
COMMENT ON COLUMN blank_patches.regions IS 'Places in reconstruction_regions.';

DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['reconstructions', 'reconstruction_scans', 'reconstruction_regions', 'reconstruction_holds', 'blank_patches'] LOOP
    PERFORM make_append_only(held::regclass);
    EXECUTE format('GRANT SELECT, INSERT ON %I TO sixpoint_correction', held);
    EXECUTE format('GRANT SELECT ON %I TO sixpoint_ledger', held);
  END LOOP;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON reconstructions FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();
GRANT SELECT, INSERT, UPDATE (bytes, store, object_id, deleted_at, deletion_reason) ON blobs TO sixpoint_correction;
GRANT SELECT (lattice_sha256) ON reconstructions TO sixpoint_ingest;
SELECT make_partitions(3);
-- And the months that inspections have already.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid, partitioned_tables t
WHERE i.inhparent = 'inspections'::regclass AND (t.name LIKE 'reconstruction%' OR t.name = 'blank_patches');

-- One kind more, as V0028 has it.
DO $$
DECLARE
  held regclass;
  kinds text[] := record_kinds();
BEGIN
  IF cardinality(kinds) < 23 THEN
    RAISE EXCEPTION 'record_entries_kind_known: % kinds, want those that were', cardinality(kinds);
  END IF;
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  EXECUTE format('ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN (%s))',
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || ARRAY['reconstruction']) k));
END
$$;

CREATE VIEW read_v1.reconstructions WITH (security_barrier) AS
  SELECT m.reconstruction_id, m.registration_id, m.blade_serial, m.part_id, m.part_revision, m.machine_id, m.machine_revision,
         n.record_sequence, n.recorded_at, m.outcome, m.remark, m.of_part_limits, m.worst_step_um, m.worst_kink_deg,
         m.tolerance_at_least_um, m.tolerance_at_most_um, m.stock_at_least_um, m.stock_at_most_um, r.region, r.kind, r.allowance_mm,
         r.lower_mm, r.upper_mm, r.area_mm2, r.seen_part, r.least_allowance_um, r.least_spare_um, r.greatest_band_use, r.worst_fixed_um,
         r.worst_datum_um, (SELECT g.station FROM registrations g WHERE g.registration_id = m.registration_id) AS station
  FROM reconstructions m JOIN record_names n ON n.record_id = m.reconstruction_id
       JOIN reconstruction_regions r ON r.reconstruction_id = m.reconstruction_id
  WHERE m.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.reconstructions IS 'Shapes that blanks contain, or that there is none: a row for each region of each.';
COMMENT ON COLUMN read_v1.reconstructions.reconstruction_id IS 'The id in reconstructions/{id}.';
COMMENT ON COLUMN read_v1.reconstructions.registration_id IS 'The pose that it rests on.';
COMMENT ON COLUMN read_v1.reconstructions.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.reconstructions.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.reconstructions.part_revision IS 'The revision whose CAD was deformed.';
COMMENT ON COLUMN read_v1.reconstructions.machine_id IS 'On which machine it was scanned.';
COMMENT ON COLUMN read_v1.reconstructions.machine_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.reconstructions.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.reconstructions.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.reconstructions.outcome IS 'RECONSTRUCTED, INFEASIBLE (proven) or NOT_DETERMINED.';
COMMENT ON COLUMN read_v1.reconstructions.remark IS 'Why it is not RECONSTRUCTED, or what is doubtful of the shape; else empty.';
COMMENT ON COLUMN read_v1.reconstructions.of_part_limits IS 'The regions'' limits are the part''s own; else it was a try.';
COMMENT ON COLUMN read_v1.reconstructions.worst_step_um IS 'Micrometres between the shape and the fixed surface about machined regions; NULL: no shape.';
COMMENT ON COLUMN read_v1.reconstructions.worst_kink_deg IS 'Degrees, as worst_step_um.';
COMMENT ON COLUMN read_v1.reconstructions.tolerance_at_least_um IS 'Micrometres that the profile tolerances lack at least, were they to give way alone; NULL: that would not cure.';
COMMENT ON COLUMN read_v1.reconstructions.tolerance_at_most_um IS 'Micrometres with which a shape was found.';
COMMENT ON COLUMN read_v1.reconstructions.stock_at_least_um IS 'Micrometres that the stock lacks at least, were it to give way alone; NULL: that would not cure.';
COMMENT ON COLUMN read_v1.reconstructions.stock_at_most_um IS 'Micrometres with which a shape was found.';
COMMENT ON COLUMN read_v1.reconstructions.region IS 'Of the surface.';
COMMENT ON COLUMN read_v1.reconstructions.kind IS 'MACHINED, FIXED or DATUM.';
COMMENT ON COLUMN read_v1.reconstructions.allowance_mm IS 'Millimetres of stock that are wanted; NULL: it is not machined.';
COMMENT ON COLUMN read_v1.reconstructions.lower_mm IS 'Millimetres: how far the shape may lie below the CAD; NULL: a datum.';
COMMENT ON COLUMN read_v1.reconstructions.upper_mm IS 'Millimetres: how far above.';
COMMENT ON COLUMN read_v1.reconstructions.area_mm2 IS 'Square millimetres of the CAD.';
COMMENT ON COLUMN read_v1.reconstructions.seen_part IS 'Share of it that was seen, 0 to 1.';
COMMENT ON COLUMN read_v1.reconstructions.least_allowance_um IS 'Micrometres: the least stock of a patch outside the shape; NULL: not machined, or not seen.';
COMMENT ON COLUMN read_v1.reconstructions.least_spare_um IS 'Micrometres: beyond what is wanted with its guard.';
COMMENT ON COLUMN read_v1.reconstructions.greatest_band_use IS 'Greatest displacement as a part of the limit towards which it goes.';
COMMENT ON COLUMN read_v1.reconstructions.worst_fixed_um IS 'Micrometres of the blank from the shape, at most; NULL: not fixed, or not seen.';
COMMENT ON COLUMN read_v1.reconstructions.worst_datum_um IS 'Micrometres that a datum moved at most; NULL: no datum.';
COMMENT ON COLUMN read_v1.reconstructions.station IS 'Where the blade stood, of its part''s stations; NULL: the part has none.';
GRANT SELECT ON read_v1.reconstructions TO sixpoint_reader;

CREATE VIEW read_v1.shape_regions WITH (security_barrier) AS
  SELECT s.part_id, s.revision, s.region, s.minimum_in_part_mm, s.maximum_in_part_mm, s.facing_in_part, s.facing_within_deg, s.kind,
         s.allowance_mm, s.lower_mm, s.upper_mm
  FROM part_shape_regions s
  WHERE s.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.shape_regions IS 'Parts of a part''s surface: what becomes of each where a blank does not contain the part.';
COMMENT ON COLUMN read_v1.shape_regions.part_id IS 'The id in parts/{id}.';
COMMENT ON COLUMN read_v1.shape_regions.revision IS 'Of the part.';
COMMENT ON COLUMN read_v1.shape_regions.region IS 'What it is called.';
COMMENT ON COLUMN read_v1.shape_regions.minimum_in_part_mm IS 'Millimetres: corner of its box; NULL: not bounded so.';
COMMENT ON COLUMN read_v1.shape_regions.maximum_in_part_mm IS 'As minimum_in_part_mm.';
COMMENT ON COLUMN read_v1.shape_regions.facing_in_part IS 'Only where the outward normal looks so; NULL: anywhere.';
COMMENT ON COLUMN read_v1.shape_regions.facing_within_deg IS 'Degrees, of facing_in_part.';
COMMENT ON COLUMN read_v1.shape_regions.kind IS 'MACHINED, FIXED or DATUM.';
COMMENT ON COLUMN read_v1.shape_regions.allowance_mm IS 'Millimetres of stock that are wanted; NULL: it is not machined.';
COMMENT ON COLUMN read_v1.shape_regions.lower_mm IS 'Millimetres: how far the shape may lie below the CAD; NULL: a datum.';
COMMENT ON COLUMN read_v1.shape_regions.upper_mm IS 'Millimetres: how far above.';
GRANT SELECT ON read_v1.shape_regions TO sixpoint_reader;

COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment, disposition, machining_model, deviation, section, drawing, assessment, measurement or reconstruction; more may come.';

CREATE OR REPLACE FUNCTION record_verdict(of_record uuid, of_kind text) RETURNS text
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  RETURN CASE of_kind
    WHEN 'inspection' THEN (SELECT i.verdict FROM inspections i WHERE i.inspection_id = of_record)
    WHEN 'reconstruction' THEN (SELECT s.outcome FROM reconstructions s WHERE s.reconstruction_id = of_record)
    WHEN 'assessment' THEN (SELECT a.verdict FROM assessments a WHERE a.assessment_id = of_record)
    WHEN 'deviation' THEN (SELECT d.verdict FROM deviation_maps d WHERE d.deviation_id = of_record)
    WHEN 'registration' THEN (SELECT r.outcome FROM registrations r WHERE r.registration_id = of_record)
    WHEN 'study' THEN (SELECT s.verdict FROM studies s WHERE s.study_id = of_record) END;
END
$$;
COMMENT ON FUNCTION record_verdict(uuid, text) IS
  'Of inspections, assessments, deviation maps with profile tolerances, registrations and reconstructions (their outcomes) and studies; NULL: none.';

-- Events tell the outcomes of reconstructions too, as V0044 has them.
DO $$
DECLARE
  told text;
  was CONSTANT text := '''inspection'', ''assessment'', ''deviation'', ''registration'', ''study''';
  held regprocedure;
BEGIN
  FOREACH held IN ARRAY ARRAY['events_between(bigint, bigint, bigint, text[], text[], text, text, text, text[])'::regprocedure,
      'read_v1.events_after(bigint, integer)'::regprocedure, 'read_v1.recall(text, bigint, integer)'::regprocedure] LOOP
    told := pg_get_functiondef(held);
    IF position(was IN told) = 0 THEN
      RAISE EXCEPTION '%: tells verdicts of other kinds, want %', held, was;
    END IF;
    EXECUTE replace(told, was, '''inspection'', ''reconstruction'', ''assessment'', ''deviation'', ''registration'', ''study''');
  END LOOP;
END
$$;
CREATE OR REPLACE VIEW read_v1.events WITH (security_barrier) AS
  SELECT n.record_sequence, n.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method,
         CASE WHEN e.kind IN ('inspection', 'reconstruction', 'assessment', 'deviation', 'registration', 'study')
              THEN record_verdict(e.record_id, e.kind) END AS verdict,
         e.measured_at, asker_for_reader(e.requested_by) AS requested_by, e.software_version, e.trace_id,
         e.work_order, e.operation
  FROM record_names n JOIN record_entries e ON e.record_id = n.record_id
  WHERE ((SELECT cardinality(hidden_from_reader())) = 0
         OR CASE WHEN e.blade_serial IS NULL
                 THEN coalesce(NOT parts_of_record(e.record_id) && (SELECT hidden_from_reader())::text[], false)
                 ELSE EXISTS (SELECT 1 FROM blades b WHERE b.blade_serial = e.blade_serial
                              AND b.part_id <> ALL ((SELECT hidden_from_reader())::text[])) END);
COMMENT ON COLUMN read_v1.events.verdict IS 'Of an inspection, an assessment, a deviation map with profile tolerances or a study; of a registration and a reconstruction its outcome; NULL of the others.';
