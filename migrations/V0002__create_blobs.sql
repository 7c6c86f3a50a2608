-- Where blobs live and how long, and damage found. What was recorded about a thing stays for ever; only bytes may go, and what
-- went is written down.

CREATE TABLE blobs (
  sha256 bytea NOT NULL,
  size_bytes bigint NOT NULL,
  bytes bytea,
  stored_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  store text NOT NULL DEFAULT 'postgresql',
  deleted_at timestamptz,
  deletion_reason text,
  CONSTRAINT blobs_pk PRIMARY KEY (sha256),
  CONSTRAINT blobs_size_true CHECK (size_bytes = octet_length(bytes)),
  CONSTRAINT blobs_store_known CHECK (store IN ('postgresql', 's3')),
  CONSTRAINT blobs_state_consistent CHECK (deleted_at IS NULL AND deletion_reason IS NULL
    AND (bytes IS NOT NULL) = (store = 'postgresql') OR deleted_at IS NOT NULL AND deletion_reason IS NOT NULL
    AND deletion_reason <> '' AND bytes IS NULL),
  CONSTRAINT blobs_digests CHECK (octet_length(sha256) = 32),
  CONSTRAINT blobs_texts CHECK (octet_length(deletion_reason) <= 1000)
);
-- EXTERNAL: clouds and meshes are compressed already; do not spend time on compressing them again.
ALTER TABLE blobs ALTER COLUMN bytes SET STORAGE EXTERNAL;
COMMENT ON TABLE blobs IS
  'The catalogue of bytes named by their SHA-256: scan blocks, meshes, CAD files, NC programs. The same bytes are one '
  'row. Kept here (store postgresql), kept as object sha256/ab/cd/<sha256> (store s3), or deleted (deleted_at).';
COMMENT ON COLUMN blobs.sha256 IS 'SHA-256 of bytes; checked again on every read.';
COMMENT ON COLUMN blobs.bytes IS 'NULL where an object store holds them, or where they were deleted.';
COMMENT ON COLUMN blobs.store IS 'Who holds the bytes; who held them, where they were deleted.';
COMMENT ON COLUMN blobs.deleted_at IS 'When retention or a person took the bytes away; sha256 and size_bytes stay.';

CREATE TABLE blob_damages (
  damage_id bigint GENERATED ALWAYS AS IDENTITY,
  sha256 bytea NOT NULL,
  store text NOT NULL,
  what text NOT NULL,
  detail text NOT NULL,
  found_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT blob_damages_pk PRIMARY KEY (damage_id),
  CONSTRAINT blob_damages_store_known CHECK (store IN ('postgresql', 's3')),
  CONSTRAINT blob_damages_what_known CHECK (what IN ('missing', 'size', 'digest', 'unreadable')),
  CONSTRAINT blob_damages_digests CHECK (octet_length(sha256) = 32),
  CONSTRAINT blob_damages_texts CHECK (octet_length(detail) <= 4000)
);
CREATE INDEX blob_damages_by_blob ON blob_damages (sha256, damage_id);
COMMENT ON TABLE blob_damages IS
  'What the check of the store found. No foreign key to blobs: a finding must not keep a blob that nothing uses.';

CREATE TABLE blob_check_progress (
  only_row boolean NOT NULL DEFAULT true,
  after_sha256 bytea NOT NULL DEFAULT '',
  checked_count bigint NOT NULL DEFAULT 0,
  checked_bytes bigint NOT NULL DEFAULT 0,
  damaged_count bigint NOT NULL DEFAULT 0,
  begun_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  finished_at timestamptz,
  CONSTRAINT blob_check_progress_pk PRIMARY KEY (only_row),
  CONSTRAINT blob_check_progress_one_row CHECK (only_row),
  CONSTRAINT blob_check_progress_position CHECK (octet_length(after_sha256) IN (0, 32)),
  CONSTRAINT blob_check_progress_counts CHECK (checked_count >= 0 AND checked_bytes >= 0 AND damaged_count >= 0)
);
COMMENT ON TABLE blob_check_progress IS
  'How far the continuous check has come, so that a restart goes on from there. Not part of the record: changed in place.';
COMMENT ON COLUMN blob_check_progress.finished_at IS 'End of the last whole pass.';

INSERT INTO blob_check_progress DEFAULT VALUES;

CREATE TABLE plant_identity (
  only_row boolean NOT NULL DEFAULT true,
  plant_id uuid NOT NULL DEFAULT gen_random_uuid(),
  CONSTRAINT plant_identity_pk PRIMARY KEY (only_row),
  CONSTRAINT plant_identity_one_row CHECK (only_row)
);
INSERT INTO plant_identity DEFAULT VALUES;
COMMENT ON TABLE plant_identity IS 'Which plant this is, for what it keeps elsewhere: a bucket says whose clouds it holds.';
SELECT make_append_only('plant_identity');

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
         AND (NEW.store = 's3' AND OLD.deleted_at IS NOT NULL OR sha256(NEW.bytes) = NEW.sha256) THEN
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
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE ON blobs FOR EACH ROW EXECUTE FUNCTION refuse_blob_change();
CREATE TRIGGER no_truncate BEFORE TRUNCATE ON blobs FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
SELECT make_append_only('blob_damages');
