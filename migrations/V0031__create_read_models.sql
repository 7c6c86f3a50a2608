-- What programs of the plant's owner read by SQL: views of their own, apart from the tables, so that these may change. Names and meanings
-- of read_v1 stay; it may grow columns at the end of a view, and views. What cannot be so is read_v2, beside it (docs/adr/0046).

-- Who reads is a login of sixpoint_reader. It has no right to a table, nor a way to name anything that is not in read_v1: functions that
-- run as the owner are everybody's to call, unless their schema is not.
DO $$
DECLARE
  service text;
BEGIN
  BEGIN
    IF NOT EXISTS (SELECT 1 FROM pg_roles WHERE rolname = 'sixpoint_reader') THEN
      CREATE ROLE sixpoint_reader NOLOGIN;
    END IF;
  EXCEPTION
    WHEN duplicate_object OR unique_violation THEN NULL;  -- another database of this server, at the same moment
    WHEN insufficient_privilege THEN
      RAISE EXCEPTION 'role sixpoint_reader: missing, want CREATE ROLE sixpoint_reader NOLOGIN by an administrator'
        USING ERRCODE = 'insufficient_privilege';
  END;
  FOR service IN SELECT rolname FROM pg_roles WHERE rolname LIKE 'sixpoint\_%' AND rolname <> 'sixpoint_reader' LOOP
    EXECUTE format('GRANT USAGE ON SCHEMA public TO %I', service);
  END LOOP;
  REVOKE USAGE ON SCHEMA public FROM PUBLIC;
END
$$;

CREATE SCHEMA read_v1;
COMMENT ON SCHEMA read_v1 IS 'The record for programs that read SQL. Names and meanings stay; columns and views may be added.';
GRANT USAGE ON SCHEMA read_v1 TO sixpoint_reader;

-- The login itself, whatever role it has taken on since.
CREATE FUNCTION hidden_from_reader() RETURNS text[]
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT hidden_parts('readers/' || session_user)
$$;
COMMENT ON FUNCTION hidden_from_reader() IS
  'Of which parts the login of this session may see nothing: readers/LOGIN is cleared as users and machines are (docs/adr/0028).';

-- A name that was written before there were pseudonyms leaves the plant no more than one that is known.
CREATE FUNCTION asker_for_reader(asker text) RETURNS text LANGUAGE sql IMMUTABLE AS $$
  SELECT CASE WHEN asker LIKE 'users/%' THEN regexp_replace(asker, '^users/[^ ]+', 'users/*') ELSE asker END
$$;
COMMENT ON FUNCTION asker_for_reader(text) IS
  'Who asked, of a person the pseudonym: a name that was copied into another database could not be forgotten.';

CREATE VIEW read_v1.machines WITH (security_barrier) AS
  SELECT m.machine_id, m.revision,
         NOT EXISTS (SELECT 1 FROM machine_revisions later WHERE later.machine_id = m.machine_id AND later.revision > m.revision)
           AS is_newest,
         n.record_sequence, n.recorded_at, m.sensor_model, m.sensor_serial_number, m.sensor_kind, m.touch_probe_serial_number,
         m.touch_probe_expires_at
  FROM machine_revisions m JOIN record_names n ON n.record_id = m.record_id;
COMMENT ON VIEW read_v1.machines IS 'Machine tools, one row for each revision of what is known of one.';
COMMENT ON COLUMN read_v1.machines.machine_id IS 'The id in machines/{id}.';
COMMENT ON COLUMN read_v1.machines.revision IS 'Counts from 1; results name the revision that they used.';
COMMENT ON COLUMN read_v1.machines.is_newest IS 'No later revision is recorded.';
COMMENT ON COLUMN read_v1.machines.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.machines.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.machines.sensor_model IS 'Of its scanner.';
COMMENT ON COLUMN read_v1.machines.sensor_serial_number IS 'Of its scanner; NULL: not stated.';
COMMENT ON COLUMN read_v1.machines.sensor_kind IS 'LINE or SNAPSHOT; NULL: not stated.';
COMMENT ON COLUMN read_v1.machines.touch_probe_serial_number IS 'NULL: no touch probe is stated.';
COMMENT ON COLUMN read_v1.machines.touch_probe_expires_at IS 'When its certificate ends; NULL: none is stated.';

CREATE VIEW read_v1.parts WITH (security_barrier) AS
  SELECT p.part_id, p.revision,
         NOT EXISTS (SELECT 1 FROM part_revisions later WHERE later.part_id = p.part_id AND later.revision > p.revision) AS is_newest,
         n.record_sequence, n.recorded_at,
         (SELECT r.customer_id FROM restricted_parts r WHERE r.part_id = p.part_id) AS customer_id, p.cad_format,
         encode(p.cad_sha256, 'hex') AS cad_sha256,
         (SELECT count(*) FROM part_holes h WHERE h.part_id = p.part_id AND h.revision = p.revision) AS hole_count
  FROM part_revisions p JOIN record_names n ON n.record_id = p.record_id
  WHERE p.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.parts IS 'Part models, one row for each revision; those of customers for whom the login is cleared.';
COMMENT ON COLUMN read_v1.parts.part_id IS 'The id in parts/{id}.';
COMMENT ON COLUMN read_v1.parts.revision IS 'Counts from 1; results name the revision that they used.';
COMMENT ON COLUMN read_v1.parts.is_newest IS 'No later revision is recorded.';
COMMENT ON COLUMN read_v1.parts.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.parts.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.parts.customer_id IS 'Whose part it is; NULL: nobody''s.';
COMMENT ON COLUMN read_v1.parts.cad_format IS 'step, iges or stl.';
COMMENT ON COLUMN read_v1.parts.cad_sha256 IS 'Of the CAD file''s bytes, in hexadecimal.';
COMMENT ON COLUMN read_v1.parts.hole_count IS 'Of all hole groups.';

CREATE VIEW read_v1.blades WITH (security_barrier) AS
  SELECT b.blade_serial, b.part_id, n.record_sequence, n.recorded_at
  FROM blades b JOIN record_names n ON n.record_id = b.record_id
  WHERE b.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.blades IS 'Each real blade.';
COMMENT ON COLUMN read_v1.blades.blade_serial IS 'The serial number in blades/{serial}.';
COMMENT ON COLUMN read_v1.blades.part_id IS 'Of which part model it is.';
COMMENT ON COLUMN read_v1.blades.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.blades.recorded_at IS 'When it was registered, by the database''s clock.';

CREATE VIEW read_v1.scans WITH (security_barrier) AS
  SELECT s.scan_id, s.kind, s.machine_id, s.machine_revision, s.blade_serial, b.part_id, s.artefact_id, s.artefact_revision,
         n.record_sequence, n.recorded_at, s.measured_at, s.point_count, s.stored_bytes, s.sensor_serial_number, s.clamping,
         s.subject_temperature_c, s.a_deg, s.b_deg,
         CASE WHEN EXISTS (SELECT 1 FROM scan_deletions d WHERE d.scan_key = s.scan_key) THEN 'POINTS_DELETED' ELSE 'KEPT' END AS state
  FROM scans s JOIN record_names n ON n.record_id = s.scan_key LEFT JOIN blades b ON b.blade_serial = s.blade_serial
  WHERE s.blade_serial IS NULL OR b.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.scans IS 'Scans of blades and of artefacts, without their points.';
COMMENT ON COLUMN read_v1.scans.scan_id IS 'The id in scans/{id}, as the machine gave it.';
COMMENT ON COLUMN read_v1.scans.kind IS 'artefact, arm, airfoil, local or pins.';
COMMENT ON COLUMN read_v1.scans.machine_id IS 'On which machine.';
COMMENT ON COLUMN read_v1.scans.machine_revision IS 'As it was described then.';
COMMENT ON COLUMN read_v1.scans.blade_serial IS 'Of which blade; NULL: of an artefact.';
COMMENT ON COLUMN read_v1.scans.part_id IS 'Of the blade.';
COMMENT ON COLUMN read_v1.scans.artefact_id IS 'Of which artefact; NULL: of a blade.';
COMMENT ON COLUMN read_v1.scans.artefact_revision IS 'NULL: of a blade.';
COMMENT ON COLUMN read_v1.scans.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.scans.recorded_at IS 'When it was complete, by the database''s clock.';
COMMENT ON COLUMN read_v1.scans.measured_at IS 'When it began, by the machine''s clock; NULL: not told.';
COMMENT ON COLUMN read_v1.scans.point_count IS 'Points.';
COMMENT ON COLUMN read_v1.scans.stored_bytes IS 'Bytes, as stored.';
COMMENT ON COLUMN read_v1.scans.sensor_serial_number IS 'As the scan states it; NULL: that of its machine''s revision.';
COMMENT ON COLUMN read_v1.scans.clamping IS 'Another name with every clamping; NULL: not known.';
COMMENT ON COLUMN read_v1.scans.subject_temperature_c IS 'Degrees Celsius; NULL: not stated.';
COMMENT ON COLUMN read_v1.scans.a_deg IS 'Degrees, of the rotary axis A as commanded.';
COMMENT ON COLUMN read_v1.scans.b_deg IS 'Degrees, of the rotary axis B as commanded.';
COMMENT ON COLUMN read_v1.scans.state IS 'KEPT, or POINTS_DELETED: the values stay.';

CREATE VIEW read_v1.calibrations WITH (security_barrier) AS
  SELECT c.calibration_id, c.kind, c.axis, c.machine_id, c.method, n.record_sequence, n.recorded_at, c.valid_from, c.valid_until,
         calibration_state(c.calibration_id, statement_timestamp()) AS state,
         (SELECT r.recorded_at FROM calibration_events e JOIN record_names r ON r.record_id = e.record_id
          WHERE e.calibration_id = c.calibration_id AND e.event = 'RELEASED') AS released_at,
         (SELECT w.recorded_at FROM calibration_events e JOIN record_names w ON w.record_id = e.record_id
          WHERE e.calibration_id = c.calibration_id AND e.event = 'WITHDRAWN') AS withdrawn_at,
         c.temperature_c, coalesce(s.residual_rms_um, r.residual_rms_um) AS residual_rms_um,
         s.t_sm_mm[1] AS sensor_x_mm, s.t_sm_mm[2] AS sensor_y_mm, s.t_sm_mm[3] AS sensor_z_mm,
         s.alpha_deg AS sensor_alpha_deg, s.beta_deg AS sensor_beta_deg, s.gamma_deg AS sensor_gamma_deg,
         r.point_c_mm[1] AS point_c_x_mm, r.point_c_mm[2] AS point_c_y_mm, r.point_c_mm[3] AS point_c_z_mm,
         asker_for_reader(c.requested_by) AS requested_by, c.software_version
  FROM calibrations c JOIN record_names n ON n.record_id = c.calibration_id
  LEFT JOIN sensor_calibrations s ON s.calibration_id = c.calibration_id
  LEFT JOIN rotation_calibrations r ON r.calibration_id = c.calibration_id;
COMMENT ON VIEW read_v1.calibrations IS 'Calibrations of all kinds with what has become of them, and those of their figures that drift.';
COMMENT ON COLUMN read_v1.calibrations.calibration_id IS 'The id in calibrations/{id}.';
COMMENT ON COLUMN read_v1.calibrations.kind IS 'sensor, rotation, probe or axis.';
COMMENT ON COLUMN read_v1.calibrations.axis IS 'Of kind axis: A, B or C; NULL of the others.';
COMMENT ON COLUMN read_v1.calibrations.machine_id IS 'Of which machine.';
COMMENT ON COLUMN read_v1.calibrations.method IS 'How it was computed.';
COMMENT ON COLUMN read_v1.calibrations.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.calibrations.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.calibrations.valid_from IS 'From when it holds.';
COMMENT ON COLUMN read_v1.calibrations.valid_until IS 'The first moment at which it no longer holds.';
COMMENT ON COLUMN read_v1.calibrations.state IS
  'Now: DRAFT, NOT_YET_VALID, IN_FORCE, SUPERSEDED, EXPIRED or WITHDRAWN. Follows the clock: it changes without a row.';
COMMENT ON COLUMN read_v1.calibrations.released_at IS 'When a person released it; NULL: nobody did, or it was no draft.';
COMMENT ON COLUMN read_v1.calibrations.withdrawn_at IS 'When a person withdrew it; NULL: nobody did.';
COMMENT ON COLUMN read_v1.calibrations.temperature_c IS 'Degrees Celsius at the measurement; NULL: not stated.';
COMMENT ON COLUMN read_v1.calibrations.residual_rms_um IS 'Micrometres, of sensor and rotation; NULL of the others.';
COMMENT ON COLUMN read_v1.calibrations.sensor_x_mm IS 'Millimetres along machine X of where the sensor''s origin is mapped to; NULL but of kind sensor, as the next five.';
COMMENT ON COLUMN read_v1.calibrations.sensor_y_mm IS 'Millimetres along machine Y.';
COMMENT ON COLUMN read_v1.calibrations.sensor_z_mm IS 'Millimetres along machine Z.';
COMMENT ON COLUMN read_v1.calibrations.sensor_alpha_deg IS 'Degrees, turn of the sensor about machine X.';
COMMENT ON COLUMN read_v1.calibrations.sensor_beta_deg IS 'Degrees, turn of the sensor about machine Y.';
COMMENT ON COLUMN read_v1.calibrations.sensor_gamma_deg IS 'Degrees, turn of the sensor about machine Z.';
COMMENT ON COLUMN read_v1.calibrations.point_c_x_mm IS 'Millimetres, of the point of the carrying axis that is nearest to the other, machine X; NULL but of kind rotation, as the next two.';
COMMENT ON COLUMN read_v1.calibrations.point_c_y_mm IS 'Millimetres, machine Y.';
COMMENT ON COLUMN read_v1.calibrations.point_c_z_mm IS 'Millimetres, machine Z.';
COMMENT ON COLUMN read_v1.calibrations.requested_by IS 'Who asked for it; persons by their pseudonyms.';
COMMENT ON COLUMN read_v1.calibrations.software_version IS 'Which release computed it.';

CREATE VIEW read_v1.registrations WITH (security_barrier) AS
  SELECT g.registration_id, g.blade_serial, g.part_id, g.part_revision, g.machine_id, g.machine_revision, n.record_sequence,
         n.recorded_at, g.method, g.outcome, g.sensor_calibration_id, g.rotation_calibration_id, g.point_count, g.points_used,
         g.residual_sigma_um, g.condition_number, g.weakest_standard_uncertainty_um, g.disagreement_um, g.disagrees,
         g.for_inspection, g.clamping, g.compute_seconds AS compute_s, asker_for_reader(g.requested_by) AS requested_by,
         g.software_version
  FROM registrations g JOIN record_names n ON n.record_id = g.registration_id
  WHERE g.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.registrations IS 'Where blades were found to stand, and fits that did not converge.';
COMMENT ON COLUMN read_v1.registrations.registration_id IS 'The id in registrations/{id}.';
COMMENT ON COLUMN read_v1.registrations.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.registrations.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.registrations.part_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.registrations.machine_id IS 'On which machine.';
COMMENT ON COLUMN read_v1.registrations.machine_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.registrations.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.registrations.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.registrations.method IS 'BEST_FIT, LOCAL, SIX_POINT, SIX_POINT_NORMALS or ALLOWANCE.';
COMMENT ON COLUMN read_v1.registrations.outcome IS 'CONVERGED, NOT_CONVERGED, NOT_DETERMINED, TOO_LITTLE_OVERLAP or INFEASIBLE.';
COMMENT ON COLUMN read_v1.registrations.sensor_calibration_id IS 'By which the scans were mapped.';
COMMENT ON COLUMN read_v1.registrations.rotation_calibration_id IS 'By which the rotary axes turned them.';
COMMENT ON COLUMN read_v1.registrations.point_count IS 'Points looked at.';
COMMENT ON COLUMN read_v1.registrations.points_used IS 'Points that the fit kept.';
COMMENT ON COLUMN read_v1.registrations.residual_sigma_um IS 'Micrometres, robust.';
COMMENT ON COLUMN read_v1.registrations.condition_number IS 'Of the fit: how unevenly the points hold the pose.';
COMMENT ON COLUMN read_v1.registrations.weakest_standard_uncertainty_um IS 'Micrometres, along the direction that the points hold least.';
COMMENT ON COLUMN read_v1.registrations.disagreement_um IS 'Micrometres between this pose and the best fit of the same scans; NULL: not compared.';
COMMENT ON COLUMN read_v1.registrations.disagrees IS 'Beyond what their uncertainties explain; NULL: not compared.';
COMMENT ON COLUMN read_v1.registrations.for_inspection IS 'Made by an inspection for its verdict.';
COMMENT ON COLUMN read_v1.registrations.clamping IS 'As the machine calls it; NULL: not stated.';
COMMENT ON COLUMN read_v1.registrations.compute_s IS 'Seconds that it took.';
COMMENT ON COLUMN read_v1.registrations.requested_by IS 'Who asked for it; persons by their pseudonyms.';
COMMENT ON COLUMN read_v1.registrations.software_version IS 'Which release computed it.';

CREATE VIEW read_v1.corrections WITH (security_barrier) AS
  SELECT c.correction_id, c.registration_id, c.blade_serial, c.part_id, c.part_revision, c.machine_id, c.machine_revision,
         n.record_sequence, n.recorded_at, c.release, correction_state(c.correction_id) AS state, c.valid_until,
         coalesce(c.nc_program_sha256, c.nc_held_sha256) IS NOT NULL AS has_program, c.sensor_calibration_id,
         c.rotation_calibration_id, c.clamping, asker_for_reader(c.requested_by) AS requested_by, c.software_version
  FROM corrections c JOIN record_names n ON n.record_id = c.correction_id
  WHERE c.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.corrections IS 'Machining programs moved onto real blades, and what has become of each.';
COMMENT ON COLUMN read_v1.corrections.correction_id IS 'The id in corrections/{id}.';
COMMENT ON COLUMN read_v1.corrections.registration_id IS 'By which pose.';
COMMENT ON COLUMN read_v1.corrections.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.corrections.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.corrections.part_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.corrections.machine_id IS 'For which machine.';
COMMENT ON COLUMN read_v1.corrections.machine_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.corrections.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.corrections.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.corrections.release IS 'What the gate said when it was made: AUTOMATIC or AWAITING_PERSON.';
COMMENT ON COLUMN read_v1.corrections.state IS
  'Now: DRAFT, RELEASED, REFUSED, SUPERSEDED, EXPIRED, WITHDRAWN or CUT. Follows the clock: it changes without a row. The one column that costs: a tenth of a millisecond a row and more.';
COMMENT ON COLUMN read_v1.corrections.valid_until IS 'The program must not be used after this.';
COMMENT ON COLUMN read_v1.corrections.has_program IS 'A template was given, and a program made.';
COMMENT ON COLUMN read_v1.corrections.sensor_calibration_id IS 'By which the scans were mapped.';
COMMENT ON COLUMN read_v1.corrections.rotation_calibration_id IS 'By which the rotary axes were taken.';
COMMENT ON COLUMN read_v1.corrections.clamping IS 'As the machine calls it; NULL: not stated.';
COMMENT ON COLUMN read_v1.corrections.requested_by IS 'Who asked for it; persons by their pseudonyms.';
COMMENT ON COLUMN read_v1.corrections.software_version IS 'Which release computed it.';

CREATE VIEW read_v1.correction_holes WITH (security_barrier) AS
  SELECT c.correction_id, c.blade_serial, c.part_id, h.group_name AS hole_group, h.hole_name AS hole, h.start_x_mm, h.start_y_mm,
         h.start_z_mm, h.nominal_start_x_mm, h.nominal_start_y_mm, h.nominal_start_z_mm, h.expanded_uncertainty_um,
         EXISTS (SELECT 1 FROM correction_cuts k WHERE k.correction_id = h.correction_id AND k.group_name = h.group_name
                 AND k.hole_name = h.hole_name) AS is_cut
  FROM correction_holes h JOIN corrections c ON c.correction_id = h.correction_id
  WHERE c.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.correction_holes IS 'Each hole of each correction, in machine coordinates with the part turned to the group''s angles.';
COMMENT ON COLUMN read_v1.correction_holes.correction_id IS 'Of which correction.';
COMMENT ON COLUMN read_v1.correction_holes.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.correction_holes.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.correction_holes.hole_group IS 'The hole''s group, by the part''s name for it.';
COMMENT ON COLUMN read_v1.correction_holes.hole IS 'The hole, by the part''s name for it.';
COMMENT ON COLUMN read_v1.correction_holes.start_x_mm IS 'Millimetres: where it is to begin.';
COMMENT ON COLUMN read_v1.correction_holes.start_y_mm IS 'Millimetres.';
COMMENT ON COLUMN read_v1.correction_holes.start_z_mm IS 'Millimetres.';
COMMENT ON COLUMN read_v1.correction_holes.nominal_start_x_mm IS 'Millimetres: where it would begin if the blade stood as drawn.';
COMMENT ON COLUMN read_v1.correction_holes.nominal_start_y_mm IS 'Millimetres.';
COMMENT ON COLUMN read_v1.correction_holes.nominal_start_z_mm IS 'Millimetres.';
COMMENT ON COLUMN read_v1.correction_holes.expanded_uncertainty_um IS 'Micrometres: 95 % of the distances from the true start lie below it.';
COMMENT ON COLUMN read_v1.correction_holes.is_cut IS 'The machine reported it cut by this correction.';

CREATE VIEW read_v1.inspections WITH (security_barrier) AS
  SELECT i.inspection_id, i.registration_id, i.blade_serial, i.part_id, i.part_revision, i.machine_id, i.machine_revision,
         n.record_sequence, n.recorded_at, i.verdict, i.decision_rule, i.method, i.rejudges AS rejudged_inspection_id,
         i.sensor_calibration_id, i.rotation_calibration_id, i.deviation_minimum_um, i.deviation_p05_um, i.deviation_p50_um,
         i.deviation_p95_um, i.deviation_maximum_um, i.deviation_rms_um, i.positioning_disagrees,
         asker_for_reader(i.requested_by) AS requested_by, i.software_version
  FROM inspections i JOIN record_names n ON n.record_id = i.inspection_id
  WHERE i.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.inspections IS 'Verdicts on machined blades. A blade that was judged again has more than one: the last by record_sequence counts.';
COMMENT ON COLUMN read_v1.inspections.inspection_id IS 'The id in inspections/{id}.';
COMMENT ON COLUMN read_v1.inspections.registration_id IS 'The pose that it rests on.';
COMMENT ON COLUMN read_v1.inspections.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.inspections.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.inspections.part_revision IS 'The revision whose tolerances were used.';
COMMENT ON COLUMN read_v1.inspections.machine_id IS 'On which machine it was scanned.';
COMMENT ON COLUMN read_v1.inspections.machine_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.inspections.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.inspections.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.inspections.verdict IS 'The worst of its holes: CONFORM, UNDECIDABLE, NOT_MEASURED or NOT_CONFORM.';
COMMENT ON COLUMN read_v1.inspections.decision_rule IS 'By which verdicts were made.';
COMMENT ON COLUMN read_v1.inspections.method IS 'How the scans were positioned: BEST_FIT, LOCAL, SIX_POINT or SIX_POINT_NORMALS.';
COMMENT ON COLUMN read_v1.inspections.rejudged_inspection_id IS 'The inspection whose scans this one judges anew; NULL: none.';
COMMENT ON COLUMN read_v1.inspections.sensor_calibration_id IS 'By which the scans were mapped.';
COMMENT ON COLUMN read_v1.inspections.rotation_calibration_id IS 'By which the rotary axes turned them.';
COMMENT ON COLUMN read_v1.inspections.deviation_minimum_um IS 'Micrometres of the points from the CAD, positive outside, as the next four.';
COMMENT ON COLUMN read_v1.inspections.deviation_p05_um IS 'Micrometres: 5 % of the points lie below.';
COMMENT ON COLUMN read_v1.inspections.deviation_p50_um IS 'Micrometres: the median.';
COMMENT ON COLUMN read_v1.inspections.deviation_p95_um IS 'Micrometres: 95 % of the points lie below.';
COMMENT ON COLUMN read_v1.inspections.deviation_maximum_um IS 'Micrometres.';
COMMENT ON COLUMN read_v1.inspections.deviation_rms_um IS 'Micrometres, root mean square.';
COMMENT ON COLUMN read_v1.inspections.positioning_disagrees IS 'Other positionings of the same scans lie elsewhere than their uncertainties explain.';
COMMENT ON COLUMN read_v1.inspections.requested_by IS 'Who asked for it; persons by their pseudonyms.';
COMMENT ON COLUMN read_v1.inspections.software_version IS 'Which release computed it.';

CREATE VIEW read_v1.characteristics WITH (security_barrier) AS
  SELECT i.blade_serial, h.group_name || '/' || h.hole_name || '/' || v.kind AS characteristic, h.group_name AS hole_group,
         h.hole_name AS hole, v.kind, v.unit, v.value, v.nominal, v.lower_limit, v.upper_limit, v.expanded_uncertainty, v.verdict,
         i.method, i.inspection_id, i.part_id, i.part_revision, i.machine_id, i.machine_revision, n.record_sequence, n.recorded_at,
         NULL::text AS drawing_characteristic
  FROM inspections i JOIN record_names n ON n.record_id = i.inspection_id
  JOIN inspection_holes h ON h.inspection_id = i.inspection_id
  CROSS JOIN LATERAL (VALUES
    ('position', 'mm', h.position_error_mm, 0::double precision, NULL::double precision, h.position_tolerance_mm,
     h.position_expanded_uncertainty_um / 1000, h.position_verdict),
    ('inclination', 'deg', h.inclination_error_deg, 0, NULL, h.inclination_tolerance_deg,
     h.inclination_expanded_uncertainty_deg, h.inclination_verdict))
    AS v (kind, unit, value, nominal, lower_limit, upper_limit, expanded_uncertainty, verdict)
  WHERE i.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.characteristics IS 'One row a value: what was measured of one characteristic of one blade, once for each inspection.';
COMMENT ON COLUMN read_v1.characteristics.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.characteristics.characteristic IS 'GROUP/HOLE/position or GROUP/HOLE/inclination, as ValueService calls it.';
COMMENT ON COLUMN read_v1.characteristics.hole_group IS 'The hole''s group, by the part''s name for it.';
COMMENT ON COLUMN read_v1.characteristics.hole IS 'The hole, by the part''s name for it.';
COMMENT ON COLUMN read_v1.characteristics.kind IS 'position: how far the hole''s start is from its nominal. inclination: how far its axis is turned.';
COMMENT ON COLUMN read_v1.characteristics.unit IS 'Of all figures of the row: mm or deg.';
COMMENT ON COLUMN read_v1.characteristics.value IS 'In unit; NULL: not measured.';
COMMENT ON COLUMN read_v1.characteristics.nominal IS 'In unit: what it should be.';
COMMENT ON COLUMN read_v1.characteristics.lower_limit IS 'In unit; NULL: none.';
COMMENT ON COLUMN read_v1.characteristics.upper_limit IS 'In unit; NULL: none.';
COMMENT ON COLUMN read_v1.characteristics.expanded_uncertainty IS 'In unit, k = 2; NULL: not measured.';
COMMENT ON COLUMN read_v1.characteristics.verdict IS 'On this value: CONFORM, UNDECIDABLE, NOT_MEASURED or NOT_CONFORM.';
COMMENT ON COLUMN read_v1.characteristics.method IS 'How the scans were positioned.';
COMMENT ON COLUMN read_v1.characteristics.inspection_id IS 'By which inspection.';
COMMENT ON COLUMN read_v1.characteristics.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.characteristics.part_revision IS 'The revision whose tolerances were used.';
COMMENT ON COLUMN read_v1.characteristics.machine_id IS 'On which machine it was scanned.';
COMMENT ON COLUMN read_v1.characteristics.machine_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.characteristics.record_sequence IS 'Of its inspection: of a value that was judged again the greatest counts.';
COMMENT ON COLUMN read_v1.characteristics.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.characteristics.drawing_characteristic IS 'What the drawing calls it; NULL: it does not, or parts do not state it yet.';

CREATE VIEW read_v1.dispositions WITH (security_barrier) AS
  SELECT d.disposition_id, d.inspection_id, d.blade_serial, d.disposition, d.reference, n.record_sequence, n.recorded_at,
         asker_for_reader(d.requested_by) AS requested_by, d.software_version
  FROM dispositions d JOIN record_names n ON n.record_id = d.disposition_id JOIN blades b ON b.blade_serial = d.blade_serial
  WHERE b.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.dispositions IS 'What persons decided about inspected blades, beside the verdict. Of an inspection the last by record_sequence counts.';
COMMENT ON COLUMN read_v1.dispositions.disposition_id IS 'The id in dispositions/{id}.';
COMMENT ON COLUMN read_v1.dispositions.inspection_id IS 'Of which inspection.';
COMMENT ON COLUMN read_v1.dispositions.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.dispositions.disposition IS 'CONCESSION, REWORK, SCRAP, USE_AS_IS or RETURN.';
COMMENT ON COLUMN read_v1.dispositions.reference IS 'A number elsewhere, such as the concession''s; NULL: none.';
COMMENT ON COLUMN read_v1.dispositions.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.dispositions.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.dispositions.requested_by IS 'Who decided it, by his pseudonym.';
COMMENT ON COLUMN read_v1.dispositions.software_version IS 'Which release recorded it.';

-- By the sequence and the name of record_names, which has an index of each.
CREATE VIEW read_v1.events WITH (security_barrier) AS
  SELECT n.record_sequence, n.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method,
         CASE WHEN e.kind IN ('inspection', 'registration', 'study') THEN record_verdict(e.record_id, e.kind) END AS verdict,
         e.measured_at, asker_for_reader(e.requested_by) AS requested_by, e.software_version, e.trace_id,
         e.work_order, e.operation
  FROM record_names n JOIN record_entries e ON e.record_id = n.record_id
  WHERE ((SELECT cardinality(hidden_from_reader())) = 0
         OR CASE WHEN e.blade_serial IS NULL
                 THEN coalesce(NOT parts_of_record(e.record_id) && (SELECT hidden_from_reader())::text[], false)
                 ELSE EXISTS (SELECT 1 FROM blades b WHERE b.blade_serial = e.blade_serial
                              AND b.part_id <> ALL ((SELECT hidden_from_reader())::text[])) END);
COMMENT ON VIEW read_v1.events IS 'The journal: one row for each thing that was recorded.';
COMMENT ON COLUMN read_v1.events.record_sequence IS 'The order of all that the plant recorded, which is that of commit: who has read up to one has missed none before it.';
COMMENT ON COLUMN read_v1.events.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment or disposition; more may come.';
COMMENT ON COLUMN read_v1.events.name IS 'Its resource name; machines, artefacts and parts with @revision.';
COMMENT ON COLUMN read_v1.events.blade_serial IS 'Which blade it concerns; NULL: none.';
COMMENT ON COLUMN read_v1.events.machine_id IS 'Which machine it concerns; NULL: none.';
COMMENT ON COLUMN read_v1.events.method IS 'How it was made; empty: in no way that has a name.';
COMMENT ON COLUMN read_v1.events.verdict IS 'Of an inspection or a study; of a registration its outcome; NULL of the others.';
COMMENT ON COLUMN read_v1.events.measured_at IS 'When, by the device''s clock; NULL: it has none.';
COMMENT ON COLUMN read_v1.events.requested_by IS 'Who asked for it; persons by their pseudonyms.';
COMMENT ON COLUMN read_v1.events.software_version IS 'Which release made it.';
COMMENT ON COLUMN read_v1.events.trace_id IS 'Of the call that recorded it: what finds it in the logs; NULL: no call did.';
COMMENT ON COLUMN read_v1.events.work_order IS 'The MES''s, for which its blade was worked on then; NULL: none was assigned.';
COMMENT ON COLUMN read_v1.events.operation IS 'Of the work order; NULL: none was named.';

-- A view behind a barrier is sorted whole before a LIMIT cuts it; this walks the index.
CREATE FUNCTION read_v1.events_after(after_sequence bigint, at_most integer DEFAULT 1000) RETURNS SETOF read_v1.events
LANGUAGE sql STABLE ROWS 1000 SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT n.record_sequence, n.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method,
         CASE WHEN e.kind IN ('inspection', 'registration', 'study') THEN record_verdict(e.record_id, e.kind) END,
         e.measured_at, asker_for_reader(e.requested_by), e.software_version, e.trace_id, e.work_order, e.operation
  FROM record_names n JOIN record_entries e ON e.record_id = n.record_id
  WHERE n.record_sequence > after_sequence AND ((SELECT cardinality(hidden_from_reader())) = 0
         OR CASE WHEN e.blade_serial IS NULL
                 THEN coalesce(NOT parts_of_record(e.record_id) && (SELECT hidden_from_reader())::text[], false)
                 ELSE EXISTS (SELECT 1 FROM blades b WHERE b.blade_serial = e.blade_serial
                              AND b.part_id <> ALL ((SELECT hidden_from_reader())::text[])) END)
  ORDER BY n.record_sequence LIMIT at_most
$$;
COMMENT ON FUNCTION read_v1.events_after(bigint, integer) IS
  'The events past a record_sequence, in order, at most at_most of them: the last of one answer begins the next.';

-- Whether both ends are seen is asked here and not of read_v1.events: a view behind a barrier is read whole before it is joined.
CREATE VIEW read_v1.edges WITH (security_barrier) AS
  SELECT m.record_sequence, m.name, i.position_index, k.record_sequence AS input_sequence, k.name AS input_name
  FROM record_names m JOIN record_entries e ON e.record_id = m.record_id JOIN record_inputs i ON i.record_id = m.record_id
  JOIN record_names k ON k.record_id = i.input_id JOIN record_entries f ON f.record_id = i.input_id
  WHERE ((SELECT cardinality(hidden_from_reader())) = 0
         OR CASE WHEN e.blade_serial IS NULL
                 THEN coalesce(NOT parts_of_record(e.record_id) && (SELECT hidden_from_reader())::text[], false)
                 ELSE EXISTS (SELECT 1 FROM blades b WHERE b.blade_serial = e.blade_serial
                              AND b.part_id <> ALL ((SELECT hidden_from_reader())::text[])) END)
    AND ((SELECT cardinality(hidden_from_reader())) = 0
         OR CASE WHEN f.blade_serial IS NULL
                 THEN coalesce(NOT parts_of_record(f.record_id) && (SELECT hidden_from_reader())::text[], false)
                 ELSE EXISTS (SELECT 1 FROM blades b WHERE b.blade_serial = f.blade_serial
                              AND b.part_id <> ALL ((SELECT hidden_from_reader())::text[])) END);
COMMENT ON VIEW read_v1.edges IS 'The genealogy: what each recorded thing was made from, one step. Of both ends only those that are seen.';
COMMENT ON COLUMN read_v1.edges.record_sequence IS 'Of what was made.';
COMMENT ON COLUMN read_v1.edges.name IS 'What was made.';
COMMENT ON COLUMN read_v1.edges.position_index IS 'Which of its inputs, from 0.';
COMMENT ON COLUMN read_v1.edges.input_sequence IS 'Of what it was made from.';
COMMENT ON COLUMN read_v1.edges.input_name IS 'What it was made from.';

-- As DerivedFrom() in storage/recall.cc has it: what is made from a thing step by step, as far as a root, and from there by its roots.
CREATE FUNCTION read_v1.recall(of_name text, after_sequence bigint DEFAULT 0, at_most integer DEFAULT 1000)
RETURNS TABLE (record_sequence bigint, recorded_at timestamptz, kind text, name text, blade_serial text, machine_id text,
               verdict text, state text)
LANGUAGE sql STABLE ROWS 1000 SECURITY DEFINER SET search_path = public, pg_temp AS $$
  WITH RECURSIVE hidden (parts) AS MATERIALIZED (SELECT hidden_from_reader()),
  near (record_id, is_origin, root) AS (
    SELECT n.record_id, true, is_root(n.name) FROM record_names n
      WHERE n.name = of_name OR (n.name >= of_name || '@' AND n.name < of_name || 'A')
    UNION SELECT i.record_id, false, is_root(n.name) FROM near d JOIN record_inputs i ON i.input_id = d.record_id
      JOIN record_names n ON n.record_id = i.record_id WHERE NOT d.root),
  roots (root_id) AS (
    SELECT d.record_id FROM near d WHERE d.root
    UNION SELECT root_of(of_name) WHERE split_part(of_name, '/', 1) IN ('sensors', 'probes', 'software')),
  hits AS (
    SELECT d.record_id, n.record_sequence FROM near d JOIN record_names n ON n.record_id = d.record_id
      WHERE NOT d.is_origin AND n.record_sequence > after_sequence
    UNION SELECT h.record_id, h.record_sequence FROM roots t CROSS JOIN LATERAL (
      SELECT r.record_id, r.record_sequence FROM record_roots r JOIN record_entries e ON e.record_id = r.record_id, hidden
      WHERE r.root_id = t.root_id AND r.record_sequence > after_sequence
        AND (cardinality(hidden.parts) = 0 OR coalesce(NOT parts_of_record(r.record_id) && hidden.parts, false))
      ORDER BY r.record_sequence LIMIT at_most) h)
  SELECT e.record_sequence, e.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id,
         CASE WHEN e.kind IN ('inspection', 'registration', 'study') THEN record_verdict(e.record_id, e.kind) END,
         CASE WHEN e.kind IN ('calibration', 'correction', 'scan') THEN record_state(e.record_id, e.kind) END
  FROM hits h JOIN record_entries e ON e.record_id = h.record_id JOIN record_names n ON n.record_id = h.record_id, hidden
  WHERE cardinality(hidden.parts) = 0 OR coalesce(NOT parts_of_record(e.record_id) && hidden.parts, false)
  ORDER BY e.record_sequence LIMIT at_most
$$;
COMMENT ON FUNCTION read_v1.recall(text, bigint, integer) IS
  'Everything that was made, directly or not, from a thing, oldest first: machines/ID, parts/ID@2, calibrations/ID, scans/ID, sensors/SERIAL, '
  'probes/SERIAL, software/VERSION and so on. At most at_most rows, from past after_sequence: the last record_sequence of one answer begins the next.';

-- A login for a program: few connections, no statement for longer than a minute, nothing to write to.
CREATE FUNCTION make_reader(login text) RETURNS void LANGUAGE plpgsql AS $$
BEGIN
  IF login !~ '^[a-z][a-z0-9_]{0,62}$' OR login LIKE 'sixpoint%' OR login LIKE 'pg\_%' THEN
    RAISE EXCEPTION 'login: %, want a lower-case letter, then up to 62 of a-z, 0-9 and _, not beginning with sixpoint or pg_', left(login, 80)
      USING ERRCODE = 'invalid_parameter_value';
  END IF;
  EXECUTE format('CREATE ROLE %I LOGIN CONNECTION LIMIT 8 IN ROLE sixpoint_reader', login);
  EXECUTE format('ALTER ROLE %I SET default_transaction_read_only = on', login);
  EXECUTE format('ALTER ROLE %I SET statement_timeout = ''60s''', login);
  EXECUTE format('ALTER ROLE %I SET idle_in_transaction_session_timeout = ''60s''', login);
  EXECUTE format('ALTER ROLE %I SET search_path = read_v1', login);
  EXECUTE format('ALTER ROLE %I SET jit = off', login);
END
$$;
COMMENT ON FUNCTION make_reader(text) IS
  'Run by the owner: a login that reads read_v1 and nothing else. It has no password until \password gives it one.';

REVOKE EXECUTE ON FUNCTION make_reader(text), read_v1.recall(text, bigint, integer), read_v1.events_after(bigint, integer),
  hidden_from_reader() FROM PUBLIC;
GRANT EXECUTE ON FUNCTION read_v1.recall(text, bigint, integer), read_v1.events_after(bigint, integer), hidden_from_reader()
  TO sixpoint_reader;
GRANT SELECT ON ALL TABLES IN SCHEMA read_v1 TO sixpoint_reader;
