-- What a machining model's template was written from: nullable columns, and a table of its own. And the spindle's axis W among a machine's joints.

ALTER TABLE machine_joints DROP CONSTRAINT machine_joints_axis_known,
  ADD CONSTRAINT machine_joints_axis_known CHECK (axis IN ('X', 'Y', 'Z', 'A', 'B', 'C', 'W'));
ALTER TABLE machine_joints ADD CONSTRAINT machine_joints_w_of_spindle CHECK (axis <> 'W' OR (kind = 'linear' AND side = 'tool'));

ALTER TABLE machining_operations
  ADD COLUMN tool_number integer,
  ADD COLUMN feed_mm_min double precision,
  ADD CONSTRAINT machining_operations_tool_number CHECK (tool_number BETWEEN 1 AND 9999),
  ADD CONSTRAINT machining_operations_feed CHECK (feed_mm_min > 0 AND feed_mm_min <= 1e5);
COMMENT ON COLUMN machining_operations.tool_number IS 'T in the program; NULL: not stated.';

CREATE TABLE machining_post_processors (
  machining_model_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  axis_words text[] NOT NULL,
  linear_decimals integer NOT NULL,
  rotary_decimals integer NOT NULL,
  direction_decimals integer NOT NULL,
  explicit_plus boolean NOT NULL,
  directions boolean NOT NULL,
  semicolon_comments boolean NOT NULL,
  leaves_out_repeated boolean NOT NULL,
  first_number integer NOT NULL,
  number_step integer NOT NULL,
  program_start text NOT NULL,
  operation_start text NOT NULL,
  hole text NOT NULL,
  path_start text NOT NULL,
  path_pose text NOT NULL,
  path_end text NOT NULL,
  operation_end text NOT NULL,
  program_end text NOT NULL,
  CONSTRAINT machining_post_processors_pk PRIMARY KEY (machining_model_id, revision),
  CONSTRAINT machining_post_processors_model_fk FOREIGN KEY (machining_model_id, revision)
    REFERENCES machining_model_revisions (machining_model_id, revision),
  CONSTRAINT machining_post_processors_axis_words_five CHECK (cardinality(axis_words) = 5
    AND char_length(array_to_string(axis_words, '')) BETWEEN 5 AND 15),
  CONSTRAINT machining_post_processors_axis_words_whole CHECK (array_position(axis_words, NULL) IS NULL),
  CONSTRAINT machining_post_processors_decimals CHECK (linear_decimals BETWEEN 4 AND 9 AND rotary_decimals BETWEEN 4 AND 9
    AND direction_decimals BETWEEN 6 AND 9),
  CONSTRAINT machining_post_processors_numbers CHECK (first_number BETWEEN 0 AND 1000000 AND number_step BETWEEN 0 AND 1000),
  CONSTRAINT machining_post_processors_texts CHECK (octet_length(program_start) <= 8192 AND octet_length(operation_start) <= 8192
    AND octet_length(hole) <= 8192 AND octet_length(path_start) <= 8192 AND octet_length(path_pose) <= 8192
    AND octet_length(path_end) <= 8192 AND octet_length(operation_end) <= 8192 AND octet_length(program_end) <= 8192)
);
COMMENT ON TABLE machining_post_processors IS
  'How the control of a machining model wants its programs to look: what its template was written from. None: the template was sent.';
COMMENT ON COLUMN machining_post_processors.axis_words IS 'Of X, Y, Z, the axis on the bed and the one that it carries.';
COMMENT ON COLUMN machining_post_processors.directions IS
  'The control''s own five-axis transformation is used, with the rotary axes of the machine''s record.';

SELECT make_append_only('machining_post_processors');
GRANT SELECT, INSERT ON machining_post_processors TO sixpoint_plant;
GRANT SELECT ON machining_post_processors TO sixpoint_ledger;
