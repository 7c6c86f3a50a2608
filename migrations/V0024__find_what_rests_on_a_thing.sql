-- What each entry of the journal rests on, however far back, of what is of no blade: by it a recall over years is found a page at a
-- time. And what an entry says of itself today: its verdict and its state.

-- Of a recorded thing the root is its record_id. Of what is no record of its own (a sensor, a touch probe, a release of the software)
-- it follows from its name.
CREATE FUNCTION root_of(of_name text) RETURNS uuid LANGUAGE sql IMMUTABLE AS $$ SELECT md5(of_name)::uuid $$;
CREATE FUNCTION is_root(of_name text) RETURNS boolean LANGUAGE sql IMMUTABLE AS $$
  SELECT split_part(of_name, '/', 1) IN ('machines', 'artefacts', 'parts', 'calibrations', 'studies')
$$;
COMMENT ON FUNCTION is_root(text) IS
  'Whether what rests on it is kept in record_roots: what is of no blade, and few. What rests on anything else is found by its edges.';

CREATE TABLE record_roots (
  record_id uuid NOT NULL,
  root_id uuid NOT NULL,
  record_sequence bigint NOT NULL,
  kind text NOT NULL,
  CONSTRAINT record_roots_pk PRIMARY KEY (record_id, root_id),
  CONSTRAINT record_roots_kind_named CHECK (kind <> '' AND octet_length(kind) <= 64)
) PARTITION BY RANGE (record_id);
CREATE INDEX record_roots_by_root ON record_roots (root_id, record_sequence);
COMMENT ON TABLE record_roots IS
  'What each entry rests on, directly or not, of what is of no blade. Follows from record_inputs, and is written with them.';
COMMENT ON COLUMN record_roots.root_id IS 'A record_id, or root_of() a name: sensors/SERIAL, probes/SERIAL, software/VERSION.';
COMMENT ON COLUMN record_roots.record_sequence IS 'This and kind as record_entries has them: a recall walks the index in their order.';
SELECT make_append_only('record_roots');
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid,
     (SELECT * FROM partitioned_tables WHERE name = 'record_roots') t
WHERE i.inhparent = 'record_inputs'::regclass;
SELECT make_partitions(3);

-- A scan rests on the sensor that it states, or else its machine's record does; a machine's record on its touch probe, and so does all
-- that rests on the machine.
CREATE FUNCTION roots_of(of_record uuid, of_kind text, of_version text, inputs text[]) RETURNS uuid[]
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT ARRAY(
    SELECT r.root_id FROM record_names n JOIN record_roots r ON r.record_id = n.record_id WHERE n.name = ANY (inputs)
    UNION SELECT n.record_id FROM record_names n WHERE n.name = ANY (inputs) AND is_root(n.name)
    UNION SELECT root_of('software/' || of_version)
    UNION SELECT root_of('sensors/' || coalesce(s.sensor_serial_number, m.sensor_serial_number))
      FROM scans s JOIN machine_revisions m ON m.machine_id = s.machine_id AND m.revision = s.machine_revision
      WHERE of_kind = 'scan' AND s.scan_key = of_record AND coalesce(s.sensor_serial_number, m.sensor_serial_number) IS NOT NULL
    UNION SELECT root_of('probes/' || m.touch_probe_serial_number) FROM machine_revisions m
      WHERE of_kind = 'machine' AND m.record_id = of_record AND m.touch_probe_serial_number IS NOT NULL)
$$;
COMMENT ON FUNCTION roots_of(uuid, text, text, text[]) IS 'What an entry that is made from these inputs rests on. Asked before the journal''s lock.';

-- As V0016 has it, with the roots.
CREATE OR REPLACE FUNCTION append_record(new_id uuid, new_name text, new_kind text, of_blade text, of_machine text, new_method text,
                              new_version text, asked_by text, new_measured_at timestamptz, new_summary jsonb, inputs text[],
                              of_call text, of_request uuid, of_request_sha256 bytea, of_trace text DEFAULT NULL,
                              OUT new_sequence bigint, OUT new_recorded_at timestamptz, OUT edge_count bigint)
LANGUAGE plpgsql AS $$
DECLARE
  asker text := pseudonym_of(asked_by);
  roots uuid[] := roots_of(new_id, new_kind, new_version, inputs);
BEGIN
  PERFORM pg_advisory_xact_lock(6021, 1);
  INSERT INTO record_names (record_id, name) VALUES (new_id, new_name)
    RETURNING record_sequence, recorded_at INTO new_sequence, new_recorded_at;
  INSERT INTO record_entries (record_id, record_sequence, recorded_at, kind, blade_serial, machine_id, method,
                              software_version, requested_by, measured_at, summary, trace_id)
    VALUES (new_id, new_sequence, new_recorded_at, new_kind, of_blade, of_machine, new_method, new_version, asker,
            new_measured_at, new_summary, of_trace);
  INSERT INTO record_inputs (record_id, position_index, input_id)
    SELECT new_id, (position - 1)::integer, n.record_id FROM unnest(inputs) WITH ORDINALITY AS input (name, position)
    JOIN record_names n ON n.name = input.name;
  GET DIAGNOSTICS edge_count = ROW_COUNT;
  INSERT INTO record_roots (record_id, root_id, record_sequence, kind)
    SELECT new_id, root, new_sequence, new_kind FROM unnest(roots) AS root;
  IF of_request IS NOT NULL THEN
    INSERT INTO requests (call, request_id, request_sha256, record_id)
      VALUES (of_call, of_request, of_request_sha256, new_id);
  END IF;
END
$$;

-- What was recorded before, in its order: each after what it was made from.
DO $$
DECLARE
  e record;
BEGIN
  FOR e IN SELECT record_id, record_sequence, kind, software_version FROM record_entries ORDER BY record_sequence LOOP
    INSERT INTO record_roots (record_id, root_id, record_sequence, kind)
      SELECT e.record_id, root, e.record_sequence, e.kind FROM unnest(roots_of(e.record_id, e.kind, e.software_version,
        ARRAY(SELECT n.name FROM record_inputs i JOIN record_names n ON n.record_id = i.input_id
              WHERE i.record_id = e.record_id))) AS root;
  END LOOP;
END
$$;

-- A span of time is one of the journal's order: from the first entry recorded at its beginning or later.
CREATE INDEX record_names_by_time ON record_names (recorded_at);

-- As StateOf() in storage/calibration_state.cc has it, by the events and the moment.
CREATE FUNCTION calibration_state(of_calibration uuid, at timestamptz) RETURNS text
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT CASE
    WHEN EXISTS (SELECT 1 FROM calibration_events w WHERE w.calibration_id = c.calibration_id AND w.event = 'WITHDRAWN')
      THEN 'WITHDRAWN'
    WHEN c.is_draft AND NOT EXISTS (SELECT 1 FROM calibration_events r WHERE r.calibration_id = c.calibration_id
                                    AND r.event = 'RELEASED') THEN 'DRAFT'
    WHEN at < c.valid_from THEN 'NOT_YET_VALID' WHEN at >= c.valid_until THEN 'EXPIRED'
    WHEN c.calibration_id = (SELECT f.calibration_id FROM calibration_forces f WHERE f.machine_id = c.machine_id
                             AND f.kind = c.kind AND f.axis = coalesce(c.axis, '') AND f.valid_from <= at AND at < f.valid_until
                             ORDER BY f.force_sequence DESC LIMIT 1) THEN 'IN_FORCE'
    ELSE 'SUPERSEDED' END
  FROM calibrations c WHERE c.calibration_id = of_calibration
$$;

-- What is soon told first, in the order of correction_states; that view tells the rest, which is what may still be used.
CREATE FUNCTION correction_state(of_correction uuid) RETURNS text
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  IF EXISTS (SELECT 1 FROM correction_events r WHERE r.correction_id = of_correction AND r.event = 'REFUSED') THEN
    RETURN 'REFUSED';
  END IF;
  IF EXISTS (SELECT 1 FROM record_roots r JOIN calibration_events w ON w.calibration_id = r.root_id AND w.event = 'WITHDRAWN'
             WHERE r.record_id = of_correction) THEN
    RETURN 'WITHDRAWN';
  END IF;
  IF EXISTS (SELECT 1 FROM corrections c WHERE c.correction_id = of_correction AND c.valid_until <= statement_timestamp())
     AND (SELECT count(*) FROM correction_cuts k WHERE k.correction_id = of_correction)
       < (SELECT count(*) FROM correction_holes h WHERE h.correction_id = of_correction) THEN
    RETURN 'EXPIRED';
  END IF;
  RETURN (SELECT s.state FROM correction_states s WHERE s.correction_id = of_correction);
END
$$;
COMMENT ON FUNCTION correction_state(uuid) IS 'correction_states of one, a hundred times sooner where it can no longer be used.';

CREATE FUNCTION record_verdict(of_record uuid, of_kind text) RETURNS text
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  RETURN CASE of_kind
    WHEN 'inspection' THEN (SELECT i.verdict FROM inspections i WHERE i.inspection_id = of_record)
    WHEN 'registration' THEN (SELECT r.outcome FROM registrations r WHERE r.registration_id = of_record)
    WHEN 'study' THEN (SELECT s.verdict FROM studies s WHERE s.study_id = of_record) END;
END
$$;
COMMENT ON FUNCTION record_verdict(uuid, text) IS 'Of inspections, registrations (their outcome) and studies; NULL: none.';

CREATE FUNCTION record_state(of_record uuid, of_kind text) RETURNS text
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  RETURN CASE of_kind
    WHEN 'calibration' THEN calibration_state(of_record, statement_timestamp())
    WHEN 'correction' THEN correction_state(of_record)
    WHEN 'scan' THEN CASE WHEN EXISTS (SELECT 1 FROM scan_deletions d WHERE d.scan_key = of_record) THEN 'POINTS_DELETED'
                          WHEN EXISTS (SELECT 1 FROM scans s WHERE s.scan_key = of_record) THEN 'KEPT' END END;
END
$$;
COMMENT ON FUNCTION record_state(uuid, text) IS 'Now, of calibrations, corrections and scans; NULL: none.';

-- Sensors, probes and releases of the software are of no part, as machines are.
CREATE OR REPLACE FUNCTION parts_of(of_name text) RETURNS text[]
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  collection text := split_part(of_name, '/', 1);
  id text := substr(of_name, length(collection) + 2);
BEGIN
  CASE collection
    WHEN 'parts' THEN
      RETURN (SELECT ARRAY[p.part_id] FROM parts p WHERE p.part_id = split_part(id, '@', 1));
    WHEN 'blades' THEN
      RETURN (SELECT ARRAY[b.part_id] FROM blades b WHERE b.blade_serial = id);
    WHEN 'machines' THEN
      RETURN (SELECT '{}'::text[] FROM machines m WHERE m.machine_id = split_part(id, '@', 1));
    WHEN 'artefacts' THEN
      RETURN (SELECT '{}'::text[] FROM artefacts a WHERE a.artefact_id = split_part(id, '@', 1));
    WHEN 'sensors', 'probes', 'software' THEN
      RETURN '{}'::text[];
    ELSE
      RETURN (SELECT parts_of_record(n.record_id) FROM record_names n WHERE n.name = of_name);
  END CASE;
END
$$;

DO $$
DECLARE
  area text;
BEGIN
  FOREACH area IN ARRAY ARRAY['plant', 'ingest', 'calibration', 'registration', 'correction', 'inspection'] LOOP
    EXECUTE format('GRANT SELECT, INSERT ON record_roots TO %I', 'sixpoint_' || area);
  END LOOP;
END
$$;
