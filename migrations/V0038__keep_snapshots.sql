-- Clouds that are no line scans: a scan says what its points are and in what unit they came, a snapshot sensor has no columns, and how it stands
-- is stated by a certificate, beside which there is no evidence of our own. New columns are nullable, constraints looser.

ALTER TABLE machine_revisions
  DROP CONSTRAINT machine_revisions_sensor_positive,
  ADD CONSTRAINT machine_revisions_sensor_positive CHECK (sensor_noise_um > 0 AND sensor_noise_um < 1e6
    AND (sensor_column_count > 0 OR (sensor_column_count = 0 AND sensor_kind IS NOT DISTINCT FROM 'SNAPSHOT'))
    AND sensor_mid_range_mm > 0 AND sensor_mid_range_mm < 1e6 AND sensor_range_mm > 0 AND sensor_range_mm < 1e6
    AND sensor_line_angle_deg > 0 AND sensor_line_angle_deg < 180);
COMMENT ON COLUMN machine_revisions.sensor_column_count IS 'Of a line scanner; 0: a snapshot sensor has none.';

ALTER TABLE scans
  ADD COLUMN cloud text,
  ADD COLUMN length_unit text,
  DROP CONSTRAINT scans_pitch_positive,
  DROP CONSTRAINT scans_columns_positive,
  ADD CONSTRAINT scans_cloud_known CHECK (cloud IN ('PROFILES', 'SNAPSHOT')),
  ADD CONSTRAINT scans_length_unit_known CHECK (length_unit IN ('MILLIMETRE', 'METRE', 'INCH')),
  ADD CONSTRAINT scans_profiles_or_snapshot CHECK (CASE cloud WHEN 'SNAPSHOT'
    THEN profile_pitch_mm = 0 AND columns_per_profile = 0 AND profile_count IS NULL AND length_unit IS NOT NULL
      AND stored_encoding = 'draco'
    ELSE profile_pitch_mm > 0 AND profile_pitch_mm < 1e6 AND columns_per_profile > 0 END);
COMMENT ON COLUMN scans.cloud IS
  'SNAPSHOT: points as they stand, in any order; PROFILES, NULL: of a line scanner, one profile behind the other.';
COMMENT ON COLUMN scans.length_unit IS 'Of the coordinates as they were sent; what is stored is in mm. NULL: mm, of profiles.';
COMMENT ON COLUMN scans.stored_encoding IS
  'draco: the points that the machine sent, to the last bit, or a snapshot''s, encoded here; range_image: profiles encoded here.';
COMMENT ON COLUMN scans.profile_count IS 'NULL: a snapshot, or from before profiles were counted.';
COMMENT ON COLUMN scan_blocks.profile_count IS 'NULL: of a snapshot, or from before profiles were counted.';

ALTER TABLE scan_upload_blocks
  DROP CONSTRAINT scan_upload_blocks_counts,
  ADD CONSTRAINT scan_upload_blocks_counts CHECK (point_count > 0 AND first_profile >= 0 AND profile_count >= 0);
COMMENT ON COLUMN scan_upload_blocks.profile_count IS '0: of a snapshot.';

ALTER TABLE calibrations
  DROP CONSTRAINT calibrations_method_fits_kind,
  ADD CONSTRAINT calibrations_method_fits_kind CHECK (kind = 'sensor' AND method IN ('JOINT', 'SEQUENTIAL', 'STATED')
    OR kind = 'rotation' AND method IN ('LINES', 'POINT_C', 'STANDARD')
    OR kind = 'probe' AND method IN ('WEIGHTED', 'LINEAR') OR kind = 'axis' AND method = 'ENCODER_RUN');

ALTER TABLE sensor_calibrations
  ADD COLUMN certificate text,
  ALTER COLUMN noise_um DROP NOT NULL,
  ALTER COLUMN touch_rms_um DROP NOT NULL,
  ALTER COLUMN residual_rms_um DROP NOT NULL,
  ALTER COLUMN condition_number DROP NOT NULL,
  ALTER COLUMN points_used DROP NOT NULL,
  ADD CONSTRAINT sensor_calibrations_certificate_named CHECK (octet_length(certificate) BETWEEN 1 AND 200),
  ADD CONSTRAINT sensor_calibrations_measured_or_stated CHECK (
    num_nulls(noise_um, touch_rms_um, residual_rms_um, condition_number, points_used) =
      CASE WHEN certificate IS NULL THEN 0 ELSE 5 END);
COMMENT ON TABLE sensor_calibrations IS
  'p_machine = R_sm (0, y, z) + (x, 0, 0) - V0 + T_sm for a scan point (x, y, z) of a line scanner, R_sm (x, y, z) - V0 + T_sm of a snapshot '
  'sensor; R_sm = Rz(gamma) Ry(beta) Rx(alpha).';
COMMENT ON COLUMN sensor_calibrations.certificate IS
  'Of method STATED: what says how the sensor stands. NULL: it was measured here, as the evidence shows.';
