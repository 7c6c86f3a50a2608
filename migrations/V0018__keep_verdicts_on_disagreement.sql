-- Whether a registration disagrees with its best fit, as it was said when it was made: the limit of the ratio has changed and
-- may change again, what was said of a blade may not. And what a registration was made for: a blade's own is registered again,
-- one that an inspection made for its verdict is not.

ALTER TABLE registrations
  ADD COLUMN disagrees boolean,
  ADD COLUMN for_inspection boolean NOT NULL DEFAULT false;
ALTER TABLE registrations ALTER COLUMN for_inspection DROP DEFAULT;
-- Rows are append-only; what follows from what they and the journal say already is filled in this once.
ALTER TABLE registrations DISABLE TRIGGER registrations_append_only;
UPDATE registrations SET disagrees = disagreement_ratio > 3,
  for_inspection = 'registrations/' || registration_id IN (SELECT input_name FROM record_inputs JOIN record_entries
    USING (record_sequence) WHERE kind = 'inspection');
ALTER TABLE registrations ENABLE TRIGGER registrations_append_only;
ALTER TABLE registrations
  ADD CONSTRAINT registrations_disagrees_where_compared CHECK ((disagrees IS NULL) = (disagreement_ratio IS NULL));
COMMENT ON COLUMN registrations.disagreement_ratio IS 'That, by its standard uncertainty.';
COMMENT ON COLUMN registrations.disagrees IS
  'The ratio was beyond the limit in force when the registration was made (before this migration: 3). NULL where not compared.';
COMMENT ON COLUMN registrations.for_inspection IS 'Made by an inspection for its verdict; not one to go on from.';
DROP INDEX registrations_beyond_agreement;
CREATE INDEX registrations_disagreeing ON registrations (record_sequence) WHERE disagrees;

-- An inspection keeps its verdict already (positioning_disagrees).
ALTER TABLE inspections DROP CONSTRAINT inspections_disagreement_flagged;
COMMENT ON COLUMN inspections.disagreement_ratio IS 'That, by its standard uncertainty.';
COMMENT ON COLUMN inspections.positioning_disagrees IS
  'That ratio was beyond the limit then in force, or the surface deviates from its CAD beside the holes'' tolerances.';
