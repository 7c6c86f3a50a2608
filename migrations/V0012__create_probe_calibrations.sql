-- The point laser probe: a third kind of calibration.

-- Added to whatever kinds and methods are known by now.
DO $$
DECLARE
  known text;
BEGIN
  SELECT pg_get_expr(conbin, conrelid) INTO STRICT known FROM pg_constraint
    WHERE conname = 'calibrations_method_fits_kind' AND conrelid = 'calibrations'::regclass;
  ALTER TABLE calibrations DROP CONSTRAINT calibrations_method_fits_kind;
  EXECUTE format('ALTER TABLE calibrations ADD CONSTRAINT calibrations_method_fits_kind CHECK (%s '
                 'OR kind = ''probe'' AND method IN (''WEIGHTED'', ''LINEAR''))', known);
END
$$;

CREATE TABLE probe_calibrations (
  calibration_id text COLLATE "C" NOT NULL,
  kind text NOT NULL DEFAULT 'probe',
  block text NOT NULL,
  approach double precision[] NOT NULL,
  offset_mm double precision[] NOT NULL,
  covariance double precision[] NOT NULL,
  scale double precision NOT NULL,
  scale_standard_uncertainty double precision NOT NULL,
  direction_standard_uncertainty_urad double precision NOT NULL,
  point_standard_uncertainty_mm double precision[] NOT NULL,
  noise_um double precision NOT NULL,
  noise_factor double precision NOT NULL,
  residual_rms_um double precision NOT NULL,
  touch_rms_um double precision NOT NULL,
  condition_number double precision NOT NULL,
  displacement_matrix_condition_number double precision NOT NULL,
  worst_approach_angle_deg double precision NOT NULL,
  CONSTRAINT probe_calibrations_pk PRIMARY KEY (calibration_id),
  CONSTRAINT probe_calibrations_calibration_fk FOREIGN KEY (calibration_id, kind)
    REFERENCES calibrations (calibration_id, kind),
  CONSTRAINT probe_calibrations_kind CHECK (kind = 'probe'),
  CONSTRAINT probe_calibrations_block_named CHECK (block ~ '^[A-Za-z0-9._-]{1,64}$'),
  CONSTRAINT probe_calibrations_approach_three CHECK (cardinality(approach) = 3
    AND array_position(approach, NULL) IS NULL
    AND abs(sqrt(approach[1] * approach[1] + approach[2] * approach[2] + approach[3] * approach[3]) - scale) < 1e-9),
  CONSTRAINT probe_calibrations_offset_three CHECK (cardinality(offset_mm) = 3
    AND array_position(offset_mm, NULL) IS NULL AND 1e6 > ALL (offset_mm) AND -1e6 < ALL (offset_mm)),
  CONSTRAINT probe_calibrations_covariance_finite CHECK (cardinality(covariance) = 36
    AND array_position(covariance, NULL) IS NULL AND 1e6 > ALL (covariance) AND -1e6 < ALL (covariance)),
  CONSTRAINT probe_calibrations_variance_positive CHECK (covariance[1] > 0 AND covariance[8] > 0 AND covariance[15] > 0
    AND covariance[22] > 0 AND covariance[29] > 0 AND covariance[36] > 0),
  CONSTRAINT probe_calibrations_scale_near_one CHECK (scale > 0.8 AND scale < 1.25),
  CONSTRAINT probe_calibrations_uncertainty_positive CHECK (scale_standard_uncertainty > 0
    AND scale_standard_uncertainty < 1 AND direction_standard_uncertainty_urad > 0
    AND direction_standard_uncertainty_urad < 1e6),
  CONSTRAINT probe_calibrations_point_uncertainty_three CHECK (cardinality(point_standard_uncertainty_mm) = 3
    AND array_position(point_standard_uncertainty_mm, NULL) IS NULL
    AND 0 < ALL (point_standard_uncertainty_mm) AND 1e6 > ALL (point_standard_uncertainty_mm)),
  CONSTRAINT probe_calibrations_evidence_finite CHECK (noise_um > 0 AND noise_um < 1e6 AND noise_factor >= 1
    AND noise_factor < 1e6 AND residual_rms_um >= 0 AND residual_rms_um < 1e6 AND touch_rms_um >= 0
    AND touch_rms_um < 1e6 AND condition_number >= 1 AND condition_number < 1e300
    AND displacement_matrix_condition_number >= 1 AND displacement_matrix_condition_number < 1e300
    AND worst_approach_angle_deg >= 0 AND worst_approach_angle_deg <= 90)
);
COMMENT ON TABLE probe_calibrations IS
  'p_machine = position + offset + displacement * approach for a reading of the point laser probe.';
COMMENT ON COLUMN probe_calibrations.block IS 'The block''s own name; its faces and touched points are in the request.';
COMMENT ON COLUMN probe_calibrations.approach IS 'scale * beam direction, away from the probe; machine frame.';
COMMENT ON COLUMN probe_calibrations.covariance IS
  '6 x 6, row-major: approach (1), offset (mm), machine frame. Units 1, mm, mm^2.';
COMMENT ON COLUMN probe_calibrations.point_standard_uncertainty_mm IS
  'Of a point at mid range, x, y, z, from the calibration alone.';
COMMENT ON COLUMN probe_calibrations.noise_um IS 'Of one displacement, as the request states it.';
COMMENT ON COLUMN probe_calibrations.noise_factor IS 'By which the residuals are worse than stated; in the covariance.';

CREATE TABLE probe_calibration_readings (
  calibration_id text COLLATE "C" NOT NULL,
  position_index integer NOT NULL,
  face text NOT NULL,
  displacement_mm double precision NOT NULL,
  residual_um double precision NOT NULL,
  CONSTRAINT probe_calibration_readings_pk PRIMARY KEY (calibration_id, position_index),
  CONSTRAINT probe_calibration_readings_calibration_fk FOREIGN KEY (calibration_id)
    REFERENCES probe_calibrations (calibration_id),
  CONSTRAINT probe_calibration_readings_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT probe_calibration_readings_finite CHECK (abs(displacement_mm) < 1e6 AND abs(residual_um) < 1e9)
);
COMMENT ON TABLE probe_calibration_readings IS 'Displacement read minus expected, of each reading of the fit.';

CREATE TABLE probe_calibration_checks (
  calibration_id text COLLATE "C" NOT NULL,
  position_index integer NOT NULL,
  face text NOT NULL,
  reading_count integer NOT NULL,
  angle_urad double precision NOT NULL,
  origin_distance_um double precision NOT NULL,
  distance_um double precision NOT NULL,
  residual_range_um double precision NOT NULL,
  CONSTRAINT probe_calibration_checks_pk PRIMARY KEY (calibration_id, position_index),
  CONSTRAINT probe_calibration_checks_calibration_fk FOREIGN KEY (calibration_id)
    REFERENCES probe_calibrations (calibration_id),
  CONSTRAINT probe_calibration_checks_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT probe_calibration_checks_finite CHECK (reading_count >= 3 AND angle_urad >= 0 AND angle_urad < 1e7
    AND abs(origin_distance_um) < 1e9 AND abs(distance_um) < 1e9 AND residual_range_um >= 0 AND residual_range_um < 1e9)
);
COMMENT ON TABLE probe_calibration_checks IS
  'The moved block, face by face: the plane through the probe''s points against the plane that was touched.';

CREATE TRIGGER probe_calibrations_append_only BEFORE UPDATE OR DELETE ON probe_calibrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER probe_calibrations_no_truncate BEFORE TRUNCATE ON probe_calibrations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER probe_calibration_readings_append_only BEFORE UPDATE OR DELETE ON probe_calibration_readings
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER probe_calibration_readings_no_truncate BEFORE TRUNCATE ON probe_calibration_readings
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER probe_calibration_checks_append_only BEFORE UPDATE OR DELETE ON probe_calibration_checks
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER probe_calibration_checks_no_truncate BEFORE TRUNCATE ON probe_calibration_checks
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
