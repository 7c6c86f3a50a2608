-- Where blobs live and how long, and damage found. What was recorded about a thing stays for ever; only bytes may go, and what
-- went is written down.

CREATE TABLE blobs (
  sha256 bytea NOT NULL,
  size_bytes bigint NOT NULL,
  bytes bytea,
  stored_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  store text NOT NULL DEFAULT 'postgresql',
  object_id uuid,
  deleted_at timestamptz,
  deletion_reason text,
  CONSTRAINT blobs_pk PRIMARY KEY (sha256),
  CONSTRAINT blobs_size_true CHECK (size_bytes = octet_length(bytes)),
  CONSTRAINT blobs_store_known CHECK (store IN ('postgresql', 's3')),
  CONSTRAINT blobs_object_named CHECK ((store = 's3') = (object_id IS NOT NULL)),
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
  'row. Kept here (store postgresql), kept as object sha256/ab/cd/<sha256>/<object_id> (store s3), or deleted (deleted_at).';
COMMENT ON COLUMN blobs.sha256 IS 'SHA-256 of bytes; checked again on every read.';
COMMENT ON COLUMN blobs.bytes IS 'NULL where an object store holds them, or where they were deleted.';
COMMENT ON COLUMN blobs.store IS 'Who holds the bytes; who held them, where they were deleted.';
COMMENT ON COLUMN blobs.object_id IS
  'Which object: a new one each time the bytes are put, so that none that is being deleted is ever put again.';
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
         AND (NEW.store = 's3' AND (OLD.deleted_at IS NOT NULL OR OLD.store = 's3') OR sha256(NEW.bytes) = NEW.sha256) THEN
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

-- How much each store holds, without reading the catalogue: each change of it adds a row here, and now and then they are added up.
CREATE TABLE blob_use (
  use_id bigint GENERATED ALWAYS AS IDENTITY,
  store text NOT NULL,
  kept_count bigint NOT NULL,
  kept_bytes bigint NOT NULL,
  deleted_count bigint NOT NULL,
  deleted_bytes bigint NOT NULL,
  CONSTRAINT blob_use_pk PRIMARY KEY (use_id),
  CONSTRAINT blob_use_store_known CHECK (store IN ('postgresql', 's3'))
);
COMMENT ON TABLE blob_use IS
  'Differences that add up to what each store holds. Not part of the record: add_up_blob_use() makes one row of many.';
COMMENT ON COLUMN blob_use.kept_count IS 'Blobs whose bytes are there, more or (below 0) fewer than before.';
COMMENT ON COLUMN blob_use.deleted_count IS 'Blobs whose bytes were deleted.';

CREATE FUNCTION count_blob_use() RETURNS trigger LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  IF TG_OP <> 'INSERT' THEN
    INSERT INTO blob_use (store, kept_count, kept_bytes, deleted_count, deleted_bytes)
      SELECT store, -count(*) FILTER (WHERE deleted_at IS NULL),
             -coalesce(sum(size_bytes) FILTER (WHERE deleted_at IS NULL), 0), -count(deleted_at),
             -coalesce(sum(size_bytes) FILTER (WHERE deleted_at IS NOT NULL), 0) FROM was GROUP BY store;
  END IF;
  IF TG_OP <> 'DELETE' THEN
    INSERT INTO blob_use (store, kept_count, kept_bytes, deleted_count, deleted_bytes)
      SELECT store, count(*) FILTER (WHERE deleted_at IS NULL),
             coalesce(sum(size_bytes) FILTER (WHERE deleted_at IS NULL), 0), count(deleted_at),
             coalesce(sum(size_bytes) FILTER (WHERE deleted_at IS NOT NULL), 0) FROM becomes GROUP BY store;
  END IF;
  RETURN NULL;
END
$$;
CREATE TRIGGER use_of_inserted AFTER INSERT ON blobs REFERENCING NEW TABLE AS becomes
  FOR EACH STATEMENT EXECUTE FUNCTION count_blob_use();
CREATE TRIGGER use_of_updated AFTER UPDATE ON blobs REFERENCING OLD TABLE AS was NEW TABLE AS becomes
  FOR EACH STATEMENT EXECUTE FUNCTION count_blob_use();
CREATE TRIGGER use_of_deleted AFTER DELETE ON blobs REFERENCING OLD TABLE AS was
  FOR EACH STATEMENT EXECUTE FUNCTION count_blob_use();

CREATE FUNCTION add_up_blob_use() RETURNS void LANGUAGE sql SECURITY DEFINER SET search_path = public, pg_temp AS $$
  WITH added AS (DELETE FROM blob_use RETURNING store, kept_count, kept_bytes, deleted_count, deleted_bytes)
  INSERT INTO blob_use (store, kept_count, kept_bytes, deleted_count, deleted_bytes)
    SELECT store, sum(kept_count), sum(kept_bytes), sum(deleted_count), sum(deleted_bytes) FROM added GROUP BY store
$$;
COMMENT ON FUNCTION add_up_blob_use() IS 'One row a store, of all that was committed; readers and writers do not wait.';

-- What the collector looks at: asking of each blob who refers to it would read the whole catalogue each hour.
CREATE TABLE loose_blobs (
  sha256 bytea NOT NULL,
  noted_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT loose_blobs_pk PRIMARY KEY (sha256),
  CONSTRAINT loose_blobs_digests CHECK (octet_length(sha256) = 32)
);
COMMENT ON TABLE loose_blobs IS
  'Blobs that lost a reference and may be needed no more: of uploads that were forgotten, of scans whose points were deleted. '
  'Not part of the record: a hint, which the collector takes away once it has looked.';
SELECT make_append_only('blob_damages');
