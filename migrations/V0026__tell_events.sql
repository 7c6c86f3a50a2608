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

GRANT SELECT ON plant_identity TO sixpoint_plant;
