-- Persons stand in what is never changed under pseudonyms. One table knows whose they are, and can forget it. And each entry of the
-- journal says of which trace its call was.
CREATE TABLE persons (
  pseudonym text COLLATE "C" NOT NULL,
  user_name text COLLATE "C",
  first_seen_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  forgotten_at timestamptz,
  CONSTRAINT persons_pk PRIMARY KEY (pseudonym),
  CONSTRAINT persons_user_once UNIQUE (user_name),
  CONSTRAINT persons_pseudonym_form CHECK (pseudonym ~ '^[0-9a-f]{16}$'),
  CONSTRAINT persons_user_form CHECK (octet_length(user_name) BETWEEN 1 AND 64),
  CONSTRAINT persons_known_or_forgotten CHECK ((user_name IS NULL) = (forgotten_at IS NOT NULL)),
  CONSTRAINT persons_times CHECK (isfinite(first_seen_at) AND isfinite(forgotten_at))
);
COMMENT ON TABLE persons IS 'Whose the pseudonyms are. Not of the record: a name may be forgotten, its pseudonym stays for ever.';
COMMENT ON COLUMN persons.pseudonym IS 'Drawn by chance; persons/{pseudonym} stands where users/{user_name} asked.';
COMMENT ON COLUMN persons.user_name IS 'NULL: forgotten.';

-- Of "users/jane via services/inspection" "persons/0123456789abcdef via services/inspection"; of anything else, itself. Who is seen for
-- the first time gets one.
CREATE FUNCTION pseudonym_of(asker text) RETURNS text
LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  known text;
  meant text := substring(asker FROM '^users/([^ ]+)');
BEGIN
  IF meant IS NULL THEN RETURN asker; END IF;
  SELECT p.pseudonym INTO known FROM persons p WHERE p.user_name = meant;
  IF known IS NULL THEN
    INSERT INTO persons (pseudonym, user_name) VALUES (right(replace(gen_random_uuid()::text, '-', ''), 16), meant)
      ON CONFLICT (user_name) DO NOTHING;
    SELECT p.pseudonym INTO STRICT known FROM persons p WHERE p.user_name = meant;
  END IF;
  RETURN 'persons/' || known || substr(asker, length('users/' || meant) + 1);
END
$$;
COMMENT ON FUNCTION pseudonym_of(text) IS 'For what is never changed. Called before the journal''s lock is taken: two that see a person for the first time wait for each other.';

-- And back, as long as it is known.
CREATE FUNCTION name_of(asker text) RETURNS text
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT CASE WHEN asker LIKE 'persons/%' THEN
    coalesce((SELECT 'users/' || p.user_name || substr(asker, 25) FROM persons p WHERE p.pseudonym = substr(asker, 9, 16)), asker)
  ELSE asker END
$$;

CREATE FUNCTION keep_pseudonym_of_requested_by() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  NEW.requested_by := pseudonym_of(NEW.requested_by);
  RETURN NEW;
END
$$;
COMMENT ON FUNCTION keep_pseudonym_of_requested_by() IS
  'Before each insert into an append-only table that says who asked: no binary, of this release or another, keeps a name there.';
DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['record_entries', 'retention_policies', 'scan_deletions', 'calibrations', 'calibration_events', 'studies',
      'registrations', 'corrections', 'correction_events', 'program_fetches', 'inspections'] LOOP
    EXECUTE format('CREATE TRIGGER pseudonyms BEFORE INSERT ON %I FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by()', held);
  END LOOP;
END
$$;

-- The sentence of a denial names its caller, or somebody whose session the gateway sent.
CREATE FUNCTION keep_pseudonym_of_caller() RETURNS trigger LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  named text;
BEGIN
  NEW.caller := pseudonym_of(NEW.caller);
  FOR named IN SELECT DISTINCT m.words[1] FROM regexp_matches(NEW.sentence, 'users/[A-Za-z0-9._-]+', 'g') AS m (words)
      ORDER BY 1 DESC LOOP
    NEW.sentence := replace(NEW.sentence, named,
      coalesce((SELECT 'persons/' || p.pseudonym FROM persons p WHERE p.user_name = substr(named, 7)), 'users/*'));
  END LOOP;
  IF octet_length(NEW.sentence) > 1000 THEN
    NEW.sentence := left(NEW.sentence, 250);  -- of characters that take four bytes at most
  END IF;
  RETURN NEW;
END
$$;
COMMENT ON FUNCTION keep_pseudonym_of_caller() IS 'Who is named and not known is nobody''s to keep: users/*.';
CREATE TRIGGER pseudonyms BEFORE INSERT ON denials FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_caller();

-- Certificates name their holders, and wait for them only: what waits for a person goes with the name.
DROP TRIGGER append_only ON certificate_renewals;
DROP TRIGGER no_truncate ON certificate_renewals;

-- The name that goes, and all that waits under it. What it was known by stays in the record; who asks again under it is another.
CREATE FUNCTION forget_person(of_user text) RETURNS text
LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  was text;
BEGIN
  UPDATE persons SET user_name = NULL, forgotten_at = clock_timestamp() WHERE user_name = of_user RETURNING pseudonym INTO was;
  DELETE FROM certificate_renewals WHERE identity = 'users/' || of_user;
  DELETE FROM credential_offers WHERE identity = 'users/' || of_user;
  UPDATE certificate_renewals SET offered_by = 'persons/' || was WHERE offered_by = 'users/' || of_user AND was IS NOT NULL;
  UPDATE credential_offers SET offered_by = 'persons/' || was WHERE offered_by = 'users/' || of_user AND was IS NOT NULL;
  RETURN was;
END
$$;
COMMENT ON FUNCTION forget_person(text) IS 'The pseudonym that it had; NULL: none.';
REVOKE EXECUTE ON FUNCTION forget_person(text) FROM PUBLIC;
GRANT EXECUTE ON FUNCTION forget_person(text) TO sixpoint_plant;
GRANT SELECT ON persons TO sixpoint_plant;

ALTER TABLE record_entries ADD COLUMN trace_id text COLLATE "C";
ALTER TABLE record_entries ADD CONSTRAINT record_entries_trace_form CHECK (trace_id ~ '^[0-9a-f]{32}$');
COMMENT ON COLUMN record_entries.trace_id IS
  'W3C trace of the call that recorded it: what finds its lines in the logs of all services. NULL: no call, or before this migration.';
COMMENT ON COLUMN record_entries.requested_by IS 'Of a person the pseudonym: name_of() says whose it is, as long as that is known.';

-- As V0001 has it, with the trace; binaries before this one leave it out.
DROP FUNCTION append_record(uuid, text, text, text, text, text, text, text, timestamptz, jsonb, text[], text, uuid, bytea);
CREATE FUNCTION append_record(new_id uuid, new_name text, new_kind text, of_blade text, of_machine text, new_method text,
                              new_version text, asked_by text, new_measured_at timestamptz, new_summary jsonb, inputs text[],
                              of_call text, of_request uuid, of_request_sha256 bytea, of_trace text DEFAULT NULL,
                              OUT new_sequence bigint, OUT new_recorded_at timestamptz, OUT edge_count bigint)
LANGUAGE plpgsql AS $$
DECLARE
  asker text := pseudonym_of(asked_by);
BEGIN
  PERFORM pg_advisory_xact_lock(6021, 1);
  INSERT INTO record_names (record_id, name) VALUES (new_id, new_name)
    RETURNING record_sequence, recorded_at INTO new_sequence, new_recorded_at;
  INSERT INTO record_entries (record_id, record_sequence, recorded_at, kind, blade_serial, machine_id, method,
                              software_version, requested_by, measured_at, summary, trace_id)
    VALUES (new_id, new_sequence, new_recorded_at, new_kind, of_blade, of_machine, new_method, new_version, asker,
            new_measured_at, new_summary, of_trace);
  INSERT INTO record_inputs (record_id, position_index, input_id)
    SELECT new_id, (position - 1)::integer, n.record_id FROM unnest(inputs) WITH ORDINALITY AS input (name, position)
    JOIN record_names n ON n.name = input.name;
  GET DIAGNOSTICS edge_count = ROW_COUNT;
  IF of_request IS NOT NULL THEN
    INSERT INTO requests (call, request_id, request_sha256, record_id)
      VALUES (of_call, of_request, of_request_sha256, new_id);
  END IF;
END
$$;
