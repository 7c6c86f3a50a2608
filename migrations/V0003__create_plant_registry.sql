-- What the plant owns: machines, artefacts, parts with their surfaces, blades. An id is one row for ever; what it stands for
-- is its revisions, which never change.

CREATE TABLE machines (
  machine_id text COLLATE "C" NOT NULL,
  CONSTRAINT machines_pk PRIMARY KEY (machine_id),
  CONSTRAINT machines_id_form CHECK (machine_id ~ '^[A-Za-z0-9._-]{1,64}$')
);
COMMENT ON TABLE machines IS 'Ids of machine tools; other areas refer to them.';

CREATE TABLE machine_revisions (
  machine_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  content_sha256 bytea NOT NULL,
  sensor_model text NOT NULL,
  sensor_noise_um double precision NOT NULL,
  sensor_column_count integer NOT NULL,
  sensor_mid_range_mm double precision NOT NULL,
  sensor_range_mm double precision NOT NULL,
  sensor_line_angle_deg double precision NOT NULL,
  nominal_centre_mm double precision[] NOT NULL,
  safety_translation_mm double precision NOT NULL,
  safety_rotation_deg double precision NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT machine_revisions_pk PRIMARY KEY (machine_id, revision),
  CONSTRAINT machine_revisions_record_once UNIQUE (record_id),
  CONSTRAINT machine_revisions_machine_fk FOREIGN KEY (machine_id) REFERENCES machines (machine_id),
  CONSTRAINT machine_revisions_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT machine_revisions_revision_positive CHECK (revision > 0),
  CONSTRAINT machine_revisions_sensor_positive CHECK (sensor_noise_um > 0 AND sensor_noise_um < 1e6
    AND sensor_column_count > 0 AND sensor_mid_range_mm > 0 AND sensor_mid_range_mm < 1e6 AND sensor_range_mm > 0
    AND sensor_range_mm < 1e6 AND sensor_line_angle_deg > 0 AND sensor_line_angle_deg < 180),
  CONSTRAINT machine_revisions_centre_finite CHECK (is_triple(nominal_centre_mm)),
  CONSTRAINT machine_revisions_safety_finite CHECK (safety_translation_mm >= 0 AND safety_translation_mm < 1e6
    AND safety_rotation_deg >= 0 AND safety_rotation_deg <= 180),
  CONSTRAINT machine_revisions_digests CHECK (octet_length(content_sha256) = 32),
  CONSTRAINT machine_revisions_texts CHECK (octet_length(sensor_model) <= 200),
  CONSTRAINT machine_revisions_nominal_centre_mm_whole CHECK (array_position(nominal_centre_mm, NULL) IS NULL)
);
COMMENT ON TABLE machine_revisions IS 'A machine as it was described at one time; results name the revision that they used.';
COMMENT ON COLUMN machine_revisions.content_sha256 IS 'Of the description as sent: the same again is the same revision.';
COMMENT ON COLUMN machine_revisions.nominal_centre_mm IS 'Nominal intersection of the rotary axes, machine frame.';
COMMENT ON COLUMN machine_revisions.safety_translation_mm IS 'A correction beyond the envelope waits for a person.';

CREATE TABLE machine_joints (
  machine_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  side text NOT NULL,
  position_index integer NOT NULL,
  axis text NOT NULL,
  kind text NOT NULL,
  direction double precision[] NOT NULL,
  point_mm double precision[],
  sign double precision NOT NULL,
  minimum double precision NOT NULL,
  maximum double precision NOT NULL,
  CONSTRAINT machine_joints_pk PRIMARY KEY (machine_id, revision, side, position_index),
  CONSTRAINT machine_joints_axis_once UNIQUE (machine_id, revision, axis),
  CONSTRAINT machine_joints_machine_fk FOREIGN KEY (machine_id, revision)
    REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT machine_joints_side_known CHECK (side IN ('part', 'tool')),
  CONSTRAINT machine_joints_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT machine_joints_axis_known CHECK (axis IN ('X', 'Y', 'Z', 'A', 'B', 'C')),
  CONSTRAINT machine_joints_kind_known CHECK (kind IN ('linear', 'rotary')),
  CONSTRAINT machine_joints_direction_unit CHECK (is_unit(direction)),
  CONSTRAINT machine_joints_point_finite CHECK (is_triple(point_mm)),
  CONSTRAINT machine_joints_point_of_rotary CHECK (kind = 'linear' OR point_mm IS NOT NULL),
  CONSTRAINT machine_joints_sign_one CHECK (sign IN (-1, 1)),
  CONSTRAINT machine_joints_limits_ordered CHECK (minimum > -1e7 AND minimum < maximum AND maximum < 1e7),
  CONSTRAINT machine_joints_direction_whole CHECK (array_position(direction, NULL) IS NULL),
  CONSTRAINT machine_joints_point_mm_whole CHECK (array_position(point_mm, NULL) IS NULL)
);
COMMENT ON TABLE machine_joints IS
  'Kinematics as data: from the bed to the part, and from the bed to the tool, at rest, machine frame.';
COMMENT ON COLUMN machine_joints.point_mm IS 'A point on the axis, for rotary joints.';
COMMENT ON COLUMN machine_joints.minimum IS 'Least command: mm for linear, degrees for rotary joints.';

CREATE TABLE artefacts (
  artefact_id text COLLATE "C" NOT NULL,
  CONSTRAINT artefacts_pk PRIMARY KEY (artefact_id),
  CONSTRAINT artefacts_id_form CHECK (artefact_id ~ '^[A-Za-z0-9._-]{1,64}$')
);
COMMENT ON TABLE artefacts IS 'Ids of calibration artefacts.';

CREATE TABLE artefact_revisions (
  artefact_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  content_sha256 bytea NOT NULL,
  side_mm double precision NOT NULL,
  cone_half_angle_deg double precision NOT NULL,
  cone_top_radius_mm double precision NOT NULL,
  cone_bottom_radius_mm double precision NOT NULL,
  slot_width_mm double precision NOT NULL,
  slot_depth_mm double precision NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT artefact_revisions_pk PRIMARY KEY (artefact_id, revision),
  CONSTRAINT artefact_revisions_record_once UNIQUE (record_id),
  CONSTRAINT artefact_revisions_artefact_fk FOREIGN KEY (artefact_id) REFERENCES artefacts (artefact_id),
  CONSTRAINT artefact_revisions_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT artefact_revisions_revision_positive CHECK (revision > 0),
  CONSTRAINT artefact_revisions_side_positive CHECK (side_mm > 0 AND side_mm < 1e4),
  CONSTRAINT artefact_revisions_cones_finite CHECK (cone_half_angle_deg >= 0 AND cone_half_angle_deg < 90
    AND cone_bottom_radius_mm >= 0 AND cone_top_radius_mm >= cone_bottom_radius_mm AND cone_top_radius_mm < 1e4),
  CONSTRAINT artefact_revisions_slots_finite CHECK (slot_width_mm >= 0 AND slot_width_mm < 1e4 AND slot_depth_mm >= 0
    AND slot_depth_mm < 1e4),
  CONSTRAINT artefact_revisions_digests CHECK (octet_length(content_sha256) = 32)
);
COMMENT ON TABLE artefact_revisions IS 'A plate side_mm x side_mm, its upper face z = 0, with cones and square slots in it.';

CREATE TABLE artefact_features (
  artefact_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  kind text NOT NULL,
  position_index integer NOT NULL,
  feature text NOT NULL,
  x_mm double precision NOT NULL,
  y_mm double precision NOT NULL,
  CONSTRAINT artefact_features_pk PRIMARY KEY (artefact_id, revision, kind, position_index),
  CONSTRAINT artefact_features_name_once UNIQUE (artefact_id, revision, feature),
  CONSTRAINT artefact_features_artefact_fk FOREIGN KEY (artefact_id, revision)
    REFERENCES artefact_revisions (artefact_id, revision),
  CONSTRAINT artefact_features_kind_known CHECK (kind IN ('cone', 'slot')),
  CONSTRAINT artefact_features_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT artefact_features_centre_finite CHECK (abs(x_mm) < 1e4 AND abs(y_mm) < 1e4),
  CONSTRAINT artefact_features_texts CHECK (octet_length(feature) <= 200)
);
COMMENT ON TABLE artefact_features IS 'Centres of cones and slots in the plane z = 0, artefact frame.';

CREATE TABLE tessellations (
  cad_sha256 bytea NOT NULL,
  method text NOT NULL,
  surface_sha256 bytea NOT NULL,
  triangle_count bigint NOT NULL,
  chordal_error_um double precision NOT NULL,
  closed boolean NOT NULL,
  minimum_mm double precision[] NOT NULL,
  maximum_mm double precision[] NOT NULL,
  software_version text NOT NULL,
  stored_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  degenerate_triangle_count bigint,
  open_rim_count bigint,
  open_rim_length_mm double precision,
  CONSTRAINT tessellations_pk PRIMARY KEY (cad_sha256, method),
  CONSTRAINT tessellations_cad_fk FOREIGN KEY (cad_sha256) REFERENCES blobs (sha256),
  CONSTRAINT tessellations_surface_fk FOREIGN KEY (surface_sha256) REFERENCES blobs (sha256),
  CONSTRAINT tessellations_method_named CHECK (method <> ''),
  CONSTRAINT tessellations_triangles_positive CHECK (triangle_count > 0),
  CONSTRAINT tessellations_error_finite CHECK (chordal_error_um >= 0 AND chordal_error_um < 1e6),
  CONSTRAINT tessellations_box_finite CHECK (is_triple(minimum_mm) AND is_triple(maximum_mm)),
  CONSTRAINT tessellations_software_named CHECK (software_version <> ''),
  CONSTRAINT tessellations_degenerate_of_all CHECK (degenerate_triangle_count BETWEEN 0 AND triangle_count),
  CONSTRAINT tessellations_rims_have_length CHECK (open_rim_count >= 0 AND open_rim_length_mm >= 0
    AND open_rim_length_mm < 1e12 AND (open_rim_count > 0 OR open_rim_length_mm = 0)),
  CONSTRAINT tessellations_digests CHECK (octet_length(cad_sha256) = 32 AND octet_length(surface_sha256) = 32),
  CONSTRAINT tessellations_texts CHECK (octet_length(method) <= 200 AND octet_length(software_version) <= 200),
  CONSTRAINT tessellations_minimum_mm_whole CHECK (array_position(minimum_mm, NULL) IS NULL),
  CONSTRAINT tessellations_maximum_mm_whole CHECK (array_position(maximum_mm, NULL) IS NULL)
);
CREATE INDEX tessellations_by_surface ON tessellations (surface_sha256);
COMMENT ON TABLE tessellations IS 'CAD files turned into triangles, so that the same CAD is not read twice.';
COMMENT ON COLUMN tessellations.method IS 'Format and parameters of the tessellation; another method is another row.';
COMMENT ON COLUMN tessellations.surface_sha256 IS 'Mesh bytes (metrology/surface/mesh_bytes.cc), a blob.';
COMMENT ON COLUMN tessellations.chordal_error_um IS 'Greatest distance measured between triangles and the true surface.';
COMMENT ON COLUMN tessellations.degenerate_triangle_count IS
  'Triangles without area, which are no part of the surface. NULL: not counted before this migration.';
COMMENT ON COLUMN tessellations.open_rim_count IS
  'Connected rims, along which the surface has one triangle only: a hole has one. NULL as above.';
COMMENT ON COLUMN tessellations.open_rim_length_mm IS 'Of all rims together. NULL as above.';

CREATE TABLE parts (
  part_id text COLLATE "C" NOT NULL,
  CONSTRAINT parts_pk PRIMARY KEY (part_id),
  CONSTRAINT parts_id_form CHECK (part_id ~ '^[A-Za-z0-9._-]{1,64}$')
);
COMMENT ON TABLE parts IS 'Ids of part models.';

CREATE TABLE part_revisions (
  part_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  content_sha256 bytea NOT NULL,
  cad_format text NOT NULL,
  cad_unit_mm double precision NOT NULL,
  cad_sha256 bytea NOT NULL,
  tessellation_method text NOT NULL,
  zero_from_part_nominal_rotation double precision[] NOT NULL,
  zero_from_part_nominal_translation_mm double precision[] NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT part_revisions_pk PRIMARY KEY (part_id, revision),
  CONSTRAINT part_revisions_record_once UNIQUE (record_id),
  CONSTRAINT part_revisions_part_fk FOREIGN KEY (part_id) REFERENCES parts (part_id),
  CONSTRAINT part_revisions_tessellation_fk FOREIGN KEY (cad_sha256, tessellation_method)
    REFERENCES tessellations (cad_sha256, method),
  CONSTRAINT part_revisions_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id)
    DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT part_revisions_revision_positive CHECK (revision > 0),
  CONSTRAINT part_revisions_format_known CHECK (cad_format IN ('step', 'iges', 'stl')),
  CONSTRAINT part_revisions_unit_finite CHECK (cad_unit_mm >= 0 AND cad_unit_mm <= 1e4),
  CONSTRAINT part_revisions_rotation_unit CHECK (cardinality(zero_from_part_nominal_rotation) = 9
    AND is_unit(zero_from_part_nominal_rotation[1:3]) AND is_unit(zero_from_part_nominal_rotation[4:6])
    AND is_unit(zero_from_part_nominal_rotation[7:9])),
  CONSTRAINT part_revisions_translation_finite CHECK (is_triple(zero_from_part_nominal_translation_mm)),
  CONSTRAINT part_revisions_digests CHECK (octet_length(content_sha256) = 32 AND octet_length(cad_sha256) = 32),
  CONSTRAINT part_revisions_zero_from_part_nominal_rotation_whole CHECK (array_position(zero_from_part_nominal_rotation,
      NULL) IS NULL),
  CONSTRAINT part_revisions_zero_from_part_nominal_translation_mm_whole CHECK
      (array_position(zero_from_part_nominal_translation_mm, NULL) IS NULL)
);
COMMENT ON TABLE part_revisions IS
  'A part model as it was at one time: its CAD, where it stands, its holes and datum points.';
COMMENT ON COLUMN part_revisions.cad_unit_mm IS 'Unit of an STL file; 0 where the CAD says its own.';
COMMENT ON COLUMN part_revisions.zero_from_part_nominal_rotation IS
  'Row-major 3 x 3. CAD millimetres to machine coordinates at A = B = 0.';

CREATE TABLE part_hole_groups (
  part_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  group_index integer NOT NULL,
  hole_group text NOT NULL,
  diameter_mm double precision NOT NULL,
  depth_mm double precision NOT NULL,
  a_nominal_deg double precision NOT NULL,
  b_nominal_deg double precision NOT NULL,
  axis_in_part double precision[] NOT NULL,
  position_tolerance_mm double precision NOT NULL,
  inclination_tolerance_deg double precision NOT NULL,
  CONSTRAINT part_hole_groups_pk PRIMARY KEY (part_id, revision, group_index),
  CONSTRAINT part_hole_groups_name_once UNIQUE (part_id, revision, hole_group),
  CONSTRAINT part_hole_groups_part_fk FOREIGN KEY (part_id, revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT part_hole_groups_sizes_positive CHECK (diameter_mm > 0 AND diameter_mm < 1e3 AND depth_mm > 0
    AND depth_mm < 1e4),
  CONSTRAINT part_hole_groups_angles_finite CHECK (abs(a_nominal_deg) <= 360 AND abs(b_nominal_deg) <= 360),
  CONSTRAINT part_hole_groups_axis_unit CHECK (is_unit(axis_in_part)),
  CONSTRAINT part_hole_groups_tolerances_positive CHECK (position_tolerance_mm > 0 AND position_tolerance_mm < 1e3
    AND inclination_tolerance_deg > 0 AND inclination_tolerance_deg <= 90),
  CONSTRAINT part_hole_groups_texts CHECK (octet_length(hole_group) <= 200),
  CONSTRAINT part_hole_groups_axis_in_part_whole CHECK (array_position(axis_in_part, NULL) IS NULL)
);
COMMENT ON TABLE part_hole_groups IS 'Holes that share an axis direction, and so one machining pose.';
COMMENT ON COLUMN part_hole_groups.axis_in_part IS 'Out of the part, along the holes.';

CREATE TABLE part_holes (
  part_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  group_index integer NOT NULL,
  hole_index integer NOT NULL,
  hole text NOT NULL,
  start_in_part_mm double precision[] NOT NULL,
  normal_in_part double precision[] NOT NULL,
  CONSTRAINT part_holes_pk PRIMARY KEY (part_id, revision, group_index, hole_index),
  CONSTRAINT part_holes_name_once UNIQUE (part_id, revision, group_index, hole),
  CONSTRAINT part_holes_group_fk FOREIGN KEY (part_id, revision, group_index)
    REFERENCES part_hole_groups (part_id, revision, group_index),
  CONSTRAINT part_holes_start_finite CHECK (is_triple(start_in_part_mm)),
  CONSTRAINT part_holes_normal_unit CHECK (is_unit(normal_in_part)),
  CONSTRAINT part_holes_texts CHECK (octet_length(hole) <= 200),
  CONSTRAINT part_holes_start_in_part_mm_whole CHECK (array_position(start_in_part_mm, NULL) IS NULL),
  CONSTRAINT part_holes_normal_in_part_whole CHECK (array_position(normal_in_part, NULL) IS NULL)
);
COMMENT ON TABLE part_holes IS 'Where each hole''s axis meets the surface, and the outward normal there; part frame.';

CREATE TABLE part_datum_points (
  part_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  datum_index integer NOT NULL,
  datum text NOT NULL,
  point_in_part_mm double precision[] NOT NULL,
  normal_in_part double precision[] NOT NULL,
  CONSTRAINT part_datum_points_pk PRIMARY KEY (part_id, revision, datum_index),
  CONSTRAINT part_datum_points_name_once UNIQUE (part_id, revision, datum),
  CONSTRAINT part_datum_points_part_fk FOREIGN KEY (part_id, revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT part_datum_points_six CHECK (datum_index BETWEEN 0 AND 5),
  CONSTRAINT part_datum_points_point_finite CHECK (is_triple(point_in_part_mm)),
  CONSTRAINT part_datum_points_normal_unit CHECK (is_unit(normal_in_part)),
  CONSTRAINT part_datum_points_texts CHECK (octet_length(datum) <= 200),
  CONSTRAINT part_datum_points_point_in_part_mm_whole CHECK (array_position(point_in_part_mm, NULL) IS NULL),
  CONSTRAINT part_datum_points_normal_in_part_whole CHECK (array_position(normal_in_part, NULL) IS NULL)
);
COMMENT ON TABLE part_datum_points IS 'The six points that locate the part, where it has them; part frame.';

CREATE TABLE blades (
  blade_serial text COLLATE "C" NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  record_id uuid NOT NULL,
  CONSTRAINT blades_pk PRIMARY KEY (blade_serial),
  CONSTRAINT blades_record_once UNIQUE (record_id),
  CONSTRAINT blades_part_fk FOREIGN KEY (part_id) REFERENCES parts (part_id),
  CONSTRAINT blades_record_fk FOREIGN KEY (record_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT blades_serial_form CHECK (blade_serial ~ '^[A-Za-z0-9._-]{1,64}$')
);
CREATE INDEX blades_by_part ON blades (part_id, blade_serial);
COMMENT ON TABLE blades IS 'Each real blade, by its serial number.';

SELECT make_append_only('machines');
SELECT make_append_only('machine_revisions');
SELECT make_append_only('machine_joints');
SELECT make_append_only('artefacts');
SELECT make_append_only('artefact_revisions');
SELECT make_append_only('artefact_features');
SELECT make_append_only('tessellations');
SELECT make_append_only('parts');
SELECT make_append_only('part_revisions');
SELECT make_append_only('part_hole_groups');
SELECT make_append_only('part_holes');
SELECT make_append_only('part_datum_points');
SELECT make_append_only('blades');
