-- An axis's characterisation is a calibration like the others: with a validity, an environment and states (ADR 14).

ALTER TABLE calibrations ADD COLUMN axis text;
COMMENT ON COLUMN calibrations.axis IS 'Of kind axis: the letter of the machine''s rotary joint. NULL for the others.';

-- Added to whatever kinds and methods are known by now.
DO $$
DECLARE
  known text;
BEGIN
  SELECT pg_get_expr(conbin, conrelid) INTO STRICT known FROM pg_constraint
    WHERE conname = 'calibrations_method_fits_kind' AND conrelid = 'calibrations'::regclass;
  ALTER TABLE calibrations DROP CONSTRAINT calibrations_method_fits_kind;
  EXECUTE format('ALTER TABLE calibrations ADD CONSTRAINT calibrations_method_fits_kind CHECK (%s '
                 'OR kind = ''axis'' AND method = ''ENCODER_RUN'')', known);
END
$$;
ALTER TABLE calibrations ADD CONSTRAINT calibrations_axis_fits_kind
  CHECK ((kind = 'axis') = (axis IS NOT NULL) AND axis IN ('A', 'B', 'C'));

-- Those made before this had no end; they get what is usual for an axis, a year.
INSERT INTO calibrations (calibration_id, machine_id, kind, axis, method, inputs, request_sha256, valid_from, valid_until,
                          requested_by, software_version, record_sequence, recorded_at)
  SELECT characterisation_id, machine_id, 'axis', axis, 'ENCODER_RUN', inputs, request_sha256, recorded_at,
         recorded_at + interval '365 days', requested_by, software_version, record_sequence, recorded_at
  FROM axis_characterisations;

ALTER TABLE axis_characterisations DROP COLUMN machine_id, DROP COLUMN axis, DROP COLUMN inputs, DROP COLUMN request_sha256,
  DROP COLUMN requested_by, DROP COLUMN software_version, DROP COLUMN record_sequence, DROP COLUMN recorded_at;
ALTER TABLE axis_characterisations RENAME COLUMN characterisation_id TO calibration_id;
ALTER TABLE axis_characterisations ADD COLUMN kind text NOT NULL DEFAULT 'axis', ADD COLUMN beyond_limits_count integer,
  ADD CONSTRAINT axis_characterisations_beyond_limits CHECK (beyond_limits_count BETWEEN 0 AND reading_count),
  ADD CONSTRAINT axis_characterisations_kind CHECK (kind = 'axis'),
  ADD CONSTRAINT axis_characterisations_calibration_fk FOREIGN KEY (calibration_id, kind)
    REFERENCES calibrations (calibration_id, kind);
COMMENT ON COLUMN axis_characterisations.beyond_limits_count IS
  'Readings commanded beyond the limits in the machine''s record; NULL: made before it was counted.';
COMMENT ON TABLE axis_characterisations IS 'How a rotary axis positions, from an encoder run.';

-- Each axis of a machine has one in force of its own.
CREATE OR REPLACE VIEW calibration_forces AS
  SELECT c.calibration_id, c.machine_id, c.kind, c.valid_from, c.valid_until,
         CASE WHEN c.is_draft THEN r.record_sequence ELSE c.record_sequence END AS force_sequence,
         COALESCE(c.axis, '') AS axis
  FROM calibrations c
  LEFT JOIN calibration_events r ON r.calibration_id = c.calibration_id AND r.event = 'RELEASED'
  WHERE (NOT c.is_draft OR r.record_sequence IS NOT NULL)
    AND NOT EXISTS (SELECT 1 FROM calibration_events w WHERE w.calibration_id = c.calibration_id
                                                         AND w.event = 'WITHDRAWN');
COMMENT ON VIEW calibration_forces IS
  'What may be in force: released and not withdrawn. In force at a moment: of those of a machine, kind and axis whose '
  'validity covers it, the one of the greatest force_sequence.';

-- What rests on a calibration names it in the journal: a calibration of the axes made with an axis's table, too. A study
-- may look at a withdrawn one, and a decision about it must name it.
CREATE FUNCTION refuse_withdrawn_input() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  IF NEW.input_name ~ '^(calibrations|characterisations)/'
     AND EXISTS (SELECT 1 FROM calibration_events WHERE event = 'WITHDRAWN'
                   AND calibration_id = split_part(NEW.input_name, '/', 2))
     AND NOT EXISTS (SELECT 1 FROM record_entries WHERE record_sequence = NEW.record_sequence
                       AND kind IN ('release', 'withdrawal', 'study')) THEN
    RAISE EXCEPTION '%: withdrawn, want one in force', NEW.input_name
      USING ERRCODE = 'restrict_violation', CONSTRAINT = 'calibration_withdrawn';
  END IF;
  RETURN NEW;
END
$$;
CREATE TRIGGER record_inputs_not_withdrawn BEFORE INSERT ON record_inputs
  FOR EACH ROW EXECUTE FUNCTION refuse_withdrawn_input();
