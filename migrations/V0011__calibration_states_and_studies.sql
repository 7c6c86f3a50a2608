-- The life of a calibration (draft, release, withdrawal: ADR 14), its environment, and studies of measuring capability.

ALTER TABLE calibrations ADD COLUMN is_draft boolean NOT NULL DEFAULT false,
  ADD COLUMN temperature_c double precision, ADD COLUMN temperature_standard_uncertainty_c double precision,
  ADD COLUMN humidity_percent double precision, ADD COLUMN environment_note text NOT NULL DEFAULT '',
  ADD CONSTRAINT calibrations_environment CHECK (temperature_c BETWEEN -50 AND 100
    AND temperature_standard_uncertainty_c BETWEEN 0 AND 50 AND humidity_percent BETWEEN 0 AND 100
    AND length(environment_note) <= 1000),
  ADD CONSTRAINT calibrations_uncertain_temperature CHECK (temperature_c IS NOT NULL
                                                           OR temperature_standard_uncertainty_c IS NULL);
COMMENT ON COLUMN calibrations.is_draft IS 'Made as a draft: never in force before its RELEASED event.';
COMMENT ON COLUMN calibrations.temperature_c IS 'Of artefact and machine at the measurement; NULL: not stated.';

CREATE TABLE calibration_events (
  calibration_id text COLLATE "C" NOT NULL,
  event text NOT NULL,
  reason text NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  record_sequence bigint NOT NULL,
  recorded_at timestamptz NOT NULL,
  CONSTRAINT calibration_events_pk PRIMARY KEY (calibration_id, event),
  CONSTRAINT calibration_events_calibration_fk FOREIGN KEY (calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT calibration_events_record_fk FOREIGN KEY (record_sequence) REFERENCES record_entries (record_sequence),
  CONSTRAINT calibration_events_known CHECK (event IN ('RELEASED', 'WITHDRAWN')),
  CONSTRAINT calibration_events_reason_given CHECK (event <> 'WITHDRAWN' OR reason <> ''),
  CONSTRAINT calibration_events_reason_bounded CHECK (length(reason) <= 1000),
  CONSTRAINT calibration_events_software_named CHECK (software_version <> '')
);
COMMENT ON TABLE calibration_events IS
  'What people decided about a calibration after it was made. Each at most once; a withdrawal is for ever.';

CREATE VIEW calibration_forces AS
  SELECT c.calibration_id, c.machine_id, c.kind, c.valid_from, c.valid_until,
         CASE WHEN c.is_draft THEN r.record_sequence ELSE c.record_sequence END AS force_sequence
  FROM calibrations c
  LEFT JOIN calibration_events r ON r.calibration_id = c.calibration_id AND r.event = 'RELEASED'
  WHERE (NOT c.is_draft OR r.record_sequence IS NOT NULL)
    AND NOT EXISTS (SELECT 1 FROM calibration_events w WHERE w.calibration_id = c.calibration_id
                                                         AND w.event = 'WITHDRAWN');
COMMENT ON VIEW calibration_forces IS
  'What may be in force: released and not withdrawn. In force at a moment: of those of a machine and kind whose validity '
  'covers it, the one of the greatest force_sequence.';
COMMENT ON TABLE calibrations IS 'One row for each calibration; which one is in force: calibration_forces.';

-- A withdrawal that comes between the fetching of a calibration and the storing of what was made with it. Both hold the
-- journal's lock, so one of them sees the other.
CREATE FUNCTION refuse_withdrawn_calibration() RETURNS trigger LANGUAGE plpgsql AS $$
DECLARE
  withdrawn text;
BEGIN
  SELECT calibration_id INTO withdrawn FROM calibration_events
    WHERE event = 'WITHDRAWN' AND calibration_id IN (NEW.sensor_calibration_id, NEW.rotation_calibration_id) LIMIT 1;
  IF FOUND THEN
    RAISE EXCEPTION 'calibrations/%: withdrawn, want one in force', withdrawn
      USING ERRCODE = 'restrict_violation', CONSTRAINT = 'calibration_withdrawn';
  END IF;
  RETURN NEW;
END
$$;
CREATE TRIGGER registrations_on_good_calibrations BEFORE INSERT ON registrations
  FOR EACH ROW EXECUTE FUNCTION refuse_withdrawn_calibration();
CREATE TRIGGER corrections_on_good_calibrations BEFORE INSERT ON corrections
  FOR EACH ROW EXECUTE FUNCTION refuse_withdrawn_calibration();
CREATE TRIGGER inspections_on_good_calibrations BEFORE INSERT ON inspections
  FOR EACH ROW EXECUTE FUNCTION refuse_withdrawn_calibration();

CREATE TABLE studies (
  study_id text COLLATE "C" NOT NULL,
  machine_id text COLLATE "C",
  kind text NOT NULL,
  inputs text[] NOT NULL,
  request_sha256 text COLLATE "C" NOT NULL,
  verdict text NOT NULL,
  result jsonb NOT NULL,
  temperature_c double precision,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  record_sequence bigint NOT NULL,
  recorded_at timestamptz NOT NULL,
  CONSTRAINT studies_pk PRIMARY KEY (study_id),
  CONSTRAINT studies_machine_fk FOREIGN KEY (machine_id) REFERENCES machines (machine_id),
  CONSTRAINT studies_request_fk FOREIGN KEY (request_sha256) REFERENCES blobs (sha256),
  CONSTRAINT studies_record_fk FOREIGN KEY (record_sequence) REFERENCES record_entries (record_sequence),
  CONSTRAINT studies_record_once UNIQUE (record_sequence),
  CONSTRAINT studies_id_form CHECK (study_id ~ '^[0-9a-f-]{36}$'),
  CONSTRAINT studies_kind_known CHECK (kind IN ('GAUGE', 'ARM', 'REPEAT', 'GAUGE_RR', 'SPHERE_CHECK')),
  CONSTRAINT studies_inputs_named CHECK (array_position(inputs, NULL) IS NULL),
  CONSTRAINT studies_verdict_known CHECK (verdict IN ('ACCEPTED', 'REJECTED', 'UNDECIDABLE', 'REPORTED')),
  CONSTRAINT studies_result_object CHECK (jsonb_typeof(result) = 'object'),
  CONSTRAINT studies_temperature CHECK (temperature_c BETWEEN -50 AND 100),
  CONSTRAINT studies_software_named CHECK (software_version <> '')
);
CREATE INDEX studies_by_machine ON studies (machine_id, kind, record_sequence);
COMMENT ON TABLE studies IS 'What an instrument or a procedure can do: gauge and arm studies, repeats, gauge R&R, sphere checks.';
COMMENT ON COLUMN studies.request_sha256 IS 'The request as it came: with its inputs, all that the result is computed from.';
COMMENT ON COLUMN studies.verdict IS 'Against the stated limit; REPORTED: no limit was stated.';
COMMENT ON COLUMN studies.result IS 'sixpoint.calibration.v1.Study in its canonical JSON; every number reads back to the same double.';

-- Added to whatever kinds are known by now.
DO $$
DECLARE
  known text;
BEGIN
  SELECT pg_get_expr(conbin, conrelid) INTO STRICT known FROM pg_constraint
    WHERE conname = 'record_entries_kind_known' AND conrelid = 'record_entries'::regclass;
  EXECUTE 'ALTER TABLE record_entries DROP CONSTRAINT record_entries_kind_known, '
    'ADD CONSTRAINT record_entries_kind_known CHECK (' || known || ' OR kind IN (''release'', ''withdrawal'', ''study''))';
END
$$;

CREATE TRIGGER calibration_events_append_only BEFORE UPDATE OR DELETE ON calibration_events
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER calibration_events_no_truncate BEFORE TRUNCATE ON calibration_events
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER studies_append_only BEFORE UPDATE OR DELETE ON studies
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER studies_no_truncate BEFORE TRUNCATE ON studies
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
