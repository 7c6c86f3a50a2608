-- Calibrations of all kinds, the life of each (draft, release, withdrawal: ADR 14), and studies of measuring capability.

CREATE TABLE calibrations (
  calibration_id uuid NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  kind text NOT NULL,
  method text NOT NULL,
  inputs text[] NOT NULL,
  request_sha256 bytea NOT NULL,
  valid_from timestamptz NOT NULL,
  valid_until timestamptz NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  is_draft boolean NOT NULL DEFAULT false,
  temperature_c double precision,
  temperature_standard_uncertainty_c double precision,
  humidity_percent double precision,
  environment_note text NOT NULL DEFAULT '',
  axis text,
  CONSTRAINT calibrations_pk PRIMARY KEY (calibration_id),
  CONSTRAINT calibrations_kind_unique UNIQUE (calibration_id, kind),
  CONSTRAINT calibrations_machine_fk FOREIGN KEY (machine_id) REFERENCES machines (machine_id),
  CONSTRAINT calibrations_request_fk FOREIGN KEY (request_sha256) REFERENCES blobs (sha256),
  CONSTRAINT calibrations_record_fk FOREIGN KEY (calibration_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT calibrations_inputs_named CHECK (array_position(inputs, NULL) IS NULL),
  CONSTRAINT calibrations_validity_ordered CHECK (isfinite(valid_from) AND isfinite(valid_until)
    AND valid_from < valid_until),
  CONSTRAINT calibrations_software_named CHECK (software_version <> ''),
  CONSTRAINT calibrations_environment CHECK (temperature_c BETWEEN -50 AND 100
    AND temperature_standard_uncertainty_c BETWEEN 0 AND 50 AND humidity_percent BETWEEN 0 AND 100
    AND length(environment_note) <= 1000),
  CONSTRAINT calibrations_uncertain_temperature CHECK (temperature_c IS NOT NULL
    OR temperature_standard_uncertainty_c IS NULL),
  CONSTRAINT calibrations_method_fits_kind CHECK (kind = 'sensor' AND method IN ('JOINT',
      'SEQUENTIAL') OR kind = 'rotation'
    AND method IN ('LINES', 'POINT_C', 'STANDARD') OR kind = 'probe' AND method IN ('WEIGHTED', 'LINEAR') OR kind = 'axis'
    AND method = 'ENCODER_RUN'),
  CONSTRAINT calibrations_axis_fits_kind CHECK ((kind = 'axis') = (axis IS NOT NULL) AND axis IN ('A', 'B', 'C')),
  CONSTRAINT calibrations_requested_by_length CHECK (octet_length(requested_by) <= 200),
  CONSTRAINT calibrations_environment_note_length CHECK (octet_length(environment_note) <= 1000),
  CONSTRAINT calibrations_digests CHECK (octet_length(request_sha256) = 32),
  CONSTRAINT calibrations_texts CHECK (octet_length(software_version) <= 200),
  CONSTRAINT calibrations_inputs_whole CHECK (array_position(inputs, NULL) IS NULL AND cardinality(inputs) <= 1000)
);
CREATE INDEX calibrations_by_request ON calibrations (request_sha256);
COMMENT ON TABLE calibrations IS 'One row for each calibration; which one is in force: calibration_forces.';
COMMENT ON COLUMN calibrations.inputs IS 'Resource names: machine and artefact with @revision, scans.';
COMMENT ON COLUMN calibrations.request_sha256 IS
  'The request as it came, with its touch data or sphere poses: with the scans, all that the result is computed from.';
COMMENT ON COLUMN calibrations.valid_until IS 'First moment at which it is no longer valid.';
COMMENT ON COLUMN calibrations.is_draft IS 'Made as a draft: never in force before its RELEASED event.';
COMMENT ON COLUMN calibrations.temperature_c IS 'Of artefact and machine at the measurement; NULL: not stated.';
COMMENT ON COLUMN calibrations.axis IS 'Of kind axis: the letter of the machine''s rotary joint. NULL for the others.';

CREATE TABLE calibration_events (
  calibration_id uuid NOT NULL,
  event text NOT NULL,
  reason text NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT calibration_events_pk PRIMARY KEY (calibration_id, event),
  CONSTRAINT calibration_events_record_once UNIQUE (record_id),
  CONSTRAINT calibration_events_calibration_fk FOREIGN KEY (calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT calibration_events_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT calibration_events_known CHECK (event IN ('RELEASED', 'WITHDRAWN')),
  CONSTRAINT calibration_events_reason_given CHECK (event <> 'WITHDRAWN' OR reason <> ''),
  CONSTRAINT calibration_events_reason_bounded CHECK (length(reason) <= 1000),
  CONSTRAINT calibration_events_software_named CHECK (software_version <> ''),
  CONSTRAINT calibration_events_requested_by_length CHECK (octet_length(requested_by) <= 200),
  CONSTRAINT calibration_events_reason_length CHECK (octet_length(reason) <= 1000),
  CONSTRAINT calibration_events_texts CHECK (octet_length(software_version) <= 200)
);
COMMENT ON TABLE calibration_events IS
  'What people decided about a calibration after it was made. Each at most once; a withdrawal is for ever.';

CREATE TABLE sensor_calibrations (
  calibration_id uuid NOT NULL,
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
    AND array_position(machine_from_sensor_rotation, NULL) IS NULL AND 1.000001 > ALL (machine_from_sensor_rotation)
    AND -1.000001 < ALL (machine_from_sensor_rotation)),
  CONSTRAINT sensor_calibrations_t_sm_three CHECK (cardinality(t_sm_mm) = 3 AND array_position(t_sm_mm, NULL) IS NULL
    AND 1e6 > ALL (t_sm_mm) AND -1e6 < ALL (t_sm_mm)),
  CONSTRAINT sensor_calibrations_covariance_finite CHECK (cardinality(covariance) = 36
    AND array_position(covariance, NULL) IS NULL AND 1e6 > ALL (covariance) AND -1e6 < ALL (covariance)),
  CONSTRAINT sensor_calibrations_variance_positive CHECK (covariance[1] > 0 AND covariance[8] > 0 AND covariance[15] > 0
    AND covariance[22] > 0 AND covariance[29] > 0 AND covariance[36] > 0),
  CONSTRAINT sensor_calibrations_angles_in_circle CHECK (abs(alpha_deg) <= 180 AND abs(beta_deg) <= 90
    AND abs(gamma_deg) <= 180),
  CONSTRAINT sensor_calibrations_uncertainty_positive CHECK (alpha_standard_uncertainty_deg > 0
    AND alpha_standard_uncertainty_deg < 180 AND beta_standard_uncertainty_deg > 0 AND beta_standard_uncertainty_deg < 180
    AND gamma_standard_uncertainty_deg > 0 AND gamma_standard_uncertainty_deg < 180),
  CONSTRAINT sensor_calibrations_evidence_finite CHECK (noise_um >= 0 AND noise_um < 1e6 AND touch_rms_um >= 0
    AND touch_rms_um < 1e6 AND residual_rms_um >= 0 AND residual_rms_um < 1e6 AND condition_number >= 1
    AND condition_number < 1e300),
  CONSTRAINT sensor_calibrations_points_positive CHECK (points_used > 0),
  CONSTRAINT sensor_calibrations_machine_from_sensor_rotation_whole CHECK (array_position(machine_from_sensor_rotation,
      NULL) IS NULL),
  CONSTRAINT sensor_calibrations_t_sm_mm_whole CHECK (array_position(t_sm_mm, NULL) IS NULL),
  CONSTRAINT sensor_calibrations_covariance_whole CHECK (array_position(covariance, NULL) IS NULL)
);
COMMENT ON TABLE sensor_calibrations IS
  'p_machine = R_sm (0, y, z) + (x, 0, 0) - V0 + T_sm for a scan point (x, y, z); R_sm = Rz(gamma) Ry(beta) Rx(alpha).';
COMMENT ON COLUMN sensor_calibrations.machine_from_sensor_rotation IS 'R_sm, 3 x 3, row-major.';
COMMENT ON COLUMN sensor_calibrations.covariance IS
  '6 x 6, row-major: rotation vector of R_sm in machine axes (rad), T_sm (mm). Units rad^2, rad mm, mm^2.';
COMMENT ON COLUMN sensor_calibrations.noise_um IS 'Of one laser reading along its ray, from the residuals.';
COMMENT ON COLUMN sensor_calibrations.touch_rms_um IS 'Touched coordinates about the fit.';

CREATE TABLE sensor_calibration_centres (
  calibration_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_key uuid NOT NULL,
  feature text NOT NULL,
  is_check boolean NOT NULL,
  dx_um double precision NOT NULL,
  dy_um double precision NOT NULL,
  dz_um double precision NOT NULL,
  CONSTRAINT sensor_calibration_centres_pk PRIMARY KEY (calibration_id, position_index),
  CONSTRAINT sensor_calibration_centres_calibration_fk FOREIGN KEY (calibration_id)
    REFERENCES sensor_calibrations (calibration_id),
  CONSTRAINT sensor_calibration_centres_scan_fk FOREIGN KEY (scan_key) REFERENCES record_names (record_id),
  CONSTRAINT sensor_calibration_centres_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT sensor_calibration_centres_finite CHECK (abs(dx_um) < 1e9 AND abs(dy_um) < 1e9 AND abs(dz_um) < 1e9),
  CONSTRAINT sensor_calibration_centres_texts CHECK (octet_length(feature) <= 200)
);
CREATE INDEX sensor_calibration_centres_by_scan ON sensor_calibration_centres (scan_key);
COMMENT ON TABLE sensor_calibration_centres IS 'Laser minus touch at the centre of each cone and slot, machine frame.';
COMMENT ON COLUMN sensor_calibration_centres.is_check IS 'A slot: it took no part in the fit.';

CREATE TABLE rotation_calibrations (
  calibration_id uuid NOT NULL,
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
  axes text[] NOT NULL DEFAULT '{A,B}',
  CONSTRAINT rotation_calibrations_pk PRIMARY KEY (calibration_id),
  CONSTRAINT rotation_calibrations_calibration_fk FOREIGN KEY (calibration_id, kind)
    REFERENCES calibrations (calibration_id, kind),
  CONSTRAINT rotation_calibrations_kind CHECK (kind = 'rotation'),
  CONSTRAINT rotation_calibrations_a_direction_unit CHECK (cardinality(a_direction) = 3
    AND array_position(a_direction, NULL) IS NULL
    AND abs(sqrt(a_direction[1] * a_direction[1] + a_direction[2] * a_direction[2] + a_direction[3] * a_direction[3]) - 1) <
      1e-9),
  CONSTRAINT rotation_calibrations_b_direction_unit CHECK (cardinality(b_direction) = 3
    AND array_position(b_direction, NULL) IS NULL
    AND abs(sqrt(b_direction[1] * b_direction[1] + b_direction[2] * b_direction[2] + b_direction[3] * b_direction[3]) - 1) <
      1e-9),
  CONSTRAINT rotation_calibrations_points_finite CHECK (cardinality(a_point_mm) = 3 AND cardinality(b_point_mm) = 3
    AND cardinality(point_c_mm) = 3 AND array_position(a_point_mm || b_point_mm || point_c_mm, NULL) IS NULL
    AND 1e6 > ALL (a_point_mm || b_point_mm || point_c_mm) AND -1e6 < ALL (a_point_mm || b_point_mm || point_c_mm)),
  CONSTRAINT rotation_calibrations_covariance_finite CHECK (cardinality(covariance) = 64
    AND array_position(covariance, NULL) IS NULL AND 1e6 > ALL (covariance) AND -1e6 < ALL (covariance)),
  CONSTRAINT rotation_calibrations_uncertainty_finite CHECK (cardinality(point_c_standard_uncertainty_mm) = 3
    AND array_position(point_c_standard_uncertainty_mm, NULL) IS NULL AND 0 <= ALL (point_c_standard_uncertainty_mm)
    AND 1e6 > ALL (point_c_standard_uncertainty_mm)),
  CONSTRAINT rotation_calibrations_evidence_finite CHECK (noise_um >= 0 AND noise_um < 1e6 AND residual_rms_um >= 0
    AND residual_rms_um < 1e6 AND check_rms_um >= 0 AND check_rms_um < 1e6 AND check_count >= 0 AND condition_number >= 1
    AND condition_number < 1e300),
  CONSTRAINT rotation_calibrations_axes_two CHECK (cardinality(axes) = 2 AND array_position(axes, NULL) IS NULL
    AND axes[1] IN ('A', 'B', 'C') AND axes[2] IN ('A', 'B', 'C') AND axes[1] <> axes[2]),
  CONSTRAINT rotation_calibrations_a_direction_whole CHECK (array_position(a_direction, NULL) IS NULL),
  CONSTRAINT rotation_calibrations_a_point_mm_whole CHECK (array_position(a_point_mm, NULL) IS NULL),
  CONSTRAINT rotation_calibrations_b_direction_whole CHECK (array_position(b_direction, NULL) IS NULL),
  CONSTRAINT rotation_calibrations_b_point_mm_whole CHECK (array_position(b_point_mm, NULL) IS NULL),
  CONSTRAINT rotation_calibrations_covariance_whole CHECK (array_position(covariance, NULL) IS NULL),
  CONSTRAINT rotation_calibrations_point_c_mm_whole CHECK (array_position(point_c_mm, NULL) IS NULL),
  CONSTRAINT rotation_calibrations_point_c_standard_uncertainty_mm_whole CHECK
      (array_position(point_c_standard_uncertainty_mm, NULL) IS NULL),
  CONSTRAINT rotation_calibrations_axes_whole CHECK (array_position(axes, NULL) IS NULL AND cardinality(axes) <= 1000)
);
COMMENT ON TABLE rotation_calibrations IS
  'The rotary axes as lines in the machine frame at A = B = 0. A turns first from the bed and carries B.';
COMMENT ON COLUMN rotation_calibrations.covariance IS
  '8 x 8, row-major, per axis A, B: direction across (2, rad), point across (2, mm), in tangent coordinates.';
COMMENT ON COLUMN rotation_calibrations.point_c_mm IS 'The point of the A axis nearest to the B axis.';
COMMENT ON COLUMN rotation_calibrations.axes IS
  'The machine''s letters of what the other columns call a (on the bed) and b (carried by it).';

CREATE TABLE rotation_calibration_poses (
  calibration_id uuid NOT NULL,
  position_index integer NOT NULL,
  a_deg double precision NOT NULL,
  b_deg double precision NOT NULL,
  distance_um double precision NOT NULL,
  held_out boolean NOT NULL,
  before_um double precision,
  CONSTRAINT rotation_calibration_poses_pk PRIMARY KEY (calibration_id, position_index),
  CONSTRAINT rotation_calibration_poses_calibration_fk FOREIGN KEY (calibration_id)
    REFERENCES rotation_calibrations (calibration_id),
  CONSTRAINT rotation_calibration_poses_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT rotation_calibration_poses_finite CHECK (abs(a_deg) < 1e6 AND abs(b_deg) < 1e6 AND distance_um >= 0
    AND distance_um < 1e9),
  CONSTRAINT rotation_calibration_poses_before CHECK (before_um >= 0 AND before_um < 1e9)
);
COMMENT ON TABLE rotation_calibration_poses IS 'The error curve: each sphere pose''s distance from the fitted axes.';
COMMENT ON COLUMN rotation_calibration_poses.before_um IS
  'Distance from the axes of the machine''s record, the sphere where it suits them best.';

CREATE TABLE probe_calibrations (
  calibration_id uuid NOT NULL,
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
  CONSTRAINT probe_calibrations_approach_three CHECK (cardinality(approach) = 3 AND array_position(approach, NULL) IS NULL
    AND abs(sqrt(approach[1] * approach[1] + approach[2] * approach[2] + approach[3] * approach[3]) - scale) < 1e-9),
  CONSTRAINT probe_calibrations_offset_three CHECK (cardinality(offset_mm) = 3 AND array_position(offset_mm, NULL) IS NULL
    AND 1e6 > ALL (offset_mm) AND -1e6 < ALL (offset_mm)),
  CONSTRAINT probe_calibrations_covariance_finite CHECK (cardinality(covariance) = 36
    AND array_position(covariance, NULL) IS NULL AND 1e6 > ALL (covariance) AND -1e6 < ALL (covariance)),
  CONSTRAINT probe_calibrations_variance_positive CHECK (covariance[1] > 0 AND covariance[8] > 0 AND covariance[15] > 0
    AND covariance[22] > 0 AND covariance[29] > 0 AND covariance[36] > 0),
  CONSTRAINT probe_calibrations_scale_near_one CHECK (scale > 0.8 AND scale < 1.25),
  CONSTRAINT probe_calibrations_uncertainty_positive CHECK (scale_standard_uncertainty > 0 AND scale_standard_uncertainty
      < 1
    AND direction_standard_uncertainty_urad > 0 AND direction_standard_uncertainty_urad < 1e6),
  CONSTRAINT probe_calibrations_point_uncertainty_three CHECK (cardinality(point_standard_uncertainty_mm) = 3
    AND array_position(point_standard_uncertainty_mm, NULL) IS NULL AND 0 < ALL (point_standard_uncertainty_mm)
    AND 1e6 > ALL (point_standard_uncertainty_mm)),
  CONSTRAINT probe_calibrations_evidence_finite CHECK (noise_um > 0 AND noise_um < 1e6 AND noise_factor >= 1
    AND noise_factor < 1e6 AND residual_rms_um >= 0 AND residual_rms_um < 1e6 AND touch_rms_um >= 0 AND touch_rms_um < 1e6
    AND condition_number >= 1 AND condition_number < 1e300 AND displacement_matrix_condition_number >= 1
    AND displacement_matrix_condition_number < 1e300 AND worst_approach_angle_deg >= 0 AND worst_approach_angle_deg <= 90),
  CONSTRAINT probe_calibrations_approach_whole CHECK (array_position(approach, NULL) IS NULL),
  CONSTRAINT probe_calibrations_offset_mm_whole CHECK (array_position(offset_mm, NULL) IS NULL),
  CONSTRAINT probe_calibrations_covariance_whole CHECK (array_position(covariance, NULL) IS NULL),
  CONSTRAINT probe_calibrations_point_standard_uncertainty_mm_whole CHECK (array_position(point_standard_uncertainty_mm,
      NULL) IS NULL)
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
  calibration_id uuid NOT NULL,
  position_index integer NOT NULL,
  face text NOT NULL,
  displacement_mm double precision NOT NULL,
  residual_um double precision NOT NULL,
  CONSTRAINT probe_calibration_readings_pk PRIMARY KEY (calibration_id, position_index),
  CONSTRAINT probe_calibration_readings_calibration_fk FOREIGN KEY (calibration_id)
    REFERENCES probe_calibrations (calibration_id),
  CONSTRAINT probe_calibration_readings_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT probe_calibration_readings_finite CHECK (abs(displacement_mm) < 1e6 AND abs(residual_um) < 1e9),
  CONSTRAINT probe_calibration_readings_texts CHECK (octet_length(face) <= 200)
);
COMMENT ON TABLE probe_calibration_readings IS 'Displacement read minus expected, of each reading of the fit.';

CREATE TABLE probe_calibration_checks (
  calibration_id uuid NOT NULL,
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
    AND abs(origin_distance_um) < 1e9 AND abs(distance_um) < 1e9 AND residual_range_um >= 0 AND residual_range_um < 1e9),
  CONSTRAINT probe_calibration_checks_texts CHECK (octet_length(face) <= 200)
);
COMMENT ON TABLE probe_calibration_checks IS
  'The moved block, face by face: the plane through the probe''s points against the plane that was touched.';

CREATE TABLE axis_characterisations (
  calibration_id uuid NOT NULL,
  reading_count integer NOT NULL,
  reversal_deg double precision[] NOT NULL,
  mean_deg double precision[] NOT NULL,
  long_wave_order integer NOT NULL,
  long_wave_amplitude_deg double precision[] NOT NULL,
  periodic_order integer,
  periodic_amplitude_deg double precision[],
  least_detectable_deg double precision NOT NULL,
  greatest_error_deg double precision[] NOT NULL,
  greatest_error_at_deg double precision NOT NULL,
  greatest_error_forward boolean NOT NULL,
  standard_uncertainty_deg double precision[] NOT NULL,
  compensated_standard_uncertainty_deg double precision[] NOT NULL,
  noise_deg double precision[] NOT NULL,
  forward_error_deg double precision[] NOT NULL,
  backward_error_deg double precision[] NOT NULL,
  table_standard_uncertainty_deg double precision NOT NULL,
  kind text NOT NULL DEFAULT 'axis',
  beyond_limits_count integer,
  CONSTRAINT axis_characterisations_pk PRIMARY KEY (calibration_id),
  CONSTRAINT axis_characterisations_calibration_fk FOREIGN KEY (calibration_id, kind)
    REFERENCES calibrations (calibration_id, kind),
  CONSTRAINT axis_characterisations_readings CHECK (reading_count > 0),
  CONSTRAINT axis_characterisations_estimates CHECK (cardinality(reversal_deg) = 2 AND cardinality(mean_deg) = 2
    AND cardinality(long_wave_amplitude_deg) = 2 AND cardinality(greatest_error_deg) = 2
    AND cardinality(standard_uncertainty_deg) = 2 AND cardinality(compensated_standard_uncertainty_deg) = 2
    AND cardinality(noise_deg) = 2
    AND array_position(reversal_deg || mean_deg || long_wave_amplitude_deg || greatest_error_deg || standard_uncertainty_deg
      || compensated_standard_uncertainty_deg || noise_deg, NULL) IS NULL
    AND 10 > ALL (reversal_deg || mean_deg || long_wave_amplitude_deg || greatest_error_deg || standard_uncertainty_deg ||
      compensated_standard_uncertainty_deg || noise_deg)
    AND -10 < ALL (reversal_deg || mean_deg || long_wave_amplitude_deg || greatest_error_deg || standard_uncertainty_deg ||
      compensated_standard_uncertainty_deg || noise_deg)),
  CONSTRAINT axis_characterisations_uncertainty_positive CHECK (reversal_deg[2] >= 0 AND mean_deg[2] >= 0
    AND long_wave_amplitude_deg[2] >= 0 AND greatest_error_deg[2] >= 0 AND standard_uncertainty_deg[2] >= 0
    AND compensated_standard_uncertainty_deg[2] >= 0 AND noise_deg[2] >= 0 AND table_standard_uncertainty_deg >= 0
    AND table_standard_uncertainty_deg < 10 AND least_detectable_deg >= 0 AND least_detectable_deg < 10),
  CONSTRAINT axis_characterisations_periodic CHECK (long_wave_order BETWEEN 1 AND 3 AND (periodic_order IS NULL
    AND periodic_amplitude_deg IS NULL OR periodic_order > 3 AND cardinality(periodic_amplitude_deg) = 2
    AND array_position(periodic_amplitude_deg, NULL) IS NULL AND 0 <= ALL (periodic_amplitude_deg)
    AND 10 > ALL (periodic_amplitude_deg))),
  CONSTRAINT axis_characterisations_greatest_at CHECK (greatest_error_at_deg >= 0 AND greatest_error_at_deg < 360),
  CONSTRAINT axis_characterisations_table CHECK (cardinality(forward_error_deg) BETWEEN 4 AND 100000
    AND cardinality(backward_error_deg) = cardinality(forward_error_deg)
    AND array_position(forward_error_deg || backward_error_deg, NULL) IS NULL
    AND 5 > ALL (forward_error_deg || backward_error_deg) AND -5 < ALL (forward_error_deg || backward_error_deg)),
  CONSTRAINT axis_characterisations_beyond_limits CHECK (beyond_limits_count BETWEEN 0 AND reading_count),
  CONSTRAINT axis_characterisations_kind CHECK (kind = 'axis'),
  CONSTRAINT axis_characterisations_compensated_standard_uncertainty_deg_who CHECK
      ((array_position(compensated_standard_uncertainty_deg, NULL::double precision) IS NULL)),
  CONSTRAINT axis_characterisations_reversal_deg_whole CHECK (array_position(reversal_deg, NULL) IS NULL),
  CONSTRAINT axis_characterisations_mean_deg_whole CHECK (array_position(mean_deg, NULL) IS NULL),
  CONSTRAINT axis_characterisations_long_wave_amplitude_deg_whole CHECK (array_position(long_wave_amplitude_deg,
      NULL) IS NULL),
  CONSTRAINT axis_characterisations_periodic_amplitude_deg_whole CHECK (array_position(periodic_amplitude_deg,
      NULL) IS NULL),
  CONSTRAINT axis_characterisations_greatest_error_deg_whole CHECK (array_position(greatest_error_deg, NULL) IS NULL),
  CONSTRAINT axis_characterisations_standard_uncertainty_deg_whole CHECK (array_position(standard_uncertainty_deg,
      NULL) IS NULL),
  CONSTRAINT axis_characterisations_compensated_standard_uncertainty_d_whole CHECK
      (array_position(compensated_standard_uncertainty_deg, NULL) IS NULL),
  CONSTRAINT axis_characterisations_noise_deg_whole CHECK (array_position(noise_deg, NULL) IS NULL),
  CONSTRAINT axis_characterisations_forward_error_deg_whole CHECK (array_position(forward_error_deg, NULL) IS NULL),
  CONSTRAINT axis_characterisations_backward_error_deg_whole CHECK (array_position(backward_error_deg, NULL) IS NULL)
);
COMMENT ON TABLE axis_characterisations IS 'How a rotary axis positions, from an encoder run.';
COMMENT ON COLUMN axis_characterisations.reversal_deg IS 'Here and below: value, standard uncertainty.';
COMMENT ON COLUMN axis_characterisations.periodic_order IS 'Periods in a turn; NULL where none stands out of the noise.';
COMMENT ON COLUMN axis_characterisations.forward_error_deg IS
  'Reached minus commanded at equal steps from 0 over a turn, coming from smaller angles; backward_error_deg from '
  'greater ones.';
COMMENT ON COLUMN axis_characterisations.beyond_limits_count IS
  'Readings commanded beyond the limits in the machine''s record; NULL: made before it was counted.';

CREATE TABLE studies (
  study_id uuid NOT NULL,
  machine_id text COLLATE "C",
  kind text NOT NULL,
  inputs text[] NOT NULL,
  request_sha256 bytea NOT NULL,
  verdict text NOT NULL,
  result jsonb NOT NULL,
  temperature_c double precision,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  CONSTRAINT studies_pk PRIMARY KEY (study_id),
  CONSTRAINT studies_machine_fk FOREIGN KEY (machine_id) REFERENCES machines (machine_id),
  CONSTRAINT studies_request_fk FOREIGN KEY (request_sha256) REFERENCES blobs (sha256),
  CONSTRAINT studies_record_fk FOREIGN KEY (study_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT studies_kind_known CHECK (kind IN ('GAUGE', 'ARM', 'REPEAT', 'GAUGE_RR', 'SPHERE_CHECK')),
  CONSTRAINT studies_inputs_named CHECK (array_position(inputs, NULL) IS NULL),
  CONSTRAINT studies_verdict_known CHECK (verdict IN ('ACCEPTED', 'REJECTED', 'UNDECIDABLE', 'REPORTED')),
  CONSTRAINT studies_result_object CHECK (jsonb_typeof(result) = 'object'),
  CONSTRAINT studies_temperature CHECK (temperature_c BETWEEN -50 AND 100),
  CONSTRAINT studies_software_named CHECK (software_version <> ''),
  CONSTRAINT studies_requested_by_length CHECK (octet_length(requested_by) <= 200),
  CONSTRAINT studies_digests CHECK (octet_length(request_sha256) = 32),
  CONSTRAINT studies_texts CHECK (octet_length(software_version) <= 200),
  CONSTRAINT studies_inputs_whole CHECK (array_position(inputs, NULL) IS NULL AND cardinality(inputs) <= 1000),
  CONSTRAINT studies_result_size CHECK (pg_column_size(result) <= 4000000)
);
CREATE INDEX studies_by_machine ON studies (machine_id, kind);
COMMENT ON TABLE studies IS
  'What an instrument or a procedure can do: gauge and arm studies, repeats, gauge R&R, sphere checks.';
COMMENT ON COLUMN studies.request_sha256 IS 'The request as it came: with its inputs, all that the result is computed from.';
COMMENT ON COLUMN studies.verdict IS 'Against the stated limit; REPORTED: no limit was stated.';
COMMENT ON COLUMN studies.result IS
  'sixpoint.calibration.v1.Study in its canonical JSON; every number reads back to the same double.';

CREATE VIEW calibration_forces AS
  SELECT c.calibration_id, c.machine_id, c.kind, coalesce(c.axis, '') AS axis, c.valid_from, c.valid_until,
         n.record_sequence AS force_sequence
  FROM calibrations c
  LEFT JOIN calibration_events r ON r.calibration_id = c.calibration_id AND r.event = 'RELEASED'
  JOIN record_names n ON n.record_id = CASE WHEN c.is_draft THEN r.record_id ELSE c.calibration_id END
  WHERE NOT EXISTS (SELECT 1 FROM calibration_events w WHERE w.calibration_id = c.calibration_id
                                                         AND w.event = 'WITHDRAWN');
COMMENT ON VIEW calibration_forces IS
  'What may be in force: released and not withdrawn. In force at a moment: of those of a machine, kind and axis whose '
  'validity covers it, the one of the greatest force_sequence.';

-- What rests on a calibration names it in the journal. A withdrawal that comes while something is made with it, and the making,
-- both hold the journal's lock here, so that one of them sees the other. A study may look at a withdrawn one, and a decision
-- about it must name it.
CREATE FUNCTION refuse_withdrawn_input() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  IF EXISTS (SELECT 1 FROM calibration_events WHERE event = 'WITHDRAWN' AND calibration_id = NEW.input_id)
     AND NOT EXISTS (SELECT 1 FROM record_entries WHERE record_id = NEW.record_id
                       AND kind IN ('release', 'withdrawal', 'study')) THEN
    RAISE EXCEPTION 'calibrations/%: withdrawn, want one in force', NEW.input_id
      USING ERRCODE = 'restrict_violation', CONSTRAINT = 'calibration_withdrawn';
  END IF;
  RETURN NULL;
END
$$;
-- After the statement that wrote the entry too. Every partition has it.
CREATE TRIGGER not_withdrawn AFTER INSERT ON record_inputs FOR EACH ROW EXECUTE FUNCTION refuse_withdrawn_input();

SELECT make_append_only('calibrations');
SELECT make_append_only('calibration_events');
SELECT make_append_only('sensor_calibrations');
SELECT make_append_only('sensor_calibration_centres');
SELECT make_append_only('rotation_calibrations');
SELECT make_append_only('rotation_calibration_poses');
SELECT make_append_only('probe_calibrations');
SELECT make_append_only('probe_calibration_readings');
SELECT make_append_only('probe_calibration_checks');
SELECT make_append_only('axis_characterisations');
SELECT make_append_only('studies');
