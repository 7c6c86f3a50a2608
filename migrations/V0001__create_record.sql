-- The ground that every area builds on: names, the journal of everything recorded, kept requests, and how tables grow by months.
-- All of it is append-only: a correction is a new row, never a changed one.

CREATE FUNCTION refuse_change() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  RAISE EXCEPTION '% on %: rows are append-only, want a new row', TG_OP, TG_TABLE_NAME
    USING ERRCODE = 'restrict_violation';
END
$$;

CREATE FUNCTION make_append_only(held_by regclass) RETURNS void LANGUAGE plpgsql AS $$
BEGIN
  EXECUTE format('CREATE TRIGGER append_only BEFORE UPDATE OR DELETE ON %s FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()',
                 held_by);
  EXECUTE format('CREATE TRIGGER no_truncate BEFORE TRUNCATE ON %s FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()',
                 held_by);
END
$$;
COMMENT ON FUNCTION make_append_only(regclass) IS
  'For every append-only table, and for every partition of one: a statement that names the partition meets only its own triggers.';

-- Three finite values: a position in mm, or a direction. Of NULL elements none: compared with anything they give NULL, which a
-- CHECK lets pass.
CREATE FUNCTION is_triple(v double precision[]) RETURNS boolean LANGUAGE sql IMMUTABLE AS $$
  SELECT v IS NULL OR coalesce(cardinality(v) = 3 AND array_ndims(v) = 1 AND abs(v[1]) < 1e7 AND abs(v[2]) < 1e7
                               AND abs(v[3]) < 1e7, false)
$$;
CREATE FUNCTION is_unit(v double precision[]) RETURNS boolean LANGUAGE sql IMMUTABLE AS $$
  SELECT v IS NULL OR (is_triple(v) AND abs(sqrt(v[1] * v[1] + v[2] * v[2] + v[3] * v[3]) - 1) <= 1e-6)
$$;

CREATE SEQUENCE record_sequence AS bigint;
COMMENT ON SEQUENCE record_sequence IS
  'Orders all events of the plant. Drawn under the journal''s lock; a rolled-back transaction leaves a gap.';

CREATE TABLE record_names (
  record_id uuid NOT NULL,
  name text COLLATE "C" NOT NULL,
  record_sequence bigint NOT NULL DEFAULT nextval('record_sequence'),
  recorded_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT record_names_pk PRIMARY KEY (record_id),
  CONSTRAINT record_names_once UNIQUE (name),
  CONSTRAINT record_names_sequence_once UNIQUE (record_sequence),
  CONSTRAINT record_names_sequence_positive CHECK (record_sequence > 0),
  CONSTRAINT record_names_form CHECK (name ~ '^[a-z]+/[A-Za-z0-9._-]{1,64}(@[0-9]{1,9})?$')
);
COMMENT ON TABLE record_names IS
  'What each recorded thing is called, and when it was recorded. Stays whole where months of the rest are detached: names are '
  'given once for ever, and what refers to a thing of another month refers to its row here.';
COMMENT ON COLUMN record_names.record_id IS 'UUID of version 7: time-ordered. Of a result it is the id in its name.';
COMMENT ON COLUMN record_names.name IS 'Resource name; machines, artefacts and parts with @revision.';
COMMENT ON COLUMN record_names.record_sequence IS
  'Order of commit: assigned under a lock held until commit, so a reader by cursor never misses a row.';
COMMENT ON COLUMN record_names.recorded_at IS 'The database''s clock when the row was written.';

CREATE TABLE record_entries (
  record_id uuid NOT NULL,
  record_sequence bigint NOT NULL,
  kind text NOT NULL,
  blade_serial text COLLATE "C",
  machine_id text COLLATE "C",
  method text NOT NULL,
  software_version text NOT NULL,
  requested_by text NOT NULL,
  measured_at timestamptz,
  summary jsonb NOT NULL,
  recorded_at timestamptz NOT NULL,
  CONSTRAINT record_entries_pk PRIMARY KEY (record_id),
  CONSTRAINT record_entries_name_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id),
  CONSTRAINT record_entries_kind_known CHECK (kind IN ('machine', 'artefact', 'part', 'blade', 'scan', 'calibration',
    'registration', 'correction', 'inspection', 'deletion', 'release', 'withdrawal', 'study', 'policy')),
  CONSTRAINT record_entries_software_named CHECK (software_version <> ''),
  CONSTRAINT record_entries_measured_finite CHECK (isfinite(measured_at)),
  CONSTRAINT record_entries_summary_object CHECK (jsonb_typeof(summary) = 'object'),
  CONSTRAINT record_entries_summary_size CHECK (pg_column_size(summary) <= 20000),
  CONSTRAINT record_entries_texts CHECK (octet_length(blade_serial) <= 64 AND octet_length(machine_id) <= 64
    AND octet_length(method) <= 64 AND octet_length(software_version) <= 200 AND octet_length(requested_by) <= 200)
) PARTITION BY RANGE (record_id);
CREATE INDEX record_entries_by_kind ON record_entries (kind, record_sequence);
CREATE INDEX record_entries_by_blade ON record_entries (blade_serial, record_sequence) WHERE blade_serial IS NOT NULL;
CREATE INDEX record_entries_by_machine ON record_entries (machine_id, record_sequence) WHERE machine_id IS NOT NULL;
COMMENT ON TABLE record_entries IS
  'The journal: one row for each stored thing, written last in the transaction that stores it, for the lock of its order.';
COMMENT ON COLUMN record_entries.record_sequence IS 'This and recorded_at as record_names has them: lists find and sort by them.';
COMMENT ON COLUMN record_entries.measured_at IS 'The device''s clock, where there is one.';
COMMENT ON COLUMN record_entries.summary IS 'A few figures that a reader wants at once; the result itself is in its own table.';

CREATE VIEW recorded AS
  SELECT record_id, record_sequence, recorded_at, kind AS entry_kind, blade_serial AS entry_blade, machine_id AS entry_machine
  FROM record_entries;
COMMENT ON VIEW recorded IS
  'When each thing was recorded and whom it concerns, to be joined with the results that are kept by months.';

CREATE TABLE record_inputs (
  record_id uuid NOT NULL,
  position_index integer NOT NULL,
  input_id uuid NOT NULL,
  CONSTRAINT record_inputs_pk PRIMARY KEY (record_id, position_index),
  CONSTRAINT record_inputs_once UNIQUE (record_id, input_id),
  CONSTRAINT record_inputs_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id),
  CONSTRAINT record_inputs_input_fk FOREIGN KEY (input_id) REFERENCES record_names (record_id),
  CONSTRAINT record_inputs_position_from_zero CHECK (position_index >= 0)
) PARTITION BY RANGE (record_id);
CREATE INDEX record_inputs_by_input ON record_inputs (input_id, record_id);
COMMENT ON TABLE record_inputs IS 'Edges: what each recorded thing was made from. Followed from input to entry for recall.';

CREATE TABLE requests (
  recorded_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  call text COLLATE "C" NOT NULL,
  request_id uuid NOT NULL,
  request_sha256 bytea NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT requests_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT requests_call_named CHECK (call <> '' AND octet_length(call) <= 64),
  CONSTRAINT requests_digests CHECK (octet_length(request_sha256) = 32)
) PARTITION BY RANGE (recorded_at);
CREATE INDEX requests_by_id ON requests (request_id, call);
COMMENT ON TABLE requests IS
  'What each request recorded, for safe retries: the same request_id gets the same thing and does the work once. Of a call and '
  'id there is one row (by a lock, for a key across months cannot be held unique); months that are over go.';

-- Name, entry, edges and request of a thing whose own rows have been written. Numbers of a sequence are drawn in one order and committed
-- in another: a reader that has seen 8 would never look for the 7 that commits later. The lock is held from the draw to the end of the
-- transaction, which makes the orders the same; so this comes last before the commit. One call, with plans that stay: while it runs,
-- other writers wait. edge_count: how many of the inputs are recorded.
CREATE FUNCTION append_record(new_id uuid, new_name text, new_kind text, of_blade text, of_machine text, new_method text,
                              new_version text, asked_by text, new_measured_at timestamptz, new_summary jsonb, inputs text[],
                              of_call text, of_request uuid, of_request_sha256 bytea,
                              OUT new_sequence bigint, OUT new_recorded_at timestamptz, OUT edge_count bigint)
LANGUAGE plpgsql AS $$
BEGIN
  PERFORM pg_advisory_xact_lock(6021, 1);
  INSERT INTO record_names (record_id, name) VALUES (new_id, new_name)
    RETURNING record_sequence, recorded_at INTO new_sequence, new_recorded_at;
  INSERT INTO record_entries (record_id, record_sequence, recorded_at, kind, blade_serial, machine_id, method,
                              software_version, requested_by, measured_at, summary)
    VALUES (new_id, new_sequence, new_recorded_at, new_kind, of_blade, of_machine, new_method, new_version, asked_by,
            new_measured_at, new_summary);
  INSERT INTO record_inputs (record_id, position_index, input_id)
    SELECT new_id, (position - 1)::integer, n.record_id FROM unnest(inputs) WITH ORDINALITY AS input (name, position)
    JOIN record_names n ON n.name = input.name;
  GET DIAGNOSTICS edge_count = ROW_COUNT;
  IF of_request IS NOT NULL THEN
    INSERT INTO requests (call, request_id, request_sha256, record_id)
      VALUES (of_call, of_request, of_request_sha256, new_id);
  END IF;
END
$$;

SELECT make_append_only('record_names');
SELECT make_append_only('record_entries');
SELECT make_append_only('record_inputs');
SELECT make_append_only('requests');
