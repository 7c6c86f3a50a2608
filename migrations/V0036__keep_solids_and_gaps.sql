-- Which solid of a CAD file is the part, and how far the file's edges lie off its faces: nullable columns.

ALTER TABLE part_revisions
  ADD COLUMN solid text,
  ADD CONSTRAINT part_revisions_solid_bounded CHECK (octet_length(solid) BETWEEN 1 AND 256);
COMMENT ON COLUMN part_revisions.solid IS
  'Name or number (from 1 on, in the file''s order) of the solid of the CAD file that is the part; NULL: it has one.';

ALTER TABLE tessellations
  ADD COLUMN healed_um double precision,
  ADD COLUMN gap_um double precision,
  ADD COLUMN gap_at_mm double precision[],
  ADD CONSTRAINT tessellations_gaps_of_edges CHECK (num_nulls(healed_um, gap_um) IN (0, 2)
    AND healed_um BETWEEN 0 AND 100 AND gap_um BETWEEN 0 AND 100),
  ADD CONSTRAINT tessellations_gap_somewhere CHECK (gap_at_mm IS NULL OR (is_triple(gap_at_mm) AND gap_um > 0)),
  ADD CONSTRAINT tessellations_gap_at_mm_whole CHECK (array_position(gap_at_mm, NULL) IS NULL);
COMMENT ON COLUMN tessellations.healed_um IS
  'How far an edge of the CAD lay off its faces before it was put onto them, at most; 0: none by more than 10 um. NULL: not looked at.';
COMMENT ON COLUMN tessellations.gap_um IS 'What is left of it, at most: faces that do not meet. 0: none by more than 10 um. NULL as above.';
COMMENT ON COLUMN tessellations.gap_at_mm IS 'Where the greatest gap is, part frame; NULL: there is none.';
