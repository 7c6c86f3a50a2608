-- Blades against their drawings, characteristic by characteristic; which blank is discarded before it is machined; and by which rule a profile
-- tolerance was judged.

ALTER TABLE deviation_profiles
  ADD COLUMN decision_rule text,
  ADD COLUMN decision_rule_edition text,
  ADD COLUMN guard_factor double precision,
  ADD CONSTRAINT deviation_profiles_rule_known CHECK (decision_rule IN ('ISO_14253_1', 'SIMPLE_ACCEPTANCE', 'GUARD_FACTOR')
    AND octet_length(decision_rule) <= 64 AND octet_length(decision_rule_edition) <= 16),
  ADD CONSTRAINT deviation_profiles_rule_whole CHECK (
    (decision_rule_edition IS NOT NULL) = (decision_rule IS NOT NULL AND decision_rule = 'ISO_14253_1')
    AND (decision_rule_edition IS NULL OR decision_rule_edition IN ('1998', '2013', '2017'))
    AND (guard_factor IS NOT NULL) = (decision_rule IS NOT NULL AND decision_rule = 'GUARD_FACTOR')
    AND (guard_factor IS NULL OR guard_factor > 0 AND guard_factor <= 3));
COMMENT ON COLUMN deviation_profiles.decision_rule IS 'NULL: the map''s.';
COMMENT ON COLUMN deviation_profiles.guard_factor IS 'Of the expanded uncertainty, k = 2.';

-- Not by months, which detach_month takes out: a blank that is discarded stays so, and with the row gone it would be released by rule again.
CREATE TABLE assessments (
  assessment_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  machine_id text COLLATE "C",
  machine_revision integer,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  drawing_id text COLLATE "C" NOT NULL,
  drawing_revision integer NOT NULL,
  stage text NOT NULL,
  verdict text NOT NULL,
  fate text,
  fate_reason text NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  computed_on text NOT NULL,
  CONSTRAINT assessments_pk PRIMARY KEY (assessment_id),
  CONSTRAINT assessments_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT assessments_machine_fk FOREIGN KEY (machine_id, machine_revision) REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT assessments_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT assessments_drawing_fk FOREIGN KEY (drawing_id, drawing_revision) REFERENCES drawing_revisions (drawing_id, revision),
  CONSTRAINT assessments_record_fk FOREIGN KEY (assessment_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT assessments_machine_whole CHECK ((machine_id IS NULL) = (machine_revision IS NULL)),
  CONSTRAINT assessments_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0 AND drawing_revision > 0),
  CONSTRAINT assessments_stage_known CHECK (stage IN ('BEFORE_MACHINING', 'MACHINED')),
  CONSTRAINT assessments_verdict_known CHECK (verdict IN ('CONFORM', 'NOT_CONFORM', 'UNDECIDABLE', 'NOT_MEASURED')),
  CONSTRAINT assessments_fate_known CHECK (fate IN ('MACHINABLE', 'DISCARD', 'UNDECIDED')),
  CONSTRAINT assessments_fate_whole CHECK ((fate IS NOT NULL) = (stage = 'BEFORE_MACHINING')
    AND (fate_reason <> '') = (fate IS NOT NULL AND fate <> 'MACHINABLE') AND octet_length(fate_reason) <= 2000),
  CONSTRAINT assessments_texts CHECK (requested_by <> '' AND octet_length(requested_by) <= 200 AND software_version <> ''
    AND octet_length(software_version) <= 200 AND octet_length(computed_on) BETWEEN 1 AND 200)
);
CREATE INDEX assessments_by_blade ON assessments (blade_serial);
COMMENT ON TABLE assessments IS 'A blade against a revision of its drawing: assessments/{id}.';
COMMENT ON COLUMN assessments.machine_id IS 'Of the first of its results that has one; NULL: none has.';
COMMENT ON COLUMN assessments.fate IS 'Of a blank: MACHINABLE, DISCARD (no correction cures it), UNDECIDED; NULL: the blade is machined.';

CREATE TABLE assessment_results (
  assessment_id uuid NOT NULL,
  position_index integer NOT NULL,
  result_id uuid NOT NULL,
  CONSTRAINT assessment_results_pk PRIMARY KEY (assessment_id, position_index),
  CONSTRAINT assessment_results_once UNIQUE (assessment_id, result_id),
  CONSTRAINT assessment_results_assessment_fk FOREIGN KEY (assessment_id) REFERENCES assessments (assessment_id),
  CONSTRAINT assessment_results_result_fk FOREIGN KEY (result_id) REFERENCES record_names (record_id),
  CONSTRAINT assessment_results_position CHECK (position_index BETWEEN 0 AND 63)
) PARTITION BY RANGE (assessment_id);
CREATE INDEX assessment_results_by_result ON assessment_results (result_id);
COMMENT ON TABLE assessment_results IS 'The results that were judged, in the order asked.';

CREATE TABLE assessment_findings (
  assessment_id uuid NOT NULL,
  position_index integer NOT NULL,
  characteristic text NOT NULL,
  feature text NOT NULL,
  place text NOT NULL,
  name text NOT NULL,
  class text NOT NULL,
  quantity text NOT NULL,
  unit text NOT NULL,
  nominal double precision,
  lower_limit double precision,
  upper_limit double precision,
  value double precision,
  expanded_uncertainty double precision,
  verdict text NOT NULL,
  decision_rule text NOT NULL,
  decision_rule_edition text,
  guard_factor double precision,
  reason text NOT NULL,
  result_index integer,
  method text,
  cure text,
  CONSTRAINT assessment_findings_pk PRIMARY KEY (assessment_id, position_index),
  CONSTRAINT assessment_findings_once UNIQUE (assessment_id, characteristic, feature),
  CONSTRAINT assessment_findings_assessment_fk FOREIGN KEY (assessment_id) REFERENCES assessments (assessment_id),
  CONSTRAINT assessment_findings_result_fk FOREIGN KEY (assessment_id, result_index) REFERENCES assessment_results (assessment_id, position_index),
  CONSTRAINT assessment_findings_position CHECK (position_index BETWEEN 0 AND 19999),
  CONSTRAINT assessment_findings_words CHECK (class IN ('MINOR', 'MAJOR', 'CRITICAL') AND quantity ~ '^[A-Z][A-Z_]{1,60}$'
    AND unit IN ('MM', 'UM', 'DEG', 'RATIO')),
  CONSTRAINT assessment_findings_texts CHECK (characteristic <> '' AND octet_length(characteristic) <= 64 AND octet_length(feature) <= 200
    AND octet_length(place) <= 200 AND name <> '' AND octet_length(name) <= 200 AND octet_length(reason) <= 1000),
  CONSTRAINT assessment_findings_verdict_known CHECK (verdict IN ('CONFORM', 'NOT_CONFORM', 'UNDECIDABLE', 'NOT_MEASURED')),
  CONSTRAINT assessment_findings_reasoned CHECK ((reason = '') = (verdict IN ('CONFORM', 'NOT_CONFORM'))),
  CONSTRAINT assessment_findings_measured_or_not CHECK ((value IS NOT NULL OR expanded_uncertainty IS NULL)
    AND (value IS NOT NULL OR verdict = 'NOT_MEASURED') AND (value IS NULL OR result_index IS NOT NULL)
    AND (result_index IS NOT NULL OR method IS NULL)),
  CONSTRAINT assessment_findings_in_range CHECK (abs(nominal) < 1e9 AND abs(lower_limit) < 1e9 AND abs(upper_limit) < 1e9
    AND abs(value) < 1e9 AND expanded_uncertainty >= 0 AND expanded_uncertainty < 1e9),
  CONSTRAINT assessment_findings_rule_known CHECK (decision_rule IN ('ISO_14253_1', 'SIMPLE_ACCEPTANCE', 'GUARD_FACTOR')
    AND octet_length(decision_rule_edition) <= 16),
  CONSTRAINT assessment_findings_rule_whole CHECK ((decision_rule_edition IS NOT NULL) = (decision_rule = 'ISO_14253_1')
    AND (decision_rule_edition IS NULL OR decision_rule_edition IN ('1998', '2013', '2017'))
    AND (guard_factor IS NOT NULL) = (decision_rule = 'GUARD_FACTOR') AND (guard_factor IS NULL OR guard_factor > 0 AND guard_factor <= 3)),
  CONSTRAINT assessment_findings_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS', 'ALLOWANCE')),
  CONSTRAINT assessment_findings_cure CHECK (cure IN ('POSSIBLE', 'NONE', 'UNKNOWN') AND (cure IS NULL OR verdict = 'NOT_CONFORM'))
) PARTITION BY RANGE (assessment_id);
COMMENT ON TABLE assessment_findings IS 'What was found of each characteristic at each of its features.';
COMMENT ON COLUMN assessment_findings.characteristic IS 'Its balloon''s number.';
COMMENT ON COLUMN assessment_findings.feature IS 'A hole, or two of a pitch; empty: at one place.';
COMMENT ON COLUMN assessment_findings.place IS 'The hole group, section or region; empty: the whole surface, or elsewhere.';
COMMENT ON COLUMN assessment_findings.unit IS 'Of the numbers of the row.';
COMMENT ON COLUMN assessment_findings.lower_limit IS 'As the value is held against it: of a zone its border on that side; NULL: none.';
COMMENT ON COLUMN assessment_findings.value IS 'NULL: not measured, see reason.';
COMMENT ON COLUMN assessment_findings.expanded_uncertainty IS '95 %; NULL with the value, and where its instrument states none.';
COMMENT ON COLUMN assessment_findings.guard_factor IS 'Of the expanded uncertainty, k = 2.';
COMMENT ON COLUMN assessment_findings.result_index IS 'Which of the results has it; NULL: none.';
COMMENT ON COLUMN assessment_findings.cure IS 'Of a blank''s that is out: whether a rigid motion brings it within its limits.';

CREATE TABLE assessment_others (
  assessment_id uuid NOT NULL,
  finding_index integer NOT NULL,
  position_index integer NOT NULL,
  result_index integer NOT NULL,
  method text,
  value double precision NOT NULL,
  expanded_uncertainty double precision,
  CONSTRAINT assessment_others_pk PRIMARY KEY (assessment_id, finding_index, position_index),
  CONSTRAINT assessment_others_finding_fk FOREIGN KEY (assessment_id, finding_index)
    REFERENCES assessment_findings (assessment_id, position_index),
  CONSTRAINT assessment_others_result_fk FOREIGN KEY (assessment_id, result_index) REFERENCES assessment_results (assessment_id, position_index),
  CONSTRAINT assessment_others_position CHECK (position_index BETWEEN 0 AND 63),
  CONSTRAINT assessment_others_in_range CHECK (abs(value) < 1e9 AND expanded_uncertainty >= 0 AND expanded_uncertainty < 1e9),
  CONSTRAINT assessment_others_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS', 'ALLOWANCE'))
) PARTITION BY RANGE (assessment_id);
COMMENT ON TABLE assessment_others IS 'What other results have of the same characteristic, beside the one that was judged.';
COMMENT ON COLUMN assessment_others.expanded_uncertainty IS '95 %; NULL: its instrument states none.';

CREATE TABLE assessment_conflicts (
  assessment_id uuid NOT NULL,
  position_index integer NOT NULL,
  characteristic text NOT NULL,
  result_index integer NOT NULL,
  patch integer NOT NULL,
  mean_um double precision NOT NULL,
  expanded_uncertainty_um double precision NOT NULL,
  centre_in_part_mm double precision[] NOT NULL,
  above boolean NOT NULL,
  share double precision NOT NULL,
  CONSTRAINT assessment_conflicts_pk PRIMARY KEY (assessment_id, position_index),
  CONSTRAINT assessment_conflicts_assessment_fk FOREIGN KEY (assessment_id) REFERENCES assessments (assessment_id),
  CONSTRAINT assessment_conflicts_result_fk FOREIGN KEY (assessment_id, result_index) REFERENCES assessment_results (assessment_id, position_index),
  CONSTRAINT assessment_conflicts_position CHECK (position_index BETWEEN 0 AND 15),
  CONSTRAINT assessment_conflicts_named CHECK (characteristic <> '' AND octet_length(characteristic) <= 64),
  CONSTRAINT assessment_conflicts_in_range CHECK (patch >= 0 AND abs(mean_um) < 1e9 AND expanded_uncertainty_um >= 0
    AND expanded_uncertainty_um < 1e9 AND share > 0 AND share <= 1),
  CONSTRAINT assessment_conflicts_place CHECK (is_triple(centre_in_part_mm)),
  CONSTRAINT assessment_conflicts_centre_in_part_mm_whole CHECK (array_position(centre_in_part_mm, NULL) IS NULL)
) PARTITION BY RANGE (assessment_id);
COMMENT ON TABLE assessment_conflicts IS 'Patches whose limits no rigid motion meets all: what frees one hurts another.';
COMMENT ON COLUMN assessment_conflicts.share IS 'Of the pushes that balance, 0 to 1.';

DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['assessments', 'assessment_results', 'assessment_findings', 'assessment_others', 'assessment_conflicts'] LOOP
    PERFORM make_append_only(held::regclass);
    EXECUTE format('GRANT SELECT, INSERT ON %I TO sixpoint_inspection', held);
    EXECUTE format('GRANT SELECT ON %I TO sixpoint_ledger', held);
  END LOOP;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON assessments FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();
SELECT make_partitions(3);
-- And the months that inspections have already.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid, partitioned_tables t
WHERE i.inhparent = 'inspections'::regclass AND t.name LIKE 'assessment\_%';

-- One kind more, as V0028 has it.
DO $$
DECLARE
  held regclass;
  kinds text[] := record_kinds();
BEGIN
  IF cardinality(kinds) < 22 THEN
    RAISE EXCEPTION 'record_entries_kind_known: % kinds, want those that were', cardinality(kinds);
  END IF;
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  EXECUTE format('ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN (%s))',
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || ARRAY['assessment']) k));
END
$$;

CREATE OR REPLACE FUNCTION record_verdict(of_record uuid, of_kind text) RETURNS text
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  RETURN CASE of_kind
    WHEN 'inspection' THEN (SELECT i.verdict FROM inspections i WHERE i.inspection_id = of_record)
    WHEN 'assessment' THEN (SELECT a.verdict FROM assessments a WHERE a.assessment_id = of_record)
    WHEN 'deviation' THEN (SELECT d.verdict FROM deviation_maps d WHERE d.deviation_id = of_record)
    WHEN 'registration' THEN (SELECT r.outcome FROM registrations r WHERE r.registration_id = of_record)
    WHEN 'study' THEN (SELECT s.verdict FROM studies s WHERE s.study_id = of_record) END;
END
$$;
COMMENT ON FUNCTION record_verdict(uuid, text) IS
  'Of inspections, assessments, deviation maps with profile tolerances, registrations (their outcome) and studies; NULL: none.';

-- Events tell the verdicts of maps and assessments too: as V0029 and V0031 have them, but for the kinds that have one.
DO $$
DECLARE
  told text;
  was CONSTANT text := '''inspection'', ''registration'', ''study''';
  held regprocedure;
BEGIN
  FOREACH held IN ARRAY ARRAY['events_between(bigint, bigint, bigint, text[], text[], text, text, text, text[])'::regprocedure,
      'read_v1.events_after(bigint, integer)'::regprocedure, 'read_v1.recall(text, bigint, integer)'::regprocedure] LOOP
    told := pg_get_functiondef(held);
    IF position(was IN told) = 0 THEN
      RAISE EXCEPTION '%: tells verdicts of other kinds, want %', held, was;
    END IF;
    EXECUTE replace(told, was, '''inspection'', ''assessment'', ''deviation'', ''registration'', ''study''');
  END LOOP;
END
$$;
CREATE OR REPLACE VIEW read_v1.events WITH (security_barrier) AS
  SELECT n.record_sequence, n.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method,
         CASE WHEN e.kind IN ('inspection', 'assessment', 'deviation', 'registration', 'study')
              THEN record_verdict(e.record_id, e.kind) END AS verdict,
         e.measured_at, asker_for_reader(e.requested_by) AS requested_by, e.software_version, e.trace_id,
         e.work_order, e.operation
  FROM record_names n JOIN record_entries e ON e.record_id = n.record_id
  WHERE ((SELECT cardinality(hidden_from_reader())) = 0
         OR CASE WHEN e.blade_serial IS NULL
                 THEN coalesce(NOT parts_of_record(e.record_id) && (SELECT hidden_from_reader())::text[], false)
                 ELSE EXISTS (SELECT 1 FROM blades b WHERE b.blade_serial = e.blade_serial
                              AND b.part_id <> ALL ((SELECT hidden_from_reader())::text[])) END);
COMMENT ON COLUMN read_v1.events.verdict IS 'Of an inspection, an assessment, a deviation map with profile tolerances or a study; of a registration its outcome; NULL of the others.';
COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment, disposition, machining_model, deviation, section, drawing or assessment; more may come.';

-- A blank that no correction cures is no less scrap than one that a person says is. What a person decided later lifts it, and a later
-- assessment by the same drawing, not by an older revision of it, that says MACHINABLE; one that says nothing lifts nothing.
CREATE OR REPLACE FUNCTION scrapped_by(of_blade text) RETURNS uuid
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  WITH decided AS (
    SELECT d.disposition_id AS record_id, d.disposition = 'SCRAP' AS is_scrap, n.record_sequence
    FROM dispositions d JOIN record_names n ON n.record_id = d.disposition_id
    WHERE d.blade_serial = of_blade ORDER BY n.record_sequence DESC LIMIT 1),
  judged AS (
    SELECT a.assessment_id AS record_id, a.fate, a.drawing_id, a.drawing_revision, n.record_sequence
    FROM assessments a JOIN record_names n ON n.record_id = a.assessment_id
    WHERE a.blade_serial = of_blade AND a.fate IN ('DISCARD', 'MACHINABLE'))
  SELECT record_id FROM (
    SELECT record_id, record_sequence FROM decided WHERE is_scrap
    UNION ALL SELECT f.record_id, f.record_sequence FROM judged f
    WHERE f.fate = 'DISCARD' AND NOT EXISTS (SELECT 1 FROM decided d WHERE d.record_sequence > f.record_sequence)
      AND NOT EXISTS (SELECT 1 FROM judged m WHERE m.fate = 'MACHINABLE' AND m.record_sequence > f.record_sequence
                      AND m.drawing_id = f.drawing_id AND m.drawing_revision >= f.drawing_revision)) scrap
  ORDER BY record_sequence DESC LIMIT 1
$$;
COMMENT ON FUNCTION scrapped_by(text) IS
  'The disposition, or the assessment before machining, by which a blade is scrap: the newest disposition, if that is SCRAP, or a DISCARD that '
  'no later disposition, and no later MACHINABLE by the same drawing, lifts; NULL: it is not.';
COMMENT ON FUNCTION scrapped_against(uuid) IS
  'The disposition or assessment by which the blade of a released correction is scrap, if nobody released it in spite of that: it was recorded '
  'after the release, or the gate never told of it. NULL: there is none.';
DO $$
DECLARE
  told text := pg_get_functiondef('refuse_unreleased_fetch()'::regprocedure);
  was CONSTANT text := 'by dispositions/%, want a blade that is not'', NEW.correction_id, scrapped';
BEGIN
  IF position(was IN told) = 0 THEN
    RAISE EXCEPTION 'refuse_unreleased_fetch: tells of something else, want %', was;
  END IF;
  EXECUTE replace(told, was, 'by %, want a blade that is not'', NEW.correction_id, (SELECT name FROM record_names WHERE record_id = scrapped)');
END
$$;

CREATE VIEW read_v1.assessments WITH (security_barrier) AS
  SELECT a.assessment_id, a.blade_serial, a.part_id, a.part_revision, a.drawing_id, a.drawing_revision, a.stage, n.record_sequence,
         n.recorded_at, a.verdict, a.fate, a.fate_reason, f.characteristic, f.feature, f.place, f.name AS characteristic_name, f.class,
         f.quantity, f.unit, f.nominal, f.lower_limit, f.upper_limit, f.value, f.expanded_uncertainty, f.verdict AS characteristic_verdict,
         f.decision_rule, f.decision_rule_edition, f.guard_factor, f.method, f.reason, f.cure
  FROM assessments a JOIN record_names n ON n.record_id = a.assessment_id JOIN assessment_findings f ON f.assessment_id = a.assessment_id
  WHERE a.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.assessments IS 'Blades against their drawings: a row for each characteristic at each of its features.';
COMMENT ON COLUMN read_v1.assessments.assessment_id IS 'The id in assessments/{id}.';
COMMENT ON COLUMN read_v1.assessments.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.assessments.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.assessments.part_revision IS 'The revision that it was measured against.';
COMMENT ON COLUMN read_v1.assessments.drawing_id IS 'By which drawing.';
COMMENT ON COLUMN read_v1.assessments.drawing_revision IS 'The revision that it was judged by.';
COMMENT ON COLUMN read_v1.assessments.stage IS 'BEFORE_MACHINING or MACHINED.';
COMMENT ON COLUMN read_v1.assessments.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.assessments.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.assessments.verdict IS 'Of the blade: the worst of all, NOT_CONFORM, NOT_MEASURED, UNDECIDABLE, CONFORM.';
COMMENT ON COLUMN read_v1.assessments.fate IS 'Of a blank: MACHINABLE, DISCARD (no correction cures it) or UNDECIDED; NULL: the blade is machined.';
COMMENT ON COLUMN read_v1.assessments.fate_reason IS 'Why it is DISCARD or UNDECIDED; else empty.';
COMMENT ON COLUMN read_v1.assessments.characteristic IS 'Its balloon''s number on the drawing.';
COMMENT ON COLUMN read_v1.assessments.feature IS 'A hole, or two of a pitch; empty: at one place.';
COMMENT ON COLUMN read_v1.assessments.place IS 'The hole group, section or region; empty: the whole surface, or elsewhere.';
COMMENT ON COLUMN read_v1.assessments.characteristic_name IS 'What people call it.';
COMMENT ON COLUMN read_v1.assessments.class IS 'MINOR, MAJOR or CRITICAL.';
COMMENT ON COLUMN read_v1.assessments.quantity IS 'What is measured, in the contract''s words; more may come.';
COMMENT ON COLUMN read_v1.assessments.unit IS 'MM, UM, DEG or RATIO, of the next five.';
COMMENT ON COLUMN read_v1.assessments.nominal IS 'As drawn, or of the CAD; NULL: it has none.';
COMMENT ON COLUMN read_v1.assessments.lower_limit IS 'What the value is held against; NULL: none.';
COMMENT ON COLUMN read_v1.assessments.upper_limit IS 'As lower_limit.';
COMMENT ON COLUMN read_v1.assessments.value IS 'As measured; NULL: not measured.';
COMMENT ON COLUMN read_v1.assessments.expanded_uncertainty IS '95 %; NULL with the value, and where its instrument states none.';
COMMENT ON COLUMN read_v1.assessments.characteristic_verdict IS 'CONFORM, NOT_CONFORM, UNDECIDABLE or NOT_MEASURED.';
COMMENT ON COLUMN read_v1.assessments.decision_rule IS 'ISO_14253_1, SIMPLE_ACCEPTANCE or GUARD_FACTOR.';
COMMENT ON COLUMN read_v1.assessments.decision_rule_edition IS 'Of ISO_14253_1, a year; NULL of the others.';
COMMENT ON COLUMN read_v1.assessments.guard_factor IS 'Of GUARD_FACTOR, of the expanded uncertainty; NULL of the others.';
COMMENT ON COLUMN read_v1.assessments.method IS 'How the scans were positioned; NULL: not by this plant.';
COMMENT ON COLUMN read_v1.assessments.reason IS 'Why it is neither CONFORM nor NOT_CONFORM; else empty.';
COMMENT ON COLUMN read_v1.assessments.cure IS 'Of a blank''s that is out: POSSIBLE, NONE or UNKNOWN: whether a rigid motion brings it within its limits; NULL: not asked.';
GRANT SELECT ON read_v1.assessments TO sixpoint_reader;
