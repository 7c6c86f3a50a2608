-- On what a result was computed: where a replay comes out with other bits, that is one of the causes that there can be.

ALTER TABLE registrations
  ADD COLUMN computed_on text,
  ADD CONSTRAINT registrations_computed_on CHECK (computed_on IS NULL OR length(computed_on) BETWEEN 1 AND 200);
ALTER TABLE corrections
  ADD COLUMN computed_on text,
  ADD CONSTRAINT corrections_computed_on CHECK (computed_on IS NULL OR length(computed_on) BETWEEN 1 AND 200);
ALTER TABLE inspections
  ADD COLUMN computed_on text,
  ADD CONSTRAINT inspections_computed_on CHECK (computed_on IS NULL OR length(computed_on) BETWEEN 1 AND 200);

COMMENT ON COLUMN registrations.computed_on IS 'Kind of processor and C library: x86-64 AVX-512, glibc 2.36. NULL: before it was kept.';
COMMENT ON COLUMN corrections.computed_on IS 'Kind of processor and C library: x86-64 AVX-512, glibc 2.36. NULL: before it was kept.';
COMMENT ON COLUMN inspections.computed_on IS 'Kind of processor and C library: x86-64 AVX-512, glibc 2.36. NULL: before it was kept.';

-- An inspection that judges an older one's scans anew.
ALTER TABLE inspections
  ADD COLUMN rejudges uuid,
  ADD CONSTRAINT inspections_rejudges_fk FOREIGN KEY (rejudges) REFERENCES record_names (record_id),
  ADD CONSTRAINT inspections_rejudges_another CHECK (rejudges IS NULL OR rejudges <> inspection_id);
CREATE INDEX inspections_by_rejudged ON inspections (rejudges) WHERE rejudges IS NOT NULL;
COMMENT ON COLUMN inspections.rejudges IS
  'The inspection whose scans this one judges anew, with what was in force then; NULL: none. Not an edge of the journal: the verdict does not rest on the old one.';
