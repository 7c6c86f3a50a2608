-- What a fit did not determine is NULL: it was 0, a perfect figure. Constraints are looser; what stands keeps its zeros.

ALTER TABLE registrations
  ALTER COLUMN residual_rms_um DROP NOT NULL,
  ALTER COLUMN residual_sigma_um DROP NOT NULL,
  ALTER COLUMN condition_number DROP NOT NULL,
  ALTER COLUMN weakest_direction DROP NOT NULL,
  ALTER COLUMN weakest_standard_uncertainty_um DROP NOT NULL,
  ADD CONSTRAINT registrations_weakest_whole CHECK (
    num_nulls(condition_number, weakest_direction, weakest_standard_uncertainty_um) IN (0, 3));
COMMENT ON COLUMN registrations.residual_rms_um IS 'Micrometres, of the points used. NULL: there are none, or the method has no residuals (ALLOWANCE).';
COMMENT ON COLUMN registrations.residual_sigma_um IS 'Micrometres, robust. NULL: no point is within the loss''s reach.';
COMMENT ON COLUMN registrations.condition_number IS
  'Of the fit: how unevenly the points hold the pose. NULL, as weakest_direction and its uncertainty: no pose was found that they could be of.';
COMMENT ON COLUMN read_v1.registrations.residual_sigma_um IS 'Micrometres, robust. NULL: not determined.';
COMMENT ON COLUMN read_v1.registrations.condition_number IS 'Of the fit: how unevenly the points hold the pose. NULL: not determined.';
COMMENT ON COLUMN read_v1.registrations.weakest_standard_uncertainty_um IS
  'Micrometres, along the direction that the points hold least. NULL: not determined.';

ALTER TABLE registration_scans
  ALTER COLUMN residual_median_um DROP NOT NULL;
COMMENT ON COLUMN registration_scans.residual_median_um IS 'Micrometres. NULL: none of its points is within the loss''s reach.';
