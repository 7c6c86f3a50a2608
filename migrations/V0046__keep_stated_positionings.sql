-- Of a hole: what its values are uncertain by in the positioning that its inspection states, without what other positionings would say. A
-- drawing names its datums; what another fit would say is no uncertainty of what it asks.

ALTER TABLE inspection_hole_values
  ADD COLUMN position_stated_expanded_uncertainty_um double precision,
  ADD COLUMN inclination_stated_expanded_uncertainty_deg double precision,
  ADD COLUMN positioning_difference_deg double precision,
  ADD COLUMN displacement_covariance_um2 double precision[],
  ADD COLUMN displacement_coverage_factor double precision,
  ADD CONSTRAINT inspection_hole_values_stated_whole CHECK (num_nulls(position_stated_expanded_uncertainty_um,
    inclination_stated_expanded_uncertainty_deg, positioning_difference_deg, displacement_covariance_um2, displacement_coverage_factor) IN (0, 5)),
  ADD CONSTRAINT inspection_hole_values_stated_in_range CHECK (position_stated_expanded_uncertainty_um >= 0
    AND position_stated_expanded_uncertainty_um < 1e9 AND inclination_stated_expanded_uncertainty_deg >= 0
    AND inclination_stated_expanded_uncertainty_deg < 1e9 AND positioning_difference_deg >= 0 AND positioning_difference_deg <= 180
    AND displacement_coverage_factor >= 0 AND displacement_coverage_factor < 1e6),
  ADD CONSTRAINT inspection_hole_values_covariance CHECK (is_triple(displacement_covariance_um2) AND displacement_covariance_um2[1] >= 0
    AND displacement_covariance_um2[3] >= 0),
  ADD CONSTRAINT inspection_hole_values_displacement_covariance_um2_whole CHECK (array_position(displacement_covariance_um2, NULL) IS NULL);
COMMENT ON COLUMN inspection_hole_values.position_stated_expanded_uncertainty_um IS
  '95 %, without what other positionings say, as inclination_stated_expanded_uncertainty_deg. NULL: made before V0046.';
COMMENT ON COLUMN inspection_hole_values.positioning_difference_deg IS 'How far other positionings of the same scans turn the axis, at most.';
COMMENT ON COLUMN inspection_hole_values.displacement_covariance_um2 IS
  'Of (along_um, across_um) in the stated positioning: variance along, covariance, variance across.';
COMMENT ON COLUMN inspection_hole_values.displacement_coverage_factor IS '95 %, of a displacement in any direction in the surface.';
