-- Airfoil sections of blades: the planes, each parameter measured or not, and the outlines that a plot is drawn from.

CREATE TABLE section_measurements (
  section_measurement_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  registration_id uuid NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  sensor_calibration_id uuid NOT NULL,
  rotation_calibration_id uuid NOT NULL,
  method text NOT NULL,
  half_width_mm double precision NOT NULL,
  reference_section text NOT NULL,
  neighbour_offset_in_part_mm double precision[],
  neighbour_standard_uncertainty_um double precision,
  outlines_sha256 bytea NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  computed_on text NOT NULL,
  CONSTRAINT section_measurements_pk PRIMARY KEY (section_measurement_id),
  CONSTRAINT section_measurements_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT section_measurements_registration_fk FOREIGN KEY (registration_id) REFERENCES record_names (record_id),
  CONSTRAINT section_measurements_machine_fk FOREIGN KEY (machine_id, machine_revision) REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT section_measurements_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT section_measurements_sensor_calibration_fk FOREIGN KEY (sensor_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT section_measurements_rotation_calibration_fk FOREIGN KEY (rotation_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT section_measurements_record_fk FOREIGN KEY (section_measurement_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT section_measurements_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0),
  CONSTRAINT section_measurements_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS', 'ALLOWANCE')),
  CONSTRAINT section_measurements_half_width CHECK (half_width_mm BETWEEN 0.01 AND 2),
  CONSTRAINT section_measurements_neighbour CHECK (is_triple(neighbour_offset_in_part_mm) AND neighbour_standard_uncertainty_um >= 0
    AND neighbour_standard_uncertainty_um < 1e9),
  CONSTRAINT section_measurements_neighbour_whole CHECK ((neighbour_offset_in_part_mm IS NULL) = (neighbour_standard_uncertainty_um IS NULL)),
  CONSTRAINT section_measurements_neighbour_offset_in_part_mm_whole CHECK (array_position(neighbour_offset_in_part_mm, NULL) IS NULL),
  CONSTRAINT section_measurements_digests CHECK (octet_length(outlines_sha256) = 32),
  CONSTRAINT section_measurements_texts CHECK (reference_section <> '' AND octet_length(reference_section) <= 200 AND requested_by <> ''
    AND octet_length(requested_by) <= 200 AND software_version <> '' AND octet_length(software_version) <= 200
    AND octet_length(computed_on) BETWEEN 1 AND 200)
) PARTITION BY RANGE (section_measurement_id);
CREATE INDEX section_measurements_by_registration ON section_measurements (registration_id);
COMMENT ON TABLE section_measurements IS 'Airfoil sections of a registered blade: sections/{id}.';
COMMENT ON COLUMN section_measurements.registration_id IS 'The fit, and whose scans.';
COMMENT ON COLUMN section_measurements.half_width_mm IS 'Points so far from a plane were slid into it.';
COMMENT ON COLUMN section_measurements.reference_section IS 'The one that twist is told from.';
COMMENT ON COLUMN section_measurements.neighbour_offset_in_part_mm IS 'From the blade to its neighbour in the row, for the throat; NULL: none was asked for.';
COMMENT ON COLUMN section_measurements.outlines_sha256 IS 'Of the columns of section_outlines, each little-endian, in their order, section by section.';

CREATE TABLE section_measurement_scans (
  section_measurement_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_key uuid NOT NULL,
  CONSTRAINT section_measurement_scans_pk PRIMARY KEY (section_measurement_id, position_index),
  CONSTRAINT section_measurement_scans_once UNIQUE (section_measurement_id, scan_key),
  CONSTRAINT section_measurement_scans_measurement_fk FOREIGN KEY (section_measurement_id) REFERENCES section_measurements (section_measurement_id),
  CONSTRAINT section_measurement_scans_scan_fk FOREIGN KEY (scan_key) REFERENCES record_names (record_id),
  CONSTRAINT section_measurement_scans_position CHECK (position_index BETWEEN 0 AND 63)
) PARTITION BY RANGE (section_measurement_id);
CREATE INDEX section_measurement_scans_by_scan ON section_measurement_scans (scan_key);
COMMENT ON TABLE section_measurement_scans IS 'The scans of a measurement, in the registration''s order.';

CREATE TABLE sections (
  section_measurement_id uuid NOT NULL,
  position_index integer NOT NULL,
  section text NOT NULL,
  origin_in_part_mm double precision[] NOT NULL,
  normal_in_part double precision[] NOT NULL,
  reference_in_part double precision[] NOT NULL,
  leading_in_part_mm double precision[],
  near_in_part_mm double precision[],
  leading_end text,
  trailing_end text,
  point_count bigint NOT NULL,
  outlier_count bigint NOT NULL,
  noise_um double precision,
  waver_um double precision,
  waver_length_mm double precision,
  gap_share double precision,
  reason text NOT NULL,
  CONSTRAINT sections_pk PRIMARY KEY (section_measurement_id, position_index),
  CONSTRAINT sections_once UNIQUE (section_measurement_id, section),
  CONSTRAINT sections_measurement_fk FOREIGN KEY (section_measurement_id) REFERENCES section_measurements (section_measurement_id),
  CONSTRAINT sections_position CHECK (position_index BETWEEN 0 AND 31),
  CONSTRAINT sections_named CHECK (section <> '' AND octet_length(section) <= 200),
  CONSTRAINT sections_plane CHECK (is_triple(origin_in_part_mm) AND is_triple(normal_in_part) AND is_triple(reference_in_part)
    AND is_triple(leading_in_part_mm) AND is_triple(near_in_part_mm)),
  CONSTRAINT sections_ends_known CHECK (leading_end IN ('ROUND', 'SQUARE', 'SHARP', 'NOT_SEEN')
    AND trailing_end IN ('ROUND', 'SQUARE', 'SHARP', 'NOT_SEEN')),
  CONSTRAINT sections_points CHECK (point_count >= 0 AND outlier_count >= 0),
  CONSTRAINT sections_seen_or_not CHECK (num_nulls(leading_end, trailing_end, noise_um, waver_um, waver_length_mm, gap_share)
    = CASE WHEN reason = '' THEN 0 ELSE 6 END AND octet_length(reason) <= 1000),
  CONSTRAINT sections_waver CHECK (noise_um >= 0 AND noise_um < 1e9 AND waver_um >= 0 AND waver_um < 1e9 AND waver_length_mm >= 0
    AND waver_length_mm < 1e9 AND gap_share >= 0 AND gap_share <= 1),
  CONSTRAINT sections_origin_in_part_mm_whole CHECK (array_position(origin_in_part_mm, NULL) IS NULL),
  CONSTRAINT sections_normal_in_part_whole CHECK (array_position(normal_in_part, NULL) IS NULL),
  CONSTRAINT sections_reference_in_part_whole CHECK (array_position(reference_in_part, NULL) IS NULL),
  CONSTRAINT sections_leading_in_part_mm_whole CHECK (array_position(leading_in_part_mm, NULL) IS NULL),
  CONSTRAINT sections_near_in_part_mm_whole CHECK (array_position(near_in_part_mm, NULL) IS NULL)
) PARTITION BY RANGE (section_measurement_id);
COMMENT ON TABLE sections IS 'The planes of a measurement, in the order asked, and how the outline there looks.';
COMMENT ON COLUMN sections.reference_in_part IS 'Angles are counted from it, in the plane.';
COMMENT ON COLUMN sections.leading_in_part_mm IS 'The leading end is nearer to it; NULL: it comes first along the reference.';
COMMENT ON COLUMN sections.near_in_part_mm IS 'Of several outlines the one nearest to it; NULL: there was one.';
COMMENT ON COLUMN sections.noise_um IS 'Of a point about the outline; NULL, as the next three and the ends: no outline was found, see reason.';
COMMENT ON COLUMN sections.waver_um IS 'Of the outline about a smooth one, over waver_length_mm.';
COMMENT ON COLUMN sections.gap_share IS 'Of the outline''s length, where nothing was seen.';

CREATE TABLE section_values (
  section_measurement_id uuid NOT NULL,
  section_index integer NOT NULL,
  position_index integer NOT NULL,
  parameter text NOT NULL,
  unit text NOT NULL,
  nominal double precision,
  value double precision,
  expanded_uncertainty double precision,
  by_noise double precision,
  by_form double precision,
  by_pose double precision,
  reason text NOT NULL,
  CONSTRAINT section_values_pk PRIMARY KEY (section_measurement_id, section_index, position_index),
  CONSTRAINT section_values_once UNIQUE (section_measurement_id, section_index, parameter),
  CONSTRAINT section_values_section_fk FOREIGN KEY (section_measurement_id, section_index)
    REFERENCES sections (section_measurement_id, position_index),
  CONSTRAINT section_values_position CHECK (position_index BETWEEN 0 AND 99),
  CONSTRAINT section_values_parameter CHECK (parameter ~ '^[A-Z][A-Z_]{1,60}$'),
  CONSTRAINT section_values_unit_known CHECK (unit IN ('MM', 'DEG', 'RATIO')),
  CONSTRAINT section_values_measured_or_not CHECK ((value IS NULL) = (expanded_uncertainty IS NULL) AND (value IS NULL) = (reason <> '')
    AND octet_length(reason) <= 1000),
  CONSTRAINT section_values_in_range CHECK (abs(nominal) < 1e9 AND abs(value) < 1e9 AND expanded_uncertainty >= 0
    AND expanded_uncertainty < 1e9 AND by_noise >= 0 AND by_noise < 1e9 AND by_form >= 0 AND by_form < 1e9 AND by_pose >= 0 AND by_pose < 1e9)
) PARTITION BY RANGE (section_measurement_id);
COMMENT ON TABLE section_values IS 'Each parameter of each section (docs/methods/sections.md), measured or not.';
COMMENT ON COLUMN section_values.unit IS 'Of the numbers of the row.';
COMMENT ON COLUMN section_values.nominal IS 'Of the CAD by the same algorithm; NULL: it has none.';
COMMENT ON COLUMN section_values.value IS 'NULL: not measured, see reason.';
COMMENT ON COLUMN section_values.expanded_uncertainty IS '95 %.';
COMMENT ON COLUMN section_values.by_noise IS 'Standard, as by_form and by_pose; NULL where they are not told apart.';

CREATE TABLE section_outlines (
  section_measurement_id uuid NOT NULL,
  section_index integer NOT NULL,
  part_from_section double precision[] NOT NULL,
  nominal_mm double precision[] NOT NULL,
  measured_mm double precision[] NOT NULL,
  deviations_um double precision[] NOT NULL,
  gaps_before integer[] NOT NULL,
  CONSTRAINT section_outlines_pk PRIMARY KEY (section_measurement_id, section_index),
  CONSTRAINT section_outlines_section_fk FOREIGN KEY (section_measurement_id, section_index)
    REFERENCES sections (section_measurement_id, position_index),
  CONSTRAINT section_outlines_each CHECK (cardinality(part_from_section) = 12 AND cardinality(nominal_mm) BETWEEN 6 AND 2000000
    AND cardinality(nominal_mm) % 2 = 0 AND cardinality(measured_mm) <= 2000000
    AND cardinality(measured_mm) = 2 * cardinality(deviations_um) AND cardinality(gaps_before) <= cardinality(deviations_um)),
  CONSTRAINT section_outlines_part_from_section_whole CHECK (array_position(part_from_section, NULL) IS NULL),
  CONSTRAINT section_outlines_nominal_mm_whole CHECK (array_position(nominal_mm, NULL) IS NULL),
  CONSTRAINT section_outlines_measured_mm_whole CHECK (array_position(measured_mm, NULL) IS NULL),
  CONSTRAINT section_outlines_deviations_um_whole CHECK (array_position(deviations_um, NULL) IS NULL),
  CONSTRAINT section_outlines_gaps_before_whole CHECK (array_position(gaps_before, NULL) IS NULL)
) PARTITION BY RANGE (section_measurement_id);
COMMENT ON TABLE section_outlines IS 'The outlines of a section in its frame, counter-clockwise about the solid.';
COMMENT ON COLUMN section_outlines.part_from_section IS 'The upper three rows of its matrix.';
COMMENT ON COLUMN section_outlines.nominal_mm IS 'x and y in turn, of the CAD; measured_mm as measured: empty where no outline was found.';
COMMENT ON COLUMN section_outlines.deviations_um IS 'Of each measured place from the CAD''s outline, positive outward.';
COMMENT ON COLUMN section_outlines.gaps_before IS 'Measured places before which nothing was seen, from 0 on.';

DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['section_measurements', 'section_measurement_scans', 'sections', 'section_values', 'section_outlines'] LOOP
    PERFORM make_append_only(held::regclass);
    EXECUTE format('GRANT SELECT, INSERT ON %I TO sixpoint_inspection', held);
    EXECUTE format('GRANT SELECT ON %I TO sixpoint_ledger', held);
  END LOOP;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON section_measurements FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();
SELECT make_partitions(3);
-- And the months that inspections have already.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid, partitioned_tables t
WHERE i.inhparent = 'inspections'::regclass AND (t.name LIKE 'section\_%' OR t.name = 'sections');

-- One kind more, as V0028 has it.
DO $$
DECLARE
  held regclass;
  kinds text[] := record_kinds();
BEGIN
  IF cardinality(kinds) < 20 THEN
    RAISE EXCEPTION 'record_entries_kind_known: % kinds, want those that were', cardinality(kinds);
  END IF;
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  EXECUTE format('ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN (%s))',
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || ARRAY['section']) k));
END
$$;

COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment, disposition, machining_model, deviation or section; more may come.';

CREATE VIEW read_v1.sections WITH (security_barrier) AS
  SELECT m.section_measurement_id, m.registration_id, m.blade_serial, m.part_id, m.part_revision, m.machine_id, m.machine_revision,
         n.record_sequence, n.recorded_at, m.method, s.section, s.origin_in_part_mm, s.leading_end, s.trailing_end, v.parameter, v.unit,
         v.nominal, v.value, v.expanded_uncertainty, v.reason
  FROM section_measurements m JOIN record_names n ON n.record_id = m.section_measurement_id
       JOIN sections s ON s.section_measurement_id = m.section_measurement_id
       JOIN section_values v ON v.section_measurement_id = s.section_measurement_id AND v.section_index = s.position_index
  WHERE m.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.sections IS 'Airfoil sections of blades: a row for each parameter of each section.';
COMMENT ON COLUMN read_v1.sections.section_measurement_id IS 'The id in sections/{id}.';
COMMENT ON COLUMN read_v1.sections.registration_id IS 'The pose that it rests on.';
COMMENT ON COLUMN read_v1.sections.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.sections.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.sections.part_revision IS 'The revision whose CAD was cut.';
COMMENT ON COLUMN read_v1.sections.machine_id IS 'On which machine it was scanned.';
COMMENT ON COLUMN read_v1.sections.machine_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.sections.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.sections.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.sections.method IS 'How the scans were positioned.';
COMMENT ON COLUMN read_v1.sections.section IS 'As whoever asked called it.';
COMMENT ON COLUMN read_v1.sections.origin_in_part_mm IS 'A point of its plane: X, Y, Z, millimetres, part frame.';
COMMENT ON COLUMN read_v1.sections.leading_end IS 'ROUND, SQUARE, SHARP or NOT_SEEN; NULL: no outline was found.';
COMMENT ON COLUMN read_v1.sections.trailing_end IS 'As leading_end.';
COMMENT ON COLUMN read_v1.sections.parameter IS 'What, and by which algorithm: CHORD_NOSE_TAIL, THICKNESS_INSCRIBED, ... (docs/methods/sections.md).';
COMMENT ON COLUMN read_v1.sections.unit IS 'MM, DEG or RATIO, of the next three.';
COMMENT ON COLUMN read_v1.sections.nominal IS 'Of the CAD; NULL: it has none.';
COMMENT ON COLUMN read_v1.sections.value IS 'As measured; NULL: not measured.';
COMMENT ON COLUMN read_v1.sections.expanded_uncertainty IS '95 %.';
COMMENT ON COLUMN read_v1.sections.reason IS 'Why it was not measured; else empty.';
GRANT SELECT ON read_v1.sections TO sixpoint_reader;
