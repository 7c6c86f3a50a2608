-- Several blades in one fixture: the stations of a part, at which of them a scan was taken, and where a registration found its blade. A table of its
-- own, and nullable columns.

CREATE TABLE part_stations (
  part_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  station_index integer NOT NULL,
  station text COLLATE "C" NOT NULL,
  zero_from_part_nominal_rotation double precision[] NOT NULL,
  zero_from_part_nominal_translation_mm double precision[] NOT NULL,
  capture_mm double precision NOT NULL,
  CONSTRAINT part_stations_pk PRIMARY KEY (part_id, revision, station_index),
  CONSTRAINT part_stations_name_once UNIQUE (part_id, revision, station),
  CONSTRAINT part_stations_part_fk FOREIGN KEY (part_id, revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT part_stations_few CHECK (station_index BETWEEN 0 AND 63),
  CONSTRAINT part_stations_form CHECK (station ~ '^[A-Za-z0-9._-]{1,64}$'),
  CONSTRAINT part_stations_rotation_unit CHECK (cardinality(zero_from_part_nominal_rotation) = 9
    AND is_unit(zero_from_part_nominal_rotation[1:3]) AND is_unit(zero_from_part_nominal_rotation[4:6])
    AND is_unit(zero_from_part_nominal_rotation[7:9])),
  CONSTRAINT part_stations_translation_finite CHECK (is_triple(zero_from_part_nominal_translation_mm)),
  CONSTRAINT part_stations_capture CHECK (capture_mm > 0 AND capture_mm <= 100),
  CONSTRAINT part_stations_zero_from_part_nominal_rotation_whole CHECK (array_position(zero_from_part_nominal_rotation, NULL) IS NULL),
  CONSTRAINT part_stations_zero_from_part_nominal_translation_mm_whole CHECK
      (array_position(zero_from_part_nominal_translation_mm, NULL) IS NULL)
);
COMMENT ON TABLE part_stations IS 'Where parts of one kind stand beside each other in a fixture.';
COMMENT ON COLUMN part_stations.zero_from_part_nominal_rotation IS
  'Row-major 3 x 3. CAD millimetres to machine coordinates at A = B = 0, of the part that stands there.';
COMMENT ON COLUMN part_stations.capture_mm IS 'How far any of it may stand from there.';
SELECT make_append_only('part_stations');
GRANT SELECT, INSERT ON part_stations TO sixpoint_plant;
GRANT SELECT ON part_stations TO sixpoint_ledger;

ALTER TABLE scans
  ADD COLUMN station text COLLATE "C",
  ADD CONSTRAINT scans_station_form CHECK (station ~ '^[A-Za-z0-9._-]{1,64}$'),
  ADD CONSTRAINT scans_station_of_blade CHECK (station IS NULL OR blade_serial IS NOT NULL);
COMMENT ON COLUMN scans.station IS 'Of the blade''s part, where the blade stood; NULL: the part has none.';

ALTER TABLE registrations
  ADD COLUMN station text COLLATE "C",
  ADD CONSTRAINT registrations_station_form CHECK (station ~ '^[A-Za-z0-9._-]{1,64}$');
COMMENT ON COLUMN registrations.station IS 'Its scans''; NULL: the part has none.';
