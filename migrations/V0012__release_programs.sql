-- A correction is judged by more than an envelope, released or refused by a person where the gate says so, and carried out hole by hole.
-- Its state follows from these rows and the clock (docs/adr/0023). Everything new is nullable, has a default or is a table of its own.

ALTER TABLE machine_revisions
  ADD COLUMN safety_uncertainty_share double precision NOT NULL DEFAULT 0.3333333333333333,
  ADD COLUMN safety_registration_age_h double precision NOT NULL DEFAULT 8,
  ADD COLUMN safety_keep_out_mm double precision NOT NULL DEFAULT 0.5,
  ADD CONSTRAINT machine_revisions_gate_finite CHECK (safety_uncertainty_share BETWEEN 0 AND 1
    AND safety_registration_age_h BETWEEN 0 AND 8760 AND safety_keep_out_mm BETWEEN 0 AND 100);
COMMENT ON COLUMN machine_revisions.safety_uncertainty_share IS
  'Of a hole''s tolerances, what the expanded uncertainty may take without a person''s release.';
COMMENT ON COLUMN machine_revisions.safety_registration_age_h IS 'How long a registration, or a person''s release, holds.';
COMMENT ON COLUMN machine_revisions.safety_keep_out_mm IS 'Least distance of the tool from the part while it cuts nothing; 0: not asked.';

ALTER TABLE registrations
  ADD COLUMN clamping text,
  ADD CONSTRAINT registrations_clamping_named CHECK (clamping <> '' AND octet_length(clamping) <= 64);
COMMENT ON COLUMN registrations.clamping IS 'As the machine calls it, another with every clamping; NULL: not stated.';

ALTER TABLE corrections
  ADD COLUMN nc_held_sha256 bytea,
  ADD COLUMN nc_tool_numbers integer[],
  ADD COLUMN nc_tool_lengths_mm double precision[],
  ADD COLUMN registration_age_h double precision,
  ADD COLUMN clamping text,
  ADD CONSTRAINT corrections_nc_held_fk FOREIGN KEY (nc_held_sha256) REFERENCES blobs (sha256),
  ADD CONSTRAINT corrections_nc_held_digest CHECK (octet_length(nc_held_sha256) = 32),
  ADD CONSTRAINT corrections_nc_held_unreleased CHECK (nc_held_sha256 IS NULL
    OR release = 'AWAITING_PERSON' AND nc_template_sha256 IS NOT NULL),
  ADD CONSTRAINT corrections_nc_tool_numbers_whole CHECK (array_position(nc_tool_numbers, NULL) IS NULL
    AND cardinality(nc_tool_numbers) BETWEEN 1 AND 100 AND 0 < ALL (nc_tool_numbers) AND 9999 >= ALL (nc_tool_numbers)),
  ADD CONSTRAINT corrections_nc_tool_lengths_mm_whole CHECK (array_position(nc_tool_lengths_mm, NULL) IS NULL),
  ADD CONSTRAINT corrections_nc_tool_lengths_stated CHECK ((nc_tool_numbers IS NULL) = (nc_tool_lengths_mm IS NULL)
    AND cardinality(nc_tool_lengths_mm) = cardinality(nc_tool_numbers)
    AND 0 <= ALL (nc_tool_lengths_mm) AND 2000 >= ALL (nc_tool_lengths_mm)),
  ADD CONSTRAINT corrections_registration_age CHECK (registration_age_h BETWEEN 0 AND 8760),
  ADD CONSTRAINT corrections_clamping_named CHECK (clamping <> '' AND octet_length(clamping) <= 64);
CREATE INDEX corrections_by_nc_held ON corrections (nc_held_sha256);
CREATE INDEX corrections_by_blade ON corrections (blade_serial);
COMMENT ON COLUMN corrections.nc_held_sha256 IS
  'The program as it was written and proven, while a person''s release is awaited; nc_program_sha256 where none is.';
COMMENT ON COLUMN corrections.nc_tool_numbers IS 'Of the tools that were stated, with nc_tool_lengths_mm; NULL: none were.';
COMMENT ON COLUMN corrections.registration_age_h IS
  'How long the registration, or a person''s release, holds; NULL: made before it was asked.';
COMMENT ON COLUMN corrections.clamping IS 'The registration''s.';

ALTER TABLE correction_groups
  ADD COLUMN tilt_deg double precision,
  ADD CONSTRAINT correction_groups_tilt CHECK (tilt_deg BETWEEN 0 AND 90);
COMMENT ON COLUMN correction_groups.tilt_deg IS
  'Between the holes'' direction and machine Z at these angles: 0, but near a singular direction; NULL: made before it was kept.';

CREATE TABLE correction_checks (
  correction_id uuid NOT NULL,
  position_index integer NOT NULL,
  kind text NOT NULL,
  subject text NOT NULL,
  value double precision,
  limit_value double precision NOT NULL,
  passed boolean NOT NULL,
  failed_count integer NOT NULL,
  CONSTRAINT correction_checks_pk PRIMARY KEY (correction_id, position_index),
  CONSTRAINT correction_checks_once UNIQUE (correction_id, kind),
  CONSTRAINT correction_checks_correction_fk FOREIGN KEY (correction_id) REFERENCES corrections (correction_id),
  CONSTRAINT correction_checks_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT correction_checks_kind_named CHECK (kind <> '' AND octet_length(kind) <= 64),
  CONSTRAINT correction_checks_subject_bounded CHECK (octet_length(subject) <= 200),
  CONSTRAINT correction_checks_finite CHECK (abs(value) < 1e300 AND abs(limit_value) < 1e300),
  CONSTRAINT correction_checks_failed CHECK (failed_count >= 0 AND passed = (failed_count = 0) AND (value IS NOT NULL OR NOT passed))
) PARTITION BY RANGE (correction_id);
COMMENT ON TABLE correction_checks IS 'What the gate asked of a correction and what it found, where it is worst.';
COMMENT ON COLUMN correction_checks.value IS 'In the kind''s unit; NULL: it could not be told, which does not pass.';

CREATE TABLE correction_events (
  correction_id uuid NOT NULL,
  event text NOT NULL,
  reason text NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT correction_events_pk PRIMARY KEY (correction_id, event),
  CONSTRAINT correction_events_correction_fk FOREIGN KEY (correction_id) REFERENCES corrections (correction_id),
  CONSTRAINT correction_events_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT correction_events_known CHECK (event IN ('RELEASED', 'REFUSED')),
  CONSTRAINT correction_events_reasoned CHECK (reason <> '' AND octet_length(reason) <= 1000),
  CONSTRAINT correction_events_answered_for CHECK (requested_by <> '' AND octet_length(requested_by) <= 200),
  CONSTRAINT correction_events_software_named CHECK (software_version <> '' AND octet_length(software_version) <= 200)
) PARTITION BY RANGE (correction_id);
COMMENT ON TABLE correction_events IS 'What a person decided about a correction: at most one release and one refusal.';

CREATE TABLE correction_cuts (
  correction_id uuid NOT NULL,
  group_name text NOT NULL,
  hole_name text NOT NULL,
  cut_at timestamptz,
  record_id uuid NOT NULL,
  CONSTRAINT correction_cuts_pk PRIMARY KEY (correction_id, group_name, hole_name),
  CONSTRAINT correction_cuts_hole_fk FOREIGN KEY (correction_id, group_name, hole_name)
    REFERENCES correction_holes (correction_id, group_name, hole_name),
  CONSTRAINT correction_cuts_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT correction_cuts_cut_at_finite CHECK (isfinite(cut_at)),
  CONSTRAINT correction_cuts_texts CHECK (octet_length(group_name) <= 200 AND octet_length(hole_name) <= 200)
) PARTITION BY RANGE (correction_id);
CREATE INDEX correction_cuts_by_record ON correction_cuts (record_id);
COMMENT ON TABLE correction_cuts IS 'Holes that the machine has reported cut, each once; those of one report share a record_id.';
COMMENT ON COLUMN correction_cuts.cut_at IS 'The machine''s clock, when the last hole of the report was done; NULL: not stated.';

CREATE TABLE program_fetches (
  fetch_id uuid NOT NULL,
  correction_id uuid NOT NULL,
  program_sha256 bytea NOT NULL,
  hole_count integer NOT NULL,
  cut_count integer NOT NULL,
  nc_reader_version text NOT NULL,
  nc_pose_count integer NOT NULL,
  nc_greatest_difference_um double precision NOT NULL,
  nc_greatest_tilt_deg double precision NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  CONSTRAINT program_fetches_pk PRIMARY KEY (fetch_id),
  CONSTRAINT program_fetches_correction_fk FOREIGN KEY (correction_id) REFERENCES record_names (record_id),
  CONSTRAINT program_fetches_program_fk FOREIGN KEY (program_sha256) REFERENCES blobs (sha256),
  CONSTRAINT program_fetches_record_fk FOREIGN KEY (fetch_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT program_fetches_counts CHECK (hole_count > 0 AND cut_count >= 0),
  CONSTRAINT program_fetches_digest CHECK (octet_length(program_sha256) = 32),
  CONSTRAINT program_fetches_proof CHECK (char_length(nc_reader_version) BETWEEN 1 AND 64 AND nc_pose_count > 0
    AND nc_greatest_difference_um BETWEEN 0 AND 1e6 AND nc_greatest_tilt_deg BETWEEN 0 AND 180),
  CONSTRAINT program_fetches_texts CHECK (octet_length(requested_by) <= 200 AND software_version <> ''
    AND octet_length(software_version) <= 200)
) PARTITION BY RANGE (fetch_id);
CREATE INDEX program_fetches_by_correction ON program_fetches (correction_id);
CREATE INDEX program_fetches_by_program ON program_fetches (program_sha256);
COMMENT ON TABLE program_fetches IS 'Every time that a program left by FetchProgram, and exactly what left.';
COMMENT ON COLUMN program_fetches.cut_count IS 'Holes that were reported cut before and left out of it.';

-- When each correction that was not refused became usable, by rule or by a person. One that was made before there was a gate passed
-- none: it is a draft.
CREATE VIEW correction_releases AS
  SELECT c.correction_id, c.blade_serial, c.registration_id, n.record_sequence AS release_sequence, n.recorded_at AS released_at,
         coalesce(c.nc_program_sha256, c.nc_held_sha256) IS NOT NULL AS has_program
  FROM corrections c
  LEFT JOIN correction_events e ON e.correction_id = c.correction_id AND e.event = 'RELEASED'
  JOIN record_names n ON n.record_id = CASE WHEN c.release = 'AUTOMATIC' AND c.registration_age_h IS NOT NULL THEN c.correction_id
                                       ELSE e.record_id END
  WHERE NOT EXISTS (SELECT 1 FROM correction_events r WHERE r.correction_id = c.correction_id AND r.event = 'REFUSED');
COMMENT ON VIEW correction_releases IS 'Corrections that are or were released, in the order of their release.';

CREATE VIEW correction_states AS
  SELECT f.*, CASE
      WHEN f.is_refused THEN 'REFUSED'
      WHEN f.is_withdrawn THEN 'WITHDRAWN'
      WHEN f.is_cut THEN 'CUT'
      WHEN f.usable_until <= statement_timestamp() THEN 'EXPIRED'
      WHEN f.superseded_by IS NOT NULL THEN 'SUPERSEDED'
      WHEN NOT f.is_released THEN 'DRAFT'
      ELSE 'RELEASED' END AS state
  FROM (
    SELECT c.correction_id, l.correction_id IS NOT NULL AS is_released,
      EXISTS (SELECT 1 FROM correction_events r WHERE r.correction_id = c.correction_id AND r.event = 'REFUSED') AS is_refused,
      -- Whatever it was made from, however far back.
      EXISTS (WITH RECURSIVE up (input_id) AS (
                SELECT i.input_id FROM record_inputs i WHERE i.record_id = c.correction_id
                UNION SELECT i.input_id FROM up JOIN record_inputs i ON i.record_id = up.input_id)
              SELECT 1 FROM up JOIN calibration_events w ON w.calibration_id = up.input_id AND w.event = 'WITHDRAWN') AS is_withdrawn,
      (SELECT count(*) FROM correction_cuts k WHERE k.correction_id = c.correction_id)
        = (SELECT count(*) FROM correction_holes h WHERE h.correction_id = c.correction_id) AS is_cut,
      CASE WHEN coalesce(c.registration_age_h, 0) = 0 OR l.correction_id IS NULL THEN c.valid_until
           ELSE least(c.valid_until, CASE WHEN c.release = 'AUTOMATIC' THEN g.recorded_at ELSE l.released_at END
                                     + c.registration_age_h * interval '1 hour') END AS usable_until,
      coalesce(
        -- Another program has cut holes of it since it was made: it would cut them again.
        (SELECT k.correction_id FROM corrections o JOIN correction_cuts k ON k.correction_id = o.correction_id
         JOIN record_names m ON m.record_id = k.record_id
         JOIN correction_holes h ON h.correction_id = c.correction_id AND h.group_name = k.group_name AND h.hole_name = k.hole_name
         WHERE o.blade_serial = c.blade_serial AND o.correction_id <> c.correction_id
           AND (m.record_sequence > n.record_sequence OR c.release = 'AUTOMATIC')
         ORDER BY m.record_sequence DESC LIMIT 1),
        -- A draft too is over once another registration has brought forth a program.
        (SELECT s.correction_id FROM correction_releases s
         WHERE s.blade_serial = c.blade_serial AND s.has_program AND s.correction_id <> c.correction_id
           AND s.release_sequence > coalesce(l.release_sequence, n.record_sequence)
           AND (s.registration_id <> c.registration_id
                OR l.correction_id IS NOT NULL
                   AND EXISTS (SELECT 1 FROM correction_groups a JOIN correction_groups b ON b.group_name = a.group_name
                               WHERE a.correction_id = c.correction_id AND b.correction_id = s.correction_id))
         ORDER BY s.release_sequence DESC LIMIT 1)) AS superseded_by
    FROM corrections c
    JOIN record_names n ON n.record_id = c.correction_id
    JOIN record_names g ON g.record_id = c.registration_id
    LEFT JOIN correction_releases l ON l.correction_id = c.correction_id) f;
COMMENT ON VIEW correction_states IS 'What each correction is now: it follows from rows that never change, and the clock.';

-- Whoever asks: what is not released does not leave.
CREATE FUNCTION refuse_unreleased_fetch() RETURNS trigger LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  found_state text := (SELECT state FROM correction_states WHERE correction_id = NEW.correction_id);
BEGIN
  IF found_state IS DISTINCT FROM 'RELEASED' THEN
    RAISE EXCEPTION 'corrections/%: %, want RELEASED', NEW.correction_id, found_state
      USING ERRCODE = 'restrict_violation', CONSTRAINT = 'program_not_released';
  END IF;
  RETURN NEW;
END
$$;
CREATE TRIGGER released_only BEFORE INSERT ON program_fetches FOR EACH ROW EXECUTE FUNCTION refuse_unreleased_fetch();

-- Looser than before: the kinds of entries (refusals, fetches and cuts are new), and an envelope of 0, which lets nothing pass. Each
-- partition has the constraint as its own, too.
DO $$
DECLARE
  held regclass;
BEGIN
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  FOR held IN SELECT 'corrections'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'corrections'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS corrections_envelope_positive', held);
  END LOOP;
END
$$;
ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN ('machine', 'artefact', 'part', 'blade', 'scan',
  'calibration', 'registration', 'correction', 'inspection', 'deletion', 'release', 'withdrawal', 'study', 'policy', 'refusal',
  'fetch', 'cut'));
ALTER TABLE corrections ADD CONSTRAINT corrections_envelope_positive CHECK (envelope_translation_mm >= 0
  AND envelope_translation_mm < 1e6 AND envelope_rotation_deg >= 0 AND envelope_rotation_deg <= 360);

SELECT make_append_only('correction_checks');
SELECT make_append_only('correction_events');
SELECT make_append_only('correction_cuts');
SELECT make_append_only('program_fetches');
GRANT SELECT, INSERT ON correction_checks, correction_events, correction_cuts, program_fetches TO sixpoint_correction;
GRANT SELECT ON correction_states TO sixpoint_correction;
GRANT SELECT (nc_held_sha256) ON corrections TO sixpoint_ingest;
GRANT SELECT (program_sha256) ON program_fetches TO sixpoint_ingest;
REVOKE EXECUTE ON FUNCTION refuse_unreleased_fetch() FROM PUBLIC;
SELECT make_partitions(3);
-- And the months that corrections have already: what was made then can be stopped, too.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid,
     (SELECT * FROM partitioned_tables WHERE name IN ('correction_checks', 'correction_events', 'correction_cuts') ORDER BY depth, name) t
WHERE i.inhparent = 'corrections'::regclass;
