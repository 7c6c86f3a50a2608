-- Uploads that are acknowledged block by block: what has come so far waits here until the scan is complete, and is moved to
-- scans and scan_blocks in one transaction. Whoever comes with the same header goes on from next_block.

CREATE TABLE scan_uploads (
  scan_id text COLLATE "C" NOT NULL,
  header bytea NOT NULL,
  machine_revision integer NOT NULL,
  artefact_revision integer,
  next_block integer NOT NULL DEFAULT 0,
  point_count bigint NOT NULL DEFAULT 0,
  profile_count integer NOT NULL DEFAULT 0,
  stored_bytes bigint NOT NULL DEFAULT 0,
  proven_error_um double precision NOT NULL DEFAULT 0,
  open_profile_points bigint NOT NULL DEFAULT 0,
  open_profile_x_mm double precision NOT NULL DEFAULT 0,
  started_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  touched_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT scan_uploads_pk PRIMARY KEY (scan_id),
  CONSTRAINT scan_uploads_id_form CHECK (scan_id ~ '^[A-Za-z0-9._-]{1,64}$'),
  CONSTRAINT scan_uploads_counts CHECK (next_block >= 0 AND point_count >= next_block AND profile_count >= 0
                                        AND stored_bytes >= 0 AND open_profile_points >= 0),
  CONSTRAINT scan_uploads_numbers CHECK (proven_error_um >= 0 AND proven_error_um < 1e6 AND abs(open_profile_x_mm) < 1e6)
);
CREATE INDEX scan_uploads_by_touch ON scan_uploads (touched_at);
COMMENT ON TABLE scan_uploads IS 'Scans that are not complete. No result may rest on them; forgotten when nobody goes on with them.';
COMMENT ON COLUMN scan_uploads.header IS 'sixpoint.ingest.v1.ScanHeader as it was accepted.';
COMMENT ON COLUMN scan_uploads.machine_revision IS 'Newest when the upload began; the blocks are checked against its sensor.';
COMMENT ON COLUMN scan_uploads.open_profile_points IS 'Points so far in the last profile, which may go on in the next block.';
COMMENT ON COLUMN scan_uploads.open_profile_x_mm IS 'Encoder reading of that profile.';

CREATE TABLE scan_upload_blocks (
  scan_id text COLLATE "C" NOT NULL,
  block_index integer NOT NULL,
  point_count integer NOT NULL,
  first_profile integer NOT NULL,
  profile_count integer NOT NULL,
  sent_sha256 text COLLATE "C" NOT NULL,
  blob_sha256 text COLLATE "C" NOT NULL,
  CONSTRAINT scan_upload_blocks_pk PRIMARY KEY (scan_id, block_index),
  CONSTRAINT scan_upload_blocks_upload_fk FOREIGN KEY (scan_id) REFERENCES scan_uploads (scan_id) ON DELETE CASCADE,
  CONSTRAINT scan_upload_blocks_blob_fk FOREIGN KEY (blob_sha256) REFERENCES blobs (sha256),
  CONSTRAINT scan_upload_blocks_index_from_zero CHECK (block_index >= 0),
  CONSTRAINT scan_upload_blocks_counts CHECK (point_count > 0 AND first_profile >= 0 AND profile_count > 0),
  CONSTRAINT scan_upload_blocks_sent_sha256_hex CHECK (sent_sha256 ~ '^[0-9a-f]{64}$')
);
CREATE INDEX scan_upload_blocks_by_blob ON scan_upload_blocks (blob_sha256);
COMMENT ON TABLE scan_upload_blocks IS 'Acknowledged blocks of scans that are not complete.';

-- Scans from before this migration have none of the new figures: NULL.
ALTER TABLE scan_blocks ADD COLUMN first_profile integer, ADD COLUMN profile_count integer,
  ADD COLUMN sent_sha256 text COLLATE "C",
  ADD CONSTRAINT scan_blocks_profiles CHECK (first_profile >= 0 AND profile_count > 0),
  ADD CONSTRAINT scan_blocks_sent_sha256_hex CHECK (sent_sha256 ~ '^[0-9a-f]{64}$');
COMMENT ON COLUMN scan_blocks.first_profile IS 'Of the scan; a profile that goes on from the block before counts in both.';
COMMENT ON COLUMN scan_blocks.sent_sha256 IS 'SHA-256 of the payload as sent: tells a repeated block from another one.';

ALTER TABLE scans ADD COLUMN stored_encoding text NOT NULL DEFAULT 'draco', ADD COLUMN profile_count integer,
  ADD COLUMN raw_step_um double precision NOT NULL DEFAULT 0,
  DROP CONSTRAINT scans_encoding_known,
  ADD CONSTRAINT scans_encoding_known CHECK (encoding IN ('draco', 'xyz_f64', 'raw_profiles')),
  ADD CONSTRAINT scans_stored_encoding_known CHECK (stored_encoding IN ('draco', 'range_image')),
  ADD CONSTRAINT scans_raw_step CHECK (raw_step_um >= 0 AND raw_step_um < 1e6),
  ADD CONSTRAINT scans_profiles_positive CHECK (profile_count > 0);
COMMENT ON COLUMN scans.encoding IS 'As sent.';
COMMENT ON COLUMN scans.stored_encoding IS 'draco: as the machine sent it; range_image: encoded here.';
COMMENT ON COLUMN scans.raw_step_um IS 'raw_profiles: what one step of y and z was; else 0.';
COMMENT ON COLUMN scans.stored_sha256 IS
  'Over the binary SHA-256 digests of the stored blocks, in order; before V0009: over their bytes.';
COMMENT ON COLUMN scans.sent_sha256 IS
  'Over the binary SHA-256 digests of the blocks as sent, in order; before V0009: over their bytes.';
