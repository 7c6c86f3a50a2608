-- How far a blade's surface is off its CAD, place by place, and its profile tolerances. Patches are arrays: a map has up to 100000, always read
-- together. Points are Draco clouds among the blobs.

CREATE TABLE deviation_maps (
  deviation_id uuid NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  registration_id uuid NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  machine_revision integer NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  part_revision integer NOT NULL,
  sensor_calibration_id uuid NOT NULL,
  rotation_calibration_id uuid NOT NULL,
  method text NOT NULL,
  patch_mm double precision NOT NULL,
  patch_count integer NOT NULL,
  compared_count bigint NOT NULL,
  at_edges_count bigint NOT NULL,
  set_aside_count bigint NOT NULL,
  far_off_count bigint NOT NULL,
  budget_sources text[] NOT NULL,
  budget_um real[] NOT NULL,
  verdict text,
  decision_rule text,
  patches_sha256 bytea NOT NULL,
  cloud_sha256 bytea,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  computed_on text NOT NULL,
  CONSTRAINT deviation_maps_pk PRIMARY KEY (deviation_id),
  CONSTRAINT deviation_maps_blade_fk FOREIGN KEY (blade_serial) REFERENCES blades (blade_serial),
  CONSTRAINT deviation_maps_registration_fk FOREIGN KEY (registration_id) REFERENCES record_names (record_id),
  CONSTRAINT deviation_maps_machine_fk FOREIGN KEY (machine_id, machine_revision) REFERENCES machine_revisions (machine_id, revision),
  CONSTRAINT deviation_maps_part_fk FOREIGN KEY (part_id, part_revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT deviation_maps_sensor_calibration_fk FOREIGN KEY (sensor_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT deviation_maps_rotation_calibration_fk FOREIGN KEY (rotation_calibration_id) REFERENCES calibrations (calibration_id),
  CONSTRAINT deviation_maps_record_fk FOREIGN KEY (deviation_id) REFERENCES record_names (record_id) DEFERRABLE INITIALLY DEFERRED,
  CONSTRAINT deviation_maps_revisions_positive CHECK (machine_revision > 0 AND part_revision > 0),
  CONSTRAINT deviation_maps_method_known CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS', 'ALLOWANCE')),
  CONSTRAINT deviation_maps_patches CHECK (patch_mm BETWEEN 0.1 AND 20 AND patch_count BETWEEN 1 AND 1000000),
  CONSTRAINT deviation_maps_points_counted CHECK (compared_count > 0 AND at_edges_count >= 0 AND set_aside_count >= 0 AND far_off_count >= 0),
  CONSTRAINT deviation_maps_budget CHECK (cardinality(budget_sources) <= 1000
    AND cardinality(budget_um) = cardinality(budget_sources) AND 0 <= ALL (budget_um) AND 1e9 > ALL (budget_um)),
  CONSTRAINT deviation_maps_budget_sources_whole CHECK (array_position(budget_sources, NULL) IS NULL),
  CONSTRAINT deviation_maps_budget_um_whole CHECK (array_position(budget_um, NULL) IS NULL),
  CONSTRAINT deviation_maps_verdict_known CHECK (verdict IN ('CONFORM', 'NOT_CONFORM', 'UNDECIDABLE', 'NOT_MEASURED')
    AND decision_rule <> '' AND octet_length(decision_rule) <= 1000),
  CONSTRAINT deviation_maps_verdict_by_rule CHECK ((verdict IS NULL) = (decision_rule IS NULL)),
  CONSTRAINT deviation_maps_digests CHECK (octet_length(patches_sha256) = 32 AND octet_length(cloud_sha256) = 32),
  CONSTRAINT deviation_maps_texts CHECK (requested_by <> '' AND octet_length(requested_by) <= 200 AND software_version <> ''
    AND octet_length(software_version) <= 200 AND octet_length(computed_on) BETWEEN 1 AND 200)
) PARTITION BY RANGE (deviation_id);
CREATE INDEX deviation_maps_by_registration ON deviation_maps (registration_id);
COMMENT ON TABLE deviation_maps IS 'A blade''s surface against its CAD after a named fit: deviations/{id}. Distances are positive outside.';
COMMENT ON COLUMN deviation_maps.registration_id IS 'The fit, and whose scans.';
COMMENT ON COLUMN deviation_maps.patch_mm IS 'Edge of a patch.';
COMMENT ON COLUMN deviation_maps.at_edges_count IS 'Points so near to an edge or rim that noise decides which face they are of.';
COMMENT ON COLUMN deviation_maps.set_aside_count IS 'Points where pins stand.';
COMMENT ON COLUMN deviation_maps.far_off_count IS 'Points more than 1 mm from the CAD.';
COMMENT ON COLUMN deviation_maps.budget_um IS 'Of a patch''s mean, standard, of each of budget_sources: root mean square by area over the patches that were seen.';
COMMENT ON COLUMN deviation_maps.verdict IS 'The worst of deviation_profiles; NULL: none was asked for.';
COMMENT ON COLUMN deviation_maps.patches_sha256 IS 'Of the columns of deviation_patches, each little-endian, in their order.';
COMMENT ON COLUMN deviation_maps.cloud_sha256 IS 'Of the blobs'' digests in their order; NULL: no cloud was kept.';

CREATE TABLE deviation_map_scans (
  deviation_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_key uuid NOT NULL,
  CONSTRAINT deviation_map_scans_pk PRIMARY KEY (deviation_id, position_index),
  CONSTRAINT deviation_map_scans_once UNIQUE (deviation_id, scan_key),
  CONSTRAINT deviation_map_scans_map_fk FOREIGN KEY (deviation_id) REFERENCES deviation_maps (deviation_id),
  CONSTRAINT deviation_map_scans_scan_fk FOREIGN KEY (scan_key) REFERENCES record_names (record_id),
  CONSTRAINT deviation_map_scans_position CHECK (position_index BETWEEN 0 AND 63)
) PARTITION BY RANGE (deviation_id);
CREATE INDEX deviation_map_scans_by_scan ON deviation_map_scans (scan_key);
COMMENT ON TABLE deviation_map_scans IS 'The scans of a map, in the registration''s order.';

CREATE TABLE deviation_regions (
  deviation_id uuid NOT NULL,
  position_index integer NOT NULL,
  region text NOT NULL,
  minimum_in_part_mm double precision[],
  maximum_in_part_mm double precision[],
  facing_in_part double precision[],
  facing_within_deg double precision,
  area_mm2 double precision NOT NULL,
  seen_area_mm2 double precision NOT NULL,
  point_count bigint NOT NULL,
  mean_um double precision,
  rms_um double precision,
  p05_um double precision,
  p50_um double precision,
  p95_um double precision,
  lowest_patch integer,
  lowest_um double precision,
  lowest_expanded_uncertainty_um double precision,
  lowest_in_part_mm double precision[],
  highest_patch integer,
  highest_um double precision,
  highest_expanded_uncertainty_um double precision,
  highest_in_part_mm double precision[],
  CONSTRAINT deviation_regions_pk PRIMARY KEY (deviation_id, position_index),
  CONSTRAINT deviation_regions_once UNIQUE (deviation_id, region),
  CONSTRAINT deviation_regions_map_fk FOREIGN KEY (deviation_id) REFERENCES deviation_maps (deviation_id),
  CONSTRAINT deviation_regions_position CHECK (position_index BETWEEN 0 AND 64 AND (region = '') = (position_index = 0)),
  CONSTRAINT deviation_regions_named CHECK (octet_length(region) <= 200),
  CONSTRAINT deviation_regions_box CHECK (is_triple(minimum_in_part_mm) AND is_triple(maximum_in_part_mm)),
  CONSTRAINT deviation_regions_facing CHECK (is_triple(facing_in_part) AND facing_within_deg > 0 AND facing_within_deg <= 180),
  CONSTRAINT deviation_regions_facing_within CHECK ((facing_in_part IS NULL) = (facing_within_deg IS NULL)),
  CONSTRAINT deviation_regions_area CHECK (area_mm2 > 0 AND area_mm2 < 1e12 AND seen_area_mm2 >= 0 AND seen_area_mm2 < 1e12 AND point_count >= 0),
  CONSTRAINT deviation_regions_seen_or_not CHECK (num_nulls(mean_um, rms_um, p05_um, p50_um, p95_um, lowest_patch, lowest_um,
    lowest_expanded_uncertainty_um, lowest_in_part_mm, highest_patch, highest_um, highest_expanded_uncertainty_um, highest_in_part_mm)
    = CASE WHEN seen_area_mm2 > 0 THEN 0 ELSE 13 END),
  CONSTRAINT deviation_regions_ordered CHECK (lowest_um > -1e9 AND highest_um < 1e9 AND lowest_um <= mean_um + 1e-6 AND mean_um <= highest_um + 1e-6
    AND rms_um >= 0 AND rms_um < 1e9 AND -1e9 < p05_um AND p05_um <= p50_um AND p50_um <= p95_um AND p95_um < 1e9),
  CONSTRAINT deviation_regions_patches CHECK (lowest_patch >= 0 AND highest_patch >= 0 AND lowest_expanded_uncertainty_um >= 0
    AND lowest_expanded_uncertainty_um < 1e9 AND highest_expanded_uncertainty_um >= 0 AND highest_expanded_uncertainty_um < 1e9
    AND is_triple(lowest_in_part_mm) AND is_triple(highest_in_part_mm)),
  CONSTRAINT deviation_regions_minimum_in_part_mm_whole CHECK (array_position(minimum_in_part_mm, NULL) IS NULL),
  CONSTRAINT deviation_regions_maximum_in_part_mm_whole CHECK (array_position(maximum_in_part_mm, NULL) IS NULL),
  CONSTRAINT deviation_regions_facing_in_part_whole CHECK (array_position(facing_in_part, NULL) IS NULL),
  CONSTRAINT deviation_regions_lowest_in_part_mm_whole CHECK (array_position(lowest_in_part_mm, NULL) IS NULL),
  CONSTRAINT deviation_regions_highest_in_part_mm_whole CHECK (array_position(highest_in_part_mm, NULL) IS NULL)
) PARTITION BY RANGE (deviation_id);
COMMENT ON TABLE deviation_regions IS 'Statistics of the whole surface ('''', position 0) and of each region that was asked for.';
COMMENT ON COLUMN deviation_regions.minimum_in_part_mm IS 'Corner of the box that the patches'' middles lie in, as maximum_in_part_mm; NULL: not bounded.';
COMMENT ON COLUMN deviation_regions.facing_in_part IS 'Outward normals lie within facing_within_deg of it; NULL: any.';
COMMENT ON COLUMN deviation_regions.seen_area_mm2 IS 'Of patches with at least ten points: the rest was not measured.';
COMMENT ON COLUMN deviation_regions.mean_um IS 'Of the patches'' means, by area, as rms_um; percentiles are of points. NULL: nothing was seen.';
COMMENT ON COLUMN deviation_regions.lowest_patch IS 'Place in the arrays of deviation_patches, from 0 on.';

CREATE TABLE deviation_profiles (
  deviation_id uuid NOT NULL,
  position_index integer NOT NULL,
  characteristic text NOT NULL,
  region text NOT NULL,
  zone text NOT NULL,
  lower_mm double precision NOT NULL,
  upper_mm double precision NOT NULL,
  least_coverage double precision NOT NULL,
  verdict text NOT NULL,
  reason text NOT NULL,
  coverage double precision NOT NULL,
  out_mm2 double precision NOT NULL,
  undecided_mm2 double precision NOT NULL,
  area_count integer NOT NULL,
  motion double precision[],
  lowest_patch integer,
  lowest_um double precision,
  lowest_expanded_uncertainty_um double precision,
  lowest_in_part_mm double precision[],
  highest_patch integer,
  highest_um double precision,
  highest_expanded_uncertainty_um double precision,
  highest_in_part_mm double precision[],
  CONSTRAINT deviation_profiles_pk PRIMARY KEY (deviation_id, position_index),
  CONSTRAINT deviation_profiles_once UNIQUE (deviation_id, characteristic),
  CONSTRAINT deviation_profiles_map_fk FOREIGN KEY (deviation_id) REFERENCES deviation_maps (deviation_id),
  CONSTRAINT deviation_profiles_region_fk FOREIGN KEY (deviation_id, region) REFERENCES deviation_regions (deviation_id, region),
  CONSTRAINT deviation_profiles_position CHECK (position_index BETWEEN 0 AND 63),
  CONSTRAINT deviation_profiles_texts CHECK (characteristic <> '' AND octet_length(characteristic) <= 200 AND octet_length(region) <= 200
    AND octet_length(reason) <= 1000),
  CONSTRAINT deviation_profiles_zone_known CHECK (zone IN ('FORM_AND_LOCATION', 'FORM')),
  CONSTRAINT deviation_profiles_limits CHECK (lower_mm >= -100 AND lower_mm < upper_mm AND upper_mm <= 100
    AND least_coverage BETWEEN 0 AND 1),
  CONSTRAINT deviation_profiles_verdict_known CHECK (verdict IN ('CONFORM', 'NOT_CONFORM', 'UNDECIDABLE', 'NOT_MEASURED')),
  CONSTRAINT deviation_profiles_seen_to_pass CHECK (coverage > 0 OR verdict = 'NOT_MEASURED'),
  CONSTRAINT deviation_profiles_reasoned CHECK ((verdict IN ('UNDECIDABLE', 'NOT_MEASURED')) = (reason <> '')),
  CONSTRAINT deviation_profiles_areas CHECK (coverage BETWEEN 0 AND 1.000001 AND out_mm2 >= 0 AND out_mm2 < 1e12 AND undecided_mm2 >= 0
    AND undecided_mm2 < 1e12 AND area_count >= 0),
  CONSTRAINT deviation_profiles_motion CHECK (cardinality(motion) = 6 AND -1e6 < ALL (motion) AND 1e6 > ALL (motion)),
  CONSTRAINT deviation_profiles_motion_of_form CHECK ((motion IS NOT NULL) = (zone = 'FORM')),
  CONSTRAINT deviation_profiles_motion_whole CHECK (array_position(motion, NULL) IS NULL),
  CONSTRAINT deviation_profiles_seen_or_not CHECK (num_nulls(lowest_patch, lowest_um, lowest_expanded_uncertainty_um, lowest_in_part_mm,
    highest_patch, highest_um, highest_expanded_uncertainty_um, highest_in_part_mm) = CASE WHEN coverage > 0 THEN 0 ELSE 8 END),
  CONSTRAINT deviation_profiles_ordered CHECK (lowest_um > -1e9 AND highest_um < 1e9 AND lowest_um <= highest_um AND lowest_patch >= 0
    AND highest_patch >= 0 AND lowest_expanded_uncertainty_um >= 0 AND lowest_expanded_uncertainty_um < 1e9
    AND highest_expanded_uncertainty_um >= 0 AND highest_expanded_uncertainty_um < 1e9
    AND is_triple(lowest_in_part_mm) AND is_triple(highest_in_part_mm)),
  CONSTRAINT deviation_profiles_lowest_in_part_mm_whole CHECK (array_position(lowest_in_part_mm, NULL) IS NULL),
  CONSTRAINT deviation_profiles_highest_in_part_mm_whole CHECK (array_position(highest_in_part_mm, NULL) IS NULL)
) PARTITION BY RANGE (deviation_id);
COMMENT ON TABLE deviation_profiles IS 'Profile tolerances of a map, judged patch by patch (ISO 1101, ISO 14253-1).';
COMMENT ON COLUMN deviation_profiles.region IS 'One of deviation_regions; empty: the whole surface.';
COMMENT ON COLUMN deviation_profiles.lowest_um IS 'The least mean of a patch in the zone, as highest_um the greatest; NULL: nothing was seen.';
COMMENT ON COLUMN deviation_profiles.coverage IS 'Share of the area that was seen.';
COMMENT ON COLUMN deviation_profiles.area_count IS 'Areas that are out; the farthest hundred are in deviation_profile_areas.';
COMMENT ON COLUMN deviation_profiles.motion IS
  'Of a zone of form: how the part was moved to fit it best, turns about X, Y, Z through the patches'' middle (rad), then shifts (mm).';

CREATE TABLE deviation_profile_areas (
  deviation_id uuid NOT NULL,
  profile_index integer NOT NULL,
  position_index integer NOT NULL,
  above boolean NOT NULL,
  area_mm2 double precision NOT NULL,
  patch_count integer NOT NULL,
  worst_patch integer NOT NULL,
  worst_um double precision NOT NULL,
  worst_expanded_uncertainty_um double precision NOT NULL,
  worst_in_part_mm double precision[] NOT NULL,
  minimum_in_part_mm double precision[] NOT NULL,
  maximum_in_part_mm double precision[] NOT NULL,
  CONSTRAINT deviation_profile_areas_pk PRIMARY KEY (deviation_id, profile_index, position_index),
  CONSTRAINT deviation_profile_areas_profile_fk FOREIGN KEY (deviation_id, profile_index)
    REFERENCES deviation_profiles (deviation_id, position_index),
  CONSTRAINT deviation_profile_areas_position CHECK (position_index BETWEEN 0 AND 99),
  CONSTRAINT deviation_profile_areas_size CHECK (area_mm2 > 0 AND area_mm2 < 1e12 AND patch_count > 0 AND worst_patch >= 0),
  CONSTRAINT deviation_profile_areas_worst CHECK (worst_um > -1e9 AND worst_um < 1e9 AND worst_expanded_uncertainty_um >= 0
    AND worst_expanded_uncertainty_um < 1e9 AND is_triple(worst_in_part_mm)),
  CONSTRAINT deviation_profile_areas_box CHECK (is_triple(minimum_in_part_mm) AND is_triple(maximum_in_part_mm)),
  CONSTRAINT deviation_profile_areas_worst_in_part_mm_whole CHECK (array_position(worst_in_part_mm, NULL) IS NULL),
  CONSTRAINT deviation_profile_areas_minimum_in_part_mm_whole CHECK (array_position(minimum_in_part_mm, NULL) IS NULL),
  CONSTRAINT deviation_profile_areas_maximum_in_part_mm_whole CHECK (array_position(maximum_in_part_mm, NULL) IS NULL)
) PARTITION BY RANGE (deviation_id);
COMMENT ON TABLE deviation_profile_areas IS 'Patches side by side that are out the same way, the farthest out first.';
COMMENT ON COLUMN deviation_profile_areas.above IS 'Beyond the upper limit; else below the lower.';
COMMENT ON COLUMN deviation_profile_areas.worst_um IS 'In the zone, of the patch that is farthest out.';
COMMENT ON COLUMN deviation_profile_areas.minimum_in_part_mm IS 'Of the patches'' middles, as maximum_in_part_mm.';

CREATE TABLE deviation_patches (
  deviation_id uuid NOT NULL,
  centres_in_part_mm double precision[] NOT NULL,
  normals_in_part real[] NOT NULL,
  areas_mm2 real[] NOT NULL,
  point_counts bigint[] NOT NULL,
  means_um real[] NOT NULL,
  expanded_uncertainties_um real[] NOT NULL,
  CONSTRAINT deviation_patches_pk PRIMARY KEY (deviation_id),
  CONSTRAINT deviation_patches_map_fk FOREIGN KEY (deviation_id) REFERENCES deviation_maps (deviation_id),
  CONSTRAINT deviation_patches_each CHECK (cardinality(areas_mm2) > 0 AND cardinality(centres_in_part_mm) = 3 * cardinality(areas_mm2)
    AND cardinality(normals_in_part) = 3 * cardinality(areas_mm2) AND cardinality(point_counts) = cardinality(areas_mm2)
    AND cardinality(means_um) = cardinality(areas_mm2) AND cardinality(expanded_uncertainties_um) = cardinality(areas_mm2)),
  CONSTRAINT deviation_patches_centres_in_part_mm_whole CHECK (array_position(centres_in_part_mm, NULL) IS NULL),
  CONSTRAINT deviation_patches_normals_in_part_whole CHECK (array_position(normals_in_part, NULL) IS NULL),
  CONSTRAINT deviation_patches_areas_mm2_whole CHECK (array_position(areas_mm2, NULL) IS NULL),
  CONSTRAINT deviation_patches_point_counts_whole CHECK (array_position(point_counts, NULL) IS NULL),
  CONSTRAINT deviation_patches_means_um_whole CHECK (array_position(means_um, NULL) IS NULL),
  CONSTRAINT deviation_patches_expanded_uncertainties_um_whole CHECK (array_position(expanded_uncertainties_um, NULL) IS NULL)
) PARTITION BY RANGE (deviation_id);
COMMENT ON TABLE deviation_patches IS 'All patches of a map, also those that were not seen.';
COMMENT ON COLUMN deviation_patches.centres_in_part_mm IS 'X, Y, Z on the CAD, patch by patch; normals_in_part outward.';
COMMENT ON COLUMN deviation_patches.means_um IS 'NaN, as its expanded uncertainty (95 %): not seen.';

CREATE TABLE deviation_cloud_blocks (
  deviation_id uuid NOT NULL,
  position_index integer NOT NULL,
  scan_index integer NOT NULL,
  point_count bigint NOT NULL,
  blob_sha256 bytea NOT NULL,
  proven_place_error_um double precision NOT NULL,
  proven_deviation_error_um double precision NOT NULL,
  CONSTRAINT deviation_cloud_blocks_pk PRIMARY KEY (deviation_id, position_index),
  CONSTRAINT deviation_cloud_blocks_scan_fk FOREIGN KEY (deviation_id, scan_index)
    REFERENCES deviation_map_scans (deviation_id, position_index),
  CONSTRAINT deviation_cloud_blocks_blob_fk FOREIGN KEY (blob_sha256) REFERENCES blobs (sha256),
  CONSTRAINT deviation_cloud_blocks_position CHECK (position_index BETWEEN 0 AND 999),
  CONSTRAINT deviation_cloud_blocks_points CHECK (point_count > 0),
  CONSTRAINT deviation_cloud_blocks_proven CHECK (proven_place_error_um >= 0 AND proven_place_error_um <= 5
    AND proven_deviation_error_um >= 0 AND proven_deviation_error_um <= 0.05),
  CONSTRAINT deviation_cloud_blocks_digests CHECK (octet_length(blob_sha256) = 32)
) PARTITION BY RANGE (deviation_id);
CREATE INDEX deviation_cloud_blocks_by_blob ON deviation_cloud_blocks (blob_sha256);
COMMENT ON TABLE deviation_cloud_blocks IS 'A map''s points with their deviations, as Draco clouds (docs/stored_clouds.md), scan by scan.';
COMMENT ON COLUMN deviation_cloud_blocks.scan_index IS 'Place in deviation_map_scans.';
COMMENT ON COLUMN deviation_cloud_blocks.proven_place_error_um IS 'Found by decoding it, as proven_deviation_error_um.';

DO $$
DECLARE
  held text;
BEGIN
  FOREACH held IN ARRAY ARRAY['deviation_maps', 'deviation_map_scans', 'deviation_regions', 'deviation_profiles', 'deviation_profile_areas',
      'deviation_patches', 'deviation_cloud_blocks'] LOOP
    PERFORM make_append_only(held::regclass);
    EXECUTE format('GRANT SELECT, INSERT ON %I TO sixpoint_inspection', held);
    EXECUTE format('GRANT SELECT ON %I TO sixpoint_ledger', held);
  END LOOP;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON deviation_maps FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_requested_by();
GRANT SELECT, INSERT, UPDATE (bytes, store, object_id, deleted_at, deletion_reason) ON blobs TO sixpoint_inspection;
GRANT SELECT (blob_sha256) ON deviation_cloud_blocks TO sixpoint_ingest;
SELECT make_partitions(3);
-- And the months that inspections have already.
SELECT make_partition(t.held_by, t.name, t.by_uuid, to_date(right(c.relname, 7), 'YYYY_MM'))
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid, partitioned_tables t
WHERE i.inhparent = 'inspections'::regclass AND t.name LIKE 'deviation\_%';

-- One kind more, as V0028 has it.
DO $$
DECLARE
  held regclass;
  kinds text[] := record_kinds();
BEGIN
  IF cardinality(kinds) < 19 THEN
    RAISE EXCEPTION 'record_entries_kind_known: % kinds, want those that were', cardinality(kinds);
  END IF;
  FOR held IN SELECT 'record_entries'::regclass UNION ALL
              SELECT inhrelid FROM pg_inherits WHERE inhparent = 'record_entries'::regclass LOOP
    EXECUTE format('ALTER TABLE %s DROP CONSTRAINT IF EXISTS record_entries_kind_known', held);
  END LOOP;
  EXECUTE format('ALTER TABLE record_entries ADD CONSTRAINT record_entries_kind_known CHECK (kind IN (%s))',
                 (SELECT string_agg(DISTINCT quote_literal(k), ', ') FROM unnest(kinds || ARRAY['deviation']) k));
END
$$;

CREATE OR REPLACE FUNCTION record_verdict(of_record uuid, of_kind text) RETURNS text
LANGUAGE plpgsql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
BEGIN
  RETURN CASE of_kind
    WHEN 'inspection' THEN (SELECT i.verdict FROM inspections i WHERE i.inspection_id = of_record)
    WHEN 'deviation' THEN (SELECT d.verdict FROM deviation_maps d WHERE d.deviation_id = of_record)
    WHEN 'registration' THEN (SELECT r.outcome FROM registrations r WHERE r.registration_id = of_record)
    WHEN 'study' THEN (SELECT s.verdict FROM studies s WHERE s.study_id = of_record) END;
END
$$;

COMMENT ON COLUMN read_v1.events.kind IS 'What it is: machine, artefact, part, blade, scan, calibration, registration, correction, inspection, deletion, release, withdrawal, study, policy, refusal, fetch, cut, assignment, disposition, machining_model or deviation; more may come.';

CREATE VIEW read_v1.deviations WITH (security_barrier) AS
  SELECT d.deviation_id, d.registration_id, d.blade_serial, d.part_id, d.part_revision, d.machine_id, d.machine_revision,
         n.record_sequence, n.recorded_at, d.method, d.patch_mm, r.region, r.area_mm2, r.seen_area_mm2, r.mean_um, r.rms_um, r.p05_um,
         r.p50_um, r.p95_um, r.lowest_um, r.lowest_expanded_uncertainty_um, r.lowest_in_part_mm, r.highest_um,
         r.highest_expanded_uncertainty_um, r.highest_in_part_mm
  FROM deviation_maps d JOIN record_names n ON n.record_id = d.deviation_id JOIN deviation_regions r ON r.deviation_id = d.deviation_id
  WHERE d.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.deviations IS 'How far blades'' surfaces are off their CAD: a row for the whole surface of each map, and for each of its regions.';
COMMENT ON COLUMN read_v1.deviations.deviation_id IS 'The id in deviations/{id}.';
COMMENT ON COLUMN read_v1.deviations.registration_id IS 'The pose that it rests on.';
COMMENT ON COLUMN read_v1.deviations.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.deviations.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.deviations.part_revision IS 'The revision whose CAD was used.';
COMMENT ON COLUMN read_v1.deviations.machine_id IS 'On which machine it was scanned.';
COMMENT ON COLUMN read_v1.deviations.machine_revision IS 'The revision that was used.';
COMMENT ON COLUMN read_v1.deviations.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.deviations.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.deviations.method IS 'How the scans were positioned.';
COMMENT ON COLUMN read_v1.deviations.patch_mm IS 'Millimetres: edge of a patch.';
COMMENT ON COLUMN read_v1.deviations.region IS 'Empty: the whole surface.';
COMMENT ON COLUMN read_v1.deviations.area_mm2 IS 'Square millimetres of the CAD.';
COMMENT ON COLUMN read_v1.deviations.seen_area_mm2 IS 'Square millimetres of it that were seen; the rest was not measured.';
COMMENT ON COLUMN read_v1.deviations.mean_um IS 'Micrometres, positive outside, of the patches'' means by area; NULL, as all below: nothing was seen.';
COMMENT ON COLUMN read_v1.deviations.rms_um IS 'Micrometres about the CAD, as mean_um.';
COMMENT ON COLUMN read_v1.deviations.p05_um IS 'Micrometres: 5 % of the points lie below.';
COMMENT ON COLUMN read_v1.deviations.p50_um IS 'Micrometres: the median of the points.';
COMMENT ON COLUMN read_v1.deviations.p95_um IS 'Micrometres: 95 % of the points lie below.';
COMMENT ON COLUMN read_v1.deviations.lowest_um IS 'Micrometres: the least mean of a patch.';
COMMENT ON COLUMN read_v1.deviations.lowest_expanded_uncertainty_um IS 'Micrometres, 95 %, of lowest_um.';
COMMENT ON COLUMN read_v1.deviations.lowest_in_part_mm IS 'Where it is: X, Y, Z, millimetres, part frame.';
COMMENT ON COLUMN read_v1.deviations.highest_um IS 'Micrometres: the greatest mean of a patch.';
COMMENT ON COLUMN read_v1.deviations.highest_expanded_uncertainty_um IS 'Micrometres, 95 %, of highest_um.';
COMMENT ON COLUMN read_v1.deviations.highest_in_part_mm IS 'Where it is: X, Y, Z, millimetres, part frame.';

CREATE VIEW read_v1.profiles WITH (security_barrier) AS
  SELECT d.deviation_id, d.blade_serial, d.part_id, d.part_revision, d.machine_id, n.record_sequence, n.recorded_at, p.characteristic,
         p.region, p.zone, p.lower_mm, p.upper_mm, p.verdict, p.reason, p.coverage, p.out_mm2, p.undecided_mm2, p.lowest_um,
         p.lowest_expanded_uncertainty_um, p.highest_um, p.highest_expanded_uncertainty_um
  FROM deviation_maps d JOIN record_names n ON n.record_id = d.deviation_id JOIN deviation_profiles p ON p.deviation_id = d.deviation_id
  WHERE d.part_id <> ALL ((SELECT hidden_from_reader())::text[]);
COMMENT ON VIEW read_v1.profiles IS 'Profile tolerances of blades'' surfaces, judged.';
COMMENT ON COLUMN read_v1.profiles.deviation_id IS 'The id in deviations/{id}.';
COMMENT ON COLUMN read_v1.profiles.blade_serial IS 'Of which blade.';
COMMENT ON COLUMN read_v1.profiles.part_id IS 'Of which part model the blade is.';
COMMENT ON COLUMN read_v1.profiles.part_revision IS 'The revision whose CAD was used.';
COMMENT ON COLUMN read_v1.profiles.machine_id IS 'On which machine it was scanned.';
COMMENT ON COLUMN read_v1.profiles.record_sequence IS 'Its place in the order of all that the plant recorded.';
COMMENT ON COLUMN read_v1.profiles.recorded_at IS 'When, by the database''s clock.';
COMMENT ON COLUMN read_v1.profiles.characteristic IS 'As whoever asked called it.';
COMMENT ON COLUMN read_v1.profiles.region IS 'Of the surface; empty: all of it.';
COMMENT ON COLUMN read_v1.profiles.zone IS 'FORM_AND_LOCATION: about the CAD as the blade was registered; FORM: fitted best.';
COMMENT ON COLUMN read_v1.profiles.lower_mm IS 'Millimetres: the least deviation that is allowed.';
COMMENT ON COLUMN read_v1.profiles.upper_mm IS 'Millimetres: the greatest.';
COMMENT ON COLUMN read_v1.profiles.verdict IS 'CONFORM, UNDECIDABLE, NOT_MEASURED or NOT_CONFORM.';
COMMENT ON COLUMN read_v1.profiles.reason IS 'Why it is neither CONFORM nor NOT_CONFORM; else empty.';
COMMENT ON COLUMN read_v1.profiles.coverage IS 'Share of the area that was seen, 0 to 1.';
COMMENT ON COLUMN read_v1.profiles.out_mm2 IS 'Square millimetres that are out.';
COMMENT ON COLUMN read_v1.profiles.undecided_mm2 IS 'Square millimetres nearer to a limit than their uncertainty.';
COMMENT ON COLUMN read_v1.profiles.lowest_um IS 'Micrometres: the least mean of a patch in the zone; NULL, as the next three: nothing was seen.';
COMMENT ON COLUMN read_v1.profiles.lowest_expanded_uncertainty_um IS 'Micrometres, 95 %, of lowest_um.';
COMMENT ON COLUMN read_v1.profiles.highest_um IS 'Micrometres: the greatest mean of a patch in the zone.';
COMMENT ON COLUMN read_v1.profiles.highest_expanded_uncertainty_um IS 'Micrometres, 95 %, of highest_um.';
GRANT SELECT ON read_v1.deviations, read_v1.profiles TO sixpoint_reader;
