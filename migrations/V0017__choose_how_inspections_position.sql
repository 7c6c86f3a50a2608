-- How the part was positioned for its inspection, and what that leaves open. Inspections so far: by pairs of datum points.

ALTER TABLE inspections
  ADD COLUMN method text NOT NULL DEFAULT 'SIX_POINT',
  ADD COLUMN disagreement_um double precision,
  ADD COLUMN disagreement_ratio double precision,
  ADD COLUMN positioning_disagrees boolean NOT NULL DEFAULT false,
  ADD COLUMN positioning_covered boolean NOT NULL DEFAULT false;
ALTER TABLE inspections ALTER COLUMN method DROP DEFAULT, ALTER COLUMN positioning_disagrees DROP DEFAULT,
  ALTER COLUMN positioning_covered DROP DEFAULT;
ALTER TABLE inspections
  ADD CONSTRAINT inspections_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS')),
  ADD CONSTRAINT inspections_disagreement_whole CHECK ((disagreement_um IS NULL) = (disagreement_ratio IS NULL)
    AND disagreement_um >= 0 AND disagreement_um < 1e9 AND disagreement_ratio >= 0 AND disagreement_ratio < 1e15),
  ADD CONSTRAINT inspections_covered_where_disagreeing CHECK (positioning_disagrees OR NOT positioning_covered),
  ADD CONSTRAINT inspections_disagreement_flagged CHECK (positioning_disagrees OR NOT disagreement_ratio > 3);
COMMENT ON COLUMN inspections.registration_id IS 'The registration of the same scans that the verdict rests on.';
COMMENT ON COLUMN inspections.disagreement_um IS
  'Greatest displacement between the best fit of the scans and a positioning by datum points or a region; NULL: not compared.';
COMMENT ON COLUMN inspections.disagreement_ratio IS 'That, by its standard uncertainty; more than 3 is flagged.';
COMMENT ON COLUMN inspections.positioning_disagrees IS
  'By that ratio, or by how far the surface deviates from its CAD beside the holes'' tolerances: the positioning decides.';
COMMENT ON COLUMN inspections.positioning_covered IS
  'The holes'' expanded uncertainties hold what other positionings would move them (inspection_holes.positioning_difference_um).';

ALTER TABLE inspection_holes
  ADD COLUMN positioning_difference_um double precision NOT NULL DEFAULT 0;
ALTER TABLE inspection_holes ALTER COLUMN positioning_difference_um DROP DEFAULT;
ALTER TABLE inspection_holes
  ADD CONSTRAINT inspection_holes_positioning_finite CHECK (positioning_difference_um >= 0
    AND positioning_difference_um < 1e9);
COMMENT ON COLUMN inspection_holes.positioning_difference_um IS
  'How far another positioning of the same scans would move the hole on the surface; 0 where none disagrees.';
