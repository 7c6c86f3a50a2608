-- Interim checks: whether a scanner still stands as it was calibrated, in which clamping that was seen, and when the scans of a registration
-- came, so that both can be held against each other; what calibrations were judged by. Every new column of a table
-- that was there is nullable.

ALTER TABLE studies
  DROP CONSTRAINT studies_kind_known,
  ADD CONSTRAINT studies_kind_known
    CHECK (kind IN ('GAUGE', 'ARM', 'REPEAT', 'GAUGE_RR', 'SPHERE_CHECK', 'INTERIM_CHECK'));
COMMENT ON TABLE studies IS
  'What an instrument or a procedure can do: gauge and arm studies, repeats, gauge R&R, sphere checks, interim checks.';

CREATE TABLE interim_checks (
  study_id uuid NOT NULL,
  sensor_calibration_id uuid NOT NULL,
  clamping text COLLATE "C",
  scanned_at timestamptz NOT NULL,
  limit_um double precision NOT NULL,
  CONSTRAINT interim_checks_pk PRIMARY KEY (study_id),
  CONSTRAINT interim_checks_study_fk FOREIGN KEY (study_id) REFERENCES studies (study_id),
  CONSTRAINT interim_checks_calibration_fk FOREIGN KEY (sensor_calibration_id) REFERENCES sensor_calibrations (calibration_id),
  CONSTRAINT interim_checks_limit CHECK (limit_um BETWEEN 0 AND 1000),
  CONSTRAINT interim_checks_clamping_named CHECK (clamping <> '' AND octet_length(clamping) <= 64)
);
CREATE INDEX interim_checks_by_calibration ON interim_checks (sensor_calibration_id, scanned_at);
COMMENT ON TABLE interim_checks IS 'Studies of kind INTERIM_CHECK by what they checked; their verdict is the study''s.';
COMMENT ON COLUMN interim_checks.clamping IS 'As its scans state it; NULL: they do not.';
COMMENT ON COLUMN interim_checks.scanned_at IS 'When the server received the first of its scans.';
COMMENT ON COLUMN interim_checks.limit_um IS 'Greatest displacement that it was to accept; 0: none was stated.';
SELECT make_append_only('interim_checks');
GRANT SELECT, INSERT ON interim_checks TO sixpoint_calibration;

ALTER TABLE registrations ADD COLUMN scans_received_at timestamptz;
COMMENT ON COLUMN registrations.scans_received_at IS
  'When the server received the last of its scans; NULL: made before it was kept.';

ALTER TABLE machine_revisions
  ADD COLUMN interim_check_limit_um double precision,
  ADD CONSTRAINT machine_revisions_interim_check_limit CHECK (interim_check_limit_um > 0 AND interim_check_limit_um <= 1000);
COMMENT ON COLUMN machine_revisions.interim_check_limit_um IS
  'Greatest displacement of the scanner that its interim checks accept, one in each clamping; NULL: none is wanted.';

ALTER TABLE calibrations
  ADD COLUMN judgements jsonb,
  ADD CONSTRAINT calibrations_judgements_listed CHECK (jsonb_typeof(judgements) = 'array' AND pg_column_size(judgements) <= 10000);
COMMENT ON COLUMN calibrations.judgements IS
  'Residuals that took no part in the fit against what is expected of them: of, ratio, count, probability, agrees; NULL: none, or made before.';
