-- The drawing as data, with revisions as parts have them: what it asks, balloon by balloon, and what its characteristics name. All is in
-- tables of its own.

CREATE TABLE drawings (
  drawing_id text COLLATE "C" NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  CONSTRAINT drawings_pk PRIMARY KEY (drawing_id),
  CONSTRAINT drawings_of_one_part UNIQUE (drawing_id, part_id),
  CONSTRAINT drawings_part_fk FOREIGN KEY (part_id) REFERENCES parts (part_id),
  CONSTRAINT drawings_id_form CHECK (drawing_id ~ '^[A-Za-z0-9._-]{1,64}$')
);
CREATE INDEX drawings_by_part ON drawings (part_id);
COMMENT ON TABLE drawings IS 'Ids of drawings, each of one part for ever: who may see the part may see the drawing.';

CREATE TABLE drawing_revisions (
  drawing_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  content_sha256 bytea NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  drawing_number text NOT NULL,
  drawing_revision text NOT NULL,
  part_number text NOT NULL,
  part_name text NOT NULL,
  part_revision_level text,
  additional_changes text[],
  decision_rule text NOT NULL,
  decision_rule_edition text,
  guard_factor double precision,
  neighbour_offset_in_part_mm double precision[],
  neighbour_standard_uncertainty_um double precision,
  requested_by text NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT drawing_revisions_pk PRIMARY KEY (drawing_id, revision),
  CONSTRAINT drawing_revisions_of_one_part UNIQUE (drawing_id, revision, part_id),
  CONSTRAINT drawing_revisions_record_once UNIQUE (record_id),
  CONSTRAINT drawing_revisions_drawing_fk FOREIGN KEY (drawing_id, part_id) REFERENCES drawings (drawing_id, part_id),
  CONSTRAINT drawing_revisions_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT drawing_revisions_revision_positive CHECK (revision > 0),
  CONSTRAINT drawing_revisions_digest CHECK (octet_length(content_sha256) = 32),
  CONSTRAINT drawing_revisions_texts CHECK (octet_length(drawing_number) BETWEEN 1 AND 64 AND octet_length(drawing_revision) BETWEEN 1 AND 32
    AND octet_length(part_number) BETWEEN 1 AND 64 AND octet_length(part_name) BETWEEN 1 AND 200
    AND octet_length(part_revision_level) BETWEEN 1 AND 32 AND octet_length(requested_by) BETWEEN 1 AND 200),
  CONSTRAINT drawing_revisions_changes CHECK (cardinality(additional_changes) BETWEEN 1 AND 32
    AND octet_length(array_to_string(additional_changes, '')) <= 32 * 64),
  CONSTRAINT drawing_revisions_changes_whole CHECK (array_position(additional_changes, NULL) IS NULL),
  CONSTRAINT drawing_revisions_rule_known CHECK (decision_rule IN ('ISO_14253_1', 'SIMPLE_ACCEPTANCE', 'GUARD_FACTOR')
    AND octet_length(decision_rule) <= 64 AND octet_length(decision_rule_edition) <= 16),
  CONSTRAINT drawing_revisions_rule_whole CHECK ((decision_rule_edition IS NOT NULL) = (decision_rule = 'ISO_14253_1')
    AND (decision_rule_edition IS NULL OR decision_rule_edition IN ('1998', '2013', '2017'))
    AND (guard_factor IS NOT NULL) = (decision_rule = 'GUARD_FACTOR') AND (guard_factor IS NULL OR guard_factor > 0 AND guard_factor <= 3)),
  CONSTRAINT drawing_revisions_neighbour CHECK (is_triple(neighbour_offset_in_part_mm) AND array_position(neighbour_offset_in_part_mm, NULL) IS NULL),
  CONSTRAINT drawing_revisions_neighbour_whole CHECK (
    (neighbour_offset_in_part_mm IS NULL) = (neighbour_standard_uncertainty_um IS NULL)
    AND (neighbour_standard_uncertainty_um IS NULL OR neighbour_standard_uncertainty_um BETWEEN 0 AND 1000))
);
COMMENT ON TABLE drawing_revisions IS 'A drawing as it was described at one time.';
COMMENT ON COLUMN drawing_revisions.revision IS 'Of the description: another one is another revision. drawing_revision is what the title block says.';
COMMENT ON COLUMN drawing_revisions.additional_changes IS 'Numbers of changes that hold and are not drawn yet; NULL: none.';
COMMENT ON COLUMN drawing_revisions.guard_factor IS 'Of the expanded uncertainty, k = 2.';
COMMENT ON COLUMN drawing_revisions.neighbour_offset_in_part_mm IS 'From a blade to its neighbour in the row, part frame; NULL: no throat is asked for.';

CREATE TABLE drawing_part_revisions (
  drawing_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  CONSTRAINT drawing_part_revisions_pk PRIMARY KEY (drawing_id, revision, part_revision),
  CONSTRAINT drawing_part_revisions_drawing_fk FOREIGN KEY (drawing_id, revision, part_id)
    REFERENCES drawing_revisions (drawing_id, revision, part_id),
  CONSTRAINT drawing_part_revisions_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision)
);
CREATE INDEX drawing_part_revisions_by_part ON drawing_part_revisions (part_id, part_revision);
COMMENT ON TABLE drawing_part_revisions IS 'Which revisions of the part a drawing is valid for.';

CREATE TABLE drawing_regions (
  drawing_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  position_index integer NOT NULL,
  region text NOT NULL,
  minimum_in_part_mm double precision[],
  maximum_in_part_mm double precision[],
  facing_in_part double precision[],
  facing_within_deg double precision,
  CONSTRAINT drawing_regions_pk PRIMARY KEY (drawing_id, revision, region),
  CONSTRAINT drawing_regions_drawing_fk FOREIGN KEY (drawing_id, revision) REFERENCES drawing_revisions (drawing_id, revision),
  CONSTRAINT drawing_regions_position CHECK (position_index >= 0),
  CONSTRAINT drawing_regions_text CHECK (octet_length(region) BETWEEN 1 AND 200),
  CONSTRAINT drawing_regions_minimum CHECK (is_triple(minimum_in_part_mm) AND array_position(minimum_in_part_mm, NULL) IS NULL),
  CONSTRAINT drawing_regions_maximum CHECK (is_triple(maximum_in_part_mm) AND array_position(maximum_in_part_mm, NULL) IS NULL),
  CONSTRAINT drawing_regions_facing CHECK (is_unit(facing_in_part) AND array_position(facing_in_part, NULL) IS NULL),
  CONSTRAINT drawing_regions_within CHECK ((facing_in_part IS NULL) = (facing_within_deg IS NULL)
    AND (facing_within_deg IS NULL OR facing_within_deg > 0 AND facing_within_deg <= 180)),
  CONSTRAINT drawing_regions_bounded CHECK (minimum_in_part_mm IS NOT NULL OR maximum_in_part_mm IS NOT NULL OR facing_in_part IS NOT NULL)
);
COMMENT ON TABLE drawing_regions IS 'Parts of the surface by a box and by where it looks; part frame.';

CREATE TABLE drawing_datum_systems (
  drawing_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  position_index integer NOT NULL,
  datum_system text NOT NULL,
  positioning text NOT NULL,
  region text,
  CONSTRAINT drawing_datum_systems_pk PRIMARY KEY (drawing_id, revision, datum_system),
  CONSTRAINT drawing_datum_systems_drawing_fk FOREIGN KEY (drawing_id, revision) REFERENCES drawing_revisions (drawing_id, revision),
  CONSTRAINT drawing_datum_systems_region_fk FOREIGN KEY (drawing_id, revision, region)
    REFERENCES drawing_regions (drawing_id, revision, region),
  CONSTRAINT drawing_datum_systems_position CHECK (position_index >= 0),
  CONSTRAINT drawing_datum_systems_form CHECK (datum_system ~ '^[A-Z]{1,2}([|][A-Z]{1,2}){0,2}$'),
  CONSTRAINT drawing_datum_systems_positioning_known CHECK (positioning IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS')
    AND octet_length(positioning) <= 64),
  CONSTRAINT drawing_datum_systems_region_of_local CHECK ((region IS NOT NULL) = (positioning = 'LOCAL'))
);
COMMENT ON TABLE drawing_datum_systems IS 'Datums as the drawing writes them, and how a registration makes them.';

CREATE TABLE drawing_datums (
  drawing_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  datum_system text NOT NULL,
  position_index integer NOT NULL,
  datum text NOT NULL,
  datum_points text[] NOT NULL,
  CONSTRAINT drawing_datums_pk PRIMARY KEY (drawing_id, revision, datum_system, position_index),
  CONSTRAINT drawing_datums_once UNIQUE (drawing_id, revision, datum_system, datum),
  CONSTRAINT drawing_datums_system_fk FOREIGN KEY (drawing_id, revision, datum_system)
    REFERENCES drawing_datum_systems (drawing_id, revision, datum_system),
  CONSTRAINT drawing_datums_position CHECK (position_index BETWEEN 0 AND 2),
  CONSTRAINT drawing_datums_form CHECK (datum ~ '^[A-Z]{1,2}$'),
  CONSTRAINT drawing_datums_points CHECK (cardinality(datum_points) <= 3 AND octet_length(array_to_string(datum_points, '')) <= 3 * 64),
  CONSTRAINT drawing_datums_points_whole CHECK (array_position(datum_points, NULL) IS NULL)
);
COMMENT ON TABLE drawing_datums IS 'Letters of a datum system, the primary one first.';
COMMENT ON COLUMN drawing_datums.datum_points IS 'Of the part''s six points, by their names; empty: it is positioned by its surface.';

CREATE TABLE drawing_sections (
  drawing_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  position_index integer NOT NULL,
  section text NOT NULL,
  height_mm double precision,
  origin_in_part_mm double precision[],
  normal_in_part double precision[],
  reference_in_part double precision[],
  leading_in_part_mm double precision[],
  near_in_part_mm double precision[],
  half_width_mm double precision NOT NULL,
  CONSTRAINT drawing_sections_pk PRIMARY KEY (drawing_id, revision, section),
  CONSTRAINT drawing_sections_drawing_fk FOREIGN KEY (drawing_id, revision) REFERENCES drawing_revisions (drawing_id, revision),
  CONSTRAINT drawing_sections_position CHECK (position_index >= 0),
  CONSTRAINT drawing_sections_text CHECK (octet_length(section) BETWEEN 1 AND 200),
  CONSTRAINT drawing_sections_origin CHECK (is_triple(origin_in_part_mm) AND array_position(origin_in_part_mm, NULL) IS NULL),
  CONSTRAINT drawing_sections_normal CHECK (is_unit(normal_in_part) AND array_position(normal_in_part, NULL) IS NULL),
  CONSTRAINT drawing_sections_reference CHECK (is_unit(reference_in_part) AND array_position(reference_in_part, NULL) IS NULL),
  CONSTRAINT drawing_sections_leading CHECK (is_triple(leading_in_part_mm) AND array_position(leading_in_part_mm, NULL) IS NULL),
  CONSTRAINT drawing_sections_near CHECK (is_triple(near_in_part_mm) AND array_position(near_in_part_mm, NULL) IS NULL),
  CONSTRAINT drawing_sections_one_place CHECK ((height_mm IS NULL) <> (origin_in_part_mm IS NULL)
    AND (height_mm IS NULL OR abs(height_mm) <= 1e5 AND normal_in_part IS NULL)),
  CONSTRAINT drawing_sections_half_width CHECK (half_width_mm BETWEEN 0.01 AND 2)
);
COMMENT ON TABLE drawing_sections IS 'Planes in which airfoils are looked at, in their order along the span; part frame.';
COMMENT ON COLUMN drawing_sections.height_mm IS 'Along the part''s z; NULL: the plane has an origin.';
COMMENT ON COLUMN drawing_sections.normal_in_part IS 'NULL: the part''s z.';
COMMENT ON COLUMN drawing_sections.reference_in_part IS 'What angles are counted from; NULL: the part''s x.';
COMMENT ON COLUMN drawing_sections.half_width_mm IS 'Points so far from the plane are taken.';

CREATE TABLE drawing_characteristics (
  drawing_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  position_index integer NOT NULL,
  characteristic text NOT NULL,
  name text NOT NULL,
  requirement text NOT NULL,
  reference_location text NOT NULL,
  class text NOT NULL,
  designator text,
  quantity text NOT NULL,
  algorithm text,
  hole_group text,
  hole text,
  to_hole text,
  along_in_part double precision[],
  section text,
  reference_section text,
  region text,
  unit text NOT NULL,
  nominal double precision,
  lower_limit double precision,
  upper_limit double precision,
  zone text,
  datum_system text,
  least_coverage double precision,
  decision_rule text,
  decision_rule_edition text,
  guard_factor double precision,
  gauge text,
  designed_tooling text,
  CONSTRAINT drawing_characteristics_pk PRIMARY KEY (drawing_id, revision, characteristic),
  CONSTRAINT drawing_characteristics_drawing_fk FOREIGN KEY (drawing_id, revision) REFERENCES drawing_revisions (drawing_id, revision),
  CONSTRAINT drawing_characteristics_section_fk FOREIGN KEY (drawing_id, revision, section)
    REFERENCES drawing_sections (drawing_id, revision, section),
  CONSTRAINT drawing_characteristics_reference_section_fk FOREIGN KEY (drawing_id, revision, reference_section)
    REFERENCES drawing_sections (drawing_id, revision, section),
  CONSTRAINT drawing_characteristics_region_fk FOREIGN KEY (drawing_id, revision, region)
    REFERENCES drawing_regions (drawing_id, revision, region),
  CONSTRAINT drawing_characteristics_datum_system_fk FOREIGN KEY (drawing_id, revision, datum_system)
    REFERENCES drawing_datum_systems (drawing_id, revision, datum_system),
  CONSTRAINT drawing_characteristics_position CHECK (position_index >= 0),
  CONSTRAINT drawing_characteristics_texts CHECK (octet_length(characteristic) BETWEEN 1 AND 64 AND octet_length(name) BETWEEN 1 AND 200
    AND octet_length(requirement) BETWEEN 1 AND 1000 AND octet_length(reference_location) BETWEEN 1 AND 64
    AND octet_length(designator) BETWEEN 1 AND 64 AND octet_length(hole_group) BETWEEN 1 AND 64 AND octet_length(hole) BETWEEN 1 AND 64
    AND octet_length(to_hole) BETWEEN 1 AND 64 AND octet_length(gauge) BETWEEN 1 AND 200
    AND octet_length(designed_tooling) BETWEEN 1 AND 200),
  CONSTRAINT drawing_characteristics_class_known CHECK (class IN ('MINOR', 'MAJOR', 'CRITICAL') AND octet_length(class) <= 64),
  CONSTRAINT drawing_characteristics_quantity_known CHECK (octet_length(quantity) <= 64 AND quantity IN ('HOLE_POSITION',
    'HOLE_DISPLACEMENT_ALONG', 'HOLE_DISPLACEMENT_ACROSS', 'HOLE_INCLINATION', 'HOLE_DIAMETER', 'HOLE_PITCH', 'HOLE_PITCH_OVER_DIAMETER',
    'PROFILE_FORM', 'PROFILE_FORM_AND_LOCATION', 'SECTION_CHORD', 'SECTION_STAGGER', 'SECTION_THICKNESS', 'SECTION_THICKNESS_PLACE',
    'SECTION_LEADING_EDGE_RADIUS', 'SECTION_TRAILING_EDGE_RADIUS', 'SECTION_LEADING_EDGE_FORM', 'SECTION_TRAILING_EDGE_FORM',
    'SECTION_CAMBER_HEIGHT', 'SECTION_PROFILE_FORM', 'SECTION_PROFILE_FORM_AND_LOCATION', 'TWIST', 'BOW_X', 'BOW_Y', 'THROAT',
    'MEASURED_ELSEWHERE')),
  CONSTRAINT drawing_characteristics_algorithm_known CHECK (octet_length(algorithm) <= 64
    AND (algorithm IS NOT NULL) = (quantity IN ('SECTION_CHORD', 'SECTION_STAGGER', 'SECTION_THICKNESS', 'SECTION_THICKNESS_PLACE'))
    AND (algorithm IS NULL OR CASE WHEN quantity IN ('SECTION_CHORD', 'SECTION_STAGGER')
      THEN algorithm IN ('NOSE_TAIL', 'CALIPER', 'TANGENT') ELSE algorithm IN ('INSCRIBED_CIRCLE', 'TWO_POINT') END)),
  CONSTRAINT drawing_characteristics_unit_fits CHECK (octet_length(unit) <= 64 AND unit IN ('MM', 'UM', 'DEG', 'RATIO') AND CASE
    WHEN quantity = 'MEASURED_ELSEWHERE' THEN true
    WHEN quantity IN ('HOLE_INCLINATION', 'SECTION_STAGGER', 'TWIST') THEN unit = 'DEG'
    WHEN quantity IN ('HOLE_PITCH_OVER_DIAMETER', 'SECTION_THICKNESS_PLACE') THEN unit = 'RATIO'
    ELSE unit IN ('MM', 'UM') END),
  CONSTRAINT drawing_characteristics_place CHECK ((hole IS NULL OR hole_group IS NOT NULL) AND (to_hole IS NULL OR hole IS NOT NULL)
    AND CASE WHEN quantity LIKE 'HOLE%' THEN hole_group IS NOT NULL AND section IS NULL AND region IS NULL
      WHEN quantity LIKE 'PROFILE%' THEN hole_group IS NULL AND section IS NULL
      WHEN quantity = 'MEASURED_ELSEWHERE' THEN true
      ELSE section IS NOT NULL AND hole_group IS NULL AND region IS NULL END),
  CONSTRAINT drawing_characteristics_pairs CHECK ((reference_section IS NOT NULL) = (quantity = 'TWIST') AND reference_section <> section
    AND to_hole <> hole),
  CONSTRAINT drawing_characteristics_along CHECK (is_unit(along_in_part) AND array_position(along_in_part, NULL) IS NULL),
  CONSTRAINT drawing_characteristics_along_of_displacements CHECK (
    (along_in_part IS NOT NULL) = (quantity IN ('HOLE_DISPLACEMENT_ALONG', 'HOLE_DISPLACEMENT_ACROSS'))),
  CONSTRAINT drawing_characteristics_limits CHECK ((lower_limit IS NOT NULL OR upper_limit IS NOT NULL) AND lower_limit < upper_limit),
  CONSTRAINT drawing_characteristics_figures CHECK (abs(nominal) <= 1e6 AND abs(lower_limit) <= 1e6 AND abs(upper_limit) <= 1e6
    AND least_coverage BETWEEN 0 AND 1),
  CONSTRAINT drawing_characteristics_zone_fits CHECK (octet_length(zone) <= 64 AND CASE
    WHEN quantity = 'HOLE_POSITION' THEN zone IS NOT NULL AND zone IN ('DIAMETER', 'RADIUS')
    WHEN quantity LIKE 'HOLE_DISPLACEMENT%' OR quantity LIKE '%PROFILE%' THEN zone IS NOT NULL AND zone IN ('WIDTH', 'HALF_WIDTH', 'BORDERS')
    ELSE zone IS NULL END),
  CONSTRAINT drawing_characteristics_zone_limits CHECK (zone IS NULL OR nominal IS NULL AND CASE WHEN zone = 'BORDERS'
    THEN lower_limit IS NOT NULL AND upper_limit IS NOT NULL ELSE lower_limit IS NULL AND upper_limit > 0 END),
  CONSTRAINT drawing_characteristics_datums_of_location CHECK (CASE
    WHEN quantity IN ('HOLE_POSITION', 'HOLE_DISPLACEMENT_ALONG', 'HOLE_DISPLACEMENT_ACROSS', 'HOLE_INCLINATION', 'SECTION_STAGGER',
      'PROFILE_FORM_AND_LOCATION', 'SECTION_PROFILE_FORM_AND_LOCATION') THEN datum_system IS NOT NULL
    WHEN quantity IN ('PROFILE_FORM', 'SECTION_PROFILE_FORM', 'HOLE_DIAMETER', 'HOLE_PITCH', 'HOLE_PITCH_OVER_DIAMETER')
      THEN datum_system IS NULL ELSE true END),
  CONSTRAINT drawing_characteristics_rule_known CHECK (decision_rule IN ('ISO_14253_1', 'SIMPLE_ACCEPTANCE', 'GUARD_FACTOR')
    AND octet_length(decision_rule) <= 64 AND octet_length(decision_rule_edition) <= 16),
  CONSTRAINT drawing_characteristics_rule_whole CHECK (
    (decision_rule_edition IS NOT NULL) = (decision_rule IS NOT NULL AND decision_rule = 'ISO_14253_1')
    AND (decision_rule_edition IS NULL OR decision_rule_edition IN ('1998', '2013', '2017'))
    AND (guard_factor IS NOT NULL) = (decision_rule IS NOT NULL AND decision_rule = 'GUARD_FACTOR')
    AND (guard_factor IS NULL OR guard_factor > 0 AND guard_factor <= 3))
);
COMMENT ON TABLE drawing_characteristics IS 'What a drawing asks, balloon by balloon, in its order.';
COMMENT ON COLUMN drawing_characteristics.characteristic IS 'Its balloon''s number.';
COMMENT ON COLUMN drawing_characteristics.hole IS 'NULL: each hole of the group; of a pitch each and the next.';
COMMENT ON COLUMN drawing_characteristics.unit IS 'Of nominal and limits.';
COMMENT ON COLUMN drawing_characteristics.lower_limit IS 'Of the value, in its unit; with zone BORDERS of the signed deviation.';
COMMENT ON COLUMN drawing_characteristics.upper_limit IS 'As lower_limit; with any other zone the size of the zone, as its kind says.';
COMMENT ON COLUMN drawing_characteristics.decision_rule IS 'NULL: the drawing''s.';

CREATE TABLE drawing_product_requirements (
  drawing_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  position_index integer NOT NULL,
  kind text NOT NULL,
  requirement text NOT NULL,
  specification text NOT NULL,
  code text,
  customer_approval boolean NOT NULL,
  CONSTRAINT drawing_product_requirements_pk PRIMARY KEY (drawing_id, revision, position_index),
  CONSTRAINT drawing_product_requirements_drawing_fk FOREIGN KEY (drawing_id, revision) REFERENCES drawing_revisions (drawing_id, revision),
  CONSTRAINT drawing_product_requirements_position CHECK (position_index >= 0),
  CONSTRAINT drawing_product_requirements_kind_known CHECK (kind IN ('MATERIAL', 'SPECIAL_PROCESS', 'FUNCTIONAL_TEST') AND octet_length(kind) <= 64),
  CONSTRAINT drawing_product_requirements_texts CHECK (octet_length(requirement) BETWEEN 1 AND 200 AND octet_length(specification) BETWEEN 1 AND 200
    AND octet_length(code) BETWEEN 1 AND 64)
);
COMMENT ON TABLE drawing_product_requirements IS 'Material, special processes and functional tests that a drawing asks for (AS9102 form 2).';

DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['drawings', 'drawing_revisions', 'drawing_part_revisions', 'drawing_regions', 'drawing_datum_systems',
      'drawing_datums', 'drawing_sections', 'drawing_characteristics', 'drawing_product_requirements'] LOOP
    PERFORM make_append_only(held::regclass);
    EXECUTE format('GRANT SELECT, INSERT ON %I TO sixpoint_plant', held);
    IF held <> 'drawings' THEN
      EXECUTE format('GRANT SELECT ON %I TO sixpoint_ledger', held);
    END IF;
  END LOOP;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON drawing_revisions FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();

-- One kind more, as V0028 has it.
DO $$
DECLARE
  held regclass;
  kinds text[] := record_kinds();
BEGIN
  IF cardinality(kinds) < 20 THEN
    RAISE EXCEPTION 'record_entries_kind_known: % kinds, want those that were', cardinality(kinds);
  END IF;
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  EXECUTE format('ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN (%s))',
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || ARRAY['drawing']) k));
END
$$;

-- As V0032 has it, with drawings.
CREATE OR REPLACE FUNCTION is_root(of_name text) RETURNS boolean LANGUAGE sql IMMUTABLE AS $$
  SELECT split_part(of_name, '/', 1) IN ('machines', 'artefacts', 'parts', 'machining_models', 'drawings', 'calibrations', 'studies')
$$;

-- As V0032 has it; a drawing is of its part.
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
    WHEN 'drawings' THEN
      RETURN (SELECT ARRAY[d.part_id] FROM drawings d WHERE d.drawing_id = split_part(id, '@', 1));
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

-- As V0032 has it; a drawing is of its part, whose own entry may be in a month that was detached.
CREATE OR REPLACE FUNCTION parts_of_record(of_record uuid) RETURNS text[]
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT CASE
    WHEN e.blade_serial IS NOT NULL THEN
      (SELECT ARRAY[b.part_id] FROM blades b WHERE b.blade_serial = e.blade_serial)
    WHEN e.kind = 'part' THEN (SELECT ARRAY[p.part_id] FROM part_revisions p WHERE p.record_id = e.record_id)
    WHEN e.kind = 'machining_model' THEN
      (SELECT ARRAY[m.part_id] FROM machining_model_revisions m WHERE m.record_id = e.record_id)
    WHEN e.kind = 'drawing' THEN (SELECT ARRAY[d.part_id] FROM drawing_revisions d WHERE d.record_id = e.record_id)
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

COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment, disposition, machining_model, deviation, section or drawing; more may come.';

CREATE VIEW read_v1.drawings WITH (security_barrier) AS
  SELECT d.drawing_id, d.revision, d.part_id,
         ARRAY(SELECT v.part_revision FROM drawing_part_revisions v
               WHERE v.drawing_id = d.drawing_id AND v.revision = d.revision ORDER BY v.part_revision) AS part_revisions,
         n.record_sequence, n.recorded_at, d.drawing_number, d.drawing_revision, d.part_number, d.part_name, d.part_revision_level,
         d.additional_changes, d.decision_rule, d.decision_rule_edition, d.guard_factor,
         (SELECT count(*) FROM drawing_characteristics c WHERE c.drawing_id = d.drawing_id AND c.revision = d.revision)
           AS characteristic_count,
         NOT EXISTS (SELECT FROM drawing_revisions l WHERE l.drawing_id = d.drawing_id AND l.revision > d.revision) AS is_newest,
         asker_for_reader(d.requested_by) AS requested_by
  FROM drawing_revisions d JOIN record_names n ON n.record_id = d.record_id
  WHERE d.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.drawings IS 'Each revision of each drawing.';
COMMENT ON COLUMN read_v1.drawings.drawing_id IS 'The id in drawings/{id}@{revision}.';
COMMENT ON COLUMN read_v1.drawings.revision IS 'Of the description; drawing_revision is what the title block says.';
COMMENT ON COLUMN read_v1.drawings.part_id IS 'Of which part model it is.';
COMMENT ON COLUMN read_v1.drawings.part_revisions IS 'The revisions of the part that it is valid for, ascending.';
COMMENT ON COLUMN read_v1.drawings.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.drawings.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.drawings.drawing_number IS 'Of the title block.';
COMMENT ON COLUMN read_v1.drawings.drawing_revision IS 'What the title block calls its revision.';
COMMENT ON COLUMN read_v1.drawings.part_number IS 'Of the title block.';
COMMENT ON COLUMN read_v1.drawings.part_name IS 'Of the title block.';
COMMENT ON COLUMN read_v1.drawings.part_revision_level IS 'What the part''s own list calls its revision; NULL: not said.';
COMMENT ON COLUMN read_v1.drawings.additional_changes IS 'Numbers of changes that hold and are not drawn yet; NULL: none.';
COMMENT ON COLUMN read_v1.drawings.decision_rule IS 'ISO_14253_1, SIMPLE_ACCEPTANCE or GUARD_FACTOR: of characteristics without one of their own.';
COMMENT ON COLUMN read_v1.drawings.decision_rule_edition IS 'Of ISO_14253_1, a year; NULL of the others.';
COMMENT ON COLUMN read_v1.drawings.guard_factor IS 'Of GUARD_FACTOR, of the expanded uncertainty; NULL of the others.';
COMMENT ON COLUMN read_v1.drawings.characteristic_count IS 'How many characteristics it has.';
COMMENT ON COLUMN read_v1.drawings.is_newest IS 'No later revision is recorded.';
COMMENT ON COLUMN read_v1.drawings.requested_by IS 'Who recorded it; persons by their pseudonyms.';

CREATE VIEW read_v1.drawing_characteristics WITH (security_barrier) AS
  SELECT c.drawing_id, c.revision, d.part_id, c.position_index, c.characteristic, c.name, c.requirement, c.reference_location, c.class,
         c.designator, c.quantity, c.algorithm, c.hole_group, c.hole, c.to_hole, c.section, c.reference_section, c.region, c.unit,
         c.nominal, c.lower_limit, c.upper_limit, c.zone, c.datum_system, s.positioning,
         coalesce(c.decision_rule, d.decision_rule) AS decision_rule,
         CASE WHEN c.decision_rule IS NULL THEN d.decision_rule_edition ELSE c.decision_rule_edition END AS decision_rule_edition,
         CASE WHEN c.decision_rule IS NULL THEN d.guard_factor ELSE c.guard_factor END AS guard_factor,
         c.gauge, c.designed_tooling
  FROM drawing_characteristics c JOIN drawing_revisions d USING (drawing_id, revision)
  LEFT JOIN drawing_datum_systems s USING (drawing_id, revision, datum_system)
  WHERE d.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.drawing_characteristics IS 'What each revision of each drawing asks, a row a balloon.';
COMMENT ON COLUMN read_v1.drawing_characteristics.drawing_id IS 'Of which drawing.';
COMMENT ON COLUMN read_v1.drawing_characteristics.revision IS 'Of which of its revisions.';
COMMENT ON COLUMN read_v1.drawing_characteristics.part_id IS 'Of which part model.';
COMMENT ON COLUMN read_v1.drawing_characteristics.position_index IS 'Its place in the drawing''s order, from 0 on.';
COMMENT ON COLUMN read_v1.drawing_characteristics.characteristic IS 'Its balloon''s number.';
COMMENT ON COLUMN read_v1.drawing_characteristics.name IS 'What people call it; of MEASURED_ELSEWHERE what its import calls it.';
COMMENT ON COLUMN read_v1.drawing_characteristics.requirement IS 'As the drawing writes it.';
COMMENT ON COLUMN read_v1.drawing_characteristics.reference_location IS 'Where on the drawing: sheet and zone.';
COMMENT ON COLUMN read_v1.drawing_characteristics.class IS 'MINOR, MAJOR or CRITICAL.';
COMMENT ON COLUMN read_v1.drawing_characteristics.designator IS 'What the drawing marks it with besides; NULL: nothing.';
COMMENT ON COLUMN read_v1.drawing_characteristics.quantity IS 'What is measured, in the contract''s words; more may come.';
COMMENT ON COLUMN read_v1.drawing_characteristics.algorithm IS 'By which algorithm; NULL: there is one.';
COMMENT ON COLUMN read_v1.drawing_characteristics.hole_group IS 'Of which hole group; NULL: of none.';
COMMENT ON COLUMN read_v1.drawing_characteristics.hole IS 'Of which hole; NULL: of each of the group.';
COMMENT ON COLUMN read_v1.drawing_characteristics.to_hole IS 'Of a pitch that has a hole: the other one.';
COMMENT ON COLUMN read_v1.drawing_characteristics.section IS 'In which section; NULL: in none.';
COMMENT ON COLUMN read_v1.drawing_characteristics.reference_section IS 'Of a twist: the section that it is told from.';
COMMENT ON COLUMN read_v1.drawing_characteristics.region IS 'Of which part of the surface; NULL: of none, or of a profile all of it.';
COMMENT ON COLUMN read_v1.drawing_characteristics.unit IS 'Of nominal and limits: MM, UM, DEG or RATIO.';
COMMENT ON COLUMN read_v1.drawing_characteristics.nominal IS 'In its unit; NULL: not said, or there is a zone about the CAD.';
COMMENT ON COLUMN read_v1.drawing_characteristics.lower_limit IS 'In its unit; NULL: none.';
COMMENT ON COLUMN read_v1.drawing_characteristics.upper_limit IS 'In its unit; NULL: none. With a zone but BORDERS the size of the zone.';
COMMENT ON COLUMN read_v1.drawing_characteristics.zone IS 'DIAMETER, RADIUS, WIDTH, HALF_WIDTH or BORDERS; NULL: the limits are the value''s.';
COMMENT ON COLUMN read_v1.drawing_characteristics.datum_system IS 'Its datums, as the drawing writes them; NULL: it has none.';
COMMENT ON COLUMN read_v1.drawing_characteristics.positioning IS 'How a registration makes that datum system: BEST_FIT, LOCAL, SIX_POINT or SIX_POINT_NORMALS.';
COMMENT ON COLUMN read_v1.drawing_characteristics.decision_rule IS 'ISO_14253_1, SIMPLE_ACCEPTANCE or GUARD_FACTOR: its own, or the drawing''s.';
COMMENT ON COLUMN read_v1.drawing_characteristics.decision_rule_edition IS 'Of ISO_14253_1, a year; NULL of the others.';
COMMENT ON COLUMN read_v1.drawing_characteristics.guard_factor IS 'Of GUARD_FACTOR, of the expanded uncertainty; NULL of the others.';
COMMENT ON COLUMN read_v1.drawing_characteristics.gauge IS 'The gauge that it is to be measured with; NULL: any.';
COMMENT ON COLUMN read_v1.drawing_characteristics.designed_tooling IS 'The tooling that was designed for it; NULL: none.';
GRANT SELECT ON read_v1.drawings, read_v1.drawing_characteristics TO sixpoint_reader;
