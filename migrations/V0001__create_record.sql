-- The ground that every area builds on: content-addressed bytes, the journal of everything recorded, kept answers.
-- All of it is append-only: a correction is a new row, never a changed one.

CREATE FUNCTION refuse_change() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  RAISE EXCEPTION '% on %: rows are append-only, want a new row', TG_OP, TG_TABLE_NAME
    USING ERRCODE = 'restrict_violation';
END
$$;
COMMENT ON FUNCTION refuse_change() IS
  'Attach twice to every append-only table: BEFORE UPDATE OR DELETE and BEFORE TRUNCATE, both FOR EACH STATEMENT.';

CREATE TABLE blobs (
  sha256 text COLLATE "C" NOT NULL,
  size_bytes bigint NOT NULL,
  bytes bytea NOT NULL,
  stored_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT blobs_pk PRIMARY KEY (sha256),
  CONSTRAINT blobs_sha256_hex CHECK (sha256 ~ '^[0-9a-f]{64}$'),
  CONSTRAINT blobs_size_true CHECK (size_bytes = octet_length(bytes))
);
-- EXTERNAL: clouds and meshes are compressed already; do not spend time on compressing them again.
ALTER TABLE blobs ALTER COLUMN bytes SET STORAGE EXTERNAL;
COMMENT ON TABLE blobs IS 'Bytes named by their SHA-256: scan blocks, meshes, CAD files, NC programs. The same bytes are one row.';
COMMENT ON COLUMN blobs.sha256 IS 'SHA-256 of bytes, lower-case hexadecimal; checked again on every read.';

CREATE SEQUENCE record_sequence AS bigint;
COMMENT ON SEQUENCE record_sequence IS 'Orders all events of the plant. Drawn under the journal lock; a rolled-back transaction leaves a gap.';

CREATE TABLE record_entries (
  record_sequence bigint NOT NULL DEFAULT nextval('record_sequence'),
  kind text NOT NULL,
  name text COLLATE "C" NOT NULL,
  blade_serial text COLLATE "C",
  machine_id text COLLATE "C",
  method text NOT NULL DEFAULT '',
  software_version text NOT NULL,
  requested_by text NOT NULL DEFAULT '',
  measured_at timestamptz,
  recorded_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  summary jsonb NOT NULL DEFAULT '{}',
  CONSTRAINT record_entries_pk PRIMARY KEY (record_sequence),
  CONSTRAINT record_entries_name_unique UNIQUE (name),
  CONSTRAINT record_entries_sequence_positive CHECK (record_sequence > 0),
  CONSTRAINT record_entries_kind_known CHECK (kind IN ('machine', 'artefact', 'part', 'blade', 'scan', 'calibration',
                                                       'registration', 'correction', 'inspection')),
  CONSTRAINT record_entries_name_form CHECK (name ~ '^[a-z]+/[A-Za-z0-9._-]{1,64}(@[0-9]{1,9})?$'),
  CONSTRAINT record_entries_software_named CHECK (software_version <> ''),
  CONSTRAINT record_entries_measured_finite CHECK (isfinite(measured_at)),
  CONSTRAINT record_entries_summary_object CHECK (jsonb_typeof(summary) = 'object')
);
CREATE INDEX record_entries_by_blade ON record_entries (blade_serial, record_sequence) WHERE blade_serial IS NOT NULL;
CREATE INDEX record_entries_by_machine ON record_entries (machine_id, record_sequence) WHERE machine_id IS NOT NULL;
COMMENT ON TABLE record_entries IS
  'The journal: one row for each stored thing, written in the transaction that stores it.';
COMMENT ON COLUMN record_entries.record_sequence IS
  'Order of commit: assigned under a lock held until commit, so a reader by cursor never misses a row.';
COMMENT ON COLUMN record_entries.name IS 'Resource name; machines, artefacts and parts with @revision.';
COMMENT ON COLUMN record_entries.measured_at IS 'The device''s clock, where there is one.';
COMMENT ON COLUMN record_entries.recorded_at IS 'The database''s clock when the row was written.';
COMMENT ON COLUMN record_entries.summary IS 'A few figures that a reader wants at once; the result itself is in its own table.';

CREATE TABLE record_inputs (
  record_sequence bigint NOT NULL,
  position_index integer NOT NULL,
  input_name text COLLATE "C" NOT NULL,
  CONSTRAINT record_inputs_pk PRIMARY KEY (record_sequence, position_index),
  CONSTRAINT record_inputs_once UNIQUE (record_sequence, input_name),
  CONSTRAINT record_inputs_entry_fk FOREIGN KEY (record_sequence) REFERENCES record_entries (record_sequence),
  CONSTRAINT record_inputs_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT record_inputs_name_form CHECK (input_name ~ '^[a-z]+/[A-Za-z0-9._-]{1,64}(@[0-9]{1,9})?$')
);
CREATE INDEX record_inputs_by_input ON record_inputs (input_name, record_sequence);
COMMENT ON TABLE record_inputs IS 'Edges: what each recorded thing was made from. Followed from input to entry for recall.';

CREATE TABLE requests (
  method text COLLATE "C" NOT NULL,
  request_id text COLLATE "C" NOT NULL,
  request_sha256 text COLLATE "C" NOT NULL,
  response bytea NOT NULL,
  recorded_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT requests_pk PRIMARY KEY (method, request_id),
  CONSTRAINT requests_id_given CHECK (request_id <> ''),
  CONSTRAINT requests_sha256_hex CHECK (request_sha256 ~ '^[0-9a-f]{64}$')
);
COMMENT ON TABLE requests IS 'Answers kept for safe retries: the same request_id gets the same answer and does the work once.';

CREATE TRIGGER blobs_append_only BEFORE UPDATE OR DELETE ON blobs FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER blobs_no_truncate BEFORE TRUNCATE ON blobs FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER record_entries_append_only BEFORE UPDATE OR DELETE ON record_entries
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER record_entries_no_truncate BEFORE TRUNCATE ON record_entries
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER record_inputs_append_only BEFORE UPDATE OR DELETE ON record_inputs
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER record_inputs_no_truncate BEFORE TRUNCATE ON record_inputs
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER requests_append_only BEFORE UPDATE OR DELETE ON requests FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER requests_no_truncate BEFORE TRUNCATE ON requests FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
