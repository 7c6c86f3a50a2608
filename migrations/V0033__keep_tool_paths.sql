-- Shaped holes as paths of the tool: beside the hole groups of a machining model's operations, and pose by pose in its corrections. A path is a group
-- of one hole there, so that states, cuts and lists are what they are of holes. All is in tables of its own, or nullable.

ALTER TABLE machining_operations ALTER COLUMN hole_group DROP NOT NULL;
COMMENT ON TABLE machining_operations IS
  'In the order of machining: a hole group of the part, and what drills its straight holes; or what cuts the paths of machining_tool_paths.';
COMMENT ON COLUMN machining_operations.hole_group IS 'NULL: the operation has paths.';

CREATE TABLE machining_tool_paths (
  machining_model_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  operation_index integer NOT NULL,
  position_index integer NOT NULL,
  path text NOT NULL,
  a_nominal_deg double precision NOT NULL,
  b_nominal_deg double precision NOT NULL,
  position_tolerance_mm double precision NOT NULL,
  inclination_tolerance_deg double precision NOT NULL,
  mouth_mm double precision NOT NULL,
  greatest_step_deg double precision,
  tips_in_part_mm double precision[] NOT NULL,
  axes_in_part double precision[] NOT NULL,
  CONSTRAINT machining_tool_paths_pk PRIMARY KEY (machining_model_id, revision, operation_index, position_index),
  CONSTRAINT machining_tool_paths_once UNIQUE (machining_model_id, revision, path),
  CONSTRAINT machining_tool_paths_operation_fk FOREIGN KEY (machining_model_id, revision, operation_index)
    REFERENCES machining_operations (machining_model_id, revision, position_index),
  CONSTRAINT machining_tool_paths_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT machining_tool_paths_texts CHECK (octet_length(path) <= 200),
  CONSTRAINT machining_tool_paths_angles_finite CHECK (abs(a_nominal_deg) <= 360 AND abs(b_nominal_deg) <= 360),
  CONSTRAINT machining_tool_paths_tolerances CHECK (position_tolerance_mm > 0 AND position_tolerance_mm <= 100
    AND inclination_tolerance_deg > 0 AND inclination_tolerance_deg <= 90),
  CONSTRAINT machining_tool_paths_reach CHECK (mouth_mm > 0 AND mouth_mm <= 10 AND greatest_step_deg > 0 AND greatest_step_deg <= 90),
  CONSTRAINT machining_tool_paths_poses_whole CHECK (cardinality(tips_in_part_mm) BETWEEN 6 AND 15000
    AND cardinality(tips_in_part_mm) % 3 = 0 AND cardinality(axes_in_part) = cardinality(tips_in_part_mm)),
  CONSTRAINT machining_tool_paths_tips_in_part_mm_whole CHECK (array_position(tips_in_part_mm, NULL) IS NULL),
  CONSTRAINT machining_tool_paths_axes_in_part_whole CHECK (array_position(axes_in_part, NULL) IS NULL),
  CONSTRAINT machining_tool_paths_poses_finite CHECK (-1e6 <= ALL (tips_in_part_mm) AND 1e6 >= ALL (tips_in_part_mm)
    AND -1.001 <= ALL (axes_in_part) AND 1.001 >= ALL (axes_in_part))
);
COMMENT ON TABLE machining_tool_paths IS 'Shaped holes of an operation, in the order of their cut: where the tool goes on the nominal part.';
COMMENT ON COLUMN machining_tool_paths.tips_in_part_mm IS 'X, Y, Z of the tip, pose by pose.';
COMMENT ON COLUMN machining_tool_paths.axes_in_part IS 'X, Y, Z of the tool''s direction, from its tip to its holder, pose by pose; of length 1.';
COMMENT ON COLUMN machining_tool_paths.mouth_mm IS 'How far beside the electrode the path may cut the surface.';
COMMENT ON COLUMN machining_tool_paths.greatest_step_deg IS 'How far a rotary axis may go from pose to pose; NULL: the service''s own.';

CREATE TABLE correction_tool_paths (
  correction_id uuid NOT NULL,
  group_name text NOT NULL,
  tips_mm double precision[] NOT NULL,
  nominal_tips_mm double precision[] NOT NULL,
  commanded_deg double precision[] NOT NULL,
  nominal_deg double precision[] NOT NULL,
  reached_deg double precision[],
  tilts_deg double precision[] NOT NULL,
  standard_uncertainties_deg double precision[] NOT NULL,
  expanded_uncertainties_um double precision[] NOT NULL,
  greatest_chord_um double precision NOT NULL,
  greatest_axis_deviation_deg double precision NOT NULL,
  CONSTRAINT correction_tool_paths_pk PRIMARY KEY (correction_id, group_name),
  CONSTRAINT correction_tool_paths_group_fk FOREIGN KEY (correction_id, group_name)
    REFERENCES correction_groups (correction_id, group_name),
  CONSTRAINT correction_tool_paths_texts CHECK (octet_length(group_name) <= 200),
  CONSTRAINT correction_tool_paths_poses_whole CHECK (cardinality(tilts_deg) BETWEEN 1 AND 5000
    AND cardinality(expanded_uncertainties_um) = cardinality(tilts_deg) AND cardinality(tips_mm) = 3 * cardinality(tilts_deg)
    AND cardinality(nominal_tips_mm) = 3 * cardinality(tilts_deg) AND cardinality(commanded_deg) = 2 * cardinality(tilts_deg)
    AND cardinality(nominal_deg) = 2 * cardinality(tilts_deg) AND cardinality(reached_deg) = 2 * cardinality(tilts_deg)
    AND cardinality(standard_uncertainties_deg) = 2 * cardinality(tilts_deg)),
  CONSTRAINT correction_tool_paths_finite CHECK (-1e6 <= ALL (tips_mm || nominal_tips_mm || commanded_deg || nominal_deg || tilts_deg)
    AND 1e6 >= ALL (tips_mm || nominal_tips_mm || commanded_deg || nominal_deg || tilts_deg)
    AND 0 <= ALL (standard_uncertainties_deg || expanded_uncertainties_um) AND 1e9 >= ALL (standard_uncertainties_deg || expanded_uncertainties_um)
    AND greatest_chord_um >= 0 AND greatest_chord_um < 1e9 AND greatest_axis_deviation_deg >= 0 AND greatest_axis_deviation_deg < 360),
  CONSTRAINT correction_tool_paths_tips_mm_whole CHECK (array_position(tips_mm, NULL) IS NULL),
  CONSTRAINT correction_tool_paths_nominal_tips_mm_whole CHECK (array_position(nominal_tips_mm, NULL) IS NULL),
  CONSTRAINT correction_tool_paths_commanded_deg_whole CHECK (array_position(commanded_deg, NULL) IS NULL),
  CONSTRAINT correction_tool_paths_nominal_deg_whole CHECK (array_position(nominal_deg, NULL) IS NULL),
  CONSTRAINT correction_tool_paths_reached_deg_whole CHECK (array_position(reached_deg, NULL) IS NULL),
  CONSTRAINT correction_tool_paths_tilts_deg_whole CHECK (array_position(tilts_deg, NULL) IS NULL),
  CONSTRAINT correction_tool_paths_standard_uncertainties_deg_whole CHECK (array_position(standard_uncertainties_deg, NULL) IS NULL),
  CONSTRAINT correction_tool_paths_expanded_uncertainties_um_whole CHECK (array_position(expanded_uncertainties_um, NULL) IS NULL)
) PARTITION BY RANGE (correction_id);
COMMENT ON TABLE correction_tool_paths IS 'The poses of a group that is a path of the tool: its one hole stands at the first of them.';
COMMENT ON COLUMN correction_tool_paths.tips_mm IS 'X, Y, Z of the tip, machine, pose by pose: the part turned to that pose''s angles.';
COMMENT ON COLUMN correction_tool_paths.commanded_deg IS 'Of the axis on the bed and of the one that it carries, pose by pose.';
COMMENT ON COLUMN correction_tool_paths.reached_deg IS 'By the tables that the registration''s angles were taken with; NULL where none was applied.';
COMMENT ON COLUMN correction_tool_paths.greatest_chord_um IS
  'Of the tip from the straight line between two poses, on the part, while all axes go straight.';
COMMENT ON COLUMN correction_tool_paths.standard_uncertainties_deg IS 'Of what either axis reaches, beside what it should, pose by pose.';

SELECT make_append_only('machining_tool_paths');
SELECT make_append_only('correction_tool_paths');
GRANT SELECT, INSERT ON machining_tool_paths TO sixpoint_plant;
GRANT SELECT, INSERT ON correction_tool_paths TO sixpoint_correction;
GRANT SELECT ON machining_tool_paths, correction_tool_paths TO sixpoint_ledger;
SELECT make_partitions(3);
-- And the months that corrections have already.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid,
     (SELECT * FROM partitioned_tables WHERE name = 'correction_tool_paths') t
WHERE i.inhparent = 'corrections'::regclass;
