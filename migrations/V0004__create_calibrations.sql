-- What the plant knows of its machines' geometry. One row for each calibration; its result in the table of its kind.

CREATE TABLE calibrations (
  calibration_id text COLLATE "C" NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  kind text NOT NULL,
  method text NOT NULL,
  inputs text[] NOT NULL,
  request_sha256 text COLLATE "C" NOT NULL,
  valid_from timestamptz NOT NULL,
  valid_until timestamptz NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  record_sequence bigint NOT NULL,
  recorded_at timestamptz NOT NULL,
  CONSTRAINT calibrations_pk PRIMARY KEY (calibration_id),
  CONSTRAINT calibrations_kind_unique UNIQUE (calibration_id, kind),
  CONSTRAINT calibrations_machine_fk FOREIGN KEY (machine_id) REFERENCES machines (machine_id),
  CONSTRAINT calibrations_request_fk FOREIGN KEY (request_sha256) REFERENCES blobs (sha256),
  CONSTRAINT calibrations_record_fk FOREIGN KEY (record_sequence) REFERENCES record_entries (record_sequence),
  CONSTRAINT calibrations_record_once UNIQUE (record_sequence),
  CONSTRAINT calibrations_id_form CHECK (calibration_id ~ '^[0-9a-f-]{36}$'),
  CONSTRAINT calibrations_method_fits_kind CHECK (kind = 'sensor' AND method IN ('JOINT', 'SEQUENTIAL')
                                                  OR kind = 'rotation' AND method IN ('LINES', 'POINT_C')),
  CONSTRAINT calibrations_inputs_named CHECK (array_position(inputs, NULL) IS NULL),
  CONSTRAINT calibrations_validity_ordered CHECK (isfinite(valid_from) AND isfinite(valid_until)
                                                  AND valid_from < valid_until),
  CONSTRAINT calibrations_software_named CHECK (software_version <> '')
);
CREATE INDEX calibrations_by_machine ON calibrations (machine_id, kind, record_sequence);
COMMENT ON TABLE calibrations IS
  'In force at a moment: of those of a machine and kind whose validity covers it, the one of the greatest record_sequence.';
COMMENT ON COLUMN calibrations.inputs IS 'Resource names: machine and artefact with @revision, scans.';
COMMENT ON COLUMN calibrations.request_sha256 IS
  'The request as it came, with its touch data or sphere poses: with the scans, all that the result is computed from.';
COMMENT ON COLUMN calibrations.valid_until IS 'First moment at which it is no longer valid.';

CREATE TABLE sensor_calibrations (
  calibration_id text COLLATE "C" NOT NULL,
  kind text NOT NULL DEFAULT 'sensor',
  machine_from_sensor_rotation double precision[] NOT NULL,
  t_sm_mm double precision[] NOT NULL,
  covariance double precision[] NOT NULL,
  alpha_deg double precision NOT NULL,
  beta_deg double precision NOT NULL,
  gamma_deg double precision NOT NULL,
  alpha_standard_uncertainty_deg double precision NOT NULL,
  beta_standard_uncertainty_deg double precision NOT NULL,
  gamma_standard_uncertainty_deg double precision NOT NULL,
  noise_um double precision NOT NULL,
  touch_rms_um double precision NOT NULL,
  residual_rms_um double precision NOT NULL,
  condition_number double precision NOT NULL,
  points_used bigint NOT NULL,
  CONSTRAINT sensor_calibrations_pk PRIMARY KEY (calibration_id),
  CONSTRAINT sensor_calibrations_calibration_fk FOREIGN KEY (calibration_id, kind)
    REFERENCES calibrations (calibration_id, kind),
  CONSTRAINT sensor_calibrations_kind CHECK (kind = 'sensor'),
  CONSTRAINT sensor_calibrations_rotation_nine CHECK (cardinality(machine_from_sensor_rotation) = 9
    AND array_position(machine_from_sensor_rotation, NULL) IS NULL
    AND 1.000001 > ALL (machine_from_sensor_rotation) AND -1.000001 < ALL (machine_from_sensor_rotation)),
  CONSTRAINT sensor_calibrations_t_sm_three CHECK (cardinality(t_sm_mm) = 3 AND array_position(t_sm_mm, NULL) IS NULL
    AND 1e6 > ALL (t_sm_mm) AND -1e6 < ALL (t_sm_mm)),
  CONSTRAINT sensor_calibrations_covariance_finite CHECK (cardinality(covariance) = 36
    AND array_position(covariance, NULL) IS NULL AND 1e6 > ALL (covariance) AND -1e6 < ALL (covariance)),
  CONSTRAINT sensor_calibrations_variance_positive CHECK (covariance[1] > 0 AND covariance[8] > 0 AND covariance[15] > 0
    AND covariance[22] > 0 AND covariance[29] > 0 AND covariance[36] > 0),
  CONSTRAINT sensor_calibrations_angles_in_circle CHECK (abs(alpha_deg) <= 180 AND abs(beta_deg) <= 90
    AND abs(gamma_deg) <= 180),
  CONSTRAINT sensor_calibrations_uncertainty_positive CHECK (alpha_standard_uncertainty_deg > 0
    AND alpha_standard_uncertainty_deg < 180 AND beta_standard_uncertainty_deg > 0
    AND beta_standard_uncertainty_deg < 180 AND gamma_standard_uncertainty_deg > 0
    AND gamma_standard_uncertainty_deg < 180),
  CONSTRAINT sensor_calibrations_evidence_finite CHECK (noise_um >= 0 AND noise_um < 1e6 AND touch_rms_um >= 0
    AND touch_rms_um < 1e6 AND residual_rms_um >= 0 AND residual_rms_um < 1e6 AND condition_number >= 1
    AND condition_number < 1e300),
  CONSTRAINT sensor_calibrations_points_positive CHECK (points_used > 0)
);
COMMENT ON TABLE sensor_calibrations IS
  'p_machine = R_sm (0, y, z) + (x, 0, 0) - V0 + T_sm for a scan point (x, y, z); R_sm = Rz(gamma) Ry(beta) Rx(alpha).';
COMMENT ON COLUMN sensor_calibrations.machine_from_sensor_rotation IS 'R_sm, 3 x 3, row-major.';
COMMENT ON COLUMN sensor_calibrations.covariance IS
  '6 x 6, row-major: rotation vector of R_sm in machine axes (rad), T_sm (mm). Units rad^2, rad mm, mm^2.';
COMMENT ON COLUMN sensor_calibrations.noise_um IS 'Of one laser reading along its ray, from the residuals.';
COMMENT ON COLUMN sensor_calibrations.touch_rms_um IS 'Touched coordinates about the fit.';

CREATE TABLE sensor_calibration_centres (
  calibration_id text COLLATE "C" NOT NULL,
  position_index integer NOT NULL,
  scan_id text COLLATE "C" NOT NULL,
  feature text NOT NULL,
  is_check boolean NOT NULL,
  dx_um double precision NOT NULL,
  dy_um double precision NOT NULL,
  dz_um double precision NOT NULL,
  CONSTRAINT sensor_calibration_centres_pk PRIMARY KEY (calibration_id, position_index),
  CONSTRAINT sensor_calibration_centres_calibration_fk FOREIGN KEY (calibration_id)
    REFERENCES sensor_calibrations (calibration_id),
  CONSTRAINT sensor_calibration_centres_scan_fk FOREIGN KEY (scan_id) REFERENCES scans (scan_id),
  CONSTRAINT sensor_calibration_centres_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT sensor_calibration_centres_finite CHECK (abs(dx_um) < 1e9 AND abs(dy_um) < 1e9 AND abs(dz_um) < 1e9)
);
CREATE INDEX sensor_calibration_centres_by_scan ON sensor_calibration_centres (scan_id);
COMMENT ON TABLE sensor_calibration_centres IS 'Laser minus touch at the centre of each cone and slot, machine frame.';
COMMENT ON COLUMN sensor_calibration_centres.is_check IS 'A slot: it took no part in the fit.';

CREATE TABLE rotation_calibrations (
  calibration_id text COLLATE "C" NOT NULL,
  kind text NOT NULL DEFAULT 'rotation',
  a_direction double precision[] NOT NULL,
  a_point_mm double precision[] NOT NULL,
  b_direction double precision[] NOT NULL,
  b_point_mm double precision[] NOT NULL,
  covariance double precision[] NOT NULL,
  point_c_mm double precision[] NOT NULL,
  point_c_standard_uncertainty_mm double precision[] NOT NULL,
  noise_um double precision NOT NULL,
  residual_rms_um double precision NOT NULL,
  check_rms_um double precision NOT NULL,
  check_count integer NOT NULL,
  condition_number double precision NOT NULL,
  CONSTRAINT rotation_calibrations_pk PRIMARY KEY (calibration_id),
  CONSTRAINT rotation_calibrations_calibration_fk FOREIGN KEY (calibration_id, kind)
    REFERENCES calibrations (calibration_id, kind),
  CONSTRAINT rotation_calibrations_kind CHECK (kind = 'rotation'),
  CONSTRAINT rotation_calibrations_a_direction_unit CHECK (cardinality(a_direction) = 3
    AND array_position(a_direction, NULL) IS NULL
    AND abs(sqrt(a_direction[1] * a_direction[1] + a_direction[2] * a_direction[2] + a_direction[3] * a_direction[3]) - 1)
      < 1e-9),
  CONSTRAINT rotation_calibrations_b_direction_unit CHECK (cardinality(b_direction) = 3
    AND array_position(b_direction, NULL) IS NULL
    AND abs(sqrt(b_direction[1] * b_direction[1] + b_direction[2] * b_direction[2] + b_direction[3] * b_direction[3]) - 1)
      < 1e-9),
  CONSTRAINT rotation_calibrations_points_finite CHECK (cardinality(a_point_mm) = 3 AND cardinality(b_point_mm) = 3
    AND cardinality(point_c_mm) = 3 AND array_position(a_point_mm || b_point_mm || point_c_mm, NULL) IS NULL
    AND 1e6 > ALL (a_point_mm || b_point_mm || point_c_mm) AND -1e6 < ALL (a_point_mm || b_point_mm || point_c_mm)),
  CONSTRAINT rotation_calibrations_covariance_finite CHECK (cardinality(covariance) = 64
    AND array_position(covariance, NULL) IS NULL AND 1e6 > ALL (covariance) AND -1e6 < ALL (covariance)),
  CONSTRAINT rotation_calibrations_uncertainty_finite CHECK (cardinality(point_c_standard_uncertainty_mm) = 3
    AND array_position(point_c_standard_uncertainty_mm, NULL) IS NULL
    AND 0 <= ALL (point_c_standard_uncertainty_mm) AND 1e6 > ALL (point_c_standard_uncertainty_mm)),
  CONSTRAINT rotation_calibrations_evidence_finite CHECK (noise_um >= 0 AND noise_um < 1e6 AND residual_rms_um >= 0
    AND residual_rms_um < 1e6 AND check_rms_um >= 0 AND check_rms_um < 1e6 AND check_count >= 0
    AND condition_number >= 1 AND condition_number < 1e300)
);
COMMENT ON TABLE rotation_calibrations IS
  'The rotary axes as lines in the machine frame at A = B = 0. A turns first from the bed and carries B.';
COMMENT ON COLUMN rotation_calibrations.covariance IS
  '8 x 8, row-major, per axis A, B: direction across (2, rad), point across (2, mm), in tangent coordinates.';
COMMENT ON COLUMN rotation_calibrations.point_c_mm IS 'The point of the A axis nearest to the B axis.';

CREATE TABLE rotation_calibration_poses (
  calibration_id text COLLATE "C" NOT NULL,
  position_index integer NOT NULL,
  a_deg double precision NOT NULL,
  b_deg double precision NOT NULL,
  distance_um double precision NOT NULL,
  held_out boolean NOT NULL,
  CONSTRAINT rotation_calibration_poses_pk PRIMARY KEY (calibration_id, position_index),
  CONSTRAINT rotation_calibration_poses_calibration_fk FOREIGN KEY (calibration_id)
    REFERENCES rotation_calibrations (calibration_id),
  CONSTRAINT rotation_calibration_poses_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT rotation_calibration_poses_finite CHECK (abs(a_deg) < 1e6 AND abs(b_deg) < 1e6 AND distance_um >= 0
    AND distance_um < 1e9)
);
COMMENT ON TABLE rotation_calibration_poses IS 'The error curve: each sphere pose''s distance from the fitted axes.';

CREATE TRIGGER calibrations_append_only BEFORE UPDATE OR DELETE ON calibrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER calibrations_no_truncate BEFORE TRUNCATE ON calibrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER sensor_calibrations_append_only BEFORE UPDATE OR DELETE ON sensor_calibrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER sensor_calibrations_no_truncate BEFORE TRUNCATE ON sensor_calibrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER sensor_calibration_centres_append_only BEFORE UPDATE OR DELETE ON sensor_calibration_centres
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER sensor_calibration_centres_no_truncate BEFORE TRUNCATE ON sensor_calibration_centres
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER rotation_calibrations_append_only BEFORE UPDATE OR DELETE ON rotation_calibrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER rotation_calibrations_no_truncate BEFORE TRUNCATE ON rotation_calibrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER rotation_calibration_poses_append_only BEFORE UPDATE OR DELETE ON rotation_calibration_poses
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER rotation_calibration_poses_no_truncate BEFORE TRUNCATE ON rotation_calibration_poses
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
