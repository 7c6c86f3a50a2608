-- What other instruments measured of blades, as their files have it, by a drawing's characteristics.

CREATE TABLE measurements (
  measurement_id uuid NOT NULL,
  import_id uuid NOT NULL,
  import_index integer NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  drawing_id text COLLATE "C" NOT NULL,
  drawing_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  instrument_kind text NOT NULL,
  instrument_manufacturer text NOT NULL,
  instrument_model text NOT NULL,
  instrument_serial_number text NOT NULL,
  instrument_certificate text,
  measured_at timestamptz NOT NULL,
  file_format text NOT NULL,
  file_sha256 bytea NOT NULL,
  lengths_expanded_uncertainty_um double precision,
  angles_expanded_uncertainty_deg double precision,
  uncertainty_basis text,
  value_count integer NOT NULL,
  measured_count integer NOT NULL,
  left_out text[] NOT NULL,
  left_out_count integer NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  CONSTRAINT measurements_pk PRIMARY KEY (measurement_id),
  CONSTRAINT measurements_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT measurements_drawing_fk FOREIGN KEY (drawing_id, drawing_revision, part_id)
    REFERENCES drawing_revisions (drawing_id, revision, part_id),
  CONSTRAINT measurements_record_fk FOREIGN KEY (measurement_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT measurements_import_index CHECK (import_index BETWEEN 0 AND 199),
  CONSTRAINT measurements_instrument_known CHECK (octet_length(instrument_kind) <= 64
    AND instrument_kind IN ('CMM', 'OPTICAL', 'CT', 'GAUGE', 'FLOW_BENCH', 'OTHER')),
  CONSTRAINT measurements_format_known CHECK (octet_length(file_format) <= 64 AND file_format IN ('QIF', 'AQDEF', 'CSV')),
  CONSTRAINT measurements_measured_finite CHECK (isfinite(measured_at)),
  CONSTRAINT measurements_digest CHECK (octet_length(file_sha256) = 32),
  CONSTRAINT measurements_uncertainty CHECK (lengths_expanded_uncertainty_um > 0 AND lengths_expanded_uncertainty_um <= 1000
    AND angles_expanded_uncertainty_deg > 0 AND angles_expanded_uncertainty_deg <= 10),
  CONSTRAINT measurements_uncertainty_whole CHECK ((uncertainty_basis IS NULL)
    = (lengths_expanded_uncertainty_um IS NULL AND angles_expanded_uncertainty_deg IS NULL)),
  CONSTRAINT measurements_counts CHECK (value_count BETWEEN 1 AND 4000 AND measured_count BETWEEN 0 AND value_count
    AND left_out_count BETWEEN 0 AND 1000000),
  CONSTRAINT measurements_left_out CHECK (cardinality(left_out) <= 200 AND cardinality(left_out) <= left_out_count
    AND octet_length(array_to_string(left_out, '')) <= 200 * 200),
  CONSTRAINT measurements_left_out_whole CHECK (array_position(left_out, NULL) IS NULL),
  CONSTRAINT measurements_texts CHECK (octet_length(instrument_manufacturer) BETWEEN 1 AND 200
    AND octet_length(instrument_model) BETWEEN 1 AND 200 AND octet_length(instrument_serial_number) BETWEEN 1 AND 64
    AND octet_length(instrument_certificate) BETWEEN 1 AND 200 AND octet_length(uncertainty_basis) BETWEEN 1 AND 200
    AND octet_length(requested_by) BETWEEN 1 AND 200 AND octet_length(software_version) BETWEEN 1 AND 200)
) PARTITION BY RANGE (measurement_id);
CREATE INDEX measurements_by_import ON measurements (import_id);
CREATE INDEX measurements_by_instrument ON measurements (instrument_serial_number);
COMMENT ON TABLE measurements IS 'What one file of another instrument has of one blade: measurements/{id}.';
COMMENT ON COLUMN measurements.import_id IS 'The id of the first measurement of the same import: all of a file are recorded at once.';
COMMENT ON COLUMN measurements.import_index IS 'Its place in the import, from 0 on.';
COMMENT ON COLUMN measurements.instrument_certificate IS 'Number of its calibration certificate; NULL: none was told.';
COMMENT ON COLUMN measurements.measured_at IS 'By the file, or as it was stated; of several moments the last.';
COMMENT ON COLUMN measurements.lengths_expanded_uncertainty_um IS '95 %, stated for lengths whose file states none; NULL: none was.';
COMMENT ON COLUMN measurements.angles_expanded_uncertainty_deg IS 'As lengths_expanded_uncertainty_um, of angles.';
COMMENT ON COLUMN measurements.left_out IS 'Characteristics of the file that the drawing does not have: as far as there is room.';

CREATE TABLE measurement_values (
  measurement_id uuid NOT NULL,
  position_index integer NOT NULL,
  characteristic text NOT NULL,
  feature text NOT NULL,
  unit text NOT NULL,
  zone text,
  value double precision,
  expanded_uncertainty double precision,
  reason text NOT NULL,
  CONSTRAINT measurement_values_pk PRIMARY KEY (measurement_id, position_index),
  CONSTRAINT measurement_values_once UNIQUE (measurement_id, characteristic, feature),
  CONSTRAINT measurement_values_measurement_fk FOREIGN KEY (measurement_id) REFERENCES measurements (measurement_id),
  CONSTRAINT measurement_values_position CHECK (position_index BETWEEN 0 AND 3999),
  CONSTRAINT measurement_values_texts CHECK (octet_length(characteristic) BETWEEN 1 AND 64 AND octet_length(feature) <= 200
    AND octet_length(reason) <= 1000),
  CONSTRAINT measurement_values_unit_known CHECK (octet_length(unit) <= 64 AND unit IN ('MM', 'UM', 'DEG', 'RATIO')),
  CONSTRAINT measurement_values_zone_known CHECK (octet_length(zone) <= 64 AND zone IN ('RADIUS', 'HALF_WIDTH', 'BORDERS')),
  CONSTRAINT measurement_values_measured_or_not CHECK ((value IS NULL) = (reason <> '') AND (value IS NOT NULL OR expanded_uncertainty IS NULL)),
  CONSTRAINT measurement_values_in_range CHECK (abs(value) < 1e9 AND expanded_uncertainty >= 0 AND expanded_uncertainty < 1e9),
  CONSTRAINT measurement_values_never_negative CHECK (zone = 'BORDERS' OR zone IS NULL OR value >= 0)
) PARTITION BY RANGE (measurement_id);
COMMENT ON TABLE measurement_values IS 'The values of a measurement, in the drawing''s order.';
COMMENT ON COLUMN measurement_values.characteristic IS 'Its balloon''s number.';
COMMENT ON COLUMN measurement_values.feature IS 'A hole, "h3", or two, "h3 to h4", of its hole group; empty: it is at one place.';
COMMENT ON COLUMN measurement_values.unit IS 'Of value and uncertainty: the drawing''s.';
COMMENT ON COLUMN measurement_values.zone IS 'What the value is the size of: a file''s diameters and widths are halved; NULL: it is no zone''s.';
COMMENT ON COLUMN measurement_values.value IS 'NULL: not measured, see reason.';
COMMENT ON COLUMN measurement_values.expanded_uncertainty IS '95 %; NULL: none is stated.';

DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['measurements', 'measurement_values'] LOOP
    PERFORM make_append_only(held::regclass);
    EXECUTE format('GRANT SELECT, INSERT ON %I TO sixpoint_inspection', held);
    EXECUTE format('GRANT SELECT ON %I TO sixpoint_ledger', held);
  END LOOP;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON measurements FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();
SELECT make_partitions(3);
-- And the months that inspections have already.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid, partitioned_tables t
WHERE i.inhparent = 'inspections'::regclass AND t.name IN ('measurements', 'measurement_values');

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
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || ARRAY['measurement']) k));
END
$$;

COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment, disposition, machining_model, deviation, section, drawing, assessment or measurement; more may come.';

CREATE VIEW read_v1.measurements WITH (security_barrier) AS
  SELECT m.measurement_id, m.blade_serial, m.part_id, m.drawing_id, m.drawing_revision, n.record_sequence, n.recorded_at, m.measured_at,
         m.instrument_kind, m.instrument_manufacturer, m.instrument_model, m.instrument_serial_number, m.file_format,
         encode(m.file_sha256, 'hex') AS file_sha256, v.characteristic, v.feature, v.unit, v.zone, v.value, v.expanded_uncertainty, v.reason
  FROM measurements m JOIN record_names n ON n.record_id = m.measurement_id
       JOIN measurement_values v ON v.measurement_id = m.measurement_id
  WHERE m.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.measurements IS 'What other instruments measured of blades: a row for each value.';
COMMENT ON COLUMN read_v1.measurements.measurement_id IS 'The id in measurements/{id}: what one file has of one blade.';
COMMENT ON COLUMN read_v1.measurements.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.measurements.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.measurements.drawing_id IS 'Whose characteristics they are.';
COMMENT ON COLUMN read_v1.measurements.drawing_revision IS 'Of which of its revisions.';
COMMENT ON COLUMN read_v1.measurements.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.measurements.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.measurements.measured_at IS 'When it was measured, by the file or as whoever imported it stated.';
COMMENT ON COLUMN read_v1.measurements.instrument_kind IS 'CMM, OPTICAL, CT, GAUGE, FLOW_BENCH or OTHER; more may come.';
COMMENT ON COLUMN read_v1.measurements.instrument_manufacturer IS 'Of the instrument, as the next two.';
COMMENT ON COLUMN read_v1.measurements.instrument_model IS 'As its maker calls it.';
COMMENT ON COLUMN read_v1.measurements.instrument_serial_number IS 'Which of them.';
COMMENT ON COLUMN read_v1.measurements.file_format IS 'QIF, AQDEF or CSV.';
COMMENT ON COLUMN read_v1.measurements.file_sha256 IS 'Of the file, hexadecimal.';
COMMENT ON COLUMN read_v1.measurements.characteristic IS 'Its balloon''s number on the drawing.';
COMMENT ON COLUMN read_v1.measurements.feature IS 'A hole, or two of a pitch ("h3 to h4"); empty: it is at one place.';
COMMENT ON COLUMN read_v1.measurements.unit IS 'MM, UM, DEG or RATIO, of the value and its uncertainty.';
COMMENT ON COLUMN read_v1.measurements.zone IS 'What the value is the size of: RADIUS, HALF_WIDTH or BORDERS; NULL: it is no zone''s.';
COMMENT ON COLUMN read_v1.measurements.value IS 'As measured; NULL: not measured.';
COMMENT ON COLUMN read_v1.measurements.expanded_uncertainty IS '95 %; NULL: none is stated.';
COMMENT ON COLUMN read_v1.measurements.reason IS 'Why it was not measured; else empty.';
GRANT SELECT ON read_v1.measurements TO sixpoint_reader;
