-- What events say beside their entries: until when a thing holds by the clock, which no later entry tells. And what a listener's
-- filter and bookmark are held against: the kinds that there can be, and which plant this is.

CREATE FUNCTION record_valid_until(of_record uuid, of_kind text) RETURNS timestamptz
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  RETURN CASE of_kind
    WHEN 'calibration' THEN (SELECT c.valid_until FROM calibrations c WHERE c.calibration_id = of_record)
    WHEN 'correction' THEN (SELECT s.usable_until FROM correction_states s WHERE s.correction_id = of_record)
    WHEN 'release' THEN
      (SELECT coalesce((SELECT c.valid_until FROM calibrations c WHERE c.calibration_id = i.input_id),
                       (SELECT s.usable_until FROM correction_states s WHERE s.correction_id = i.input_id))
       FROM record_inputs i WHERE i.record_id = of_record ORDER BY i.position_index LIMIT 1) END;
END
$$;
COMMENT ON FUNCTION record_valid_until(uuid, text) IS
  'When a calibration or a correction, or the one that was released, is EXPIRED by the clock alone; NULL: nothing ends by itself.';

CREATE FUNCTION record_kinds() RETURNS text[] LANGUAGE sql STABLE AS $$
  SELECT coalesce(array_agg(DISTINCT kind[1]), '{}') FROM pg_constraint c
  CROSS JOIN regexp_matches(pg_get_constraintdef(c.oid), '''([a-z]+)''', 'g') AS kind
  WHERE c.conrelid = 'record_entries'::regclass AND c.conname = 'record_entries_kind_known'
$$;
COMMENT ON FUNCTION record_kinds() IS 'Every kind that an entry of the journal may have, as its CHECK has them.';

-- Past one number as far as another, the first so many of those that the filters let through and whom the parts `hidden` are hidden from
-- may see. One call, with a plan that stays: to plan it anew took longer than to carry it out. By keys alone, for PostgreSQL would
-- rather read months whole.
CREATE FUNCTION events_between(past bigint, upto bigint, most bigint, hidden text[], of_kinds text[], of_machine text, of_blade text,
                               of_part text, of_verdicts text[])
RETURNS TABLE (record_sequence bigint, recorded_at timestamptz, kind text, name text, blade_serial text, machine_id text, method text,
               software_version text, requested_by text, measured_at timestamptz, summary text, inputs text[], trace_id text,
               verdict text, state text, work_order text, operation text, valid_until timestamptz, parts text[], is_restricted boolean)
LANGUAGE plpgsql STABLE SET enable_hashjoin = off SET enable_mergejoin = off SET plan_cache_mode = force_generic_plan AS $$
#variable_conflict use_column
BEGIN
  IF upto <= past THEN
    RETURN;
  END IF;
  RETURN QUERY
  WITH told AS MATERIALIZED (
    SELECT e.record_id, n.name, v.verdict, p.ids
    FROM record_names n
    JOIN record_entries e ON e.record_id = n.record_id
    CROSS JOIN LATERAL (SELECT CASE WHEN e.kind IN ('inspection', 'registration', 'study')
                               THEN record_verdict(e.record_id, e.kind) END AS verdict OFFSET 0) v
    -- As parts_of_record() has it.
    CROSS JOIN LATERAL (SELECT CASE WHEN e.blade_serial IS NOT NULL
                               THEN (SELECT ARRAY[b.part_id] FROM blades b WHERE b.blade_serial = e.blade_serial)
                               ELSE parts_of_record(e.record_id) END AS ids OFFSET 0) p
    WHERE n.record_sequence > past AND n.record_sequence <= upto
      AND (cardinality(of_kinds) = 0 OR e.kind = ANY (of_kinds))
      AND (of_machine = '' OR e.machine_id = of_machine)
      AND (of_blade = '' OR e.blade_serial = of_blade)
      AND (of_part = '' OR of_part = ANY (p.ids))
      AND (cardinality(of_verdicts) = 0 OR v.verdict = ANY (of_verdicts))
      AND (cardinality(hidden) = 0 OR coalesce(NOT p.ids && hidden, false))
    ORDER BY n.record_sequence LIMIT most)
  SELECT e.record_sequence, e.recorded_at, e.kind, t.name, e.blade_serial, e.machine_id, e.method, e.software_version,
    CASE WHEN e.requested_by LIKE 'persons/%' THEN name_of(e.requested_by) ELSE e.requested_by END,
    e.measured_at, e.summary::text,
    ARRAY(SELECT m.name FROM record_inputs i JOIN record_names m ON m.record_id = i.input_id
          WHERE i.record_id = e.record_id ORDER BY i.position_index),
    e.trace_id, t.verdict,
    CASE WHEN e.kind IN ('calibration', 'correction', 'scan') THEN record_state(e.record_id, e.kind) END,
    e.work_order, e.operation,
    CASE WHEN e.kind IN ('calibration', 'correction', 'release') THEN record_valid_until(e.record_id, e.kind) END,
    t.ids, t.ids IS NULL OR EXISTS (SELECT 1 FROM restricted_parts r WHERE r.part_id = ANY (t.ids))
  FROM told t JOIN record_entries e ON e.record_id = t.record_id ORDER BY e.record_sequence;
END
$$;
COMMENT ON FUNCTION events_between(bigint, bigint, bigint, text[], text[], text, text, text, text[]) IS
  'Entries of the journal as events. parts: of which it is, NULL where it cannot be told; is_restricted: somebody may not see it.';

GRANT SELECT ON plant_identity TO sixpoint_plant;
