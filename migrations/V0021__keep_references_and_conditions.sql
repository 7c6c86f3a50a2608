-- What measuring equipment brings with it (serial numbers, certificates, expansion), under which conditions a scan was taken, and what
-- further makes results uncertain: linear axes, tool, temperature, an axis without a table. Everything new is nullable.

ALTER TABLE machine_joints
  ADD COLUMN positioning_standard_uncertainty_deg double precision,
  ADD CONSTRAINT machine_joints_positioning_of_rotary CHECK (positioning_standard_uncertainty_deg IS NULL
    OR (kind = 'rotary' AND positioning_standard_uncertainty_deg > 0 AND positioning_standard_uncertainty_deg <= 10));
COMMENT ON COLUMN machine_joints.positioning_standard_uncertainty_deg IS
  'Of the angle that it reaches, where no characterisation is in force; NULL: not stated.';

ALTER TABLE machine_revisions
  ADD COLUMN sensor_serial_number text,
  ADD COLUMN sensor_kind text,
  ADD COLUMN tool_offset_um double precision,
  ADD COLUMN linear_scale_um_per_m double precision,
  ADD COLUMN squareness_um_per_m double precision,
  ADD COLUMN temperature_k double precision,
  ADD COLUMN temperature_half_range_k double precision,
  ADD COLUMN scale_expansion_um_per_m_k double precision,
  ADD COLUMN scale_expansion_standard_uncertainty_um_per_m_k double precision,
  ADD COLUMN encoder_latency_um double precision,
  ADD COLUMN touch_probe_serial_number text,
  ADD COLUMN touch_probe_certificate_number text,
  ADD COLUMN touch_probe_calibrated_at timestamptz,
  ADD COLUMN touch_probe_expires_at timestamptz,
  ADD CONSTRAINT machine_revisions_sensor_kind_known CHECK (sensor_kind IN ('LINE', 'SNAPSHOT')),
  ADD CONSTRAINT machine_revisions_serial_numbers_named CHECK (sensor_serial_number <> '' AND octet_length(sensor_serial_number) <= 64
    AND touch_probe_serial_number <> '' AND octet_length(touch_probe_serial_number) <= 64),
  ADD CONSTRAINT machine_revisions_lengths_finite CHECK (tool_offset_um > 0 AND tool_offset_um <= 1000
    AND encoder_latency_um > 0 AND encoder_latency_um <= 1000),
  ADD CONSTRAINT machine_revisions_linear_axes_finite CHECK (linear_scale_um_per_m > 0 AND linear_scale_um_per_m <= 10000
    AND squareness_um_per_m > 0 AND squareness_um_per_m <= 10000),
  ADD CONSTRAINT machine_revisions_temperatures_finite CHECK (temperature_k > 0 AND temperature_k <= 10
    AND temperature_half_range_k > 0 AND temperature_half_range_k <= 30),
  ADD CONSTRAINT machine_revisions_expansion CHECK (num_nulls(scale_expansion_um_per_m_k,
      scale_expansion_standard_uncertainty_um_per_m_k) IN (0, 2)
    AND scale_expansion_um_per_m_k BETWEEN -5 AND 50 AND scale_expansion_standard_uncertainty_um_per_m_k > 0
    AND scale_expansion_standard_uncertainty_um_per_m_k <= 10),
  ADD CONSTRAINT machine_revisions_touch_probe_certificate CHECK (num_nulls(touch_probe_certificate_number,
      touch_probe_calibrated_at, touch_probe_expires_at) IN (0, 3) AND touch_probe_certificate_number <> ''
    AND octet_length(touch_probe_certificate_number) <= 64 AND touch_probe_calibrated_at < touch_probe_expires_at);
COMMENT ON COLUMN machine_revisions.sensor_kind IS 'NULL: not stated, and taken as LINE.';
COMMENT ON COLUMN machine_revisions.tool_offset_um IS
  'Standard uncertainty along each axis of the tool''s tip against what the touch probe finds; NULL: not stated.';
COMMENT ON COLUMN machine_revisions.temperature_k IS 'Standard uncertainty of temperatures that scans state; NULL: not stated.';
COMMENT ON COLUMN machine_revisions.temperature_half_range_k IS
  'How far from 20 C part and scales may be where scans state no temperature; NULL: not stated.';
COMMENT ON COLUMN machine_revisions.encoder_latency_um IS
  'Standard uncertainty of how far apart along X a scan forward and one backward put the same; NULL: not stated.';

ALTER TABLE artefact_revisions
  ADD COLUMN serial_number text,
  ADD COLUMN certificate_number text,
  ADD COLUMN certificate_calibrated_at timestamptz,
  ADD COLUMN certificate_expires_at timestamptz,
  ADD COLUMN centre_standard_uncertainty_um double precision,
  ADD CONSTRAINT artefact_revisions_serial_number_named CHECK (serial_number <> '' AND octet_length(serial_number) <= 64),
  ADD CONSTRAINT artefact_revisions_certificate CHECK (num_nulls(certificate_number, certificate_calibrated_at,
      certificate_expires_at) IN (0, 3) AND certificate_number <> '' AND octet_length(certificate_number) <= 64
    AND certificate_calibrated_at < certificate_expires_at),
  ADD CONSTRAINT artefact_revisions_centre CHECK (centre_standard_uncertainty_um > 0 AND centre_standard_uncertainty_um <= 100);
COMMENT ON COLUMN artefact_revisions.centre_standard_uncertainty_um IS
  'Along each axis, of a feature''s centre as it is touched against the same as it is scanned; NULL: not stated.';

ALTER TABLE part_revisions
  ADD COLUMN thermal_expansion_um_per_m_k double precision,
  ADD COLUMN thermal_expansion_standard_uncertainty_um_per_m_k double precision,
  ADD CONSTRAINT part_revisions_expansion CHECK (num_nulls(thermal_expansion_um_per_m_k,
      thermal_expansion_standard_uncertainty_um_per_m_k) IN (0, 2)
    AND thermal_expansion_um_per_m_k BETWEEN -5 AND 50 AND thermal_expansion_standard_uncertainty_um_per_m_k > 0
    AND thermal_expansion_standard_uncertainty_um_per_m_k <= 10);

ALTER TABLE part_hole_groups
  ADD COLUMN gauge_pin_certificate_number text,
  ADD COLUMN gauge_pin_calibrated_at timestamptz,
  ADD COLUMN gauge_pin_expires_at timestamptz,
  ADD CONSTRAINT part_hole_groups_gauge_pin_certificate CHECK (num_nulls(gauge_pin_certificate_number, gauge_pin_calibrated_at,
      gauge_pin_expires_at) IN (0, 3) AND gauge_pin_certificate_number <> ''
    AND octet_length(gauge_pin_certificate_number) <= 64 AND gauge_pin_calibrated_at < gauge_pin_expires_at);

ALTER TABLE scans
  ADD COLUMN clamping text,
  ADD COLUMN subject_temperature_c double precision,
  ADD COLUMN scales_temperature_c double precision,
  ADD COLUMN sensor_serial_number text,
  ADD COLUMN travel text,
  ADD CONSTRAINT scans_clamping_named CHECK (clamping <> '' AND octet_length(clamping) <= 64),
  ADD CONSTRAINT scans_temperatures_possible CHECK (subject_temperature_c BETWEEN 0 AND 60 AND scales_temperature_c BETWEEN 0 AND 60),
  ADD CONSTRAINT scans_sensor_serial_number_named CHECK (sensor_serial_number <> '' AND octet_length(sensor_serial_number) <= 64),
  ADD CONSTRAINT scans_travel_known CHECK (travel IN ('FORWARD', 'BACKWARD'));
COMMENT ON COLUMN scans.clamping IS 'Another name with every clamping of the subject; NULL: not known.';
COMMENT ON COLUMN scans.scales_temperature_c IS 'Of the linear axes'' scales; NULL: not stated.';
COMMENT ON COLUMN scans.travel IS 'Which way the encoder went; NULL: not known.';

ALTER TABLE sensor_calibrations
  ADD COLUMN sensor_serial_number text,
  ADD COLUMN travel text,
  ADD CONSTRAINT sensor_calibrations_serial_number_named CHECK (sensor_serial_number <> '' AND octet_length(sensor_serial_number) <= 64),
  ADD CONSTRAINT sensor_calibrations_travel_known CHECK (travel IN ('FORWARD', 'BACKWARD'));
COMMENT ON COLUMN sensor_calibrations.travel IS 'Of its scans, where all went one way; NULL: not known, or both.';

ALTER TABLE rotation_calibrations
  ADD COLUMN linear_response double precision[],
  ADD CONSTRAINT rotation_calibrations_linear_response_whole CHECK (array_position(linear_response, NULL) IS NULL),
  ADD CONSTRAINT rotation_calibrations_linear_response_sized CHECK (cardinality(linear_response) = 48
    AND NOT linear_response && ARRAY['NaN', 'Infinity', '-Infinity']::double precision[]);
COMMENT ON COLUMN rotation_calibrations.linear_response IS
  '8 x 6, row-major: change of the parameters per parameter of the linear axes; NULL: made before it was kept.';

ALTER TABLE registrations
  ADD COLUMN thermal_stretch double precision,
  ADD COLUMN sensor_calibration_asked boolean,
  ADD CONSTRAINT registrations_thermal_stretch_possible CHECK (thermal_stretch BETWEEN 0.99 AND 1.01);
COMMENT ON COLUMN registrations.thermal_stretch IS
  'How many times as long as at 20 C the part was on the machine''s scales; NULL: no temperature was stated.';
COMMENT ON COLUMN registrations.sensor_calibration_asked IS
  'The sensor''s calibration was asked for, and is not the one in force when the scans were received; NULL: it is that.';

-- An angle of an axis that has a figure and no table is uncertain, too.
ALTER TABLE registration_angles ALTER COLUMN characterisation_id DROP NOT NULL;
COMMENT ON COLUMN registration_angles.characterisation_id IS 'Whose table was applied; NULL: none was.';

ALTER TABLE registration_error_sources
  DROP CONSTRAINT registration_error_sources_sized,
  ADD CONSTRAINT registration_error_sources_sized CHECK (draw_count >= 0 AND draw_count <= 64
    AND cardinality(parameters_per_sigma) IN (23 * draw_count, 29 * draw_count) AND cardinality(pose_per_sigma) = 6 * draw_count);
COMMENT ON COLUMN registration_error_sources.parameters_per_sigma IS
  '29 x draws, row-major: what a standard deviation of each draw does to the parameters that map a scan to the part; 23 where the linear axes were not named yet.';
