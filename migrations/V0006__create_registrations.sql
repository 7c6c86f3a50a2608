-- Where a blade stands: one row for each registration, the scans it was made from and, for six-point, its datum points.

CREATE TABLE registrations (
  registration_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  method text NOT NULL,
  sensor_calibration_id uuid NOT NULL,
  rotation_calibration_id uuid NOT NULL,
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
  weakest_direction_in_words text NOT NULL DEFAULT '',
  noise_sigma_um double precision,
  model_sigma_um double precision,
  information_kept double precision,
  surface_part double precision,
  least_stock_mm double precision,
  lacking_mm double precision,
  disagreement_um double precision,
  disagreement_ratio double precision,
  options jsonb NOT NULL DEFAULT '{}',
  detail jsonb NOT NULL DEFAULT '{}',
  disagrees boolean,
  for_inspection boolean NOT NULL,
  CONSTRAINT registrations_pk PRIMARY KEY (registration_id),
  CONSTRAINT registrations_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT registrations_machine_fk FOREIGN KEY (machine_id, machine_revision)
    REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT registrations_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT registrations_sensor_calibration_fk FOREIGN KEY (sensor_calibration_id)
    REFERENCES calibrations (calibration_id),
  CONSTRAINT registrations_rotation_calibration_fk FOREIGN KEY (rotation_calibration_id)
    REFERENCES calibrations (calibration_id),
  CONSTRAINT registrations_record_fk FOREIGN KEY (registration_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT registrations_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0),
  CONSTRAINT registrations_pose_only_where_converged CHECK (CASE WHEN outcome = 'CONVERGED'
    THEN cardinality(zero_from_part) = 12 AND cardinality(reference_mm) = 3 AND cardinality(covariance) = 36
    AND cardinality(noise_covariance) = 36 AND cardinality(calibration_sensitivity) = 84 ELSE cardinality(zero_from_part) = 0
    AND cardinality(reference_mm) = 0 AND cardinality(covariance) = 0 AND cardinality(noise_covariance) = 0
    AND cardinality(calibration_sensitivity) = 0 END),
  CONSTRAINT registrations_values_finite CHECK (NOT (zero_from_part || reference_mm || covariance || noise_covariance ||
      calibration_sensitivity || weakest_direction && ARRAY['NaN', 'Infinity', '-Infinity']::double precision[])),
  CONSTRAINT registrations_direction_count CHECK (cardinality(weakest_direction) = 6),
  CONSTRAINT registrations_counts_possible CHECK (points_used >= 0 AND points_used <= point_count AND iteration_count >=
      0),
  CONSTRAINT registrations_figures_finite CHECK (residual_rms_um >= 0 AND residual_rms_um < 1e9 AND residual_sigma_um >= 0
    AND residual_sigma_um < 1e9 AND condition_number >= 1 AND condition_number < 1e15
    AND weakest_standard_uncertainty_um >= 0 AND weakest_standard_uncertainty_um < 1e15 AND compute_seconds >= 0
    AND compute_seconds < 1e9),
  CONSTRAINT registrations_software_named CHECK (software_version <> ''),
  CONSTRAINT registrations_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS',
      'ALLOWANCE')),
  CONSTRAINT registrations_outcome_known CHECK (outcome IN ('CONVERGED', 'NOT_CONVERGED', 'NOT_DETERMINED',
      'TOO_LITTLE_OVERLAP', 'INFEASIBLE')),
  CONSTRAINT registrations_infeasible_is_allowance CHECK (outcome <> 'INFEASIBLE' OR method = 'ALLOWANCE'),
  CONSTRAINT registrations_sigmas_finite CHECK (noise_sigma_um >= 0 AND noise_sigma_um < 1e9 AND model_sigma_um >= 0
    AND model_sigma_um < 1e9),
  CONSTRAINT registrations_parts_of_one CHECK (information_kept BETWEEN 0 AND 1 AND surface_part BETWEEN 0 AND 1),
  CONSTRAINT registrations_stock_of_allowance CHECK ((least_stock_mm IS NULL) = (lacking_mm IS NULL)
    AND (least_stock_mm IS NULL OR method = 'ALLOWANCE') AND abs(least_stock_mm) <= 100 AND lacking_mm BETWEEN 0 AND 100),
  CONSTRAINT registrations_lacking_is_infeasible CHECK (lacking_mm IS NULL OR lacking_mm = 0 OR outcome <> 'CONVERGED'),
  CONSTRAINT registrations_options_object CHECK (jsonb_typeof(options) = 'object'),
  CONSTRAINT registrations_detail_object CHECK (jsonb_typeof(detail) = 'object'),
  CONSTRAINT registrations_disagrees_where_compared CHECK ((disagrees IS NULL) = (disagreement_ratio IS NULL)),
  CONSTRAINT registrations_requested_by_length CHECK (octet_length(requested_by) <= 200),
  CONSTRAINT registrations_texts CHECK (octet_length(remark) <= 1000 AND octet_length(software_version) <= 200
    AND octet_length(weakest_direction_in_words) <= 200),
  CONSTRAINT registrations_zero_from_part_whole CHECK (array_position(zero_from_part, NULL) IS NULL),
  CONSTRAINT registrations_reference_mm_whole CHECK (array_position(reference_mm, NULL) IS NULL),
  CONSTRAINT registrations_covariance_whole CHECK (array_position(covariance, NULL) IS NULL),
  CONSTRAINT registrations_noise_covariance_whole CHECK (array_position(noise_covariance, NULL) IS NULL),
  CONSTRAINT registrations_calibration_sensitivity_whole CHECK (array_position(calibration_sensitivity, NULL) IS NULL),
  CONSTRAINT registrations_weakest_direction_whole CHECK (array_position(weakest_direction, NULL) IS NULL),
  CONSTRAINT registrations_options_size CHECK (pg_column_size(options) <= 4000000),
  CONSTRAINT registrations_detail_size CHECK (pg_column_size(detail) <= 4000000)
) PARTITION BY RANGE (registration_id);
CREATE INDEX registrations_by_sensor_calibration ON registrations (sensor_calibration_id);
CREATE INDEX registrations_by_rotation_calibration ON registrations (rotation_calibration_id);
CREATE INDEX registrations_disagreeing ON registrations (registration_id) WHERE disagrees;
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
COMMENT ON COLUMN registrations.weakest_direction_in_words IS 'By the part''s axes.';
COMMENT ON COLUMN registrations.noise_sigma_um IS
  'Of a point. This and the figures after it: NULL where the method has none.';
COMMENT ON COLUMN registrations.model_sigma_um IS 'Of a patch beyond its points'' noise: casting, sensor, CAD.';
COMMENT ON COLUMN registrations.information_kept IS
  'Of what the points say along the weakest direction, the part that the robust loss kept.';
COMMENT ON COLUMN registrations.surface_part IS 'Of the CAD''s area, the part that the scans cover.';
COMMENT ON COLUMN registrations.least_stock_mm IS 'ALLOWANCE: of any patch, at the pose that is best or lacks least.';
COMMENT ON COLUMN registrations.lacking_mm IS 'ALLOWANCE: by how much that falls short of the stock asked for.';
COMMENT ON COLUMN registrations.disagreement_um IS
  'Greatest displacement of a point of the part from the best fit of the same scans to this pose; NULL where not compared.';
COMMENT ON COLUMN registrations.disagreement_ratio IS 'That, by its standard uncertainty.';
COMMENT ON COLUMN registrations.options IS
  'What was asked: sixpoint.registration.v1.FitOptions in its canonical JSON; every number reads back to the same double.';
COMMENT ON COLUMN registrations.detail IS
  'Evidence that has no column of its own: sixpoint.registration.v1.Evidence in its canonical JSON.';
COMMENT ON COLUMN registrations.disagrees IS
  'The ratio was beyond the limit in force when the registration was made. NULL where not compared.';
COMMENT ON COLUMN registrations.for_inspection IS 'Made by an inspection for its verdict; not one to go on from.';

CREATE TABLE registration_scans (
  registration_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_key uuid NOT NULL,
  point_count bigint NOT NULL,
  points_used bigint NOT NULL,
  residual_median_um double precision NOT NULL,
  CONSTRAINT registration_scans_pk PRIMARY KEY (registration_id, position_index),
  CONSTRAINT registration_scans_once UNIQUE (registration_id, scan_key),
  CONSTRAINT registration_scans_registration_fk FOREIGN KEY (registration_id) REFERENCES registrations (registration_id),
  CONSTRAINT registration_scans_scan_fk FOREIGN KEY (scan_key) REFERENCES record_names (record_id),
  CONSTRAINT registration_scans_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT registration_scans_counts_possible CHECK (points_used >= 0 AND points_used <= point_count),
  CONSTRAINT registration_scans_median_finite CHECK (abs(residual_median_um) < 1e9),
  CONSTRAINT registration_scans_at_most_64 CHECK (position_index < 64)
) PARTITION BY RANGE (registration_id);
CREATE INDEX registration_scans_by_scan ON registration_scans (scan_key);
COMMENT ON TABLE registration_scans IS 'The scans of a registration, in the order asked, and how the fit took each.';

CREATE TABLE registration_agreements (
  registration_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_key uuid NOT NULL,
  other_scan_key uuid NOT NULL,
  patch_count bigint NOT NULL,
  difference_rms_um double precision NOT NULL,
  expected_rms_um double precision NOT NULL,
  CONSTRAINT registration_agreements_pk PRIMARY KEY (registration_id, position_index),
  CONSTRAINT registration_agreements_once UNIQUE (registration_id, scan_key, other_scan_key),
  CONSTRAINT registration_agreements_scan_fk FOREIGN KEY (registration_id, scan_key)
    REFERENCES registration_scans (registration_id, scan_key),
  CONSTRAINT registration_agreements_other_scan_fk FOREIGN KEY (registration_id, other_scan_key)
    REFERENCES registration_scans (registration_id, scan_key),
  CONSTRAINT registration_agreements_of_two CHECK (scan_key <> other_scan_key),
  CONSTRAINT registration_agreements_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT registration_agreements_values CHECK (patch_count > 0 AND difference_rms_um >= 0 AND difference_rms_um < 1e15
    AND expected_rms_um >= 0 AND expected_rms_um < 1e15)
) PARTITION BY RANGE (registration_id);
COMMENT ON TABLE registration_agreements IS
  'Two scans where they see the same surface; differing far beyond noise: a rotary axis is not where its calibration says.';
COMMENT ON COLUMN registration_agreements.difference_rms_um IS 'Of the two scans'' offsets, patch by patch.';
COMMENT ON COLUMN registration_agreements.expected_rms_um IS 'From the scanner''s noise alone.';

CREATE TABLE registration_datums (
  registration_id uuid NOT NULL,
  position_index integer NOT NULL,
  datum_name text NOT NULL,
  distance_um double precision NOT NULL,
  standard_uncertainty_um double precision NOT NULL,
  point_count bigint NOT NULL,
  CONSTRAINT registration_datums_pk PRIMARY KEY (registration_id, position_index),
  CONSTRAINT registration_datums_registration_fk FOREIGN KEY (registration_id) REFERENCES registrations (registration_id),
  CONSTRAINT registration_datums_position_of_six CHECK (position_index BETWEEN 0 AND 5),
  CONSTRAINT registration_datums_values_finite CHECK (abs(distance_um) < 1e9 AND standard_uncertainty_um >= 0
    AND standard_uncertainty_um < 1e9 AND point_count >= 0),
  CONSTRAINT registration_datums_texts CHECK (octet_length(datum_name) <= 200)
) PARTITION BY RANGE (registration_id);
COMMENT ON TABLE registration_datums IS
  'Six-point: the scanned surface''s height over the best-fitted CAD at each datum point, along its normal.';

CREATE TABLE registration_angles (
  registration_id uuid NOT NULL,
  position_index integer NOT NULL,
  axis text NOT NULL,
  characterisation_id uuid NOT NULL,
  kind text NOT NULL DEFAULT 'axis',
  commanded_deg double precision NOT NULL,
  reached_deg double precision NOT NULL,
  standard_uncertainty_deg double precision NOT NULL,
  half_reversal_deg double precision NOT NULL,
  pose_per_rad double precision[] NOT NULL,
  CONSTRAINT registration_angles_pk PRIMARY KEY (registration_id, position_index),
  CONSTRAINT registration_angles_once UNIQUE (registration_id, axis, commanded_deg),
  CONSTRAINT registration_angles_registration_fk FOREIGN KEY (registration_id) REFERENCES registrations (registration_id),
  CONSTRAINT registration_angles_characterisation_fk FOREIGN KEY (characterisation_id, kind)
    REFERENCES calibrations (calibration_id, kind),
  CONSTRAINT registration_angles_kind CHECK (kind = 'axis'),
  CONSTRAINT registration_angles_axis_known CHECK (axis IN ('A', 'B', 'C')),
  CONSTRAINT registration_angles_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT registration_angles_near_command CHECK (abs(commanded_deg) < 1e6 AND abs(reached_deg - commanded_deg) < 6
    AND abs(half_reversal_deg) < 6),
  CONSTRAINT registration_angles_uncertainty CHECK (standard_uncertainty_deg >= 0 AND standard_uncertainty_deg < 10),
  CONSTRAINT registration_angles_influence CHECK (cardinality(pose_per_rad) IN (0, 6)
    AND NOT (pose_per_rad && ARRAY['NaN', 'Infinity', '-Infinity']::double precision[])),
  CONSTRAINT registration_angles_pose_per_rad_whole CHECK (array_position(pose_per_rad, NULL) IS NULL)
) PARTITION BY RANGE (registration_id);
CREATE INDEX registration_angles_by_characterisation ON registration_angles (characterisation_id);
COMMENT ON TABLE registration_angles IS
  'Where a registration applied axis tables: each angle of each such axis that its scans were taken at.';
COMMENT ON COLUMN registration_angles.reached_deg IS 'By the table, the mean of both ways.';
COMMENT ON COLUMN registration_angles.half_reversal_deg IS
  'Half of what coming forward differs from coming backward there; common to the angles of an axis.';
COMMENT ON COLUMN registration_angles.pose_per_rad IS
  'Change of the pose (rotation vector, mm; about reference_mm) per radian; empty where there is no pose.';

SELECT make_append_only('registrations');
SELECT make_append_only('registration_scans');
SELECT make_append_only('registration_agreements');
SELECT make_append_only('registration_datums');
SELECT make_append_only('registration_angles');
