-- What each machine did, hour by hour and day by day, kept with every entry of the journal: the state of a fleet is read from a few
-- rows, never from the journal. All of it follows from the journal, is changed in place, and can be made anew (rebuild_summaries).

-- Before anything: writers take this one first and then record_entries. The trigger below locks that table, and what was recorded before is
-- counted under this lock at the end: taken in that order, each would wait for the other.
SELECT pg_advisory_xact_lock(6021, 1);

CREATE TABLE machine_activity (
  machine_id text COLLATE "C" NOT NULL,
  period text COLLATE "C" NOT NULL,
  begins_at timestamptz NOT NULL,
  measure text COLLATE "C" NOT NULL,
  bucket smallint NOT NULL DEFAULT 0,
  entry_count bigint NOT NULL,
  seconds double precision NOT NULL DEFAULT 0,
  CONSTRAINT machine_activity_pk PRIMARY KEY (period, machine_id, begins_at, measure, bucket),
  CONSTRAINT machine_activity_period_known CHECK (period IN ('hour', 'day')),
  CONSTRAINT machine_activity_measure_form CHECK (measure ~ '^[A-Za-z_]{1,32}$'),
  CONSTRAINT machine_activity_counts CHECK (entry_count > 0 AND seconds >= 0 AND bucket BETWEEN 0 AND 100),
  CONSTRAINT machine_activity_machine_bounded CHECK (octet_length(machine_id) <= 64)
) WITH (fillfactor = 70);
COMMENT ON TABLE machine_activity IS
  'Counts of a machine in an hour and in a day (UTC). Not part of the record: changed in place by count_entry. Hours go after 62 days.';
COMMENT ON COLUMN machine_activity.measure IS
  'A kind of entries; of inspections the verdict, of those that judge an older one''s scans anew rejudgement; blade_begun; or a step of a '
  'blade''s way: SCAN_TO_REGISTRATION, ...';
COMMENT ON COLUMN machine_activity.bucket IS
  'Of a step: its time lay within 2 ^ ((bucket - 1) / 4) s and 2 ^ (bucket / 4) s, the first from 0 s on; 0: not a step.';
COMMENT ON COLUMN machine_activity.seconds IS 'Of a step: the sum of its times.';

CREATE TABLE machine_contacts (
  machine_id text COLLATE "C" NOT NULL,
  kind text COLLATE "C" NOT NULL,
  record_id uuid NOT NULL,
  record_sequence bigint NOT NULL,
  recorded_at timestamptz NOT NULL,
  detail text COLLATE "C",
  run_count bigint NOT NULL DEFAULT 1,
  run_since timestamptz NOT NULL,
  CONSTRAINT machine_contacts_pk PRIMARY KEY (machine_id, kind),
  CONSTRAINT machine_contacts_texts CHECK (octet_length(machine_id) <= 64 AND octet_length(kind) <= 64 AND octet_length(detail) <= 64),
  CONSTRAINT machine_contacts_run_positive CHECK (run_count > 0)
) WITH (fillfactor = 50);
COMMENT ON TABLE machine_contacts IS 'The last entry of each kind of each machine. Not part of the record: changed in place by count_entry.';
COMMENT ON COLUMN machine_contacts.detail IS 'Of a scan its kind, of an inspection its verdict, of a correction its release.';
COMMENT ON COLUMN machine_contacts.run_count IS 'How many in a row had that detail, this one too; the first of them at run_since.';

CREATE TABLE blade_cycles (
  blade_serial text COLLATE "C" NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  begun_at timestamptz NOT NULL,
  scanned_at timestamptz,
  registered_at timestamptz,
  corrected_at timestamptz,
  correction_id uuid,
  awaiting_since timestamptz,
  released_at timestamptz,
  fetched_at timestamptz,
  cut_at timestamptz,
  pins_scanned_at timestamptz,
  CONSTRAINT blade_cycles_pk PRIMARY KEY (blade_serial),
  CONSTRAINT blade_cycles_texts CHECK (octet_length(blade_serial) <= 64 AND octet_length(machine_id) <= 64)
) WITH (fillfactor = 50);
CREATE INDEX blade_cycles_by_machine ON blade_cycles (machine_id);
CREATE INDEX blade_cycles_by_beginning ON blade_cycles (begun_at);
COMMENT ON TABLE blade_cycles IS
  'Blades in work, each from its first scan to its verdict, for 30 days at most: when each step was last done. Not part of the record: '
  'changed in place by count_entry; a row goes with the verdict.';
COMMENT ON COLUMN blade_cycles.machine_id IS 'Of the last entry.';
COMMENT ON COLUMN blade_cycles.scanned_at IS 'The last scan before the registration; a later one begins the steps anew.';
COMMENT ON COLUMN blade_cycles.awaiting_since IS 'Since when correction_id waits for a person; NULL: it does not.';
COMMENT ON COLUMN blade_cycles.cut_at IS 'When the last hole of the program was reported cut.';

-- What an entry says beside its kind, from its own row, which is written before it.
CREATE FUNCTION entry_detail(of_record uuid, of_kind text) RETURNS text
LANGUAGE plpgsql STABLE AS $$
BEGIN
  IF of_kind = 'scan' THEN
    RETURN (SELECT s.kind FROM scans s WHERE s.scan_key = of_record);
  ELSIF of_kind = 'registration' THEN
    RETURN (SELECT CASE WHEN r.for_inspection THEN 'FOR_INSPECTION' ELSE r.outcome END FROM registrations r
            WHERE r.registration_id = of_record);
  ELSIF of_kind = 'correction' THEN
    RETURN (SELECT c.release FROM corrections c WHERE c.correction_id = of_record);
  ELSIF of_kind = 'inspection' THEN
    RETURN (SELECT CASE WHEN i.rejudges IS NOT NULL THEN 'REJUDGED' ELSE i.verdict END FROM inspections i
            WHERE i.inspection_id = of_record);
  END IF;
  RETURN NULL;
END
$$;

-- Whether with that report all holes of its correction are cut.
CREATE FUNCTION is_cut_to_the_last(of_record uuid, of_sequence bigint) RETURNS boolean LANGUAGE plpgsql STABLE AS $$
DECLARE
  cut_correction uuid := (SELECT k.correction_id FROM correction_cuts k WHERE k.record_id = of_record LIMIT 1);
BEGIN
  RETURN (SELECT count(*) FROM correction_cuts k JOIN record_names n ON n.record_id = k.record_id
          WHERE k.correction_id = cut_correction AND n.record_sequence <= of_sequence)
         >= (SELECT count(*) FROM correction_holes h WHERE h.correction_id = cut_correction);
END
$$;

-- Amortised: one blade that begins takes away two that were given up, and hours that are over.
CREATE FUNCTION forget_old_summaries(of_machine text, at timestamptz) RETURNS void
LANGUAGE plpgsql AS $$
BEGIN
  DELETE FROM blade_cycles WHERE blade_serial IN (
    SELECT c.blade_serial FROM blade_cycles c WHERE c.begun_at < at - interval '30 days' ORDER BY c.begun_at LIMIT 2);
  DELETE FROM machine_activity WHERE ctid = ANY (ARRAY(
    SELECT a.ctid FROM machine_activity a WHERE a.period = 'hour' AND a.machine_id = of_machine
    AND a.begins_at < at - interval '62 days' ORDER BY a.begins_at LIMIT 40));
END
$$;

-- The blade's way, one entry further: which steps ended with it, and when each began (NULL: not a step, but counted).
CREATE FUNCTION follow_blade(of_record uuid, of_sequence bigint, at timestamptz, of_kind text, of_blade text, of_machine text,
                             detail text, OUT steps text[], OUT since timestamptz[])
LANGUAGE plpgsql AS $$
DECLARE
  c blade_cycles;
BEGIN
  steps := '{}';
  since := '{}';
  SELECT * INTO c FROM blade_cycles b WHERE b.blade_serial = of_blade;
  IF c.blade_serial IS NULL OR c.begun_at < at - interval '30 days' THEN
    DELETE FROM blade_cycles b WHERE b.blade_serial = of_blade;
    IF of_kind <> 'scan' THEN
      RETURN;
    END IF;
    c := NULL;
    c.blade_serial := of_blade;
    c.begun_at := at;
    steps := ARRAY['blade_begun'];
    since := ARRAY[NULL::timestamptz];
    PERFORM forget_old_summaries(of_machine, at);
  END IF;
  c.machine_id := of_machine;
  IF of_kind = 'scan' AND detail = 'pins' THEN
    IF c.cut_at IS NOT NULL AND c.pins_scanned_at IS NULL THEN
      steps := steps || 'CUT_TO_PINS_SCAN'::text;
      since := since || c.cut_at;
    END IF;
    c.pins_scanned_at := at;
  ELSIF of_kind = 'scan' THEN
    c.scanned_at := at;
    c.registered_at := NULL; c.corrected_at := NULL; c.correction_id := NULL; c.awaiting_since := NULL;
    c.released_at := NULL; c.fetched_at := NULL; c.cut_at := NULL; c.pins_scanned_at := NULL;
  ELSIF of_kind = 'registration' THEN
    IF c.scanned_at IS NOT NULL AND c.registered_at IS NULL THEN
      steps := steps || 'SCAN_TO_REGISTRATION'::text;
      since := since || c.scanned_at;
    END IF;
    c.registered_at := at;
  ELSIF of_kind = 'correction' THEN
    IF c.registered_at IS NOT NULL AND c.corrected_at IS NULL THEN
      steps := steps || 'REGISTRATION_TO_CORRECTION'::text;
      since := since || c.registered_at;
    END IF;
    c.corrected_at := at;
    c.correction_id := of_record;
    c.awaiting_since := CASE WHEN detail = 'AWAITING_PERSON' THEN at END;
  ELSIF of_kind IN ('refusal', 'release') THEN
    -- Of an older correction of the blade: the last one waits on.
    IF EXISTS (SELECT 1 FROM correction_events e WHERE e.record_id = of_record AND e.correction_id = c.correction_id) THEN
      c.awaiting_since := NULL;
    END IF;
  ELSIF of_kind = 'fetch' THEN
    IF c.corrected_at IS NOT NULL AND c.fetched_at IS NULL THEN
      steps := steps || 'CORRECTION_TO_FETCH'::text;
      since := since || c.corrected_at;
    END IF;
    c.fetched_at := at;
  ELSIF of_kind = 'cut' THEN
    IF NOT is_cut_to_the_last(of_record, of_sequence) THEN
      RETURN;
    END IF;
    IF c.fetched_at IS NOT NULL AND c.cut_at IS NULL THEN
      steps := steps || 'FETCH_TO_CUT'::text;
      since := since || c.fetched_at;
    END IF;
    c.cut_at := at;
  ELSIF of_kind = 'inspection' THEN
    IF c.pins_scanned_at IS NOT NULL THEN
      steps := steps || ARRAY['PINS_SCAN_TO_VERDICT', 'FIRST_SCAN_TO_VERDICT'];
      since := since || ARRAY[c.pins_scanned_at, c.begun_at];
      DELETE FROM blade_cycles b WHERE b.blade_serial = of_blade;
    END IF;
    RETURN;
  END IF;
  -- By rule with the correction, or by a person.
  IF of_kind = 'release' OR (of_kind = 'correction' AND detail = 'AUTOMATIC') THEN
    IF c.released_at IS NULL THEN
      steps := steps || 'FIRST_SCAN_TO_PROGRAM'::text;
      since := since || c.begun_at;
    END IF;
    c.released_at := at;
  END IF;
  INSERT INTO blade_cycles VALUES (c.*)
    ON CONFLICT (blade_serial) DO UPDATE SET machine_id = excluded.machine_id, scanned_at = excluded.scanned_at,
      registered_at = excluded.registered_at, corrected_at = excluded.corrected_at, correction_id = excluded.correction_id,
      awaiting_since = excluded.awaiting_since, released_at = excluded.released_at, fetched_at = excluded.fetched_at,
      cut_at = excluded.cut_at, pins_scanned_at = excluded.pins_scanned_at;
END
$$;

-- Under the journal's lock, so that no two count at once.
CREATE FUNCTION count_entry(of_record uuid, of_sequence bigint, at timestamptz, of_kind text, of_blade text, of_machine text)
RETURNS void LANGUAGE plpgsql AS $$
DECLARE
  detail text := entry_detail(of_record, of_kind);
  counted text := CASE WHEN detail = 'REJUDGED' THEN 'rejudgement' ELSE of_kind END;
  steps text[] := '{}';
  since timestamptz[] := '{}';
BEGIN
  IF of_blade IS NOT NULL AND detail IS DISTINCT FROM 'FOR_INSPECTION' AND counted IN ('scan', 'registration', 'correction', 'release',
       'refusal', 'fetch', 'cut', 'inspection') THEN
    SELECT f.steps, f.since INTO steps, since FROM follow_blade(of_record, of_sequence, at, of_kind, of_blade, of_machine, detail) f;
  END IF;
  INSERT INTO machine_activity AS a (machine_id, period, begins_at, measure, bucket, entry_count, seconds)
    SELECT of_machine, p.period, date_trunc(p.period, at, 'UTC'), s.measure,
           CASE WHEN s.seconds IS NULL THEN 0 ELSE 1 + floor(4 * ln(greatest(s.seconds, 1)) / ln(2::double precision))::integer END, 1,
           coalesce(s.seconds, 0)
    FROM (VALUES ('hour'), ('day')) AS p (period),
         (SELECT m.measure, CASE WHEN m.began IS NOT NULL THEN greatest(extract(epoch FROM at - m.began)::double precision, 0) END AS seconds
          FROM unnest(CASE WHEN counted = 'inspection' THEN coalesce(detail, counted) ELSE counted END || steps, NULL::timestamptz || since)
            AS m (measure, began)) s
    ON CONFLICT (period, machine_id, begins_at, measure, bucket)
      DO UPDATE SET entry_count = a.entry_count + 1, seconds = a.seconds + excluded.seconds;
  INSERT INTO machine_contacts AS k (machine_id, kind, record_id, record_sequence, recorded_at, detail, run_since)
    VALUES (of_machine, counted, of_record, of_sequence, at, detail, at)
    ON CONFLICT (machine_id, kind) DO UPDATE SET record_id = excluded.record_id, record_sequence = excluded.record_sequence,
      recorded_at = excluded.recorded_at, detail = excluded.detail,
      run_count = CASE WHEN k.detail IS NOT DISTINCT FROM excluded.detail THEN k.run_count + 1 ELSE 1 END,
      run_since = CASE WHEN k.detail IS NOT DISTINCT FROM excluded.detail THEN k.run_since ELSE excluded.run_since END;
END
$$;
COMMENT ON FUNCTION count_entry(uuid, bigint, timestamptz, text, text, text) IS
  'One entry of the journal into the summaries. Called by the trigger of record_entries alone, and when they are made anew.';

-- Plans are kept: to look a row up takes less than to plan how.
CREATE FUNCTION count_new_entry() RETURNS trigger
LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp SET plan_cache_mode = force_generic_plan AS $$
BEGIN
  PERFORM count_entry(NEW.record_id, NEW.record_sequence, NEW.recorded_at, NEW.kind, NEW.blade_serial, NEW.machine_id);
  RETURN NULL;
END
$$;
CREATE TRIGGER counted AFTER INSERT ON record_entries FOR EACH ROW WHEN (NEW.machine_id IS NOT NULL)
  EXECUTE FUNCTION count_new_entry();

-- As V0024 has it. It is asked with every entry, and was planned anew each time: that took longer than all of the above.
CREATE OR REPLACE FUNCTION roots_of(of_record uuid, of_kind text, of_version text, inputs text[]) RETURNS uuid[]
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp SET plan_cache_mode = force_generic_plan AS $$
DECLARE
  roots uuid[] := ARRAY(
    SELECT r.root_id FROM record_names n JOIN record_roots r ON r.record_id = n.record_id WHERE n.name = ANY (inputs)
    UNION SELECT n.record_id FROM record_names n WHERE n.name = ANY (inputs) AND is_root(n.name)
    UNION SELECT root_of('software/' || of_version));
  own uuid;
BEGIN
  IF of_kind = 'scan' THEN
    own := (SELECT root_of('sensors/' || coalesce(s.sensor_serial_number, m.sensor_serial_number))
            FROM scans s JOIN machine_revisions m ON m.machine_id = s.machine_id AND m.revision = s.machine_revision
            WHERE s.scan_key = of_record);
  ELSIF of_kind = 'machine' THEN
    own := (SELECT root_of('probes/' || m.touch_probe_serial_number) FROM machine_revisions m WHERE m.record_id = of_record);
  END IF;
  RETURN CASE WHEN own IS NULL OR own = ANY (roots) THEN roots ELSE roots || own END;
END
$$;

-- Days of which only the entries are counted, all at once and without the steps of blades. Of each kind the last one is told as if it were the
-- first of its run.
CREATE FUNCTION count_days_before(day timestamptz) RETURNS bigint
LANGUAGE plpgsql SET search_path = public, pg_temp AS $$
DECLARE
  counted bigint;
BEGIN
  WITH put AS (
    INSERT INTO machine_activity (machine_id, period, begins_at, measure, entry_count)
      SELECT e.machine_id, 'day', date_trunc('day', e.recorded_at, 'UTC'),
             CASE WHEN i.rejudges IS NOT NULL THEN 'rejudgement' ELSE coalesce(i.verdict, e.kind) END AS said, count(*)
      FROM record_entries e LEFT JOIN inspections i ON e.kind = 'inspection' AND i.inspection_id = e.record_id
      WHERE e.machine_id IS NOT NULL AND e.recorded_at < day
      GROUP BY 1, 3, 4
      RETURNING entry_count)
  SELECT coalesce(sum(entry_count), 0) INTO counted FROM put;
  INSERT INTO machine_contacts (machine_id, kind, record_id, record_sequence, recorded_at, detail, run_since)
    SELECT l.machine_id, l.kind, l.record_id, l.record_sequence, l.recorded_at, entry_detail(l.record_id, l.entry_kind), l.recorded_at
    FROM (SELECT DISTINCT ON (e.machine_id, s.kind) e.machine_id, s.kind, e.kind AS entry_kind, e.record_id, e.record_sequence, e.recorded_at
          FROM record_entries e LEFT JOIN inspections i ON e.kind = 'inspection' AND i.inspection_id = e.record_id,
               LATERAL (SELECT CASE WHEN i.rejudges IS NOT NULL THEN 'rejudgement' ELSE e.kind END AS kind) s
          WHERE e.machine_id IS NOT NULL AND e.recorded_at < day
          ORDER BY e.machine_id, s.kind, e.record_sequence DESC) l;
  RETURN counted;
END
$$;

-- Of months that were detached the journal says nothing any more: what was counted of them stays.
CREATE FUNCTION rebuild_summaries(steps_since timestamptz DEFAULT '-infinity') RETURNS bigint
LANGUAGE plpgsql SET search_path = public, pg_temp SET plan_cache_mode = force_generic_plan AS $$
DECLARE
  e record;
  first_day timestamptz := CASE WHEN isfinite(steps_since) THEN date_trunc('day', steps_since, 'UTC') ELSE steps_since END;
  counted bigint;
BEGIN
  PERFORM pg_advisory_xact_lock(6021, 1);
  DELETE FROM machine_activity WHERE begins_at >= (SELECT date_trunc('day', min(recorded_at), 'UTC') FROM record_entries);
  DELETE FROM machine_contacts WHERE recorded_at >= (SELECT min(recorded_at) FROM record_entries);
  DELETE FROM blade_cycles;
  counted := count_days_before(first_day);
  FOR e IN SELECT record_id, record_sequence, recorded_at, kind, blade_serial, machine_id FROM record_entries
           WHERE machine_id IS NOT NULL AND recorded_at >= first_day ORDER BY record_sequence LOOP
    PERFORM count_entry(e.record_id, e.record_sequence, e.recorded_at, e.kind, e.blade_serial, e.machine_id);
    counted := counted + 1;
  END LOOP;
  RETURN counted;
END
$$;
COMMENT ON FUNCTION rebuild_summaries(timestamptz) IS
  'Makes the summaries anew from the journal that is there, with the plant''s writers waiting; how many entries it counted. Of days before '
  'steps_since by days and without steps. For the owner.';
REVOKE EXECUTE ON FUNCTION count_entry(uuid, bigint, timestamptz, text, text, text), count_new_entry(), rebuild_summaries(timestamptz),
  follow_blade(uuid, bigint, timestamptz, text, text, text, text), forget_old_summaries(text, timestamptz),
  entry_detail(uuid, text), is_cut_to_the_last(uuid, bigint), count_days_before(timestamptz) FROM PUBLIC;

-- How far a calibration lies from the one that was in force when it was made.

-- How far an axis leans toward a direction across it (1: x, 2: y, 3: z), with what its covariance of 8 x 8 says of it, its rows and
-- columns from `first` on: as services/calibration/trend.cc has it, across the basis of metrology/kinematics/axis_line.cc.
CREATE FUNCTION axis_lean(d double precision[], toward integer, covariance double precision[], first integer,
                          OUT value double precision, OUT standard_uncertainty double precision)
LANGUAGE plpgsql IMMUTABLE SET search_path = public, pg_temp AS $$
DECLARE
  u double precision[] := ARRAY[0, d[3], -d[2]];
  v double precision[];
  u_length double precision;
  v_length double precision;
  a double precision;
  b double precision;
BEGIN
  IF abs(d[1]) > abs(d[2]) OR abs(d[1]) > abs(d[3]) THEN
    u := CASE WHEN abs(d[2]) < abs(d[3]) THEN ARRAY[-d[3], 0, d[1]] ELSE ARRAY[d[2], -d[1], 0] END;
  END IF;
  v := ARRAY[d[2] * u[3] - d[3] * u[2], d[3] * u[1] - d[1] * u[3], d[1] * u[2] - d[2] * u[1]];
  u_length := sqrt(u[1] * u[1] + u[2] * u[2] + u[3] * u[3]);
  v_length := sqrt(v[1] * v[1] + v[2] * v[2] + v[3] * v[3]);
  a := u[toward] / u_length;
  b := v[toward] / v_length;
  value := degrees(asin(least(greatest(d[toward], -1), 1)));
  standard_uncertainty := degrees(sqrt(greatest(0, a * a * covariance[9 * first + 1]
    + a * b * (covariance[9 * first + 2] + covariance[9 * first + 9]) + b * b * covariance[9 * first + 10])));
END
$$;

CREATE FUNCTION calibration_parameters(of_calibration uuid)
RETURNS TABLE (position_index integer, parameter text, value double precision, standard_uncertainty double precision)
LANGUAGE sql STABLE SET search_path = public, pg_temp AS $$
  SELECT p.* FROM sensor_calibrations s, LATERAL (VALUES
      (1, 'alpha_deg', s.alpha_deg, s.alpha_standard_uncertainty_deg), (2, 'beta_deg', s.beta_deg, s.beta_standard_uncertainty_deg),
      (3, 'gamma_deg', s.gamma_deg, s.gamma_standard_uncertainty_deg), (4, 't_sm_x_mm', s.t_sm_mm[1], sqrt(s.covariance[22])),
      (5, 't_sm_y_mm', s.t_sm_mm[2], sqrt(s.covariance[29])), (6, 't_sm_z_mm', s.t_sm_mm[3], sqrt(s.covariance[36]))) p
    WHERE s.calibration_id = of_calibration
  UNION ALL
  SELECT p.* FROM rotation_calibrations r, axis_lean(r.a_direction, 1, r.covariance, 0) ax, axis_lean(r.a_direction, 3, r.covariance, 0) az,
      axis_lean(r.b_direction, 2, r.covariance, 4) b_y, axis_lean(r.b_direction, 3, r.covariance, 4) bz, LATERAL (VALUES
      (1, 'point_c_x_mm', r.point_c_mm[1], r.point_c_standard_uncertainty_mm[1]),
      (2, 'point_c_y_mm', r.point_c_mm[2], r.point_c_standard_uncertainty_mm[2]),
      (3, 'point_c_z_mm', r.point_c_mm[3], r.point_c_standard_uncertainty_mm[3]),
      (4, 'a_toward_x_deg', ax.value, ax.standard_uncertainty), (5, 'a_toward_z_deg', az.value, az.standard_uncertainty),
      (6, 'b_toward_y_deg', b_y.value, b_y.standard_uncertainty), (7, 'b_toward_z_deg', bz.value, bz.standard_uncertainty)) p
    WHERE r.calibration_id = of_calibration
  UNION ALL
  SELECT p.* FROM probe_calibrations o, LATERAL (VALUES
      (1, 'approach_x', o.approach[1], sqrt(o.covariance[1])), (2, 'approach_y', o.approach[2], sqrt(o.covariance[8])),
      (3, 'approach_z', o.approach[3], sqrt(o.covariance[15])), (4, 'offset_x_mm', o.offset_mm[1], sqrt(o.covariance[22])),
      (5, 'offset_y_mm', o.offset_mm[2], sqrt(o.covariance[29])), (6, 'offset_z_mm', o.offset_mm[3], sqrt(o.covariance[36])),
      (7, 'scale', o.scale, o.scale_standard_uncertainty)) p
    WHERE o.calibration_id = of_calibration
  UNION ALL
  SELECT p.* FROM axis_characterisations x, LATERAL (VALUES
      (1, 'reversal_deg', x.reversal_deg[1], x.reversal_deg[2]), (2, 'mean_deg', x.mean_deg[1], x.mean_deg[2]),
      (3, 'long_wave_amplitude_deg', x.long_wave_amplitude_deg[1], x.long_wave_amplitude_deg[2]),
      (4, 'periodic_amplitude_deg', x.periodic_amplitude_deg[1], CASE WHEN x.periodic_order IS NOT NULL THEN x.periodic_amplitude_deg[2] END),
      (5, 'greatest_error_deg', x.greatest_error_deg[1], x.greatest_error_deg[2])) p
    WHERE x.calibration_id = of_calibration
$$;
COMMENT ON FUNCTION calibration_parameters(uuid) IS
  'As ParametersOf() in services/calibration/trend.cc has them; of what is no uncertainty stated that is 0 or NULL.';

CREATE TABLE calibration_drifts (
  calibration_id uuid NOT NULL,
  earlier_id uuid NOT NULL,
  parameter text NOT NULL,
  change double precision NOT NULL,
  ratio double precision NOT NULL,
  flagged_parameters text[] NOT NULL,
  CONSTRAINT calibration_drifts_pk PRIMARY KEY (calibration_id),
  CONSTRAINT calibration_drifts_calibration_fk FOREIGN KEY (calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT calibration_drifts_earlier_fk FOREIGN KEY (earlier_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT calibration_drifts_parameter_named CHECK (parameter <> '' AND octet_length(parameter) <= 64),
  CONSTRAINT calibration_drifts_ratio CHECK (ratio >= 0 AND ratio < 1e300 AND abs(change) < 1e300),
  CONSTRAINT calibration_drifts_flagged_parameters_whole CHECK (array_position(flagged_parameters, NULL) IS NULL
    AND cardinality(flagged_parameters) <= 64)
);
COMMENT ON TABLE calibration_drifts IS
  'Of each calibration what moved most since the one of its machine, kind and axis that was released last before it. Follows from both.';
COMMENT ON COLUMN calibration_drifts.ratio IS 'Of the change, over the combined standard uncertainty of the two.';
COMMENT ON COLUMN calibration_drifts.flagged_parameters IS 'Those beyond 3.';
SELECT make_append_only('calibration_drifts');
CREATE INDEX calibrations_by_machine ON calibrations (machine_id, kind);

CREATE FUNCTION keep_drift(of_calibration uuid) RETURNS void LANGUAGE sql SET search_path = public, pg_temp AS $$
  WITH own AS (SELECT c.machine_id, c.kind, coalesce(c.axis, '') AS axis, n.record_sequence FROM calibrations c
               JOIN record_names n ON n.record_id = c.calibration_id WHERE c.calibration_id = of_calibration),
  earlier AS (SELECT f.calibration_id FROM calibration_forces f JOIN own USING (machine_id, kind, axis)
              WHERE f.force_sequence < own.record_sequence AND f.calibration_id <> of_calibration
              ORDER BY f.force_sequence DESC LIMIT 1),
  moved AS (SELECT e.calibration_id AS earlier_id, p.position_index, p.parameter, p.value - q.value AS change,
                   abs(p.value - q.value) / sqrt(p.standard_uncertainty ^ 2 + q.standard_uncertainty ^ 2) AS ratio
            FROM earlier e, calibration_parameters(of_calibration) p JOIN LATERAL calibration_parameters(e.calibration_id) q
              ON q.parameter = p.parameter
            WHERE p.standard_uncertainty > 0 AND q.standard_uncertainty > 0)
  INSERT INTO calibration_drifts (calibration_id, earlier_id, parameter, change, ratio, flagged_parameters)
    SELECT of_calibration, m.earlier_id, m.parameter, m.change, m.ratio,
           ARRAY(SELECT f.parameter FROM moved f WHERE f.ratio > 3 ORDER BY f.position_index)
    FROM moved m ORDER BY m.ratio DESC, m.position_index LIMIT 1
$$;
CREATE FUNCTION keep_drift_of_entry() RETURNS trigger LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  PERFORM keep_drift(NEW.record_id);
  RETURN NULL;
END
$$;
CREATE TRIGGER drifted AFTER INSERT ON record_entries FOR EACH ROW WHEN (NEW.kind = 'calibration')
  EXECUTE FUNCTION keep_drift_of_entry();
REVOKE EXECUTE ON FUNCTION keep_drift(uuid), keep_drift_of_entry() FROM PUBLIC;

-- Of each machine, kind and axis the calibration that is in force or, without one, the one that was last. Beside it what moved, and the
-- interim check that stands against it, by the rule of storage/interim_checks.cc.
CREATE VIEW machine_calibrations AS
  SELECT f.machine_id, f.kind, f.axis, f.calibration_id, n.recorded_at, f.valid_from, f.valid_until,
         f.valid_until > statement_timestamp() AS is_in_force, d.earlier_id, d.parameter, d.change, d.ratio, d.flagged_parameters,
         k.study_id AS standing_check_id, k.scanned_at AS standing_check_at
  FROM (SELECT DISTINCT ON (o.machine_id, o.kind, o.axis) o.* FROM calibration_forces o
        WHERE o.valid_from <= statement_timestamp()
        ORDER BY o.machine_id, o.kind, o.axis, o.valid_until > statement_timestamp() DESC, o.force_sequence DESC) f
  JOIN record_names n ON n.record_id = f.calibration_id
  LEFT JOIN calibration_drifts d ON d.calibration_id = f.calibration_id
  LEFT JOIN LATERAL (
    SELECT r.study_id, r.scanned_at FROM interim_checks r JOIN studies s ON s.study_id = r.study_id
    JOIN record_names rn ON rn.record_id = r.study_id
    WHERE f.kind = 'sensor' AND r.sensor_calibration_id = f.calibration_id AND s.verdict NOT IN ('ACCEPTED', 'REPORTED')
      AND NOT EXISTS (SELECT 1 FROM interim_checks a JOIN studies sa ON sa.study_id = a.study_id
                      JOIN record_names an ON an.record_id = a.study_id
                      WHERE a.sensor_calibration_id = f.calibration_id AND sa.verdict = 'ACCEPTED' AND a.limit_um <= r.limit_um
                        AND (a.scanned_at, an.record_sequence) > (r.scanned_at, rn.record_sequence))
    ORDER BY r.scanned_at DESC, rn.record_sequence DESC LIMIT 1) k ON true;
COMMENT ON VIEW machine_calibrations IS
  'What machines are calibrated by now, or were last, with the drift since the one before and the check that stands against it.';

-- From each damage to its scans, never the other way: scans are millions, damages none.
CREATE VIEW machine_damages AS
  SELECT s.machine_id, count(*) AS blob_count, min(d.found_at) AS found_at
  FROM (SELECT l.sha256, min(l.found_at) AS found_at
        FROM (SELECT b.sha256, b.found_at FROM blob_damages b ORDER BY b.damage_id DESC LIMIT 1000) l GROUP BY l.sha256) d
  CROSS JOIN LATERAL (SELECT DISTINCT o.machine_id FROM scan_blocks k JOIN scans o ON o.scan_key = k.scan_key
                      WHERE k.blob_sha256 = d.sha256 OFFSET 0) s
  GROUP BY s.machine_id;
COMMENT ON VIEW machine_damages IS 'Blobs of each machine''s scans among the last 1000 damages that the check of the store found.';

CREATE VIEW machine_work AS
  SELECT b.machine_id, count(*) AS blade_count, count(k.correction_id) AS awaiting_count, min(b.awaiting_since) FILTER (WHERE k.correction_id
           IS NOT NULL) AS awaiting_since,
         (array_agg(k.correction_id ORDER BY b.awaiting_since) FILTER (WHERE k.correction_id IS NOT NULL))[1] AS first_awaiting_id
  FROM blade_cycles b
  LEFT JOIN corrections k ON b.awaiting_since IS NOT NULL AND k.correction_id = b.correction_id
    AND correction_state(k.correction_id) = 'DRAFT'
  WHERE b.begun_at > statement_timestamp() - interval '30 days'
  GROUP BY b.machine_id;
COMMENT ON VIEW machine_work IS 'Blades in work at each machine, and those of them whose correction waits for a person.';

GRANT SELECT ON machine_activity, machine_contacts, machine_calibrations, machine_damages, machine_work TO sixpoint_plant;
GRANT SELECT (scan_id, header, next_block, point_count, stored_bytes, started_at, touched_at) ON scan_uploads TO sixpoint_plant;

-- What was recorded before; one by one, of which a migration has no time for many years, what hours are kept of.
SELECT rebuild_summaries(statement_timestamp() - interval '62 days');
SELECT keep_drift(c.calibration_id) FROM calibrations c JOIN record_names n ON n.record_id = c.calibration_id ORDER BY n.record_sequence;
