-- Axis tables in poses: the angles that scans were taken at, and what corrections command; machines of any two rotary axes.

CREATE TABLE registration_angles (
  registration_id text COLLATE "C" NOT NULL,
  position_index integer NOT NULL,
  axis text NOT NULL,
  characterisation_id text COLLATE "C" NOT NULL,
  kind text NOT NULL DEFAULT 'axis',
  commanded_deg double precision NOT NULL,
  reached_deg double precision NOT NULL,
  standard_uncertainty_deg double precision NOT NULL,
  half_reversal_deg double precision NOT NULL,
  pose_per_rad double precision[] NOT NULL,
  CONSTRAINT registration_angles_pk PRIMARY KEY (registration_id, position_index),
  CONSTRAINT registration_angles_once UNIQUE (registration_id, axis, commanded_deg),
  CONSTRAINT registration_angles_registration_fk FOREIGN KEY (registration_id) REFERENCES registrations (registration_id),
  CONSTRAINT registration_angles_characterisation_fk FOREIGN KEY (characterisation_id, kind)
    REFERENCES calibrations (calibration_id, kind),
  CONSTRAINT registration_angles_kind CHECK (kind = 'axis'),
  CONSTRAINT registration_angles_axis_known CHECK (axis IN ('A', 'B', 'C')),
  CONSTRAINT registration_angles_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT registration_angles_near_command CHECK (abs(commanded_deg) < 1e6 AND abs(reached_deg - commanded_deg) < 6
    AND abs(half_reversal_deg) < 6),
  CONSTRAINT registration_angles_uncertainty CHECK (standard_uncertainty_deg >= 0 AND standard_uncertainty_deg < 10),
  CONSTRAINT registration_angles_influence CHECK (cardinality(pose_per_rad) IN (0, 6)
    AND NOT (pose_per_rad && ARRAY['NaN', 'Infinity', '-Infinity']::double precision[]))
);
CREATE INDEX registration_angles_by_characterisation ON registration_angles (characterisation_id);
COMMENT ON TABLE registration_angles IS
  'Where a registration applied axis tables: each angle of each such axis that its scans were taken at.';
COMMENT ON COLUMN registration_angles.reached_deg IS 'By the table, the mean of both ways.';
COMMENT ON COLUMN registration_angles.half_reversal_deg IS
  'Half of what coming forward differs from coming backward there; common to the angles of an axis.';
COMMENT ON COLUMN registration_angles.pose_per_rad IS
  'Change of the pose (rotation vector, mm; about reference_mm) per radian; empty where there is no pose.';

CREATE TRIGGER registration_angles_append_only BEFORE UPDATE OR DELETE ON registration_angles
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER registration_angles_no_truncate BEFORE TRUNCATE ON registration_angles
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();

-- Corrections from before this migration were for machines with A on the bed and B on A.
ALTER TABLE corrections ADD COLUMN axes text[] NOT NULL DEFAULT '{A,B}',
  ADD CONSTRAINT corrections_axes_two CHECK (cardinality(axes) = 2 AND array_position(axes, NULL) IS NULL
    AND axes[1] IN ('A', 'B', 'C') AND axes[2] IN ('A', 'B', 'C') AND axes[1] <> axes[2]);
COMMENT ON COLUMN corrections.axes IS 'The machine''s letters of what the groups call a (on the bed) and b (carried by it).';

ALTER TABLE correction_groups ADD COLUMN a_reached_deg double precision, ADD COLUMN b_reached_deg double precision,
  ADD CONSTRAINT correction_groups_reached CHECK ((a_reached_deg IS NULL) = (b_reached_deg IS NULL)
    AND abs(a_reached_deg - a_deg) < 6 AND abs(b_reached_deg - b_deg) < 6);
COMMENT ON COLUMN correction_groups.a_reached_deg IS
  'By the tables that the registration''s angles were taken with; NULL where none was applied.';
