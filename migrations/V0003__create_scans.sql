-- Scans as the machines sent them: a row for each scan, a row for each of its blocks; the points are Draco blobs.

CREATE TABLE scans (
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
  stored_sha256 text COLLATE "C" NOT NULL,
  sent_sha256 text COLLATE "C" NOT NULL,
  proven_error_um double precision NOT NULL,
  record_sequence bigint NOT NULL,
  recorded_at timestamptz NOT NULL,
  CONSTRAINT scans_pk PRIMARY KEY (scan_id),
  CONSTRAINT scans_machine_fk FOREIGN KEY (machine_id) REFERENCES machines (machine_id),
  CONSTRAINT scans_artefact_fk FOREIGN KEY (artefact_id) REFERENCES artefacts (artefact_id),
  CONSTRAINT scans_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT scans_record_fk FOREIGN KEY (record_sequence) REFERENCES record_entries (record_sequence),
  CONSTRAINT scans_record_once UNIQUE (record_sequence),
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
  CONSTRAINT scans_encoding_known CHECK (encoding IN ('draco', 'xyz_f64')),
  CONSTRAINT scans_errors_finite CHECK (sender_error_um >= 0 AND sender_error_um < 1e6 AND error_bound_um >= 0
                                        AND error_bound_um < 1e6 AND proven_error_um >= 0 AND proven_error_um < 1e6),
  CONSTRAINT scans_measured_finite CHECK (isfinite(measured_at)),
  CONSTRAINT scans_blocks_positive CHECK (block_count > 0 AND block_count <= point_count),
  CONSTRAINT scans_bytes_positive CHECK (stored_bytes > 0),
  CONSTRAINT scans_stored_sha256_hex CHECK (stored_sha256 ~ '^[0-9a-f]{64}$'),
  CONSTRAINT scans_sent_sha256_hex CHECK (sent_sha256 ~ '^[0-9a-f]{64}$')
);
CREATE INDEX scans_by_machine ON scans (machine_id, record_sequence);
CREATE INDEX scans_by_blade ON scans (blade_serial, record_sequence) WHERE blade_serial IS NOT NULL;
CREATE INDEX scans_by_artefact ON scans (artefact_id, record_sequence) WHERE artefact_id IS NOT NULL;
COMMENT ON TABLE scans IS 'One row for each scan, written with all of its blocks or not at all. Points are in the sensor frame.';
COMMENT ON COLUMN scans.machine_revision IS 'The revision whose limits the scan was checked against.';
COMMENT ON COLUMN scans.v0_x_mm IS 'Machine position at the start of the scan (V0 of CONF 12).';
COMMENT ON COLUMN scans.a_deg IS 'Rotary axis A as commanded during the scan.';
COMMENT ON COLUMN scans.columns_per_profile IS 'Sensor columns in a profile, measured or not.';
COMMENT ON COLUMN scans.encoding IS 'As sent. Stored blocks are Draco always: xyz_f64 is encoded on arrival.';
COMMENT ON COLUMN scans.sender_error_um IS 'Greatest coordinate error that the sender says its encoding put in.';
COMMENT ON COLUMN scans.error_bound_um IS 'Greatest coordinate error that storing was allowed to add, as asked; 0: the default.';
COMMENT ON COLUMN scans.measured_at IS 'The machine''s clock at the start of the scan, where it told.';
COMMENT ON COLUMN scans.stored_sha256 IS 'Over the payloads of all stored blocks, in order.';
COMMENT ON COLUMN scans.sent_sha256 IS 'Over the payloads as sent, in order: tells a repeated upload from another scan.';
COMMENT ON COLUMN scans.proven_error_um IS 'Measured by decoding again where encoded here; sender_error_um where kept as sent.';

CREATE TABLE scan_blocks (
  scan_id text COLLATE "C" NOT NULL,
  block_index integer NOT NULL,
  point_count integer NOT NULL,
  blob_sha256 text COLLATE "C" NOT NULL,
  CONSTRAINT scan_blocks_pk PRIMARY KEY (scan_id, block_index),
  CONSTRAINT scan_blocks_scan_fk FOREIGN KEY (scan_id) REFERENCES scans (scan_id),
  CONSTRAINT scan_blocks_blob_fk FOREIGN KEY (blob_sha256) REFERENCES blobs (sha256),
  CONSTRAINT scan_blocks_index_from_zero CHECK (block_index >= 0),
  CONSTRAINT scan_blocks_points_positive CHECK (point_count > 0)
);
CREATE INDEX scan_blocks_by_blob ON scan_blocks (blob_sha256);
COMMENT ON TABLE scan_blocks IS 'The blocks of each scan in the order measured; some tens of profiles each.';

CREATE TRIGGER scans_append_only BEFORE UPDATE OR DELETE ON scans FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER scans_no_truncate BEFORE TRUNCATE ON scans FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER scan_blocks_append_only BEFORE UPDATE OR DELETE ON scan_blocks
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER scan_blocks_no_truncate BEFORE TRUNCATE ON scan_blocks
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
