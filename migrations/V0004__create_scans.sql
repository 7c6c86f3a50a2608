-- Scans: a row for each, a row for each of its blocks, the points as blobs; what has come so far of those that are not complete
-- (acknowledged block by block, and moved in one transaction); and how long points are kept.

CREATE TABLE scans (
  scan_key uuid NOT NULL,
  scan_id text COLLATE "C" NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  artefact_id text COLLATE "C",
  artefact_revision integer,
  blade_serial text COLLATE "C",
  kind text NOT NULL,
  v0_x_mm double precision NOT NULL,
  v0_y_mm double precision NOT NULL,
  v0_z_mm double precision NOT NULL,
  a_deg double precision NOT NULL,
  b_deg double precision NOT NULL,
  profile_pitch_mm double precision NOT NULL,
  columns_per_profile integer NOT NULL,
  point_count bigint NOT NULL,
  encoding text NOT NULL,
  sender_error_um double precision NOT NULL,
  error_bound_um double precision NOT NULL,
  measured_at timestamptz,
  block_count integer NOT NULL,
  stored_bytes bigint NOT NULL,
  stored_sha256 bytea NOT NULL,
  sent_sha256 bytea NOT NULL,
  proven_error_um double precision NOT NULL,
  stored_encoding text NOT NULL DEFAULT 'draco',
  profile_count integer,
  raw_step_um double precision NOT NULL DEFAULT 0,
  CONSTRAINT scans_pk PRIMARY KEY (scan_key),
  CONSTRAINT scans_machine_fk FOREIGN KEY (machine_id, machine_revision) REFERENCES machine_revisions (machine_id,
      revision),
  CONSTRAINT scans_artefact_fk FOREIGN KEY (artefact_id, artefact_revision)
    REFERENCES artefact_revisions (artefact_id, revision),
  CONSTRAINT scans_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT scans_record_fk FOREIGN KEY (scan_key) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT scans_id_form CHECK (scan_id ~ '^[A-Za-z0-9._-]{1,64}$'),
  CONSTRAINT scans_machine_revision_positive CHECK (machine_revision > 0),
  CONSTRAINT scans_one_subject CHECK ((artefact_id IS NULL) <> (blade_serial IS NULL)),
  CONSTRAINT scans_artefact_revision_given CHECK ((artefact_id IS NULL) = (artefact_revision IS NULL)),
  CONSTRAINT scans_artefact_revision_positive CHECK (artefact_revision > 0),
  CONSTRAINT scans_kind_fits_subject CHECK (kind IN ('artefact', 'arm') AND artefact_id IS NOT NULL
    OR kind IN ('airfoil', 'local', 'pins') AND blade_serial IS NOT NULL),
  CONSTRAINT scans_v0_finite CHECK (abs(v0_x_mm) < 1e6 AND abs(v0_y_mm) < 1e6 AND abs(v0_z_mm) < 1e6),
  CONSTRAINT scans_angles_finite CHECK (abs(a_deg) < 1e6 AND abs(b_deg) < 1e6),
  CONSTRAINT scans_pitch_positive CHECK (profile_pitch_mm > 0 AND profile_pitch_mm < 1e6),
  CONSTRAINT scans_columns_positive CHECK (columns_per_profile > 0),
  CONSTRAINT scans_points_positive CHECK (point_count > 0),
  CONSTRAINT scans_errors_finite CHECK (sender_error_um >= 0 AND sender_error_um < 1e6 AND error_bound_um >= 0
    AND error_bound_um < 1e6 AND proven_error_um >= 0 AND proven_error_um < 1e6),
  CONSTRAINT scans_measured_finite CHECK (isfinite(measured_at)),
  CONSTRAINT scans_blocks_positive CHECK (block_count > 0 AND block_count <= point_count),
  CONSTRAINT scans_bytes_positive CHECK (stored_bytes > 0),
  CONSTRAINT scans_encoding_known CHECK (encoding IN ('draco', 'xyz_f64', 'raw_profiles')),
  CONSTRAINT scans_stored_encoding_known CHECK (stored_encoding IN ('draco', 'range_image')),
  CONSTRAINT scans_raw_step CHECK (raw_step_um >= 0 AND raw_step_um < 1e6),
  CONSTRAINT scans_profiles_positive CHECK (profile_count > 0),
  CONSTRAINT scans_digests CHECK (octet_length(stored_sha256) = 32 AND octet_length(sent_sha256) = 32)
) PARTITION BY RANGE (scan_key);
CREATE INDEX scans_by_artefact ON scans (artefact_id) WHERE (artefact_id IS NOT NULL);
COMMENT ON TABLE scans IS
  'One row for each scan, written with all of its blocks or not at all. Points are in the sensor frame.';
COMMENT ON COLUMN scans.scan_key IS 'Its record_id: time-ordered, and what other tables refer to.';
COMMENT ON COLUMN scans.machine_revision IS 'The revision whose limits the scan was checked against.';
COMMENT ON COLUMN scans.v0_x_mm IS 'Machine position at the start of the scan (V0 of CONF 12).';
COMMENT ON COLUMN scans.a_deg IS 'Rotary axis A as commanded during the scan.';
COMMENT ON COLUMN scans.columns_per_profile IS 'Sensor columns in a profile, measured or not.';
COMMENT ON COLUMN scans.encoding IS 'As sent.';
COMMENT ON COLUMN scans.sender_error_um IS 'Greatest coordinate error that the sender says its encoding put in.';
COMMENT ON COLUMN scans.error_bound_um IS
  'Greatest coordinate error that storing was allowed to add, as asked; 0: the default.';
COMMENT ON COLUMN scans.measured_at IS 'The machine''s clock at the start of the scan, where it told.';
COMMENT ON COLUMN scans.stored_sha256 IS
  'Over the binary SHA-256 digests of the blocks that readers decode, in order.';
COMMENT ON COLUMN scans.sent_sha256 IS
  'Over the binary SHA-256 digests of the blocks as sent, in order.';
COMMENT ON COLUMN scans.proven_error_um IS
  'Measured by decoding again where encoded here; sender_error_um where the points are those sent.';
COMMENT ON COLUMN scans.stored_encoding IS 'draco: the points that the machine sent, to the last bit; range_image: encoded here.';
COMMENT ON COLUMN scans.raw_step_um IS 'raw_profiles: what one step of y and z was; else 0.';

CREATE TABLE scan_blocks (
  scan_key uuid NOT NULL,
  block_index integer NOT NULL,
  point_count integer NOT NULL,
  blob_sha256 bytea NOT NULL,
  first_profile integer,
  profile_count integer,
  sent_sha256 bytea,
  evidence_sha256 bytea,
  CONSTRAINT scan_blocks_pk PRIMARY KEY (scan_key, block_index),
  CONSTRAINT scan_blocks_scan_fk FOREIGN KEY (scan_key) REFERENCES scans (scan_key),
  CONSTRAINT scan_blocks_blob_fk FOREIGN KEY (blob_sha256) REFERENCES blobs (sha256),
  CONSTRAINT scan_blocks_evidence_fk FOREIGN KEY (evidence_sha256) REFERENCES blobs (sha256),
  CONSTRAINT scan_blocks_index_from_zero CHECK (block_index >= 0),
  CONSTRAINT scan_blocks_points_positive CHECK (point_count > 0),
  CONSTRAINT scan_blocks_profiles CHECK (first_profile >= 0 AND profile_count > 0),
  CONSTRAINT scan_blocks_digests CHECK (octet_length(blob_sha256) = 32 AND octet_length(sent_sha256) = 32
    AND evidence_sha256 = sent_sha256)
) PARTITION BY RANGE (scan_key);
CREATE INDEX scan_blocks_by_blob ON scan_blocks (blob_sha256);
CREATE INDEX scan_blocks_by_evidence ON scan_blocks (evidence_sha256) WHERE evidence_sha256 IS NOT NULL;
COMMENT ON TABLE scan_blocks IS 'The blocks of each scan in the order measured; some tens of profiles each.';
COMMENT ON COLUMN scan_blocks.first_profile IS 'Of the scan; a profile that goes on from the block before counts in both.';
COMMENT ON COLUMN scan_blocks.blob_sha256 IS 'What readers decode: written by our own encoder.';
COMMENT ON COLUMN scan_blocks.evidence_sha256 IS
  'The payload as sent, kept and never decoded again; NULL where it is what readers decode, or was no cloud of its own.';
COMMENT ON COLUMN scan_blocks.sent_sha256 IS 'SHA-256 of the payload as sent: tells a repeated block from another one.';

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
) WITH (fillfactor = 50);
-- No index but the key: each block changes this row, and a change that meets no index leaves none behind (HOT); there are few rows.
COMMENT ON TABLE scan_uploads IS
  'Scans that are not complete. No result may rest on them; forgotten when nobody goes on with them.';
COMMENT ON COLUMN scan_uploads.header IS 'sixpoint.ingest.v1.ScanHeader as it was accepted.';
COMMENT ON COLUMN scan_uploads.machine_revision IS
  'Newest when the upload began; the blocks are checked against its sensor.';
COMMENT ON COLUMN scan_uploads.open_profile_points IS
  'Points so far in the last profile, which may go on in the next block.';
COMMENT ON COLUMN scan_uploads.open_profile_x_mm IS 'Encoder reading of that profile.';

CREATE TABLE scan_upload_blocks (
  scan_id text COLLATE "C" NOT NULL,
  block_index integer NOT NULL,
  point_count integer NOT NULL,
  first_profile integer NOT NULL,
  profile_count integer NOT NULL,
  sent_sha256 bytea NOT NULL,
  blob_sha256 bytea NOT NULL,
  evidence_sha256 bytea,
  CONSTRAINT scan_upload_blocks_pk PRIMARY KEY (scan_id, block_index),
  CONSTRAINT scan_upload_blocks_upload_fk FOREIGN KEY (scan_id) REFERENCES scan_uploads (scan_id) ON DELETE CASCADE,
  CONSTRAINT scan_upload_blocks_blob_fk FOREIGN KEY (blob_sha256) REFERENCES blobs (sha256),
  CONSTRAINT scan_upload_blocks_evidence_fk FOREIGN KEY (evidence_sha256) REFERENCES blobs (sha256),
  CONSTRAINT scan_upload_blocks_index_from_zero CHECK (block_index >= 0),
  CONSTRAINT scan_upload_blocks_counts CHECK (point_count > 0 AND first_profile >= 0 AND profile_count > 0),
  CONSTRAINT scan_upload_blocks_digests CHECK (octet_length(sent_sha256) = 32 AND octet_length(blob_sha256) = 32
    AND evidence_sha256 = sent_sha256)
);
CREATE INDEX scan_upload_blocks_by_blob ON scan_upload_blocks (blob_sha256);
CREATE INDEX scan_upload_blocks_by_evidence ON scan_upload_blocks (evidence_sha256) WHERE evidence_sha256 IS NOT NULL;
COMMENT ON TABLE scan_upload_blocks IS 'Acknowledged blocks of scans that are not complete.';

CREATE TABLE retention_policies (
  scan_kind text NOT NULL,
  revision integer NOT NULL,
  keep_days integer,
  requested_by text NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT retention_policies_pk PRIMARY KEY (scan_kind, revision),
  CONSTRAINT retention_policies_record_once UNIQUE (record_id),
  CONSTRAINT retention_policies_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT retention_policies_kind_known CHECK (scan_kind IN ('artefact', 'arm', 'airfoil', 'local', 'pins')),
  CONSTRAINT retention_policies_revision_positive CHECK (revision > 0),
  CONSTRAINT retention_policies_days_positive CHECK (keep_days > 0 AND keep_days <= 36525),
  CONSTRAINT retention_policies_requested_by_length CHECK (octet_length(requested_by) <= 200)
);
COMMENT ON TABLE retention_policies IS
  'How long the points of scans are kept, by kind; the newest revision holds. A kind without one is kept for ever.';
COMMENT ON COLUMN retention_policies.keep_days IS 'Whole days since the scan was recorded; NULL: for ever.';

CREATE TABLE scan_deletions (
  scan_key uuid NOT NULL,
  reason text NOT NULL,
  requested_by text NOT NULL,
  policy_kind text,
  policy_revision integer,
  points_sha256 bytea NOT NULL,
  points_bytes bigint NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT scan_deletions_pk PRIMARY KEY (scan_key),
  CONSTRAINT scan_deletions_scan_fk FOREIGN KEY (scan_key) REFERENCES scans (scan_key),
  CONSTRAINT scan_deletions_policy_fk FOREIGN KEY (policy_kind, policy_revision)
    REFERENCES retention_policies (scan_kind, revision),
  CONSTRAINT scan_deletions_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT scan_deletions_reason_given CHECK (reason <> ''),
  CONSTRAINT scan_deletions_bytes_positive CHECK (points_bytes > 0),
  CONSTRAINT scan_deletions_requested_by_length CHECK (octet_length(requested_by) <= 200),
  CONSTRAINT scan_deletions_reason_length CHECK (octet_length(reason) <= 1000),
  CONSTRAINT scan_deletions_digests CHECK (octet_length(points_sha256) = 32)
) PARTITION BY RANGE (scan_key);
COMMENT ON TABLE scan_deletions IS
  'Scans whose points went: why, when and by whom. The scan, its values and all results made from it stay.';
COMMENT ON COLUMN scan_deletions.policy_kind IS 'The policy that asked for it, with its revision; NULL where a person did.';
COMMENT ON COLUMN scan_deletions.points_sha256 IS
  'stored_sha256 of the scan: whoever has the points elsewhere can prove it.';
COMMENT ON COLUMN scan_deletions.points_bytes IS 'As stored. Blocks that another scan or thing still uses did not go.';

CREATE TABLE retention_progress (
  scan_kind text NOT NULL,
  policy_revision integer NOT NULL,
  after_scan_key uuid NOT NULL,
  CONSTRAINT retention_progress_pk PRIMARY KEY (scan_kind),
  CONSTRAINT retention_progress_policy_fk FOREIGN KEY (scan_kind, policy_revision)
    REFERENCES retention_policies (scan_kind, revision)
);
COMMENT ON TABLE retention_progress IS
  'How far each kind''s policy has been applied, so that scans deleted years ago are not read each hour. Not part of the record: '
  'changed in place; a new revision begins anew.';
COMMENT ON COLUMN retention_progress.after_scan_key IS 'Everything up to this one has been looked at and was due.';

SELECT make_append_only('scans');
SELECT make_append_only('scan_blocks');
SELECT make_append_only('retention_policies');
SELECT make_append_only('scan_deletions');
