-- For which work order and operation of the MES a blade was worked on, and what a person decided about a blade beside its verdict.

CREATE FUNCTION is_order_id(id text) RETURNS boolean LANGUAGE sql IMMUTABLE AS $$ SELECT id ~ '^[A-Za-z0-9._:/-]{1,64}$' $$;

-- By revision of a blade, not by months: it is asked for the newest with each entry, and a blade has few.
CREATE TABLE blade_work_orders (
  blade_serial text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  work_order text COLLATE "C" NOT NULL,
  operation text COLLATE "C",
  requested_by text NOT NULL,
  software_version text NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT blade_work_orders_pk PRIMARY KEY (blade_serial, revision),
  CONSTRAINT blade_work_orders_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT blade_work_orders_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT blade_work_orders_revision_positive CHECK (revision > 0),
  CONSTRAINT blade_work_orders_form CHECK (is_order_id(work_order) AND octet_length(work_order) <= 64
    AND is_order_id(operation) AND octet_length(operation) <= 64),
  CONSTRAINT blade_work_orders_texts CHECK (requested_by <> '' AND octet_length(requested_by) <= 200
    AND software_version <> '' AND octet_length(software_version) <= 200)
);
CREATE INDEX blade_work_orders_by_order ON blade_work_orders (work_order, blade_serial);
CREATE INDEX blade_work_orders_by_record ON blade_work_orders (record_id);
COMMENT ON TABLE blade_work_orders IS
  'Work orders that were assigned to blades; the newest revision holds for what is recorded of the blade from then on.';
COMMENT ON COLUMN blade_work_orders.operation IS 'Of the work order; NULL: none was named.';
COMMENT ON COLUMN blade_work_orders.record_id IS 'Of the assignment or, with the first, of the blade itself.';
SELECT make_append_only('blade_work_orders');

ALTER TABLE record_entries
  ADD COLUMN work_order text COLLATE "C",
  ADD COLUMN operation text COLLATE "C",
  ADD CONSTRAINT record_entries_order_form CHECK (is_order_id(work_order) AND octet_length(work_order) <= 64
    AND is_order_id(operation) AND octet_length(operation) <= 64 AND (work_order IS NOT NULL OR operation IS NULL));
CREATE INDEX record_entries_by_order ON record_entries (work_order, record_sequence) WHERE work_order IS NOT NULL;
COMMENT ON COLUMN record_entries.work_order IS 'That its blade was worked on for when it was recorded; NULL: none was assigned.';
COMMENT ON COLUMN record_entries.operation IS 'Of the work order; NULL: none was named.';

CREATE OR REPLACE VIEW recorded AS
  SELECT record_id, record_sequence, recorded_at, kind AS entry_kind, blade_serial AS entry_blade, machine_id AS entry_machine,
         work_order AS entry_order, operation AS entry_operation
  FROM record_entries;

-- Not by months, which detach_month takes out: a blade that is scrap stays so, and with the row gone it would be released by rule again.
-- A person decides of few blades.
CREATE TABLE dispositions (
  disposition_id uuid NOT NULL,
  inspection_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  disposition text NOT NULL,
  reason text NOT NULL,
  reference text,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  CONSTRAINT dispositions_pk PRIMARY KEY (disposition_id),
  CONSTRAINT dispositions_inspection_fk FOREIGN KEY (inspection_id) REFERENCES record_names (record_id),
  CONSTRAINT dispositions_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT dispositions_record_fk FOREIGN KEY (disposition_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT dispositions_known CHECK (disposition IN ('CONCESSION', 'REWORK', 'SCRAP', 'USE_AS_IS', 'RETURN')),
  CONSTRAINT dispositions_reasoned CHECK (reason <> '' AND octet_length(reason) <= 1000),
  CONSTRAINT dispositions_reference CHECK (reference <> '' AND octet_length(reference) <= 64
    AND (disposition <> 'CONCESSION' OR reference IS NOT NULL)),
  CONSTRAINT dispositions_texts CHECK (requested_by <> '' AND octet_length(requested_by) <= 200
    AND software_version <> '' AND octet_length(software_version) <= 200)
);
CREATE INDEX dispositions_by_inspection ON dispositions (inspection_id);
CREATE INDEX dispositions_by_blade ON dispositions (blade_serial);
COMMENT ON TABLE dispositions IS
  'What a person decided about an inspected blade, beside the verdict, which stays. Of an inspection and of a blade the newest holds.';
COMMENT ON COLUMN dispositions.reference IS 'A number elsewhere, such as the concession''s; NULL: none.';
SELECT make_append_only('dispositions');

CREATE TRIGGER pseudonyms BEFORE INSERT ON blade_work_orders FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();
CREATE TRIGGER pseudonyms BEFORE INSERT ON dispositions FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();

-- Asked by the gate of corrections, which sees no row of inspection's.
CREATE FUNCTION scrapped_by(of_blade text) RETURNS uuid
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT newest.disposition_id
  FROM (SELECT d.disposition_id, d.disposition FROM dispositions d JOIN record_names n ON n.record_id = d.disposition_id
        WHERE d.blade_serial = of_blade ORDER BY n.record_sequence DESC LIMIT 1) newest
  WHERE newest.disposition = 'SCRAP'
$$;
COMMENT ON FUNCTION scrapped_by(text) IS 'The disposition by which a blade is scrap: the newest of the blade, if that is SCRAP; NULL: it is not.';

-- Asked before a program leaves. A correction that tells of the disposition in its checks was released by a person in spite of it.
CREATE FUNCTION scrapped_against(of_correction uuid) RETURNS uuid
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT d.record_id FROM correction_releases l JOIN record_names d ON d.record_id = scrapped_by(l.blade_serial)
  WHERE l.correction_id = of_correction
    AND (d.record_sequence > l.release_sequence
         OR NOT EXISTS (SELECT 1 FROM correction_checks k WHERE k.correction_id = of_correction AND k.kind = 'SCRAPPED'))
$$;
COMMENT ON FUNCTION scrapped_against(uuid) IS
  'The disposition by which the blade of a released correction is scrap, if nobody released it in spite of that: it was recorded after the '
  'release, or the gate never told of it. NULL: there is none.';

-- As V0012 has it, and nothing of a blade that was scrapped since the program was released, or of which its gate never told that.
CREATE OR REPLACE FUNCTION refuse_unreleased_fetch() RETURNS trigger
LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  found_state text := (SELECT state FROM correction_states WHERE correction_id = NEW.correction_id);
  scrapped uuid := scrapped_against(NEW.correction_id);
BEGIN
  IF found_state IS DISTINCT FROM 'RELEASED' THEN
    RAISE EXCEPTION 'corrections/%: %, want RELEASED', NEW.correction_id, found_state
      USING ERRCODE = 'restrict_violation', CONSTRAINT = 'program_not_released';
  END IF;
  IF scrapped IS NOT NULL THEN
    RAISE EXCEPTION 'corrections/%: its blade was scrapped since by dispositions/%, want a blade that is not', NEW.correction_id, scrapped
      USING ERRCODE = 'restrict_violation', CONSTRAINT = 'program_not_released';
  END IF;
  RETURN NEW;
END
$$;

-- Two kinds more than there were, whatever migrations came before. Each partition has the constraint as its own, too.
DO $$
DECLARE
  held regclass;
  kinds text[] := ARRAY(SELECT m[1] FROM pg_constraint c, regexp_matches(pg_get_constraintdef(c.oid), '''([a-z_]+)''::text', 'g') m
                        WHERE c.conname = 'record_entries_kind_known' AND c.conrelid = 'record_entries'::regclass);
BEGIN
  IF cardinality(kinds) < 17 THEN
    RAISE EXCEPTION 'record_entries_kind_known: % kinds, want those that were', cardinality(kinds);
  END IF;
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  EXECUTE format('ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN (%s))',
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || ARRAY['assignment', 'disposition']) k));
END
$$;

-- As V0024 has it, with the work order: stated, or else the newest of the blade. Binaries before this one leave it out, and so get that.
DROP FUNCTION append_record(uuid, text, text, text, text, text, text, text, timestamptz, jsonb, text[], text, uuid, bytea, text);
CREATE FUNCTION append_record(new_id uuid, new_name text, new_kind text, of_blade text, of_machine text, new_method text,
                              new_version text, asked_by text, new_measured_at timestamptz, new_summary jsonb, inputs text[],
                              of_call text, of_request uuid, of_request_sha256 bytea, of_trace text DEFAULT NULL,
                              of_order text DEFAULT NULL, of_operation text DEFAULT NULL,
                              OUT new_sequence bigint, OUT new_recorded_at timestamptz, OUT edge_count bigint)
LANGUAGE plpgsql AS $$
DECLARE
  asker text := pseudonym_of(asked_by);
  roots uuid[] := roots_of(new_id, new_kind, new_version, inputs);
BEGIN
  IF of_order IS NULL AND of_blade IS NOT NULL THEN
    SELECT b.work_order, b.operation INTO of_order, of_operation FROM blade_work_orders b
      WHERE b.blade_serial = of_blade ORDER BY b.revision DESC LIMIT 1;
  END IF;
  PERFORM pg_advisory_xact_lock(6021, 1);
  INSERT INTO record_names (record_id, name) VALUES (new_id, new_name)
    RETURNING record_sequence, recorded_at INTO new_sequence, new_recorded_at;
  INSERT INTO record_entries (record_id, record_sequence, recorded_at, kind, blade_serial, machine_id, method,
                              software_version, requested_by, measured_at, summary, trace_id, work_order, operation)
    VALUES (new_id, new_sequence, new_recorded_at, new_kind, of_blade, of_machine, new_method, new_version, asker,
            new_measured_at, new_summary, of_trace, of_order, of_operation);
  INSERT INTO record_inputs (record_id, position_index, input_id)
    SELECT new_id, (position - 1)::integer, n.record_id FROM unnest(inputs) WITH ORDINALITY AS input (name, position)
    JOIN record_names n ON n.name = input.name;
  GET DIAGNOSTICS edge_count = ROW_COUNT;
  INSERT INTO record_roots (record_id, root_id, record_sequence, kind)
    SELECT new_id, root, new_sequence, new_kind FROM unnest(roots) AS root;
  IF of_request IS NOT NULL THEN
    INSERT INTO requests (call, request_id, request_sha256, record_id)
      VALUES (of_call, of_request, of_request_sha256, new_id);
  END IF;
END
$$;

DO $$
DECLARE
  area text;
BEGIN
  FOREACH area IN ARRAY ARRAY['plant', 'ingest', 'calibration', 'registration', 'correction', 'inspection'] LOOP
    EXECUTE format('GRANT SELECT ON blade_work_orders TO %I', 'sixpoint_' || area);
  END LOOP;
END
$$;
GRANT INSERT ON blade_work_orders TO sixpoint_plant;
GRANT SELECT, INSERT ON dispositions TO sixpoint_inspection;
GRANT SELECT ON blade_work_orders, dispositions TO sixpoint_ledger;
REVOKE EXECUTE ON FUNCTION scrapped_by(text), scrapped_against(uuid) FROM PUBLIC;
GRANT EXECUTE ON FUNCTION scrapped_by(text), scrapped_against(uuid) TO sixpoint_correction;
