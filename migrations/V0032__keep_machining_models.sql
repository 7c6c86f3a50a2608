-- How a part is machined, as a record with revisions: operations in their order, their electrodes, and the template of the program, which
-- corrections name instead of being sent one each time. All is in tables of its own, or nullable.

CREATE TABLE machining_models (
  machining_model_id text COLLATE "C" NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  CONSTRAINT machining_models_pk PRIMARY KEY (machining_model_id),
  CONSTRAINT machining_models_of_one_part UNIQUE (machining_model_id, part_id),
  CONSTRAINT machining_models_part_fk FOREIGN KEY (part_id) REFERENCES parts (part_id),
  CONSTRAINT machining_models_id_form CHECK (machining_model_id ~ '^[A-Za-z0-9._-]{1,64}$')
);
COMMENT ON TABLE machining_models IS 'Ids of machining models, each of one part for ever: who may see the part may see the model.';

CREATE TABLE machining_model_revisions (
  machining_model_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  content_sha256 bytea NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  w_mm double precision,
  nc_template_sha256 bytea NOT NULL,
  nc_work_offset_codes text[],
  nc_work_offsets double precision[],
  nc_tool_numbers integer[],
  nc_tool_lengths_mm double precision[],
  record_id uuid NOT NULL,
  CONSTRAINT machining_model_revisions_pk PRIMARY KEY (machining_model_id, revision),
  CONSTRAINT machining_model_revisions_record_once UNIQUE (record_id),
  CONSTRAINT machining_model_revisions_model_fk FOREIGN KEY (machining_model_id, part_id)
    REFERENCES machining_models (machining_model_id, part_id),
  CONSTRAINT machining_model_revisions_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT machining_model_revisions_nc_template_fk FOREIGN KEY (nc_template_sha256) REFERENCES blobs (sha256),
  CONSTRAINT machining_model_revisions_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT machining_model_revisions_revision_positive CHECK (revision > 0 AND part_revision > 0),
  CONSTRAINT machining_model_revisions_digests CHECK (octet_length(content_sha256) = 32 AND octet_length(nc_template_sha256) = 32),
  CONSTRAINT machining_model_revisions_w_finite CHECK (abs(w_mm) <= 1e4),
  CONSTRAINT machining_model_revisions_nc_work_offset_codes_known CHECK (cardinality(nc_work_offset_codes) BETWEEN 1 AND 6
    AND char_length(array_to_string(nc_work_offset_codes, '')) <= 48 AND array_position(nc_work_offset_codes, NULL) IS NULL),
  CONSTRAINT machining_model_revisions_nc_work_offsets_stated CHECK (array_position(nc_work_offsets, NULL) IS NULL
    AND -1e5 <= ALL (nc_work_offsets) AND 1e5 >= ALL (nc_work_offsets)),
  CONSTRAINT machining_model_revisions_nc_work_offsets_whole CHECK ((nc_work_offset_codes IS NULL) = (nc_work_offsets IS NULL)
    AND cardinality(nc_work_offsets) = 5 * cardinality(nc_work_offset_codes)),
  CONSTRAINT machining_model_revisions_nc_tool_numbers_whole CHECK (array_position(nc_tool_numbers, NULL) IS NULL
    AND cardinality(nc_tool_numbers) BETWEEN 1 AND 100 AND 0 < ALL (nc_tool_numbers) AND 9999 >= ALL (nc_tool_numbers)),
  CONSTRAINT machining_model_revisions_nc_tool_lengths_mm_whole CHECK (array_position(nc_tool_lengths_mm, NULL) IS NULL),
  CONSTRAINT machining_model_revisions_nc_tool_lengths_stated CHECK ((nc_tool_numbers IS NULL) = (nc_tool_lengths_mm IS NULL)
    AND cardinality(nc_tool_lengths_mm) = cardinality(nc_tool_numbers)
    AND 0 <= ALL (nc_tool_lengths_mm) AND 2000 >= ALL (nc_tool_lengths_mm))
);
CREATE INDEX machining_model_revisions_by_nc_template ON machining_model_revisions (nc_template_sha256);
COMMENT ON TABLE machining_model_revisions IS 'A machining model as it was at one time.';
COMMENT ON COLUMN machining_model_revisions.part_revision IS 'Whose hole groups the operations were compared with.';
COMMENT ON COLUMN machining_model_revisions.w_mm IS
  'Where the spindle''s axis W, parallel to Z, stands meanwhile; NULL: of machines without one, or wherever it is.';
COMMENT ON COLUMN machining_model_revisions.nc_template_sha256 IS 'The program of the nominal part, a blob.';
COMMENT ON COLUMN machining_model_revisions.nc_work_offsets IS
  'Machine less program coordinates, five for each code: X, Y, Z in mm, the first and the second rotary axis in deg.';
COMMENT ON COLUMN machining_model_revisions.nc_tool_numbers IS 'Of the tools that are stated, with nc_tool_lengths_mm; NULL: none are.';

CREATE TABLE machining_operations (
  machining_model_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  position_index integer NOT NULL,
  operation text NOT NULL,
  hole_group text NOT NULL,
  electrode_diameter_mm double precision NOT NULL,
  electrode_length_mm double precision NOT NULL,
  electrode_wear_mm double precision NOT NULL,
  CONSTRAINT machining_operations_pk PRIMARY KEY (machining_model_id, revision, position_index),
  CONSTRAINT machining_operations_once UNIQUE (machining_model_id, revision, operation),
  CONSTRAINT machining_operations_group_once UNIQUE (machining_model_id, revision, hole_group),
  CONSTRAINT machining_operations_model_fk FOREIGN KEY (machining_model_id, revision)
    REFERENCES machining_model_revisions (machining_model_id, revision),
  CONSTRAINT machining_operations_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT machining_operations_electrode_sizes CHECK (electrode_diameter_mm > 0 AND electrode_diameter_mm < 1e3
    AND electrode_length_mm > 0 AND electrode_length_mm <= 1e3
    AND electrode_wear_mm >= 0 AND electrode_wear_mm <= electrode_length_mm),
  CONSTRAINT machining_operations_texts CHECK (octet_length(operation) <= 200 AND octet_length(hole_group) <= 200)
);
COMMENT ON TABLE machining_operations IS 'In the order of machining: a hole group of the part, and what drills its straight holes.';
COMMENT ON COLUMN machining_operations.electrode_length_mm IS 'From the holder to the tip, as new.';
COMMENT ON COLUMN machining_operations.electrode_wear_mm IS 'Of the length, lost after each hole.';

ALTER TABLE corrections
  ADD COLUMN machining_model_id text COLLATE "C",
  ADD COLUMN machining_model_revision integer,
  ADD CONSTRAINT corrections_machining_model_fk FOREIGN KEY (machining_model_id, machining_model_revision)
    REFERENCES machining_model_revisions (machining_model_id, revision),
  ADD CONSTRAINT corrections_machining_model_whole CHECK ((machining_model_id IS NULL) = (machining_model_revision IS NULL)
    AND (machining_model_id IS NULL OR nc_template_sha256 IS NOT NULL)),
  ADD CONSTRAINT corrections_machining_model_texts CHECK (octet_length(machining_model_id) <= 64);
CREATE INDEX corrections_by_machining_model ON corrections (machining_model_id, machining_model_revision)
  WHERE machining_model_id IS NOT NULL;
COMMENT ON COLUMN corrections.machining_model_id IS
  'Whose template, offsets, tools and electrodes were taken; NULL: none was named, or made before there were any.';

SELECT make_append_only('machining_models');
SELECT make_append_only('machining_model_revisions');
SELECT make_append_only('machining_operations');

-- As V0028 does, one kind more; each partition has the constraint as its own, too.
DO $$
DECLARE
  held regclass;
  kinds text[] := ARRAY(SELECT m[1] FROM pg_constraint c, regexp_matches(pg_get_constraintdef(c.oid), '''([a-z_]+)''::text', 'g') m
                        WHERE c.conname = 'record_entries_kind_known' AND c.conrelid = 'record_entries'::regclass);
BEGIN
  IF cardinality(kinds) < 19 THEN
    RAISE EXCEPTION 'record_entries_kind_known: % kinds, want those that were', cardinality(kinds);
  END IF;
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  EXECUTE format('ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN (%s))',
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || ARRAY['machining_model']) k));
END
$$;

-- A collection's name of two words, too. What is there obeyed the tighter one, and is not read again.
ALTER TABLE record_names DROP CONSTRAINT record_names_form,
  ADD CONSTRAINT record_names_form CHECK (name ~ '^[a-z_]+/[A-Za-z0-9._-]{1,64}(@[0-9]{1,9})?$') NOT VALID;

-- As V0029 has it, of names with an underscore too.
CREATE OR REPLACE FUNCTION record_kinds() RETURNS text[] LANGUAGE sql STABLE AS $$
  SELECT coalesce(array_agg(DISTINCT kind[1]), '{}') FROM pg_constraint c
  CROSS JOIN regexp_matches(pg_get_constraintdef(c.oid), '''([a-z_]+)''', 'g') AS kind
  WHERE c.conrelid = 'record_entries'::regclass AND c.conname = 'record_entries_kind_known'
$$;

-- As V0024 has it, with machining models.
CREATE OR REPLACE FUNCTION is_root(of_name text) RETURNS boolean LANGUAGE sql IMMUTABLE AS $$
  SELECT split_part(of_name, '/', 1) IN ('machines', 'artefacts', 'parts', 'machining_models', 'calibrations', 'studies')
$$;

-- As V0024 has it; a machining model is of its part.
CREATE OR REPLACE FUNCTION parts_of(of_name text) RETURNS text[]
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
    WHEN 'machining_models' THEN
      RETURN (SELECT ARRAY[m.part_id] FROM machining_models m WHERE m.machining_model_id = split_part(id, '@', 1));
    WHEN 'machines' THEN
      RETURN (SELECT '{}'::text[] FROM machines m WHERE m.machine_id = split_part(id, '@', 1));
    WHEN 'artefacts' THEN
      RETURN (SELECT '{}'::text[] FROM artefacts a WHERE a.artefact_id = split_part(id, '@', 1));
    WHEN 'sensors', 'probes', 'software' THEN
      RETURN '{}'::text[];
    ELSE
      RETURN (SELECT parts_of_record(n.record_id) FROM record_names n WHERE n.name = of_name);
  END CASE;
END
$$;

-- As V0018 has it; a machining model is of its part, whose own entry may be in a month that was detached.
CREATE OR REPLACE FUNCTION parts_of_record(of_record uuid) RETURNS text[]
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT CASE
    WHEN e.blade_serial IS NOT NULL THEN
      (SELECT ARRAY[b.part_id] FROM blades b WHERE b.blade_serial = e.blade_serial)
    WHEN e.kind = 'part' THEN (SELECT ARRAY[p.part_id] FROM part_revisions p WHERE p.record_id = e.record_id)
    WHEN e.kind = 'machining_model' THEN
      (SELECT ARRAY[m.part_id] FROM machining_model_revisions m WHERE m.record_id = e.record_id)
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

GRANT SELECT, INSERT ON machining_models, machining_model_revisions, machining_operations TO sixpoint_plant;
GRANT SELECT ON machining_model_revisions, machining_operations TO sixpoint_ledger;
-- The collector asks who refers to a blob.
GRANT SELECT (nc_template_sha256) ON machining_model_revisions TO sixpoint_ingest;

COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment, disposition or machining_model; more may come.';
