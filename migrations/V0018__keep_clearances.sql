-- Who may see what is of which part: a part that has a customer is seen, with all that is recorded of it, by those alone who were
-- cleared for the customer or for the part. What is stated and granted stays: who could see what, and when, can be told for ever.
ALTER TABLE part_revisions ADD COLUMN customer_id text COLLATE "C",
  ADD CONSTRAINT part_revisions_customer_form CHECK (customer_id ~ '^[A-Za-z0-9._-]{1,64}$');
CREATE INDEX part_revisions_of_customers ON part_revisions (part_id, revision) WHERE customer_id IS NOT NULL;
COMMENT ON COLUMN part_revisions.customer_id IS
  'Whose part it is; NULL: nobody''s. What the newest revision that states one says holds for all of the part.';

CREATE VIEW restricted_parts AS
  SELECT DISTINCT ON (part_id) part_id, customer_id FROM part_revisions WHERE customer_id IS NOT NULL
  ORDER BY part_id, revision DESC;
COMMENT ON VIEW restricted_parts IS
  'Parts that are not everybody''s to see. A revision that states no customer, such as one of the release before, opens none.';

CREATE TABLE clearance_events (
  event_id uuid NOT NULL,
  event_sequence bigint GENERATED ALWAYS AS IDENTITY,
  holder text COLLATE "C" NOT NULL,
  scope text COLLATE "C" NOT NULL,
  granted boolean NOT NULL,
  took_effect boolean NOT NULL,
  requested_by text NOT NULL,
  request_id uuid NOT NULL,
  recorded_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT clearance_events_pk PRIMARY KEY (event_id),
  CONSTRAINT clearance_events_sequence_once UNIQUE (event_sequence),
  CONSTRAINT clearance_events_request_once UNIQUE (request_id),
  CONSTRAINT clearance_events_scope_form CHECK (scope ~ '^(parts|customers)/[A-Za-z0-9._-]{1,64}$'),
  CONSTRAINT clearance_events_texts CHECK (octet_length(holder) BETWEEN 1 AND 128 AND octet_length(requested_by) <= 200)
);
CREATE INDEX clearance_events_by_holder ON clearance_events (holder, scope, event_sequence);
CREATE INDEX clearance_events_by_scope ON clearance_events (scope, event_sequence);
COMMENT ON TABLE clearance_events IS
  'Clearances as they were granted and withdrawn; the newest event of a holder and scope holds. Not in the journal, which more '
  'people read than may know of a part.';
COMMENT ON COLUMN clearance_events.event_sequence IS 'Of one holder and scope in the order of commit: by a lock.';
COMMENT ON COLUMN clearance_events.holder IS 'Who may see it, as clearance_holder() writes him.';
COMMENT ON COLUMN clearance_events.scope IS 'customers/ID: all of that customer''s parts, those to come too; parts/ID: that part.';
COMMENT ON COLUMN clearance_events.granted IS 'False: withdrawn.';
COMMENT ON COLUMN clearance_events.took_effect IS
  'False: it was so already. Kept for its request_id: come again after the opposite, that request changes nothing.';

-- Whoever is looked for in clearance_events is looked for under this name, here and nowhere else.
CREATE FUNCTION clearance_holder(of_identity text) RETURNS text LANGUAGE sql STABLE AS $$ SELECT of_identity $$;

CREATE VIEW clearances AS
  SELECT g.holder, g.scope, g.event_sequence AS granted_sequence, g.recorded_at AS granted_at, g.requested_by AS granted_by,
         w.recorded_at AS withdrawn_at, w.requested_by AS withdrawn_by
  FROM clearance_events g LEFT JOIN LATERAL (
    SELECT e.recorded_at, e.requested_by FROM clearance_events e
    WHERE e.holder = g.holder AND e.scope = g.scope AND e.event_sequence > g.event_sequence AND NOT e.granted
    ORDER BY e.event_sequence LIMIT 1) w ON true
  WHERE g.granted AND g.took_effect;
COMMENT ON VIEW clearances IS 'From when until when who was cleared for what; withdrawn_at NULL: still.';

-- All that follows runs as the owner: a service learns what it asks, and needs no right to the tables behind.

-- NULL: of the plant's own work, from which nothing is hidden.
CREATE FUNCTION hidden_parts(of_identity text) RETURNS text[]
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  cleared text[];
BEGIN
  IF of_identity IS NULL OR NOT EXISTS (SELECT 1 FROM part_revisions WHERE customer_id IS NOT NULL) THEN
    RETURN '{}';
  END IF;
  cleared := ARRAY(SELECT newest.scope FROM (
    SELECT DISTINCT ON (scope) scope, granted FROM clearance_events WHERE holder = clearance_holder(of_identity)
    ORDER BY scope, event_sequence DESC) newest WHERE newest.granted);
  RETURN ARRAY(SELECT r.part_id FROM restricted_parts r
               WHERE 'parts/' || r.part_id <> ALL (cleared) AND 'customers/' || r.customer_id <> ALL (cleared)
               ORDER BY r.part_id);
END
$$;
COMMENT ON FUNCTION hidden_parts(text) IS 'Of which parts that identity may see nothing now.';

CREATE FUNCTION parts_of_record(of_record uuid) RETURNS text[]
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT CASE
    WHEN e.blade_serial IS NOT NULL THEN
      (SELECT ARRAY[b.part_id] FROM blades b WHERE b.blade_serial = e.blade_serial)
    WHEN e.kind = 'part' THEN (SELECT ARRAY[p.part_id] FROM part_revisions p WHERE p.record_id = e.record_id)
    WHEN e.kind IN ('machine', 'artefact', 'calibration', 'release', 'withdrawal', 'policy') THEN '{}'
    ELSE (SELECT CASE WHEN bool_and(i.input_id IS NULL OR (n.kind IS NOT NULL AND (n.blade_serial IS NULL OR b.part_id IS NOT NULL)))
                 THEN coalesce(array_agg(DISTINCT coalesce(b.part_id, p.part_id))
                               FILTER (WHERE b.part_id IS NOT NULL OR p.part_id IS NOT NULL), '{}') END
          FROM (SELECT e.record_id) own LEFT JOIN record_inputs i ON i.record_id = own.record_id
          LEFT JOIN record_entries n ON n.record_id = i.input_id
          LEFT JOIN blades b ON b.blade_serial = n.blade_serial
          LEFT JOIN part_revisions p ON p.record_id = i.input_id)
    END
  FROM record_entries e WHERE e.record_id = of_record
$$;
COMMENT ON FUNCTION parts_of_record(uuid) IS
  'Of which parts an entry of the journal is: its blade''s, its own, or, of a study, those of what it rests on. NULL: it cannot be '
  'told, for it, or what it rests on, is not recorded or in a month that was detached.';

CREATE FUNCTION parts_of(of_name text) RETURNS text[]
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  collection text := split_part(of_name, '/', 1);
  id text := substr(of_name, length(collection) + 2);
BEGIN
  CASE collection
    WHEN 'parts' THEN
      RETURN (SELECT ARRAY[p.part_id] FROM parts p WHERE p.part_id = split_part(id, '@', 1));
    WHEN 'blades' THEN
      RETURN (SELECT ARRAY[b.part_id] FROM blades b WHERE b.blade_serial = id);
    WHEN 'machines' THEN
      RETURN (SELECT '{}'::text[] FROM machines m WHERE m.machine_id = split_part(id, '@', 1));
    WHEN 'artefacts' THEN
      RETURN (SELECT '{}'::text[] FROM artefacts a WHERE a.artefact_id = split_part(id, '@', 1));
    ELSE
      RETURN (SELECT parts_of_record(n.record_id) FROM record_names n WHERE n.name = of_name);
  END CASE;
END
$$;
COMMENT ON FUNCTION parts_of(text) IS 'Of which parts a name is; NULL: nothing is recorded under it.';

CREATE FUNCTION first_hidden(names text[], of_identity text, unrecorded_too boolean) RETURNS text
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  hidden text[] := hidden_parts(of_identity);
  name text;
  of_parts text[];
BEGIN
  IF cardinality(hidden) = 0 THEN
    RETURN NULL;
  END IF;
  FOREACH name IN ARRAY names LOOP
    of_parts := parts_of(name);
    IF of_parts && hidden OR (of_parts IS NULL AND unrecorded_too) THEN
      RETURN name;
    END IF;
  END LOOP;
  RETURN NULL;
END
$$;
COMMENT ON FUNCTION first_hidden(text[], text, boolean) IS
  'The first of the names that is of a part that identity may not see. unrecorded_too: to whom something is hidden, what is not '
  'recorded is as hidden. NULL: none of them.';

CREATE FUNCTION sight_of(of_identity text, most_blades integer, OUT hidden text[], OUT seen_blades text[])
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  hidden := hidden_parts(of_identity);
  IF cardinality(hidden) = 0 THEN
    RETURN;
  END IF;
  seen_blades := ARRAY(
    SELECT b.blade_serial FROM parts p
    CROSS JOIN LATERAL (SELECT own.blade_serial FROM blades own WHERE own.part_id = p.part_id LIMIT most_blades + 1) b
    WHERE p.part_id <> ALL (sight_of.hidden) LIMIT most_blades + 1);
  IF cardinality(seen_blades) > most_blades THEN
    seen_blades := NULL;
  END IF;
END
$$;
COMMENT ON FUNCTION sight_of(text, integer) IS
  'hidden_parts, and where something is hidden and no more than so many blades are seen, all of those: by them lists are found '
  'sooner than by leaving out everything else.';

SELECT make_append_only('clearance_events');
GRANT SELECT, INSERT ON clearance_events TO sixpoint_plant;
GRANT SELECT ON clearances, restricted_parts TO sixpoint_plant;
-- A reader of few blades finds scans by these and, of artefacts, newest first, by this; so few entries are of no blade that it is small.
CREATE INDEX record_entries_of_no_blade ON record_entries (kind, record_sequence) WHERE blade_serial IS NULL;
-- What rests on a withdrawn calibration is told as far as it is seen.
GRANT SELECT (blade_serial, part_id) ON blades TO sixpoint_calibration;
