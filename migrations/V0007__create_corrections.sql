-- The machining program moved onto the real blade: one row for each correction, its hole groups and their holes.

CREATE TABLE corrections (
  correction_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  registration_id uuid NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  sensor_calibration_id uuid NOT NULL,
  rotation_calibration_id uuid NOT NULL,
  nc_template_sha256 bytea,
  nc_program_sha256 bytea,
  release text NOT NULL,
  release_reasons text[] NOT NULL,
  envelope_translation_mm double precision NOT NULL,
  envelope_rotation_deg double precision NOT NULL,
  valid_until timestamptz NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  axes text[] NOT NULL DEFAULT '{A,B}',
  CONSTRAINT corrections_pk PRIMARY KEY (correction_id),
  CONSTRAINT corrections_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT corrections_registration_fk FOREIGN KEY (registration_id) REFERENCES record_names (record_id),
  CONSTRAINT corrections_machine_fk FOREIGN KEY (machine_id, machine_revision)
    REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT corrections_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT corrections_sensor_calibration_fk FOREIGN KEY (sensor_calibration_id) REFERENCES calibrations
      (calibration_id),
  CONSTRAINT corrections_rotation_calibration_fk FOREIGN KEY (rotation_calibration_id)
    REFERENCES calibrations (calibration_id),
  CONSTRAINT corrections_nc_template_fk FOREIGN KEY (nc_template_sha256) REFERENCES blobs (sha256),
  CONSTRAINT corrections_nc_program_fk FOREIGN KEY (nc_program_sha256) REFERENCES blobs (sha256),
  CONSTRAINT corrections_record_fk FOREIGN KEY (correction_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT corrections_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0),
  CONSTRAINT corrections_release_known CHECK (release IN ('AUTOMATIC', 'AWAITING_PERSON')),
  CONSTRAINT corrections_release_reasoned CHECK ((release = 'AWAITING_PERSON') = (cardinality(release_reasons) > 0)
    AND array_position(release_reasons, NULL) IS NULL),
  CONSTRAINT corrections_program_from_template CHECK (nc_program_sha256 IS NULL OR nc_template_sha256 IS NOT NULL),
  CONSTRAINT corrections_no_program_unreleased CHECK (nc_program_sha256 IS NULL OR release = 'AUTOMATIC'),
  CONSTRAINT corrections_envelope_positive CHECK (envelope_translation_mm > 0 AND envelope_translation_mm < 1e6
    AND envelope_rotation_deg > 0 AND envelope_rotation_deg <= 360),
  CONSTRAINT corrections_validity_finite CHECK (isfinite(valid_until)),
  CONSTRAINT corrections_software_named CHECK (software_version <> ''),
  CONSTRAINT corrections_axes_two CHECK (cardinality(axes) = 2 AND array_position(axes, NULL) IS NULL
    AND axes[1] IN ('A', 'B', 'C') AND axes[2] IN ('A', 'B', 'C') AND axes[1] <> axes[2]),
  CONSTRAINT corrections_requested_by_length CHECK (octet_length(requested_by) <= 200),
  CONSTRAINT corrections_digests CHECK (octet_length(nc_template_sha256) = 32 AND octet_length(nc_program_sha256) = 32),
  CONSTRAINT corrections_texts CHECK (octet_length(software_version) <= 200),
  CONSTRAINT corrections_release_reasons_whole CHECK (array_position(release_reasons, NULL) IS NULL
    AND cardinality(release_reasons) <= 1000),
  CONSTRAINT corrections_axes_whole CHECK (array_position(axes, NULL) IS NULL AND cardinality(axes) <= 1000)
) PARTITION BY RANGE (correction_id);
CREATE INDEX corrections_by_registration ON corrections (registration_id);
CREATE INDEX corrections_by_nc_template ON corrections (nc_template_sha256);
CREATE INDEX corrections_by_nc_program ON corrections (nc_program_sha256);
COMMENT ON TABLE corrections IS 'Made from a converged registration whose calibrations were in force at the time.';
COMMENT ON COLUMN corrections.machine_revision IS 'Whose kinematics, limits and safety envelope were used.';
COMMENT ON COLUMN corrections.nc_program_sha256 IS
  'The template with its coordinates replaced; none without a template or while a person''s release is awaited.';
COMMENT ON COLUMN corrections.envelope_translation_mm IS 'How far a start may move without a person''s release.';
COMMENT ON COLUMN corrections.valid_until IS 'The program must not be used after this: the calibrations'' validity ends.';
COMMENT ON COLUMN corrections.axes IS 'The machine''s letters of what the groups call a (on the bed) and b (carried by it).';

CREATE TABLE correction_groups (
  correction_id uuid NOT NULL,
  position_index integer NOT NULL,
  group_name text NOT NULL,
  a_deg double precision NOT NULL,
  b_deg double precision NOT NULL,
  a_nominal_deg double precision NOT NULL,
  b_nominal_deg double precision NOT NULL,
  a_ideal_deg double precision NOT NULL,
  b_ideal_deg double precision NOT NULL,
  a_standard_uncertainty_deg double precision NOT NULL,
  b_standard_uncertainty_deg double precision NOT NULL,
  a_reached_deg double precision,
  b_reached_deg double precision,
  CONSTRAINT correction_groups_pk PRIMARY KEY (correction_id, position_index),
  CONSTRAINT correction_groups_once UNIQUE (correction_id, group_name),
  CONSTRAINT correction_groups_correction_fk FOREIGN KEY (correction_id) REFERENCES corrections (correction_id),
  CONSTRAINT correction_groups_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT correction_groups_angles_finite CHECK (abs(a_deg) < 1e6 AND abs(b_deg) < 1e6 AND abs(a_nominal_deg) < 1e6
    AND abs(b_nominal_deg) < 1e6 AND abs(a_ideal_deg) < 1e6 AND abs(b_ideal_deg) < 1e6),
  CONSTRAINT correction_groups_uncertainty_finite CHECK (a_standard_uncertainty_deg >= 0 AND a_standard_uncertainty_deg <
      360
    AND b_standard_uncertainty_deg >= 0 AND b_standard_uncertainty_deg < 360),
  CONSTRAINT correction_groups_reached CHECK ((a_reached_deg IS NULL) = (b_reached_deg IS NULL)
    AND abs(a_reached_deg - a_deg) < 6 AND abs(b_reached_deg - b_deg) < 6),
  CONSTRAINT correction_groups_texts CHECK (octet_length(group_name) <= 200)
) PARTITION BY RANGE (correction_id);
COMMENT ON TABLE correction_groups IS 'The machining pose of each hole group, corrected beside nominal.';
COMMENT ON COLUMN correction_groups.a_deg IS 'On the identified axes; a_ideal_deg on the machine''s nominal ones.';
COMMENT ON COLUMN correction_groups.a_reached_deg IS
  'By the tables that the registration''s angles were taken with; NULL where none was applied.';

CREATE TABLE correction_holes (
  correction_id uuid NOT NULL,
  group_name text NOT NULL,
  position_index integer NOT NULL,
  hole_name text NOT NULL,
  start_x_mm double precision NOT NULL,
  start_y_mm double precision NOT NULL,
  start_z_mm double precision NOT NULL,
  nominal_start_x_mm double precision NOT NULL,
  nominal_start_y_mm double precision NOT NULL,
  nominal_start_z_mm double precision NOT NULL,
  expanded_uncertainty_um double precision NOT NULL,
  CONSTRAINT correction_holes_pk PRIMARY KEY (correction_id, group_name, position_index),
  CONSTRAINT correction_holes_once UNIQUE (correction_id, group_name, hole_name),
  CONSTRAINT correction_holes_group_fk FOREIGN KEY (correction_id, group_name)
    REFERENCES correction_groups (correction_id, group_name),
  CONSTRAINT correction_holes_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT correction_holes_starts_finite CHECK (abs(start_x_mm) < 1e6 AND abs(start_y_mm) < 1e6 AND abs(start_z_mm) <
      1e6
    AND abs(nominal_start_x_mm) < 1e6 AND abs(nominal_start_y_mm) < 1e6 AND abs(nominal_start_z_mm) < 1e6),
  CONSTRAINT correction_holes_uncertainty_finite CHECK (expanded_uncertainty_um >= 0 AND expanded_uncertainty_um < 1e9),
  CONSTRAINT correction_holes_texts CHECK (octet_length(hole_name) <= 200)
) PARTITION BY RANGE (correction_id);
COMMENT ON TABLE correction_holes IS
  'Starts in machine coordinates with the part turned to the group''s A, B; the hole then points along machine Z.';
COMMENT ON COLUMN correction_holes.expanded_uncertainty_um IS
  '95 % of the distances between this start and the true one lie below it.';

SELECT make_append_only('corrections');
SELECT make_append_only('correction_groups');
SELECT make_append_only('correction_holes');
