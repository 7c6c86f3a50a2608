-- Where blobs live and how long: a second store for bytes, deletion of points by name or by age, damage found.
-- What was recorded about a thing stays for ever; only bytes may go, and what went is written down.

ALTER TABLE blobs
  ALTER COLUMN bytes DROP NOT NULL,
  ADD COLUMN store text NOT NULL DEFAULT 'postgresql',
  ADD COLUMN deleted_at timestamptz,
  ADD COLUMN deletion_reason text,
  ADD CONSTRAINT blobs_store_known CHECK (store IN ('postgresql', 's3')),
  ADD CONSTRAINT blobs_state_consistent CHECK (
    deleted_at IS NULL AND deletion_reason IS NULL AND (bytes IS NOT NULL) = (store = 'postgresql')
    OR deleted_at IS NOT NULL AND deletion_reason IS NOT NULL AND deletion_reason <> '' AND bytes IS NULL);
COMMENT ON TABLE blobs IS
  'The catalogue of bytes named by their SHA-256: scan blocks, meshes, CAD files, NC programs. The same bytes are one row. '
  'Kept here (store postgresql), kept as object sha256/ab/cd/<sha256> (store s3), or deleted (deleted_at).';
COMMENT ON COLUMN blobs.bytes IS 'NULL where an object store holds them, or where they were deleted.';
COMMENT ON COLUMN blobs.store IS 'Who holds the bytes; who held them, where they were deleted.';
COMMENT ON COLUMN blobs.deleted_at IS 'When retention or a person took the bytes away; sha256 and size_bytes stay.';

-- Rows stay append-only but for three changes, each announced by a transaction-local setting: setting a value by accident is
-- hard, and the change must still have the one shape that goes with it.
CREATE FUNCTION refuse_blob_change() RETURNS trigger LANGUAGE plpgsql AS $$
DECLARE
  purpose text := coalesce(current_setting('sixpoint.blob_change', true), '');
BEGIN
  -- A row that anything refers to is held by its foreign keys.
  IF TG_OP = 'DELETE' AND purpose = 'collect' THEN
    RETURN OLD;
  END IF;
  IF TG_OP = 'UPDATE' THEN
    IF NEW.sha256 = OLD.sha256 AND NEW.size_bytes = OLD.size_bytes AND NEW.stored_at = OLD.stored_at THEN
      IF purpose = 'delete_bytes' AND OLD.deleted_at IS NULL AND NEW.deleted_at IS NOT NULL AND NEW.store = OLD.store THEN
        RETURN NEW;
      END IF;
      -- The same bytes came again. Those that come here prove themselves.
      IF purpose = 'restore_bytes' AND OLD.bytes IS NULL AND NEW.deleted_at IS NULL
         AND (NEW.store = 's3' AND OLD.deleted_at IS NOT NULL OR encode(sha256(NEW.bytes), 'hex') = NEW.sha256) THEN
        RETURN NEW;
      END IF;
    END IF;
  END IF;
  RAISE EXCEPTION '% on blobs: rows are append-only, want a new row', TG_OP USING ERRCODE = 'restrict_violation';
END
$$;
COMMENT ON FUNCTION refuse_blob_change() IS
  'Allows, where sixpoint.blob_change says so: delete_bytes (retention), restore_bytes (the same bytes again), collect '
  '(rows that nothing refers to).';
DROP TRIGGER blobs_append_only ON blobs;
CREATE TRIGGER blobs_append_only BEFORE UPDATE OR DELETE ON blobs FOR EACH ROW EXECUTE FUNCTION refuse_blob_change();

-- The collector asks every referring column; the large one has its index since V0003.
CREATE INDEX tessellations_by_surface ON tessellations (surface_sha256);
CREATE INDEX calibrations_by_request ON calibrations (request_sha256);
CREATE INDEX corrections_by_nc_template ON corrections (nc_template_sha256);
CREATE INDEX corrections_by_nc_program ON corrections (nc_program_sha256);

CREATE TABLE retention_policies (
  scan_kind text NOT NULL,
  revision integer NOT NULL,
  keep_days integer,
  requested_by text NOT NULL,
  recorded_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT retention_policies_pk PRIMARY KEY (scan_kind, revision),
  CONSTRAINT retention_policies_kind_known CHECK (scan_kind IN ('artefact', 'arm', 'airfoil', 'local', 'pins')),
  CONSTRAINT retention_policies_revision_positive CHECK (revision > 0),
  CONSTRAINT retention_policies_days_positive CHECK (keep_days > 0 AND keep_days <= 36525)
);
COMMENT ON TABLE retention_policies IS
  'How long the points of scans are kept, by kind; the newest revision holds. A kind without one is kept for ever.';
COMMENT ON COLUMN retention_policies.keep_days IS 'Whole days since the scan was recorded; NULL: for ever.';

CREATE TABLE scan_deletions (
  scan_id text COLLATE "C" NOT NULL,
  reason text NOT NULL,
  requested_by text NOT NULL,
  policy_kind text,
  policy_revision integer,
  points_sha256 text COLLATE "C" NOT NULL,
  points_bytes bigint NOT NULL,
  record_sequence bigint NOT NULL,
  deleted_at timestamptz NOT NULL,
  CONSTRAINT scan_deletions_pk PRIMARY KEY (scan_id),
  CONSTRAINT scan_deletions_scan_fk FOREIGN KEY (scan_id) REFERENCES scans (scan_id),
  CONSTRAINT scan_deletions_policy_fk FOREIGN KEY (policy_kind, policy_revision)
    REFERENCES retention_policies (scan_kind, revision),
  CONSTRAINT scan_deletions_record_fk FOREIGN KEY (record_sequence) REFERENCES record_entries (record_sequence),
  CONSTRAINT scan_deletions_record_once UNIQUE (record_sequence),
  CONSTRAINT scan_deletions_reason_given CHECK (reason <> ''),
  CONSTRAINT scan_deletions_policy_whole CHECK ((policy_kind IS NULL) = (policy_revision IS NULL)),
  CONSTRAINT scan_deletions_sha256_hex CHECK (points_sha256 ~ '^[0-9a-f]{64}$'),
  CONSTRAINT scan_deletions_bytes_positive CHECK (points_bytes > 0)
);
COMMENT ON TABLE scan_deletions IS
  'Scans whose points went: why, when and by whom. The scan, its values and all results made from it stay.';
COMMENT ON COLUMN scan_deletions.policy_kind IS 'The policy that asked for it, with its revision; NULL where a person did.';
COMMENT ON COLUMN scan_deletions.points_sha256 IS 'stored_sha256 of the scan: whoever has the points elsewhere can prove it.';
COMMENT ON COLUMN scan_deletions.points_bytes IS 'As stored. Blocks that another scan or thing still uses did not go.';

CREATE TABLE blob_damages (
  damage_id bigint GENERATED ALWAYS AS IDENTITY,
  sha256 text COLLATE "C" NOT NULL,
  store text NOT NULL,
  what text NOT NULL,
  detail text NOT NULL,
  found_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT blob_damages_pk PRIMARY KEY (damage_id),
  CONSTRAINT blob_damages_sha256_hex CHECK (sha256 ~ '^[0-9a-f]{64}$'),
  CONSTRAINT blob_damages_store_known CHECK (store IN ('postgresql', 's3')),
  CONSTRAINT blob_damages_what_known CHECK (what IN ('missing', 'size', 'digest', 'unreadable'))
);
CREATE INDEX blob_damages_by_blob ON blob_damages (sha256, damage_id);
COMMENT ON TABLE blob_damages IS
  'What the check of the store found. No foreign key to blobs: a finding must not keep a blob that nothing uses.';

CREATE TABLE blob_check_progress (
  only_row boolean NOT NULL DEFAULT true,
  after_sha256 text COLLATE "C" NOT NULL DEFAULT '',
  checked_count bigint NOT NULL DEFAULT 0,
  checked_bytes bigint NOT NULL DEFAULT 0,
  damaged_count bigint NOT NULL DEFAULT 0,
  begun_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  finished_at timestamptz,
  CONSTRAINT blob_check_progress_pk PRIMARY KEY (only_row),
  CONSTRAINT blob_check_progress_one_row CHECK (only_row),
  CONSTRAINT blob_check_progress_position CHECK (after_sha256 = '' OR after_sha256 ~ '^[0-9a-f]{64}$'),
  CONSTRAINT blob_check_progress_counts CHECK (checked_count >= 0 AND checked_bytes >= 0 AND damaged_count >= 0)
);
INSERT INTO blob_check_progress DEFAULT VALUES;
COMMENT ON TABLE blob_check_progress IS
  'How far the continuous check has come, so that a restart goes on from there. Not part of the record: changed in place.';
COMMENT ON COLUMN blob_check_progress.finished_at IS 'End of the last whole pass.';

ALTER TABLE record_entries
  DROP CONSTRAINT record_entries_kind_known,
  ADD CONSTRAINT record_entries_kind_known CHECK (kind IN ('machine', 'artefact', 'part', 'blade', 'scan', 'calibration',
                                                           'registration', 'correction', 'inspection', 'deletion'));

CREATE TRIGGER retention_policies_append_only BEFORE UPDATE OR DELETE ON retention_policies
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER retention_policies_no_truncate BEFORE TRUNCATE ON retention_policies
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER scan_deletions_append_only BEFORE UPDATE OR DELETE ON scan_deletions
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER scan_deletions_no_truncate BEFORE TRUNCATE ON scan_deletions
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER blob_damages_append_only BEFORE UPDATE OR DELETE ON blob_damages
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER blob_damages_no_truncate BEFORE TRUNCATE ON blob_damages
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
