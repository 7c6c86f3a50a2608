-- What keeps a part's surface from being a whole skin: a hole in the CAD is to be seen, not found out by a measurement.

ALTER TABLE tessellations
  ADD COLUMN degenerate_triangle_count bigint,
  ADD COLUMN open_rim_count bigint,
  ADD COLUMN open_rim_length_mm double precision,
  ADD CONSTRAINT tessellations_gaps_whole CHECK ((degenerate_triangle_count IS NULL) = (open_rim_count IS NULL)
    AND (open_rim_count IS NULL) = (open_rim_length_mm IS NULL)),
  ADD CONSTRAINT tessellations_degenerate_of_all CHECK (degenerate_triangle_count BETWEEN 0 AND triangle_count),
  ADD CONSTRAINT tessellations_rims_have_length CHECK (open_rim_count >= 0 AND open_rim_length_mm >= 0
    AND open_rim_length_mm < 1e12 AND (open_rim_count > 0 OR open_rim_length_mm = 0));
COMMENT ON COLUMN tessellations.degenerate_triangle_count IS
  'Triangles without area, which are no part of the surface. NULL: not counted before this migration.';
COMMENT ON COLUMN tessellations.open_rim_count IS
  'Connected rims, along which the surface has one triangle only: a hole has one. NULL as above.';
COMMENT ON COLUMN tessellations.open_rim_length_mm IS 'Of all rims together. NULL as above.';
