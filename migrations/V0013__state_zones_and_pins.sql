-- What a position tolerance is the size of, and the calibrated pins that holes are measured by. Parts from before were described as
-- distances from the nominal. Everything new is nullable or has a default.

ALTER TABLE part_hole_groups
  ADD COLUMN position_zone text NOT NULL DEFAULT 'RADIUS',
  ADD COLUMN gauge_pin_diameter_mm double precision,
  ADD COLUMN gauge_pin_diameter_standard_uncertainty_um double precision,
  ADD COLUMN gauge_pin_greatest_play_mm double precision,
  ADD COLUMN gauge_pin_least_depth_mm double precision,
  ADD CONSTRAINT part_hole_groups_zone_known CHECK (position_zone IN ('DIAMETER', 'RADIUS')),
  ADD CONSTRAINT part_hole_groups_gauge_pin_whole CHECK (num_nulls(gauge_pin_diameter_mm,
    gauge_pin_diameter_standard_uncertainty_um, gauge_pin_greatest_play_mm) IN (0, 3)
    AND (gauge_pin_least_depth_mm IS NULL OR gauge_pin_diameter_mm IS NOT NULL)),
  ADD CONSTRAINT part_hole_groups_gauge_pin_finite CHECK (gauge_pin_diameter_mm > 0 AND gauge_pin_diameter_mm <= 160
    AND gauge_pin_diameter_standard_uncertainty_um > 0 AND gauge_pin_diameter_standard_uncertainty_um <= 5
    AND gauge_pin_greatest_play_mm BETWEEN 0 AND 1 AND gauge_pin_least_depth_mm > 0 AND gauge_pin_least_depth_mm <= depth_mm);
COMMENT ON COLUMN part_hole_groups.position_zone IS
  'DIAMETER: a start may be half of position_tolerance_mm from its nominal; RADIUS: all of it.';
COMMENT ON COLUMN part_hole_groups.gauge_pin_diameter_mm IS 'As calibrated; NULL: any pin.';
COMMENT ON COLUMN part_hole_groups.gauge_pin_greatest_play_mm IS 'Across the hole as drilled, with gauge_pin_diameter_mm.';
COMMENT ON COLUMN part_hole_groups.gauge_pin_least_depth_mm IS 'How deep the pins stand in their holes; NULL: depth_mm.';

ALTER TABLE inspection_holes
  ADD COLUMN pin_half_play_um double precision,
  ADD CONSTRAINT inspection_holes_pin_half_play_finite CHECK (pin_half_play_um >= 0 AND pin_half_play_um < 1e6
    AND (pin_half_play_um IS NULL OR verdict <> 'NOT_MEASURED'));
COMMENT ON COLUMN inspection_holes.position_tolerance_mm IS
  'Of the distance: half of the part''s tolerance where that is the diameter of a zone.';
COMMENT ON COLUMN inspection_holes.pin_half_play_um IS
  'How far the pin''s axis may stand from the hole''s at the surface; NULL: not measured, or judged before it was looked at.';
