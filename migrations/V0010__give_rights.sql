-- One role for each service, with what it reads and appends and nothing more. None owns a table, so none can switch a trigger off,
-- change a row of the record, or alter the schema; the owner of the database does that, with sixpoint-migrate.

DO $$
DECLARE
  area text;
BEGIN
  FOREACH area IN ARRAY ARRAY['plant', 'ingest', 'calibration', 'registration', 'correction', 'inspection'] LOOP
    BEGIN
      IF NOT EXISTS (SELECT 1 FROM pg_roles WHERE rolname = 'sixpoint_' || area) THEN
        EXECUTE format('CREATE ROLE %I LOGIN', 'sixpoint_' || area);
      END IF;
    EXCEPTION
      WHEN duplicate_object OR unique_violation THEN NULL;  -- another database of this server, at the same moment
      WHEN insufficient_privilege THEN
        RAISE EXCEPTION 'role sixpoint_%: missing, want CREATE ROLE sixpoint_% LOGIN by an administrator', area, area
          USING ERRCODE = 'insufficient_privilege';
    END;
    EXECUTE format('GRANT SELECT, INSERT ON record_names, record_entries, record_inputs, requests TO %I', 'sixpoint_' || area);
    EXECUTE format('GRANT SELECT ON schema_migrations, recorded TO %I', 'sixpoint_' || area);
    EXECUTE format('GRANT USAGE ON SEQUENCE record_sequence TO %I', 'sixpoint_' || area);
  END LOOP;
END
$$;
-- Asked by a trigger for everyone who appends to the journal.
ALTER FUNCTION refuse_withdrawn_input() SECURITY DEFINER SET search_path = public, pg_temp;

-- Bytes: whoever puts some may put back what was deleted (the trigger lets nothing else pass); ingest alone takes away.
GRANT SELECT, INSERT, UPDATE (bytes, store, object_id, deleted_at, deletion_reason) ON blobs
  TO sixpoint_plant, sixpoint_ingest, sixpoint_calibration, sixpoint_correction;
GRANT DELETE ON blobs TO sixpoint_ingest;
GRANT SELECT, INSERT ON blob_damages TO sixpoint_ingest;
GRANT SELECT ON plant_identity TO sixpoint_ingest;
GRANT SELECT, UPDATE ON blob_check_progress TO sixpoint_ingest;
GRANT SELECT ON blob_use TO sixpoint_ingest;
GRANT SELECT, INSERT, DELETE ON loose_blobs TO sixpoint_ingest;
GRANT SELECT, INSERT, UPDATE ON retention_progress TO sixpoint_ingest;

GRANT SELECT, INSERT ON machines, machine_revisions, machine_joints, artefacts, artefact_revisions, artefact_features,
  tessellations, parts, part_revisions, part_hole_groups, part_holes, part_datum_points, blades TO sixpoint_plant;

GRANT SELECT, INSERT ON scans, scan_blocks, scan_deletions, retention_policies TO sixpoint_ingest;
GRANT SELECT, INSERT, UPDATE, DELETE ON scan_uploads, scan_upload_blocks TO sixpoint_ingest;
GRANT SELECT ON blades TO sixpoint_ingest;
-- The collector asks who refers to a blob; detach_month lets it read what it detaches.
GRANT USAGE ON SCHEMA detached TO sixpoint_ingest;
GRANT SELECT (cad_sha256, surface_sha256) ON tessellations TO sixpoint_ingest;
GRANT SELECT (cad_sha256) ON part_revisions TO sixpoint_ingest;
GRANT SELECT (request_sha256) ON calibrations, studies TO sixpoint_ingest;
GRANT SELECT (nc_template_sha256, nc_program_sha256) ON corrections TO sixpoint_ingest;

GRANT SELECT, INSERT ON calibrations, calibration_events, sensor_calibrations, sensor_calibration_centres,
  rotation_calibrations, rotation_calibration_poses, probe_calibrations, probe_calibration_readings,
  probe_calibration_checks, axis_characterisations, studies TO sixpoint_calibration;
GRANT SELECT ON calibration_forces TO sixpoint_calibration;

GRANT SELECT, INSERT ON registrations, registration_scans, registration_agreements, registration_datums, registration_angles
  TO sixpoint_registration;
GRANT SELECT, INSERT ON corrections, correction_groups, correction_holes TO sixpoint_correction;
GRANT SELECT, INSERT ON inspections, inspection_holes, inspection_scans TO sixpoint_inspection;
-- Whose tables were applied: the registration's are the correction's, and a filter of lists.
GRANT SELECT ON registration_angles TO sixpoint_correction, sixpoint_inspection;

-- Ingest makes months and lets old requests go. Both run as the owner and can do no more than they say.
REVOKE EXECUTE ON FUNCTION make_partitions(integer), drop_requests_before(date), detach_month(date), add_up_blob_use(),
  make_partition(regclass, text, boolean, date), make_append_only(regclass) FROM PUBLIC;
GRANT EXECUTE ON FUNCTION make_partitions(integer), drop_requests_before(date), add_up_blob_use() TO sixpoint_ingest;
