-- The ledger: a Merkle tree (RFC 9162) over the journal's entries and the digests of their rows, sealed behind the writes, whose heads are
-- signed by a key that no role of the database has (docs/ledger.md, ADR 43). What is changed in the database afterwards, by whomever, no
-- longer fits to the leaves, or the leaves no longer to the heads that were sent out.

-- One for each entry, in the journal's order. Stays whole where months are detached, as record_names does: without the leaf of an entry
-- no root could be told again.
CREATE TABLE ledger_leaves (
  leaf_index bigint NOT NULL,
  record_sequence bigint NOT NULL,
  record_id uuid NOT NULL,
  format smallint NOT NULL,
  name_sha256 bytea NOT NULL,
  content_sha256 bytea NOT NULL,
  CONSTRAINT ledger_leaves_pk PRIMARY KEY (leaf_index),
  CONSTRAINT ledger_leaves_sequence_once UNIQUE (record_sequence),
  CONSTRAINT ledger_leaves_record_once UNIQUE (record_id),
  CONSTRAINT ledger_leaves_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id),
  CONSTRAINT ledger_leaves_index_from_zero CHECK (leaf_index >= 0),
  CONSTRAINT ledger_leaves_sequence_positive CHECK (record_sequence > 0),
  CONSTRAINT ledger_leaves_format_positive CHECK (format > 0),
  CONSTRAINT ledger_leaves_digests CHECK (octet_length(name_sha256) = 32 AND octet_length(content_sha256) = 32)
);
COMMENT ON TABLE ledger_leaves IS
  'The leaves of the ledger''s tree: what an entry of the journal was when it was sealed. By a few seconds later than the entry.';
COMMENT ON COLUMN ledger_leaves.format IS 'By which rules the leaf was made (docs/ledger.md).';
COMMENT ON COLUMN ledger_leaves.name_sha256 IS 'Of the text of its row of record_names.';
COMMENT ON COLUMN ledger_leaves.content_sha256 IS 'Of its text in ledger_contents.';

CREATE TABLE ledger_contents (
  record_id uuid NOT NULL,
  content text NOT NULL,
  CONSTRAINT ledger_contents_pk PRIMARY KEY (record_id),
  CONSTRAINT ledger_contents_size CHECK (octet_length(content) <= 20000)
);
COMMENT ON TABLE ledger_contents IS
  'How many rows of which tables belong to an entry, and their digest: by it a change is found, and told of which table. Not by months, '
  'though it grows with each blade: where a month is detached, rows of other tables stay, and nothing else says what they were.';

-- Subtrees that are complete, from 256 leaves on: by them a root or a path is told without reading all leaves.
CREATE TABLE ledger_nodes (
  level smallint NOT NULL,
  node_index bigint NOT NULL,
  hash bytea NOT NULL,
  CONSTRAINT ledger_nodes_pk PRIMARY KEY (level, node_index),
  CONSTRAINT ledger_nodes_level CHECK (level BETWEEN 8 AND 62),
  CONSTRAINT ledger_nodes_index_from_zero CHECK (node_index >= 0),
  CONSTRAINT ledger_nodes_digests CHECK (octet_length(hash) = 32)
);
COMMENT ON TABLE ledger_nodes IS 'Roots of complete subtrees of 2^level leaves. They follow from ledger_leaves.';

CREATE TABLE ledger_heads (
  tree_size bigint NOT NULL,
  root_sha256 bytea NOT NULL,
  record_sequence bigint NOT NULL,
  signed_at timestamptz NOT NULL,
  key_id text COLLATE "C" NOT NULL,
  signature bytea NOT NULL,
  public_key text NOT NULL,
  CONSTRAINT ledger_heads_pk PRIMARY KEY (tree_size),
  CONSTRAINT ledger_heads_size_positive CHECK (tree_size > 0),
  CONSTRAINT ledger_heads_sequence_positive CHECK (record_sequence > 0),
  CONSTRAINT ledger_heads_signed_finite CHECK (isfinite(signed_at)),
  CONSTRAINT ledger_heads_key_form CHECK (key_id ~ '^[0-9a-f]{16}$'),
  CONSTRAINT ledger_heads_digests CHECK (octet_length(root_sha256) = 32 AND octet_length(signature) = 64),
  CONSTRAINT ledger_heads_texts CHECK (octet_length(public_key) <= 1000)
);
COMMENT ON TABLE ledger_heads IS
  'Heads as they were signed and sent out, at most one a minute. The copies outside are what counts: these can be cut off.';
COMMENT ON COLUMN ledger_heads.signed_at IS 'The clock of the service that signed, in whole seconds.';

SELECT make_append_only('ledger_leaves');
SELECT make_append_only('ledger_contents');
SELECT make_append_only('ledger_nodes');
SELECT make_append_only('ledger_heads');

-- What an entry's rows are found by.
CREATE INDEX correction_events_by_record ON correction_events (record_id);
CREATE INDEX scan_deletions_by_record ON scan_deletions (record_id);

-- Who seals and checks reads every table of the record, which no service does: a role without a login, which the plant's service takes on
-- for these statements alone. It inherits nothing, so that its other statements have its own rights.
DO $$
BEGIN
  -- Roles are of the whole server, where no lock of one database is asked: another, made at the same moment, may change the same rows.
  FOR attempt IN 1..20 LOOP
    BEGIN
      IF NOT EXISTS (SELECT 1 FROM pg_roles WHERE rolname = 'sixpoint_ledger') THEN
        CREATE ROLE sixpoint_ledger NOLOGIN;
      END IF;
      IF (SELECT rolinherit FROM pg_roles WHERE rolname = 'sixpoint_plant') THEN
        ALTER ROLE sixpoint_plant NOINHERIT;
      END IF;
      IF NOT EXISTS (SELECT 1 FROM pg_auth_members m WHERE m.roleid = 'sixpoint_ledger'::regrole AND m.member = 'sixpoint_plant'::regrole) THEN
        GRANT sixpoint_ledger TO sixpoint_plant;
      END IF;
      EXIT;
    EXCEPTION
      -- internal_error: "tuple concurrently updated".
      WHEN internal_error OR unique_violation OR duplicate_object THEN
        IF attempt = 20 THEN
          RAISE;
        END IF;
        PERFORM pg_sleep(0.1);
      WHEN insufficient_privilege THEN
        RAISE EXCEPTION 'role sixpoint_ledger: want CREATE ROLE sixpoint_ledger NOLOGIN, ALTER ROLE sixpoint_plant NOINHERIT and GRANT sixpoint_ledger TO sixpoint_plant by an administrator'
          USING ERRCODE = 'insufficient_privilege';
    END;
  END LOOP;
END
$$;
GRANT SELECT, INSERT ON ledger_leaves, ledger_contents, ledger_nodes, ledger_heads TO sixpoint_ledger;
GRANT SELECT ON record_names, record_entries, record_inputs, record_roots, plant_identity, schema_migrations,
  machine_revisions, machine_joints, artefact_revisions, artefact_features, tessellations, part_revisions, part_hole_groups, part_holes,
  part_datum_points, blades, blobs, scans, scan_blocks, scan_deletions, retention_policies,
  calibrations, calibration_events, sensor_calibrations, sensor_calibration_centres, rotation_calibrations, rotation_calibration_poses,
  probe_calibrations, probe_calibration_readings, probe_calibration_checks, axis_characterisations, studies, interim_checks,
  registrations, registration_scans, registration_agreements, registration_datums, registration_angles, registration_error_sources,
  corrections, correction_groups, correction_holes, correction_checks, correction_events, correction_cuts, program_fetches,
  inspections, inspection_holes, inspection_scans TO sixpoint_ledger;
