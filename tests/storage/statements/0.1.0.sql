-- Every statement of the services, on schema V0010; made by tests/storage/statements/capture, not by hand.
-- storage/axis_characterisations.cc kInsert
INSERT INTO axis_characterisations (calibration_id, forward_error_deg, backward_error_deg, reading_count, reversal_deg, mean_deg, long_wave_order, long_wave_amplitude_deg, periodic_order, periodic_amplitude_deg, least_detectable_deg, greatest_error_deg, greatest_error_at_deg, greatest_error_forward, standard_uncertainty_deg, compensated_standard_uncertainty_deg, noise_deg, table_standard_uncertainty_deg, beyond_limits_count) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19);
-- storage/axis_characterisations.cc kSelect
SELECT calibration_id, axis, reading_count, reversal_deg, mean_deg, long_wave_order, long_wave_amplitude_deg, periodic_order, periodic_amplitude_deg, least_detectable_deg, greatest_error_deg, greatest_error_at_deg, greatest_error_forward, standard_uncertainty_deg, compensated_standard_uncertainty_deg, noise_deg, table_standard_uncertainty_deg, beyond_limits_count FROM axis_characterisations JOIN calibrations USING (calibration_id) WHERE calibration_id = ANY ($1::uuid[]);
-- storage/axis_characterisations.cc kSelectTable
SELECT forward_error_deg, backward_error_deg FROM axis_characterisations WHERE calibration_id = $1;
-- storage/blob_check.cc kSelectPage
SELECT sha256, size_bytes, store, coalesce(object_id::text, '') FROM blobs WHERE sha256 > $1 AND deleted_at IS NULL ORDER BY sha256 LIMIT $2;
-- storage/blob_check.cc kSelectBytes
SELECT bytes FROM blobs WHERE sha256 = $1;
-- storage/blob_check.cc kInsertDamage
INSERT INTO blob_damages (sha256, store, what, detail) SELECT $1::bytea, $2::text, $3::text, $4::text WHERE NOT EXISTS (SELECT 1 FROM blob_damages WHERE sha256 = $1 AND what = $3);
-- storage/blob_check.cc kSelectDamages
SELECT sha256, store, what, detail, found_at FROM blob_damages ORDER BY damage_id DESC LIMIT $1;
-- storage/blob_check.cc kSelectState
SELECT after_sha256, checked_count, checked_bytes, damaged_count, begun_at, finished_at FROM blob_check_progress;
-- storage/blob_check.cc kUpdateProgress
UPDATE blob_check_progress SET after_sha256 = $1, checked_count = $2, checked_bytes = $3, damaged_count = $4;
-- storage/blob_check.cc kUpdateFinished
UPDATE blob_check_progress SET after_sha256 = '', checked_count = 0, checked_bytes = 0, damaged_count = 0, begun_at = clock_timestamp(), finished_at = clock_timestamp();
-- storage/blob_check.cc kSelectUse
SELECT store, sum(kept_count), sum(kept_bytes), sum(deleted_count), sum(deleted_bytes) FROM blob_use GROUP BY store ORDER BY store;
-- storage/blob_check.cc kAddUpUse
SELECT add_up_blob_use();
-- storage/blob_collector.cc kSelectCandidates
SELECT b.sha256, b.size_bytes, b.store, b.deleted_at IS NULL FROM blobs b WHERE b.sha256 > $1 AND b.stored_at <= clock_timestamp() - make_interval(secs => $2);
-- storage/blob_collector.cc kDeleteRows
DELETE FROM blobs b WHERE b.sha256 = ANY ($1::bytea[]);
-- storage/blob_collector.cc kForgetLoose
DELETE FROM loose_blobs l WHERE l.sha256 = ANY ($1::bytea[]) AND NOT EXISTS (SELECT 1 FROM blobs b WHERE b.sha256 = l.sha256);
-- storage/blob_collector.cc kSelectClaimed
SELECT object_id FROM blobs WHERE sha256 = ANY ($1::bytea[]) AND store = 's3' AND deleted_at IS NULL;
-- storage/blob_references.cc kSelectReferences
SELECT format('%I.%I', n.nspname, c.relname), quote_ident(a.attname), c.oid = 'scan_blocks'::regclass FROM pg_constraint k JOIN pg_class c ON c.oid = k.conrelid JOIN pg_namespace n ON n.oid = c.relnamespace JOIN pg_attribute a ON a.attrelid = k.conrelid AND a.attnum = k.conkey[1] WHERE k.contype = 'f' AND k.confrelid = 'blobs'::regclass AND k.conparentid = 0 ORDER BY 1, 2;
-- storage/blob_rows.cc kSelectRow
SELECT size_bytes, store, to_char(deleted_at AT TIME ZONE 'UTC', 'YYYY-MM-DD HH24:MI:SS"Z"'), coalesce(deletion_reason, ''), object_id FROM blobs WHERE sha256 = $1;
-- storage/blob_rows.cc kHoldRow
SELECT size_bytes, store, to_char(deleted_at AT TIME ZONE 'UTC', 'YYYY-MM-DD HH24:MI:SS"Z"'), coalesce(deletion_reason, ''), object_id FROM blobs WHERE sha256 = $1 FOR KEY SHARE;
-- storage/blob_rows.cc kSelectBytes
SELECT bytes FROM blobs WHERE sha256 = $1;
-- storage/blob_rows.cc kInsertRow
INSERT INTO blobs (sha256, size_bytes, bytes, store, object_id) VALUES ($1, $2, $3, $4, $5) ON CONFLICT (sha256) DO NOTHING;
-- storage/blob_rows.cc kRestoreRow
UPDATE blobs SET bytes = $2, store = $3, object_id = $4, deleted_at = NULL, deletion_reason = NULL WHERE sha256 = $1 AND bytes IS NULL;
-- storage/blob_rows.cc kAnnounce
SELECT set_config('sixpoint.blob_change', $1, true);
-- storage/bucket_owner.cc kSelectOwner
SELECT 'plant ' || plant_id || ', database ' || (SELECT system_identifier FROM pg_control_system()) || '/' || (SELECT timeline_id FROM pg_control_checkpoint()) FROM plant_identity;
-- storage/calibration_events.cc kInsertEvent
INSERT INTO calibration_events (calibration_id, event, reason, requested_by, software_version, record_id) VALUES ($1, $2, $3, $4, $5, $6);
-- storage/calibrations.cc kInsertHead
INSERT INTO calibrations (calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, valid_until, requested_by, software_version, is_draft, temperature_c, temperature_standard_uncertainty_c, humidity_percent, environment_note, axis) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16);
-- storage/calibrations.cc kInsertSensor
INSERT INTO sensor_calibrations (calibration_id, machine_from_sensor_rotation, t_sm_mm, covariance, alpha_deg, beta_deg, gamma_deg, alpha_standard_uncertainty_deg, beta_standard_uncertainty_deg, gamma_standard_uncertainty_deg, noise_um, touch_rms_um, residual_rms_um, condition_number, points_used) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15);
-- storage/calibrations.cc kInsertCentres
INSERT INTO sensor_calibration_centres (calibration_id, position_index, scan_key, feature, is_check, dx_um, dy_um, dz_um) SELECT $1::uuid, (position - 1)::integer, (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || scan_id::text), feature, is_check::boolean, dx_um, dy_um, dz_um FROM unnest($2::text[], $3::text[], $4::text[], $5::double precision[], $6::double precision[], $7::double precision[]) WITH ORDINALITY AS centre (scan_id, feature, is_check, dx_um, dy_um, dz_um, position);
-- storage/calibrations.cc kInsertRotation
INSERT INTO rotation_calibrations (calibration_id, a_direction, a_point_mm, b_direction, b_point_mm, covariance, point_c_mm, point_c_standard_uncertainty_mm, noise_um, residual_rms_um, check_rms_um, check_count, condition_number, axes) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14);
-- storage/calibrations.cc kInsertPoses
INSERT INTO rotation_calibration_poses (calibration_id, position_index, a_deg, b_deg, distance_um, held_out, before_um) SELECT $1::uuid, (position - 1)::integer, a_deg, b_deg, distance_um, held_out::boolean, before_um FROM unnest($2::double precision[], $3::double precision[], $4::double precision[], $5::text[], $6::double precision[]) WITH ORDINALITY AS pose (a_deg, b_deg, distance_um, held_out, before_um, position);
-- storage/calibrations.cc kSelectNow
SELECT clock_timestamp();
-- storage/calibrations.cc kSelectHead
SELECT calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, valid_until, requested_by, software_version, is_draft, temperature_c, temperature_standard_uncertainty_c, humidity_percent, environment_note, record_sequence, recorded_at FROM calibrations c JOIN record_names n ON n.record_id = c.calibration_id WHERE calibration_id = $1;
-- storage/calibrations.cc kSelectInForce
SELECT calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, valid_until, requested_by, software_version, is_draft, temperature_c, temperature_standard_uncertainty_c, humidity_percent, environment_note, record_sequence, recorded_at FROM calibrations c JOIN record_names n ON n.record_id = c.calibration_id WHERE calibration_id = (SELECT f.calibration_id FROM calibration_forces f WHERE f.machine_id = $1 AND f.kind = $2 AND f.axis = $3 AND f.valid_from <= $4 AND $4 < f.valid_until ORDER BY f.force_sequence DESC LIMIT 1);
-- storage/calibrations.cc kSelectLastValidity
SELECT valid_until FROM calibration_forces WHERE machine_id = $1 AND kind = $2 AND axis = $3 AND valid_from <= $4 ORDER BY valid_until DESC LIMIT 1;
-- storage/calibrations.cc kSelectWithdrawn
SELECT calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, valid_until, requested_by, software_version, is_draft, temperature_c, temperature_standard_uncertainty_c, humidity_percent, environment_note, record_sequence, recorded_at FROM calibrations c JOIN record_names n ON n.record_id = c.calibration_id WHERE calibration_id = (SELECT d.calibration_id FROM calibrations d JOIN calibration_events w ON w.calibration_id = d.calibration_id AND w.event = 'WITHDRAWN' JOIN record_names m ON m.record_id = w.record_id WHERE d.machine_id = $1 AND d.kind = $2 AND COALESCE(d.axis, '') = $3 AND d.valid_from <= $4 AND $4 < d.valid_until ORDER BY m.record_sequence DESC LIMIT 1);
-- storage/calibrations.cc kSelectHistory
SELECT calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, valid_until, requested_by, software_version, is_draft, temperature_c, temperature_standard_uncertainty_c, humidity_percent, environment_note, record_sequence, recorded_at FROM calibrations c JOIN record_names n ON n.record_id = c.calibration_id WHERE calibration_id IN (SELECT f.calibration_id FROM calibration_forces f WHERE f.machine_id = $1 AND f.kind = $2 AND f.axis = $3 ORDER BY f.valid_from DESC, f.force_sequence DESC LIMIT $4) ORDER BY valid_from, record_sequence;
-- storage/calibrations.cc kSelectStates
SELECT c.calibration_id, (SELECT f.calibration_id FROM calibration_forces f WHERE f.machine_id = c.machine_id AND f.kind = c.kind AND f.axis = COALESCE(c.axis, '') AND f.valid_from <= $2 AND $2 < f.valid_until ORDER BY f.force_sequence DESC LIMIT 1) FROM calibrations c WHERE c.calibration_id = ANY ($1::uuid[]);
-- storage/calibrations.cc kSelectEvents
SELECT calibration_id, event, reason, requested_by, software_version, record_sequence, recorded_at FROM calibration_events e JOIN record_names n ON n.record_id = e.record_id WHERE calibration_id = ANY ($1::uuid[]);
-- storage/calibrations.cc kSelectPage
SELECT calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, valid_until, requested_by, software_version, is_draft, temperature_c, temperature_standard_uncertainty_c, humidity_percent, environment_note, record_sequence, recorded_at FROM calibrations c JOIN record_names n ON n.record_id = c.calibration_id WHERE ($1 = '' OR machine_id = $1) AND ($2 = '' OR kind = $2) AND ($3 = '' OR axis = $3) AND ($4 = '' OR $4 = CASE WHEN EXISTS (SELECT 1 FROM calibration_events w WHERE w.calibration_id = c.calibration_id AND w.event = 'WITHDRAWN') THEN 'WITHDRAWN' WHEN is_draft AND NOT EXISTS (SELECT 1 FROM calibration_events r WHERE r.calibration_id = c.calibration_id AND r.event = 'RELEASED') THEN 'DRAFT' WHEN $5::timestamptz < valid_from THEN 'NOT_YET_VALID' WHEN $5::timestamptz >= valid_until THEN 'EXPIRED' WHEN calibration_id = (SELECT f.calibration_id FROM calibration_forces f WHERE f.machine_id = c.machine_id AND f.kind = c.kind AND f.axis = COALESCE(c.axis, '') AND f.valid_from <= $5 AND $5 < f.valid_until ORDER BY f.force_sequence DESC LIMIT 1) THEN 'IN_FORCE' ELSE 'SUPERSEDED' END) AND ($6::timestamptz IS NULL OR recorded_at >= $6) AND ($7::timestamptz IS NULL OR recorded_at < $7) AND ($8::bigint = 0 OR record_sequence < $8::bigint) ORDER BY record_sequence DESC LIMIT $9;
-- storage/calibrations.cc kSelectSensors
SELECT calibration_id, machine_from_sensor_rotation, t_sm_mm, covariance, alpha_deg, beta_deg, gamma_deg, alpha_standard_uncertainty_deg, beta_standard_uncertainty_deg, gamma_standard_uncertainty_deg, noise_um, touch_rms_um, residual_rms_um, condition_number, points_used FROM sensor_calibrations WHERE calibration_id = ANY ($1::uuid[]);
-- storage/calibrations.cc kSelectRotations
SELECT calibration_id, a_direction, a_point_mm, b_direction, b_point_mm, covariance, point_c_mm, point_c_standard_uncertainty_mm, noise_um, residual_rms_um, check_rms_um, check_count, condition_number, axes FROM rotation_calibrations WHERE calibration_id = ANY ($1::uuid[]);
-- storage/calibrations.cc kSelectCentres
SELECT (SELECT substr(n.name, 7) FROM record_names n WHERE n.record_id = scan_key), feature, is_check, dx_um, dy_um, dz_um FROM sensor_calibration_centres WHERE calibration_id = $1 ORDER BY position_index;
-- storage/calibrations.cc kSelectPoses
SELECT a_deg, b_deg, distance_um, held_out, before_um FROM rotation_calibration_poses WHERE calibration_id = $1 ORDER BY position_index;
-- storage/corrections.cc kInsertCorrection
INSERT INTO corrections (correction_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, sensor_calibration_id, rotation_calibration_id, nc_template_sha256, nc_program_sha256, release, release_reasons, envelope_translation_mm, envelope_rotation_deg, valid_until, requested_by, software_version, axes) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19);
-- storage/corrections.cc kSelectCorrection
SELECT correction_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, sensor_calibration_id, rotation_calibration_id, nc_template_sha256, nc_program_sha256, release, release_reasons, envelope_translation_mm, envelope_rotation_deg, valid_until, requested_by, software_version, axes, ARRAY(SELECT DISTINCT a.characterisation_id FROM registration_angles a WHERE a.registration_id = corrections.registration_id ORDER BY 1), record_sequence, recorded_at FROM corrections JOIN recorded r ON r.record_id = correction_id WHERE correction_id = $1;
-- storage/corrections.cc kListCorrections
SELECT correction_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, sensor_calibration_id, rotation_calibration_id, nc_template_sha256, nc_program_sha256, release, release_reasons, envelope_translation_mm, envelope_rotation_deg, valid_until, requested_by, software_version, axes, ARRAY(SELECT DISTINCT a.characterisation_id FROM registration_angles a WHERE a.registration_id = corrections.registration_id ORDER BY 1), record_sequence, recorded_at FROM corrections JOIN recorded r ON r.record_id = correction_id WHERE entry_kind = 'correction' AND ($1::bigint = 0 OR record_sequence < $1::bigint) AND ($2 = '' OR entry_blade = $2) AND ($3 = '' OR entry_machine = $3) AND ($4 = '' OR part_id = $4) AND ($5::uuid IS NULL OR $5::uuid IN (sensor_calibration_id, rotation_calibration_id) OR EXISTS (SELECT 1 FROM registration_angles a WHERE a.registration_id = corrections.registration_id AND a.characterisation_id = $5::uuid)) AND ($6::timestamptz IS NULL OR recorded_at >= $6) AND ($7::timestamptz IS NULL OR recorded_at < $7) AND ($8 = '' OR release = $8) ORDER BY record_sequence DESC LIMIT $9;
-- storage/corrections.cc kSelectProgram
SELECT nc_program_sha256 FROM corrections WHERE correction_id = $1;
-- storage/corrections.cc kInsertGroup
INSERT INTO correction_groups (correction_id, position_index, group_name, a_deg, b_deg, a_nominal_deg, b_nominal_deg, a_ideal_deg, b_ideal_deg, a_standard_uncertainty_deg, b_standard_uncertainty_deg, a_reached_deg, b_reached_deg) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13);
-- storage/corrections.cc kInsertHoles
INSERT INTO correction_holes (correction_id, group_name, position_index, hole_name, start_x_mm, start_y_mm, start_z_mm, nominal_start_x_mm, nominal_start_y_mm, nominal_start_z_mm, expanded_uncertainty_um) SELECT $1::uuid, $2::text, (position - 1)::integer, hole, x, y, z, nominal_x, nominal_y, nominal_z, uncertainty FROM unnest($3::text[], $4::double precision[], $5::double precision[], $6::double precision[], $7::double precision[], $8::double precision[], $9::double precision[], $10::double precision[]) WITH ORDINALITY AS holes (hole, x, y, z, nominal_x, nominal_y, nominal_z, uncertainty, position);
-- storage/corrections.cc kSelectGroups
SELECT correction_id, group_name, a_deg, b_deg, a_nominal_deg, b_nominal_deg, a_ideal_deg, b_ideal_deg, a_standard_uncertainty_deg, b_standard_uncertainty_deg, a_reached_deg, b_reached_deg FROM correction_groups WHERE correction_id = ANY ($1::uuid[]) ORDER BY correction_id, position_index;
-- storage/corrections.cc kSelectHoles
SELECT correction_id, group_name, hole_name, start_x_mm, start_y_mm, start_z_mm, nominal_start_x_mm, nominal_start_y_mm, nominal_start_z_mm, expanded_uncertainty_um FROM correction_holes WHERE correction_id = ANY ($1::uuid[]) ORDER BY correction_id, group_name, position_index;
-- storage/inspections.cc kInsertInspection
INSERT INTO inspections (inspection_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, sensor_calibration_id, rotation_calibration_id, verdict, decision_rule, deviation_minimum_um, deviation_maximum_um, deviation_rms_um, deviation_p05_um, deviation_p50_um, deviation_p95_um, deviation_point_count, deviation_excluded_count, requested_by, software_version, method, disagreement_um, disagreement_ratio, positioning_disagrees, positioning_covered) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, $23, $24, $25, $26);
-- storage/inspections.cc kSelectInspection
SELECT inspection_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, sensor_calibration_id, rotation_calibration_id, verdict, decision_rule, deviation_minimum_um, deviation_maximum_um, deviation_rms_um, deviation_p05_um, deviation_p50_um, deviation_p95_um, deviation_point_count, deviation_excluded_count, requested_by, software_version, method, disagreement_um, disagreement_ratio, positioning_disagrees, positioning_covered, record_sequence, recorded_at FROM inspections JOIN recorded r ON r.record_id = inspection_id WHERE inspection_id = $1;
-- storage/inspections.cc kListInspections
SELECT inspection_id, blade_serial, registration_id, machine_id, machine_revision, part_id, part_revision, sensor_calibration_id, rotation_calibration_id, verdict, decision_rule, deviation_minimum_um, deviation_maximum_um, deviation_rms_um, deviation_p05_um, deviation_p50_um, deviation_p95_um, deviation_point_count, deviation_excluded_count, requested_by, software_version, method, disagreement_um, disagreement_ratio, positioning_disagrees, positioning_covered, record_sequence, recorded_at FROM inspections JOIN recorded r ON r.record_id = inspection_id WHERE entry_kind = 'inspection' AND ($1::bigint = 0 OR record_sequence < $1::bigint) AND ($2 = '' OR entry_blade = $2) AND ($3 = '' OR entry_machine = $3) AND ($4 = '' OR part_id = $4) AND ($5::uuid IS NULL OR $5::uuid IN (sensor_calibration_id, rotation_calibration_id) OR EXISTS (SELECT 1 FROM registration_angles a WHERE a.registration_id = inspections.registration_id AND a.characterisation_id = $5::uuid)) AND ($6::timestamptz IS NULL OR recorded_at >= $6) AND ($7::timestamptz IS NULL OR recorded_at < $7) AND ($8 = '' OR verdict = $8) ORDER BY record_sequence DESC LIMIT $9;
-- storage/inspections.cc kInsertScans
INSERT INTO inspection_scans (inspection_id, position_index, scan_key) SELECT $1::uuid, (position - 1)::integer, (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || scan::text) FROM unnest($2::text[]) WITH ORDINALITY AS scans (scan, position);
-- storage/inspections.cc kSelectScans
SELECT inspection_id, (SELECT substr(n.name, 7) FROM record_names n WHERE n.record_id = scan_key) FROM inspection_scans WHERE inspection_id = ANY ($1::uuid[]) ORDER BY inspection_id, position_index;
-- storage/inspections.cc kInsertHoles
INSERT INTO inspection_holes (inspection_id, position_index, group_name, hole_name, verdict, position_verdict, inclination_verdict, position_error_mm, inclination_error_deg, position_expanded_uncertainty_um, inclination_expanded_uncertainty_deg, start_in_part_mm, axis_in_part, pin_diameter_mm, position_tolerance_mm, inclination_tolerance_deg, point_count, pin_residual_rms_um, reason, positioning_difference_um) SELECT $1::uuid, (position - 1)::integer, group_name, hole_name, verdict, position_verdict, inclination_verdict, position_error, inclination_error, position_uncertainty, inclination_uncertainty, CASE WHEN start_x IS NOT NULL THEN ARRAY[start_x, start_y, start_z] END, CASE WHEN axis_x IS NOT NULL THEN ARRAY[axis_x, axis_y, axis_z] END, diameter, position_tolerance, inclination_tolerance, point_count::integer, residual_rms, reason, positioning_difference FROM unnest($2::text[], $3::text[], $4::text[], $5::text[], $6::text[], $7::text[], $8::text[], $9::double precision[], $10::double precision[], $11::double precision[], $12::double precision[], $13::double precision[], $14::double precision[], $15::double precision[], $16::double precision[], $17::double precision[], $18::double precision[], $19::double precision[], $20::double precision[], $21::double precision[], $22::double precision[], $23::double precision[]) WITH ORDINALITY AS holes (group_name, hole_name, verdict, position_verdict, inclination_verdict, reason, point_count, position_error, inclination_error, position_uncertainty, inclination_uncertainty, start_x, start_y, start_z, axis_x, axis_y, axis_z, diameter, position_tolerance, inclination_tolerance, residual_rms, positioning_difference, position);
-- storage/inspections.cc kSelectHoles
SELECT inspection_id, group_name, hole_name, verdict, position_verdict, inclination_verdict, position_error_mm, inclination_error_deg, position_expanded_uncertainty_um, inclination_expanded_uncertainty_deg, start_in_part_mm, axis_in_part, pin_diameter_mm, position_tolerance_mm, inclination_tolerance_deg, point_count, pin_residual_rms_um, reason, positioning_difference_um FROM inspection_holes WHERE inspection_id = ANY ($1::uuid[]) ORDER BY inspection_id, position_index;
-- storage/migrate.cc kSelectApplied
SELECT version, name, sha256 FROM schema_migrations ORDER BY version;
-- storage/migrate.cc kInsertApplied
INSERT INTO schema_migrations (version, name, sha256) VALUES ($1, $2, $3);
-- storage/months.cc kMake
SELECT make_partitions($1);
-- storage/months.cc kForget
SELECT drop_requests_before((date_trunc('month', clock_timestamp()) - make_interval(months => $1))::date);
-- storage/months.cc kSelectMonths
SELECT replace(right(c.relname, 7), '_', '-'), count(*), sum(greatest(c.reltuples, 0))::bigint, sum(pg_total_relation_size(c.oid))::bigint FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid JOIN pg_partitioned_table p ON p.partrelid = i.inhparent GROUP BY 1 ORDER BY 1;
-- storage/plant_registry.cc kInsertMachine
INSERT INTO machines (machine_id) VALUES ($1) ON CONFLICT DO NOTHING;
-- storage/plant_registry.cc kLockMachine
SELECT pg_advisory_xact_lock(hashtextextended('machines/' || $1, 0));
-- storage/plant_registry.cc kInsertMachineRevision
INSERT INTO machine_revisions (machine_id, revision, content_sha256, sensor_model, sensor_noise_um, sensor_column_count, sensor_mid_range_mm, sensor_range_mm, sensor_line_angle_deg, nominal_centre_mm, safety_translation_mm, safety_rotation_deg, record_id) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13);
-- storage/plant_registry.cc kInsertJoint
INSERT INTO machine_joints (machine_id, revision, side, position_index, axis, kind, direction, point_mm, sign, minimum, maximum) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11);
-- storage/plant_registry.cc kSelectMachine
SELECT revision, content_sha256, sensor_model, sensor_noise_um, sensor_column_count, sensor_mid_range_mm, sensor_range_mm, sensor_line_angle_deg, nominal_centre_mm, safety_translation_mm, safety_rotation_deg, record_sequence, recorded_at FROM machine_revisions JOIN record_names USING (record_id) WHERE machine_id = $1 AND ($2::integer = 0 OR revision = $2) ORDER BY revision DESC LIMIT 1;
-- storage/plant_registry.cc kSelectJoints
SELECT side, axis, kind, direction, point_mm, sign, minimum, maximum FROM machine_joints WHERE machine_id = $1 AND revision = $2 ORDER BY side, position_index;
-- storage/plant_registry.cc kInsertArtefact
INSERT INTO artefacts (artefact_id) VALUES ($1) ON CONFLICT DO NOTHING;
-- storage/plant_registry.cc kLockArtefact
SELECT pg_advisory_xact_lock(hashtextextended('artefacts/' || $1, 0));
-- storage/plant_registry.cc kInsertArtefactRevision
INSERT INTO artefact_revisions (artefact_id, revision, content_sha256, side_mm, cone_half_angle_deg, cone_top_radius_mm, cone_bottom_radius_mm, slot_width_mm, slot_depth_mm, record_id) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10);
-- storage/plant_registry.cc kInsertFeatures
INSERT INTO artefact_features (artefact_id, revision, kind, position_index, feature, x_mm, y_mm) SELECT $1::text, $2::integer, kind, (position - 1)::integer, feature, x_mm, y_mm FROM unnest($3::text[], $4::text[], $5::double precision[], $6::double precision[]) WITH ORDINALITY AS feature (kind, feature, x_mm, y_mm, position);
-- storage/plant_registry.cc kSelectArtefact
SELECT revision, content_sha256, side_mm, cone_half_angle_deg, cone_top_radius_mm, cone_bottom_radius_mm, slot_width_mm, slot_depth_mm, record_sequence, recorded_at FROM artefact_revisions JOIN record_names USING (record_id) WHERE artefact_id = $1 AND ($2::integer = 0 OR revision = $2) ORDER BY revision DESC LIMIT 1;
-- storage/plant_registry.cc kSelectFeatures
SELECT kind, feature, x_mm, y_mm FROM artefact_features WHERE artefact_id = $1 AND revision = $2 ORDER BY kind, position_index;
-- storage/plant_registry.cc kSelectMachineIds
SELECT machine_id FROM (SELECT DISTINCT ON (machine_id) machine_id, recorded_at FROM machine_revisions JOIN record_names USING (record_id) WHERE machine_id > $1 ORDER BY machine_id, revision DESC) newest WHERE ($2::timestamptz IS NULL OR recorded_at >= $2) AND ($3::timestamptz IS NULL OR recorded_at < $3) ORDER BY machine_id LIMIT $4;
-- storage/plant_registry.cc kSelectArtefactIds
SELECT artefact_id FROM (SELECT DISTINCT ON (artefact_id) artefact_id, recorded_at FROM artefact_revisions JOIN record_names USING (record_id) WHERE artefact_id > $1 ORDER BY artefact_id, revision DESC) newest WHERE ($2::timestamptz IS NULL OR recorded_at >= $2) AND ($3::timestamptz IS NULL OR recorded_at < $3) ORDER BY artefact_id LIMIT $4;
-- storage/plant_registry.cc kSelectPartIds
SELECT part_id FROM (SELECT DISTINCT ON (part_id) part_id, recorded_at FROM part_revisions JOIN record_names USING (record_id) WHERE part_id > $1 ORDER BY part_id, revision DESC) newest WHERE ($2::timestamptz IS NULL OR recorded_at >= $2) AND ($3::timestamptz IS NULL OR recorded_at < $3) ORDER BY part_id LIMIT $4;
-- storage/plant_registry.cc kInsertBlade
INSERT INTO blades (blade_serial, part_id, record_id) VALUES ($1, $2, $3);
-- storage/plant_registry.cc kLockBlade
SELECT pg_advisory_xact_lock(hashtextextended('blades/' || $1, 0));
-- storage/plant_registry.cc kSelectBlade
SELECT blade_serial, part_id, record_sequence, recorded_at FROM blades JOIN record_names USING (record_id) WHERE blade_serial = $1;
-- storage/plant_registry.cc kSelectBlades
SELECT blade_serial, part_id, record_sequence, recorded_at FROM blades JOIN record_names USING (record_id) WHERE blade_serial > $1 AND ($2 = '' OR part_id = $2) AND ($3::timestamptz IS NULL OR recorded_at >= $3) AND ($4::timestamptz IS NULL OR recorded_at < $4) ORDER BY blade_serial LIMIT $5;
-- storage/plant_registry_parts.cc kInsertTessellation
INSERT INTO tessellations (cad_sha256, method, surface_sha256, triangle_count, chordal_error_um, closed, minimum_mm, maximum_mm, software_version, degenerate_triangle_count, open_rim_count, open_rim_length_mm) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12) ON CONFLICT DO NOTHING;
-- storage/plant_registry_parts.cc kSelectTessellation
SELECT surface_sha256, triangle_count, chordal_error_um, closed, minimum_mm, maximum_mm, degenerate_triangle_count, open_rim_count, open_rim_length_mm FROM tessellations WHERE cad_sha256 = $1 AND method = $2;
-- storage/plant_registry_parts.cc kInsertId
INSERT INTO parts (part_id) VALUES ($1) ON CONFLICT DO NOTHING;
-- storage/plant_registry_parts.cc kLockId
SELECT pg_advisory_xact_lock(hashtextextended('parts/' || $1, 0));
-- storage/plant_registry_parts.cc kInsertRevision
INSERT INTO part_revisions (part_id, revision, content_sha256, cad_format, cad_unit_mm, cad_sha256, tessellation_method, zero_from_part_nominal_rotation, zero_from_part_nominal_translation_mm, record_id) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10);
-- storage/plant_registry_parts.cc kInsertGroup
INSERT INTO part_hole_groups (part_id, revision, group_index, hole_group, diameter_mm, depth_mm, a_nominal_deg, b_nominal_deg, axis_in_part, position_tolerance_mm, inclination_tolerance_deg) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11);
-- storage/plant_registry_parts.cc kInsertHoles
INSERT INTO part_holes (part_id, revision, group_index, hole_index, hole, start_in_part_mm, normal_in_part) SELECT $1::text, $2::integer, $3::integer, (position - 1)::integer, hole, ARRAY[x, y, z], ARRAY[nx, ny, nz] FROM unnest($4::text[], $5::double precision[], $6::double precision[], $7::double precision[], $8::double precision[], $9::double precision[], $10::double precision[]) WITH ORDINALITY AS hole (hole, x, y, z, nx, ny, nz, position);
-- storage/plant_registry_parts.cc kInsertDatum
INSERT INTO part_datum_points (part_id, revision, datum_index, datum, point_in_part_mm, normal_in_part) VALUES ($1, $2, $3, $4, $5, $6);
-- storage/plant_registry_parts.cc kSelectRevision
SELECT revision, content_sha256, cad_format, cad_unit_mm, cad_sha256, tessellation_method, zero_from_part_nominal_rotation, zero_from_part_nominal_translation_mm, record_sequence, recorded_at FROM part_revisions JOIN record_names USING (record_id) WHERE part_id = $1 AND ($2::integer = 0 OR revision = $2) ORDER BY revision DESC LIMIT 1;
-- storage/plant_registry_parts.cc kSelectGroups
SELECT hole_group, diameter_mm, depth_mm, a_nominal_deg, b_nominal_deg, axis_in_part, position_tolerance_mm, inclination_tolerance_deg FROM part_hole_groups WHERE part_id = $1 AND revision = $2 ORDER BY group_index;
-- storage/plant_registry_parts.cc kSelectHoles
SELECT group_index, hole, start_in_part_mm, normal_in_part FROM part_holes WHERE part_id = $1 AND revision = $2 ORDER BY group_index, hole_index;
-- storage/plant_registry_parts.cc kSelectDatums
SELECT datum, point_in_part_mm, normal_in_part FROM part_datum_points WHERE part_id = $1 AND revision = $2 ORDER BY datum_index;
-- storage/probe_calibrations.cc kInsertProbe
INSERT INTO probe_calibrations (calibration_id, block, approach, offset_mm, covariance, point_standard_uncertainty_mm, scale, scale_standard_uncertainty, direction_standard_uncertainty_urad, noise_um, noise_factor, residual_rms_um, touch_rms_um, condition_number, displacement_matrix_condition_number, worst_approach_angle_deg) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16);
-- storage/probe_calibrations.cc kSelectProbes
SELECT calibration_id, block, approach, offset_mm, covariance, point_standard_uncertainty_mm, scale, scale_standard_uncertainty, direction_standard_uncertainty_urad, noise_um, noise_factor, residual_rms_um, touch_rms_um, condition_number, displacement_matrix_condition_number, worst_approach_angle_deg FROM probe_calibrations WHERE calibration_id = ANY ($1::uuid[]);
-- storage/probe_calibrations.cc kInsertReadings
INSERT INTO probe_calibration_readings (calibration_id, position_index, face, displacement_mm, residual_um) SELECT $1::uuid, (position - 1)::integer, face, displacement_mm, residual_um FROM unnest($2::text[], $3::double precision[], $4::double precision[]) WITH ORDINALITY AS reading (face, displacement_mm, residual_um, position);
-- storage/probe_calibrations.cc kInsertChecks
INSERT INTO probe_calibration_checks (calibration_id, position_index, face, reading_count, angle_urad, origin_distance_um, distance_um, residual_range_um) SELECT $1::uuid, (position - 1)::integer, face, reading_count::integer, angle_urad, origin_distance_um, distance_um, residual_range_um FROM unnest($2::text[], $3::double precision[], $4::double precision[], $5::double precision[], $6::double precision[], $7::double precision[]) WITH ORDINALITY AS face_check (face, reading_count, angle_urad, origin_distance_um, distance_um, residual_range_um, position);
-- storage/probe_calibrations.cc kSelectReadings
SELECT face, displacement_mm, residual_um FROM probe_calibration_readings WHERE calibration_id = $1 ORDER BY position_index;
-- storage/probe_calibrations.cc kSelectChecks
SELECT face, reading_count, angle_urad, origin_distance_um, distance_um, residual_range_um FROM probe_calibration_checks WHERE calibration_id = $1 ORDER BY position_index;
-- storage/record.cc kAppend
SELECT new_sequence, new_recorded_at, edge_count FROM append_record($1, $2, $3, $4, $5, $6, $7, $8, $9, $10::jsonb, $11::text[], $12, $13::uuid, $14::bytea);
-- storage/record.cc kSelectEntry
SELECT e.record_sequence, e.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method, e.software_version, e.requested_by, e.measured_at, e.summary::text, ARRAY(SELECT m.name FROM record_inputs i JOIN record_names m ON m.record_id = i.input_id WHERE i.record_id = e.record_id ORDER BY i.position_index) FROM record_entries e JOIN record_names n ON n.record_id = e.record_id WHERE n.name = $1;
-- storage/record.cc kSelectBlade
SELECT e.record_sequence, e.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method, e.software_version, e.requested_by, e.measured_at, e.summary::text, ARRAY(SELECT m.name FROM record_inputs i JOIN record_names m ON m.record_id = i.input_id WHERE i.record_id = e.record_id ORDER BY i.position_index) FROM record_entries e JOIN record_names n ON n.record_id = e.record_id WHERE e.blade_serial = $1 AND e.record_sequence > $2 ORDER BY e.record_sequence LIMIT $3;
-- storage/record.cc kSelectRecorded
SELECT 1 FROM record_names n WHERE (n.name = $1 OR (n.name >= $1 || '@' AND n.name < $1 || 'A')) LIMIT 1;
-- storage/record.cc kSelectDerived
WITH RECURSIVE derived (record_id) AS (SELECT i.record_id FROM record_inputs i JOIN record_names n ON n.record_id = i.input_id WHERE (n.name = $1 OR (n.name >= $1 || '@' AND n.name < $1 || 'A')) UNION SELECT i.record_id FROM derived d JOIN record_inputs i ON i.input_id = d.record_id) SELECT e.record_sequence, e.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method, e.software_version, e.requested_by, e.measured_at, e.summary::text, ARRAY(SELECT m.name FROM record_inputs i JOIN record_names m ON m.record_id = i.input_id WHERE i.record_id = e.record_id ORDER BY i.position_index) FROM record_entries e JOIN record_names n ON n.record_id = e.record_id JOIN derived d ON d.record_id = e.record_id WHERE (cardinality($2::text[]) = 0 OR e.kind = ANY ($2::text[])) AND e.record_sequence > $3 ORDER BY e.record_sequence LIMIT $4;
-- storage/registrations.cc kInsertRegistration
INSERT INTO registrations (registration_id, blade_serial, machine_id, machine_revision, part_id, part_revision, method, sensor_calibration_id, rotation_calibration_id, outcome, zero_from_part, reference_mm, covariance, noise_covariance, calibration_sensitivity, point_count, points_used, iteration_count, residual_rms_um, residual_sigma_um, condition_number, weakest_direction, weakest_standard_uncertainty_um, remark, compute_seconds, requested_by, software_version, weakest_direction_in_words, noise_sigma_um, model_sigma_um, information_kept, surface_part, least_stock_mm, lacking_mm, disagreement_um, disagreement_ratio, disagrees, for_inspection, options, detail) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, $23, $24, $25, $26, $27, $28, $29, $30, $31, $32, $33, $34, $35, $36, $37, $38, $39::jsonb, $40::jsonb);
-- storage/registrations.cc kSelectRegistration
SELECT registration_id, blade_serial, machine_id, machine_revision, part_id, part_revision, method, sensor_calibration_id, rotation_calibration_id, outcome, zero_from_part, reference_mm, covariance, noise_covariance, calibration_sensitivity, point_count, points_used, iteration_count, residual_rms_um, residual_sigma_um, condition_number, weakest_direction, weakest_standard_uncertainty_um, remark, compute_seconds, requested_by, software_version, weakest_direction_in_words, noise_sigma_um, model_sigma_um, information_kept, surface_part, least_stock_mm, lacking_mm, disagreement_um, disagreement_ratio, disagrees, for_inspection, options::text, detail::text, record_sequence, recorded_at FROM registrations JOIN recorded r ON r.record_id = registration_id WHERE registration_id = $1;
-- storage/registrations.cc kListRegistrations
SELECT registration_id, blade_serial, machine_id, machine_revision, part_id, part_revision, method, sensor_calibration_id, rotation_calibration_id, outcome, zero_from_part, reference_mm, covariance, noise_covariance, calibration_sensitivity, point_count, points_used, iteration_count, residual_rms_um, residual_sigma_um, condition_number, weakest_direction, weakest_standard_uncertainty_um, remark, compute_seconds, requested_by, software_version, weakest_direction_in_words, noise_sigma_um, model_sigma_um, information_kept, surface_part, least_stock_mm, lacking_mm, disagreement_um, disagreement_ratio, disagrees, for_inspection, options::text, detail::text, record_sequence, recorded_at FROM registrations JOIN recorded r ON r.record_id = registration_id WHERE entry_kind = 'registration' AND ($1::bigint = 0 OR record_sequence < $1::bigint) AND ($2 = '' OR entry_blade = $2) AND ($3 = '' OR entry_machine = $3) AND ($4 = '' OR part_id = $4) AND ($5::uuid IS NULL OR $5::uuid IN (sensor_calibration_id, rotation_calibration_id) OR EXISTS (SELECT 1 FROM registration_angles a WHERE a.registration_id = registrations.registration_id AND a.characterisation_id = $5::uuid)) AND ($6::timestamptz IS NULL OR recorded_at >= $6) AND ($7::timestamptz IS NULL OR recorded_at < $7) AND ($8 = '' OR outcome = $8) AND (NOT $9::boolean OR disagrees) AND NOT ($10::boolean AND for_inspection) ORDER BY record_sequence DESC LIMIT $11;
-- storage/registrations.cc kInsertScan
INSERT INTO registration_scans (registration_id, position_index, scan_key, point_count, points_used, residual_median_um) VALUES ($1, $2, (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || $3::text), $4, $5, $6);
-- storage/registrations.cc kInsertAgreement
INSERT INTO registration_agreements (registration_id, position_index, scan_key, other_scan_key, patch_count, difference_rms_um, expected_rms_um) VALUES ($1, $2, (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || $3::text), (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || $4::text), $5, $6, $7);
-- storage/registrations.cc kInsertDatum
INSERT INTO registration_datums (registration_id, position_index, datum_name, distance_um, standard_uncertainty_um, point_count) VALUES ($1, $2, $3, $4, $5, $6);
-- storage/registrations.cc kInsertAngle
INSERT INTO registration_angles (registration_id, position_index, axis, characterisation_id, commanded_deg, reached_deg, standard_uncertainty_deg, half_reversal_deg, pose_per_rad) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9);
-- storage/registrations.cc kSelectScans
SELECT registration_id, (SELECT substr(n.name, 7) FROM record_names n WHERE n.record_id = scan_key), point_count, points_used, residual_median_um FROM registration_scans WHERE registration_id = ANY ($1::uuid[]) ORDER BY registration_id, position_index;
-- storage/registrations.cc kSelectDatums
SELECT registration_id, datum_name, distance_um, standard_uncertainty_um, point_count FROM registration_datums WHERE registration_id = ANY ($1::uuid[]) ORDER BY registration_id, position_index;
-- storage/registrations.cc kSelectAgreements
SELECT registration_id, (SELECT substr(n.name, 7) FROM record_names n WHERE n.record_id = scan_key), (SELECT substr(n.name, 7) FROM record_names n WHERE n.record_id = other_scan_key), patch_count, difference_rms_um, expected_rms_um FROM registration_agreements WHERE registration_id = ANY ($1::uuid[]) ORDER BY registration_id, position_index;
-- storage/registrations.cc kSelectAngles
SELECT registration_id, axis, characterisation_id, commanded_deg, reached_deg, standard_uncertainty_deg, half_reversal_deg, pose_per_rad FROM registration_angles WHERE registration_id = ANY ($1::uuid[]) ORDER BY registration_id, position_index;
-- storage/requests.cc kLockRequest
SELECT pg_advisory_xact_lock(hashtextextended($1 || ' ' || $2, 0));
-- storage/requests.cc kSelectKept
SELECT r.request_sha256, n.name FROM requests r JOIN record_names n ON n.record_id = r.record_id WHERE r.request_id = $2::uuid AND r.call = $1;
-- storage/requests.cc kInsertKept
INSERT INTO requests (call, request_id, request_sha256, record_id) SELECT $1, $2::uuid, $3, n.record_id FROM record_names n WHERE n.name = $4;
-- storage/retention.cc kSelectDeletion
SELECT s.scan_id, d.reason, d.requested_by, coalesce(d.policy_kind, ''), coalesce(d.policy_revision, 0), d.points_sha256, d.points_bytes, r.record_sequence, r.recorded_at, to_char(r.recorded_at AT TIME ZONE 'UTC', 'YYYY-MM-DD HH24:MI:SS"Z"') FROM scan_deletions d JOIN scans s USING (scan_key) JOIN record_names r USING (record_id) WHERE d.scan_key = (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || $1::text);
-- storage/retention.cc kInsertDeletion
INSERT INTO scan_deletions (scan_key, reason, requested_by, policy_kind, policy_revision, points_sha256, points_bytes, record_id) VALUES ((SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || $1::text), $2, $3, $4, $5, $6, $7, $8);
-- storage/retention.cc kLockBlobsOfScan
SELECT b.sha256 FROM blobs b WHERE b.sha256 IN (SELECT unnest(ARRAY[blob_sha256, evidence_sha256]) FROM scan_blocks WHERE scan_key = (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || $1::text)) AND b.deleted_at IS NULL ORDER BY b.sha256 FOR UPDATE OF b SKIP LOCKED;
-- storage/retention.cc kNoteLoose
INSERT INTO loose_blobs (sha256) SELECT b.sha256 FROM blobs b WHERE b.sha256 IN (SELECT unnest(ARRAY[blob_sha256, evidence_sha256]) FROM scan_blocks WHERE scan_key = (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || $1::text)) AND b.deleted_at IS NULL AND NOT b.sha256 = ANY ($2::bytea[]) ON CONFLICT (sha256) DO NOTHING;
-- storage/retention.cc kSelectLoose
SELECT b.sha256 FROM blobs b WHERE b.sha256 > $1 AND b.sha256 IN (SELECT l.sha256 FROM loose_blobs l);
-- storage/retention.cc kForgetLoose
DELETE FROM loose_blobs WHERE sha256 = ANY ($1::bytea[]);
-- storage/retention.cc kDeleteBytes
UPDATE blobs b SET bytes = NULL, deleted_at = clock_timestamp(), deletion_reason = $2 WHERE b.sha256 = ANY ($1::bytea[]) AND b.deleted_at IS NULL;
-- storage/retention.cc kSelectInForce
SELECT p.scan_kind, p.revision, p.keep_days, coalesce(g.after_scan_key, '00000000-0000-0000-0000-000000000000') FROM retention_policies p LEFT JOIN retention_progress g ON g.scan_kind = p.scan_kind AND g.policy_revision = p.revision WHERE p.keep_days IS NOT NULL AND NOT EXISTS (SELECT 1 FROM retention_policies q WHERE q.scan_kind = p.scan_kind AND q.revision > p.revision) ORDER BY p.scan_kind;
-- storage/retention.cc kSelectDue
SELECT s.scan_id, s.stored_bytes, s.scan_key, EXISTS (SELECT 1 FROM scan_deletions d WHERE d.scan_key = s.scan_key), n.recorded_at < now() - make_interval(days => $3) FROM scans s JOIN recorded n ON n.record_id = s.scan_key WHERE s.kind = $1 AND s.scan_key > $2 AND s.scan_key < least_uuid_of(now() - make_interval(days => $3, hours => 1)) ORDER BY s.scan_key LIMIT $4;
-- storage/retention.cc kKeepProgress
INSERT INTO retention_progress (scan_kind, policy_revision, after_scan_key) VALUES ($1, $2, $3) ON CONFLICT (scan_kind) DO UPDATE SET policy_revision = excluded.policy_revision, after_scan_key = excluded.after_scan_key;
-- storage/retention_policies.cc kLockPolicies
SELECT pg_advisory_xact_lock(hashtextextended('retention_policies/' || $1, 0));
-- storage/retention_policies.cc kInsertPolicy
INSERT INTO retention_policies (scan_kind, revision, keep_days, requested_by, record_id) VALUES ($1, $2, $3, $4, $5);
-- storage/retention_policies.cc kSelectPolicy
SELECT p.scan_kind, p.revision, p.keep_days, p.requested_by, record_sequence, recorded_at FROM retention_policies p JOIN record_names USING (record_id) WHERE p.scan_kind = $1 AND p.revision = $2;
-- storage/retention_policies.cc kSelectPolicies
SELECT p.scan_kind, p.revision, p.keep_days, p.requested_by, record_sequence, recorded_at FROM retention_policies p JOIN record_names USING (record_id) WHERE ($1 OR NOT EXISTS (SELECT 1 FROM retention_policies q WHERE q.scan_kind = p.scan_kind AND q.revision > p.revision)) AND ($2 = '' OR p.scan_kind > $2 OR (p.scan_kind = $2 AND p.revision < $3)) ORDER BY p.scan_kind, p.revision DESC LIMIT $4;
-- storage/retention_policies.cc kSelectNewest
SELECT max(revision) FROM retention_policies WHERE scan_kind = $1;
-- storage/scan_uploads.cc kSelectUpload
SELECT header, machine_revision, artefact_revision, next_block, point_count, profile_count, stored_bytes, proven_error_um, open_profile_points, open_profile_x_mm FROM scan_uploads WHERE scan_id = $1;
-- storage/scan_uploads.cc kInsertUpload
INSERT INTO scan_uploads (scan_id, header, machine_revision, artefact_revision) VALUES ($1, $2, $3, $4);
-- storage/scan_uploads.cc kInsertBlock
WITH advanced AS (UPDATE scan_uploads SET next_block = $2::integer + 1, point_count = $3, profile_count = $4, stored_bytes = $5, proven_error_um = $6, open_profile_points = $7, open_profile_x_mm = $8, touched_at = clock_timestamp() WHERE scan_id = $1 AND next_block = $2::integer RETURNING scan_id) INSERT INTO scan_upload_blocks (scan_id, block_index, point_count, first_profile, profile_count, sent_sha256, blob_sha256, evidence_sha256) SELECT scan_id, $2::integer, $9::integer, $10::integer, $11::integer, $12::bytea, $13::bytea, decode(nullif($14::text, ''), 'hex') FROM advanced;
-- storage/scan_uploads.cc kSelectBlocks
SELECT block_index, point_count, blob_sha256, first_profile, profile_count, sent_sha256, evidence_sha256 FROM scan_upload_blocks WHERE scan_id = $1 ORDER BY block_index;
-- storage/scan_uploads.cc kDeleteUpload
DELETE FROM scan_uploads WHERE scan_id = $1;
-- storage/scan_uploads.cc kDeleteUntouched
WITH gone AS (DELETE FROM scan_uploads WHERE touched_at < $1 RETURNING scan_id), loose AS (INSERT INTO loose_blobs (sha256) SELECT blob_sha256 FROM scan_upload_blocks WHERE scan_id IN (SELECT scan_id FROM gone) UNION SELECT evidence_sha256 FROM scan_upload_blocks WHERE scan_id IN (SELECT scan_id FROM gone) AND evidence_sha256 IS NOT NULL ON CONFLICT (sha256) DO NOTHING) SELECT count(*) FROM gone;
-- storage/scans.cc kLockScanId
SELECT pg_advisory_xact_lock(hashtextextended('scans/' || $1, 0));
-- storage/scans.cc kInsertScan
INSERT INTO scans (scan_id, machine_id, machine_revision, artefact_id, artefact_revision, blade_serial, kind, v0_x_mm, v0_y_mm, v0_z_mm, a_deg, b_deg, profile_pitch_mm, columns_per_profile, point_count, encoding, sender_error_um, error_bound_um, measured_at, block_count, stored_bytes, stored_sha256, sent_sha256, proven_error_um, stored_encoding, profile_count, raw_step_um, scan_key) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, $23, $24, $25, $26, $27, $28);
-- storage/scans.cc kSelectScan
SELECT scan_id, machine_id, machine_revision, artefact_id, artefact_revision, blade_serial, kind, v0_x_mm, v0_y_mm, v0_z_mm, a_deg, b_deg, profile_pitch_mm, columns_per_profile, point_count, encoding, sender_error_um, error_bound_um, measured_at, block_count, stored_bytes, stored_sha256, sent_sha256, proven_error_um, stored_encoding, profile_count, raw_step_um, record_sequence, recorded_at FROM scans JOIN recorded r ON r.record_id = scan_key WHERE scan_key = (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || $1::text);
-- storage/scans.cc kListScans
SELECT scan_id, machine_id, machine_revision, artefact_id, artefact_revision, blade_serial, kind, v0_x_mm, v0_y_mm, v0_z_mm, a_deg, b_deg, profile_pitch_mm, columns_per_profile, point_count, encoding, sender_error_um, error_bound_um, measured_at, block_count, stored_bytes, stored_sha256, sent_sha256, proven_error_um, stored_encoding, profile_count, raw_step_um, record_sequence, recorded_at FROM scans JOIN recorded r ON r.record_id = scan_key WHERE entry_kind = 'scan' AND ($1::bigint = 0 OR record_sequence < $1::bigint) AND ($2 = '' OR entry_machine = $2) AND ($3 = '' OR artefact_id = $3) AND ($4 = '' OR entry_blade = $4) AND ($5 = '' OR kind = $5) AND ($6 = '' OR blade_serial IN (SELECT b.blade_serial FROM blades b WHERE b.part_id = $6)) AND ($7::timestamptz IS NULL OR recorded_at >= $7) AND ($8::timestamptz IS NULL OR recorded_at < $8) ORDER BY record_sequence DESC LIMIT $9;
-- storage/scans.cc kInsertBlocks
INSERT INTO scan_blocks (scan_key, block_index, point_count, blob_sha256, first_profile, profile_count, sent_sha256, evidence_sha256) SELECT $1::uuid, (position - 1)::integer, points::integer, blob, first::integer, profiles::integer, sent, decode(nullif(evidence, ''), 'hex') FROM unnest($2::text[], $3::bytea[], $4::text[], $5::text[], $6::bytea[], $7::text[]) WITH ORDINALITY AS block (points, blob, first, profiles, sent, evidence, position);
-- storage/scans.cc kSelectBlocks
SELECT block_index, point_count, blob_sha256, first_profile, profile_count, sent_sha256, evidence_sha256 FROM scan_blocks WHERE scan_key = (SELECT n.record_id FROM record_names n WHERE n.name = 'scans/' || $1::text) ORDER BY block_index;
-- storage/studies.cc kInsertStudy
INSERT INTO studies (study_id, machine_id, kind, inputs, request_sha256, verdict, result, temperature_c, requested_by, software_version) VALUES ($1, $2, $3, $4, $5, $6, $7::jsonb, $8, $9, $10);
-- storage/studies.cc kSelectStudy
SELECT study_id, machine_id, kind, inputs, request_sha256, verdict, result, temperature_c, requested_by, software_version, record_sequence, recorded_at FROM studies JOIN record_names n ON n.record_id = study_id WHERE study_id = $1;
-- storage/studies.cc kSelectPage
SELECT study_id, machine_id, kind, inputs, request_sha256, verdict, result, temperature_c, requested_by, software_version, record_sequence, recorded_at FROM studies JOIN record_names n ON n.record_id = study_id WHERE ($1 = '' OR machine_id = $1) AND ($2 = '' OR kind = $2) AND ($3 = '' OR verdict = $3) AND ($4::timestamptz IS NULL OR recorded_at >= $4) AND ($5::timestamptz IS NULL OR recorded_at < $5) AND ($6::bigint = 0 OR record_sequence < $6::bigint) ORDER BY record_sequence DESC LIMIT $7;
