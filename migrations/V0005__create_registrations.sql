-- Where a blade stands: one row for each registration, the scans it was made from and, for six-point, its datum points.

CREATE TABLE registrations (
  registration_id text COLLATE "C" NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  method text NOT NULL,
  sensor_calibration_id text COLLATE "C" NOT NULL,
  rotation_calibration_id text COLLATE "C" NOT NULL,
  outcome text NOT NULL,
  zero_from_part double precision[] NOT NULL,
  reference_mm double precision[] NOT NULL,
  covariance double precision[] NOT NULL,
  noise_covariance double precision[] NOT NULL,
  calibration_sensitivity double precision[] NOT NULL,
  point_count bigint NOT NULL,
  points_used bigint NOT NULL,
  iteration_count integer NOT NULL,
  residual_rms_um double precision NOT NULL,
  residual_sigma_um double precision NOT NULL,
  condition_number double precision NOT NULL,
  weakest_direction double precision[] NOT NULL,
  weakest_standard_uncertainty_um double precision NOT NULL,
  remark text NOT NULL,
  compute_seconds double precision NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  record_sequence bigint NOT NULL,
  recorded_at timestamptz NOT NULL,
  CONSTRAINT registrations_pk PRIMARY KEY (registration_id),
  CONSTRAINT registrations_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT registrations_machine_fk FOREIGN KEY (machine_id) REFERENCES machines (machine_id),
  CONSTRAINT registrations_part_fk FOREIGN KEY (part_id) REFERENCES parts (part_id),
  CONSTRAINT registrations_sensor_calibration_fk FOREIGN KEY (sensor_calibration_id)
    REFERENCES calibrations (calibration_id),
  CONSTRAINT registrations_rotation_calibration_fk FOREIGN KEY (rotation_calibration_id)
    REFERENCES calibrations (calibration_id),
  CONSTRAINT registrations_record_fk FOREIGN KEY (record_sequence) REFERENCES record_entries (record_sequence),
  CONSTRAINT registrations_record_once UNIQUE (record_sequence),
  CONSTRAINT registrations_id_form CHECK (registration_id ~ '^[0-9a-f-]{36}$'),
  CONSTRAINT registrations_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0),
  CONSTRAINT registrations_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS')),
  CONSTRAINT registrations_outcome_known
    CHECK (outcome IN ('CONVERGED', 'NOT_CONVERGED', 'NOT_DETERMINED', 'TOO_LITTLE_OVERLAP')),
  CONSTRAINT registrations_pose_only_where_converged CHECK (CASE WHEN outcome = 'CONVERGED'
    THEN cardinality(zero_from_part) = 12 AND cardinality(reference_mm) = 3 AND cardinality(covariance) = 36
      AND cardinality(noise_covariance) = 36 AND cardinality(calibration_sensitivity) = 84
    ELSE cardinality(zero_from_part) = 0 AND cardinality(reference_mm) = 0 AND cardinality(covariance) = 0
      AND cardinality(noise_covariance) = 0 AND cardinality(calibration_sensitivity) = 0 END),
  CONSTRAINT registrations_values_finite CHECK (NOT (zero_from_part || reference_mm || covariance || noise_covariance
    || calibration_sensitivity || weakest_direction && ARRAY['NaN', 'Infinity', '-Infinity']::double precision[])),
  CONSTRAINT registrations_direction_count CHECK (cardinality(weakest_direction) = 6),
  CONSTRAINT registrations_counts_possible CHECK (points_used >= 0 AND points_used <= point_count AND iteration_count >= 0),
  CONSTRAINT registrations_figures_finite CHECK (residual_rms_um >= 0 AND residual_rms_um < 1e9
    AND residual_sigma_um >= 0 AND residual_sigma_um < 1e9 AND condition_number >= 1 AND condition_number < 1e15
    AND weakest_standard_uncertainty_um >= 0 AND weakest_standard_uncertainty_um < 1e15
    AND compute_seconds >= 0 AND compute_seconds < 1e9),
  CONSTRAINT registrations_software_named CHECK (software_version <> '')
);
CREATE INDEX registrations_by_blade ON registrations (blade_serial, record_sequence);
CREATE INDEX registrations_by_sensor_calibration ON registrations (sensor_calibration_id);
CREATE INDEX registrations_by_rotation_calibration ON registrations (rotation_calibration_id);
COMMENT ON TABLE registrations IS 'A fit that did not converge is kept with its evidence and has no pose.';
COMMENT ON COLUMN registrations.zero_from_part IS
  'CAD millimetres to machine coordinates at A = B = 0: three rows of four, rotation and translation (mm).';
COMMENT ON COLUMN registrations.reference_mm IS 'The point about which the covariances'' rotation vector turns.';
COMMENT ON COLUMN registrations.covariance IS
  '6 x 6 by rows: rotation vector (rad), translation (mm); from noise and calibrations together.';
COMMENT ON COLUMN registrations.noise_covariance IS 'The part of it that comes from the scanner''s noise.';
COMMENT ON COLUMN registrations.calibration_sensitivity IS
  '6 x 14 by rows: pose per sensor rotation vector (3, rad), T_sm (3, mm) and the eight axis parameters.';
COMMENT ON COLUMN registrations.point_count IS 'Points looked at, after thinning.';
COMMENT ON COLUMN registrations.weakest_direction IS
  'The pose change that the points hold least: rotation times the part''s radius of gyration, translation; unit.';

CREATE TABLE registration_scans (
  registration_id text COLLATE "C" NOT NULL,
  position_index integer NOT NULL,
  scan_id text COLLATE "C" NOT NULL,
  point_count bigint NOT NULL,
  points_used bigint NOT NULL,
  residual_median_um double precision NOT NULL,
  CONSTRAINT registration_scans_pk PRIMARY KEY (registration_id, position_index),
  CONSTRAINT registration_scans_once UNIQUE (registration_id, scan_id),
  CONSTRAINT registration_scans_registration_fk FOREIGN KEY (registration_id) REFERENCES registrations (registration_id),
  CONSTRAINT registration_scans_scan_fk FOREIGN KEY (scan_id) REFERENCES scans (scan_id),
  CONSTRAINT registration_scans_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT registration_scans_counts_possible CHECK (points_used >= 0 AND points_used <= point_count),
  CONSTRAINT registration_scans_median_finite CHECK (abs(residual_median_um) < 1e9)
);
CREATE INDEX registration_scans_by_scan ON registration_scans (scan_id);
COMMENT ON TABLE registration_scans IS 'The scans of a registration, in the order asked, and how the fit took each.';

CREATE TABLE registration_datums (
  registration_id text COLLATE "C" NOT NULL,
  position_index integer NOT NULL,
  datum_name text NOT NULL,
  distance_um double precision NOT NULL,
  standard_uncertainty_um double precision NOT NULL,
  point_count bigint NOT NULL,
  CONSTRAINT registration_datums_pk PRIMARY KEY (registration_id, position_index),
  CONSTRAINT registration_datums_registration_fk FOREIGN KEY (registration_id) REFERENCES registrations (registration_id),
  CONSTRAINT registration_datums_position_of_six CHECK (position_index BETWEEN 0 AND 5),
  CONSTRAINT registration_datums_values_finite CHECK (abs(distance_um) < 1e9 AND standard_uncertainty_um >= 0
    AND standard_uncertainty_um < 1e9 AND point_count >= 0)
);
COMMENT ON TABLE registration_datums IS
  'Six-point: the scanned surface''s height over the best-fitted CAD at each datum point, along its normal.';

CREATE TRIGGER registrations_append_only BEFORE UPDATE OR DELETE ON registrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER registrations_no_truncate BEFORE TRUNCATE ON registrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER registration_scans_append_only BEFORE UPDATE OR DELETE ON registration_scans
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER registration_scans_no_truncate BEFORE TRUNCATE ON registration_scans
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER registration_datums_append_only BEFORE UPDATE OR DELETE ON registration_datums
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER registration_datums_no_truncate BEFORE TRUNCATE ON registration_datums
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
