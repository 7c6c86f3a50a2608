-- A scanner's field as its calibration found it, how flat the artefact is that shows it, and how a calibration follows where the arm stood in
-- each of several swings. Every new column is nullable.

ALTER TABLE sensor_calibrations
  ADD COLUMN field_terms_um double precision[],
  ADD COLUMN field_covariance_um2 double precision[],
  ADD COLUMN field_stated_um double precision,
  ADD COLUMN arm_shares jsonb,
  ADD CONSTRAINT sensor_calibrations_field_terms CHECK (cardinality(field_terms_um) = 9 AND array_position(field_terms_um, NULL) IS NULL),
  ADD CONSTRAINT sensor_calibrations_field_covariance
    CHECK (cardinality(field_covariance_um2) = 81 AND array_position(field_covariance_um2, NULL) IS NULL),
  ADD CONSTRAINT sensor_calibrations_field_stated CHECK (field_stated_um > 0),
  ADD CONSTRAINT sensor_calibrations_arm_shares
    CHECK (jsonb_typeof(arm_shares) = 'array' AND pg_column_size(arm_shares) <= 100000),
  ADD CONSTRAINT sensor_calibrations_field_whole
    CHECK (num_nulls(field_terms_um, field_covariance_um2, field_stated_um) IN (0, 3));
COMMENT ON COLUMN sensor_calibrations.field_terms_um IS
  'What readings are off by along the sensor''s z, by Legendre''s products up to the third order; taken off every reading that is mapped. NULL: not looked for.';
COMMENT ON COLUMN sensor_calibrations.field_covariance_um2 IS '9 x 9, row-major, of field_terms_um.';
COMMENT ON COLUMN sensor_calibrations.arm_shares IS
  'Of each series of the arm that it was made from: series, response (6 x 6, row-major) of what is stated to where the arm stood; NULL: of one series, or not known.';
COMMENT ON COLUMN sensor_calibrations.field_stated_um IS 'Root mean square of the field as it was stated before.';

ALTER TABLE artefact_revisions
  ADD COLUMN flatness_standard_uncertainty_um double precision,
  ADD CONSTRAINT artefact_revisions_flatness
    CHECK (flatness_standard_uncertainty_um > 0 AND flatness_standard_uncertainty_um <= 100);
COMMENT ON COLUMN artefact_revisions.flatness_standard_uncertainty_um IS
  'Root mean square of the upper face about a plane; NULL: not stated.';
