-- Of a hole beside its position and inclination: where it lies in the surface, with direction, its diameter, and the pitches of its row.

CREATE TABLE inspection_hole_values (
  inspection_id uuid NOT NULL,
  position_index integer NOT NULL,
  measured_by text NOT NULL,
  along_is text NOT NULL,
  along_in_part double precision[] NOT NULL,
  across_in_part double precision[] NOT NULL,
  along_um double precision NOT NULL,
  along_expanded_uncertainty_um double precision NOT NULL,
  across_um double precision NOT NULL,
  across_expanded_uncertainty_um double precision NOT NULL,
  inclination_along_deg double precision NOT NULL,
  inclination_along_expanded_uncertainty_deg double precision NOT NULL,
  inclination_across_deg double precision NOT NULL,
  inclination_across_expanded_uncertainty_deg double precision NOT NULL,
  pin_diameter_expanded_uncertainty_um double precision,
  diameter_mm double precision,
  diameter_expanded_uncertainty_um double precision,
  diameter_reason text NOT NULL,
  along_budget_um real[],
  across_budget_um real[],
  CONSTRAINT inspection_hole_values_pk PRIMARY KEY (inspection_id, position_index),
  CONSTRAINT inspection_hole_values_hole_fk FOREIGN KEY (inspection_id, position_index)
    REFERENCES inspection_holes (inspection_id, position_index),
  CONSTRAINT inspection_hole_values_measured_by_known CHECK (measured_by IN ('PIN', 'BORE')),
  CONSTRAINT inspection_hole_values_along_known CHECK (along_is IN ('AXIS_IN_SURFACE', 'PART_Z', 'PART_X')),
  CONSTRAINT inspection_hole_values_directions CHECK (is_triple(along_in_part) AND is_triple(across_in_part)),
  CONSTRAINT inspection_hole_values_in_range CHECK (abs(along_um) < 1e9 AND along_expanded_uncertainty_um >= 0
    AND along_expanded_uncertainty_um < 1e9 AND abs(across_um) < 1e9 AND across_expanded_uncertainty_um >= 0
    AND across_expanded_uncertainty_um < 1e9 AND abs(inclination_along_deg) <= 180 AND inclination_along_expanded_uncertainty_deg >= 0
    AND inclination_along_expanded_uncertainty_deg < 1e9 AND abs(inclination_across_deg) <= 180
    AND inclination_across_expanded_uncertainty_deg >= 0 AND inclination_across_expanded_uncertainty_deg < 1e9),
  CONSTRAINT inspection_hole_values_diameters CHECK (pin_diameter_expanded_uncertainty_um >= 0 AND pin_diameter_expanded_uncertainty_um < 1e9
    AND diameter_mm > 0 AND diameter_mm < 1e6 AND diameter_expanded_uncertainty_um >= 0 AND diameter_expanded_uncertainty_um < 1e9),
  CONSTRAINT inspection_hole_values_pin CHECK ((measured_by = 'PIN') = (pin_diameter_expanded_uncertainty_um IS NOT NULL)),
  CONSTRAINT inspection_hole_values_diameter_or_reason CHECK ((diameter_mm IS NULL) = (diameter_reason <> '')
    AND (diameter_mm IS NULL) = (diameter_expanded_uncertainty_um IS NULL) AND octet_length(diameter_reason) <= 1000),
  CONSTRAINT inspection_hole_values_budgets CHECK (cardinality(along_budget_um) <= 1000 AND 0 <= ALL (along_budget_um) AND 1e9 > ALL (along_budget_um)
    AND cardinality(across_budget_um) <= 1000 AND 0 <= ALL (across_budget_um) AND 1e9 > ALL (across_budget_um)),
  CONSTRAINT inspection_hole_values_along_in_part_whole CHECK (array_position(along_in_part, NULL) IS NULL),
  CONSTRAINT inspection_hole_values_across_in_part_whole CHECK (array_position(across_in_part, NULL) IS NULL),
  CONSTRAINT inspection_hole_values_along_budget_um_whole CHECK (array_position(along_budget_um, NULL) IS NULL),
  CONSTRAINT inspection_hole_values_across_budget_um_whole CHECK (array_position(across_budget_um, NULL) IS NULL)
) PARTITION BY RANGE (inspection_id);
COMMENT ON TABLE inspection_hole_values IS 'Of each hole that was measured (docs/methods/inspection.md); U: 95 %. None of inspections from before V0042.';
COMMENT ON COLUMN inspection_hole_values.measured_by IS 'By the pin in it, or by the wall of its bore.';
COMMENT ON COLUMN inspection_hole_values.along_is IS 'What along_in_part is: the drawn axis in the surface, or the part''s Z or X in it.';
COMMENT ON COLUMN inspection_hole_values.across_in_part IS 'Normal x along; both unit.';
COMMENT ON COLUMN inspection_hole_values.along_um IS 'Of the start from the drawn start, in the surface; inclination_along_deg: the axis leans so much further that way.';
COMMENT ON COLUMN inspection_hole_values.diameter_mm IS 'Of the hole itself, the middle of what it may be; NULL: not known, see diameter_reason.';
COMMENT ON COLUMN inspection_hole_values.along_budget_um IS 'Standard, of each of the inspection''s budget_sources.';

CREATE TABLE inspection_pitches (
  inspection_id uuid NOT NULL,
  position_index integer NOT NULL,
  hole_index integer NOT NULL,
  next_index integer NOT NULL,
  nominal_pitch_mm double precision NOT NULL,
  pitch_mm double precision,
  pitch_expanded_uncertainty_um double precision,
  pitch_over_diameter double precision,
  pitch_over_diameter_expanded_uncertainty double precision,
  reason text NOT NULL,
  budget_um real[],
  CONSTRAINT inspection_pitches_pk PRIMARY KEY (inspection_id, position_index),
  CONSTRAINT inspection_pitches_hole_fk FOREIGN KEY (inspection_id, hole_index) REFERENCES inspection_holes (inspection_id, position_index),
  CONSTRAINT inspection_pitches_next_fk FOREIGN KEY (inspection_id, next_index) REFERENCES inspection_holes (inspection_id, position_index),
  CONSTRAINT inspection_pitches_once UNIQUE (inspection_id, hole_index),
  CONSTRAINT inspection_pitches_next CHECK (position_index >= 0 AND next_index > hole_index),
  CONSTRAINT inspection_pitches_measured_or_reason CHECK (num_nulls(pitch_mm, pitch_expanded_uncertainty_um, pitch_over_diameter,
    pitch_over_diameter_expanded_uncertainty) = CASE WHEN reason = '' THEN 0 ELSE 4 END AND octet_length(reason) <= 1000),
  CONSTRAINT inspection_pitches_in_range CHECK (nominal_pitch_mm >= 0 AND nominal_pitch_mm < 1e6 AND abs(pitch_mm) < 1e6
    AND pitch_expanded_uncertainty_um >= 0 AND pitch_expanded_uncertainty_um < 1e9 AND abs(pitch_over_diameter) < 1e9
    AND pitch_over_diameter_expanded_uncertainty >= 0 AND pitch_over_diameter_expanded_uncertainty < 1e9),
  CONSTRAINT inspection_pitches_budget CHECK (cardinality(budget_um) <= 1000 AND 0 <= ALL (budget_um) AND 1e9 > ALL (budget_um)),
  CONSTRAINT inspection_pitches_budget_um_whole CHECK (array_position(budget_um, NULL) IS NULL)
) PARTITION BY RANGE (inspection_id);
COMMENT ON TABLE inspection_pitches IS 'From each hole of a group to the next, in the part''s order.';
COMMENT ON COLUMN inspection_pitches.pitch_mm IS 'Along the line from drawn start to drawn start; NULL: one of both was not measured.';
COMMENT ON COLUMN inspection_pitches.pitch_over_diameter IS 'By the drawn diameter.';
COMMENT ON COLUMN inspection_pitches.budget_um IS 'Of pitch_mm, standard, of each of the inspection''s budget_sources.';

DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['inspection_hole_values', 'inspection_pitches'] LOOP
    PERFORM make_append_only(held::regclass);
    EXECUTE format('GRANT SELECT, INSERT ON %I TO sixpoint_inspection', held);
    EXECUTE format('GRANT SELECT ON %I TO sixpoint_ledger', held);
  END LOOP;
END
$$;
SELECT make_partitions(3);
-- And the months that inspections have already.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid, partitioned_tables t
WHERE i.inhparent = 'inspections'::regclass AND t.name IN ('inspection_hole_values', 'inspection_pitches');
