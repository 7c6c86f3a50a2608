-- What becomes of each part of a surface where a blank does not contain the part: a table of its own.

CREATE TABLE part_shape_regions (
  part_id text COLLATE "C" NOT NULL,
  revision integer NOT NULL,
  region_index integer NOT NULL,
  region text NOT NULL,
  minimum_in_part_mm double precision[],
  maximum_in_part_mm double precision[],
  facing_in_part double precision[],
  facing_within_deg double precision,
  kind text NOT NULL,
  allowance_mm double precision,
  lower_mm double precision,
  upper_mm double precision,
  CONSTRAINT part_shape_regions_pk PRIMARY KEY (part_id, revision, region_index),
  CONSTRAINT part_shape_regions_name_once UNIQUE (part_id, revision, region),
  CONSTRAINT part_shape_regions_part_fk FOREIGN KEY (part_id, revision) REFERENCES part_revisions (part_id, revision),
  CONSTRAINT part_shape_regions_few CHECK (region_index BETWEEN 0 AND 63),
  CONSTRAINT part_shape_regions_text CHECK (octet_length(region) BETWEEN 1 AND 200),
  CONSTRAINT part_shape_regions_minimum CHECK (is_triple(minimum_in_part_mm) AND array_position(minimum_in_part_mm, NULL) IS NULL),
  CONSTRAINT part_shape_regions_maximum CHECK (is_triple(maximum_in_part_mm) AND array_position(maximum_in_part_mm, NULL) IS NULL),
  CONSTRAINT part_shape_regions_facing CHECK (is_unit(facing_in_part) AND array_position(facing_in_part, NULL) IS NULL),
  CONSTRAINT part_shape_regions_within CHECK ((facing_in_part IS NULL) = (facing_within_deg IS NULL)
    AND (facing_within_deg IS NULL OR facing_within_deg > 0 AND facing_within_deg <= 180)),
  CONSTRAINT part_shape_regions_kind_known CHECK (octet_length(kind) <= 64 AND kind IN ('MACHINED', 'FIXED', 'DATUM')),
  CONSTRAINT part_shape_regions_allowance CHECK ((kind = 'MACHINED') = (allowance_mm IS NOT NULL)
    AND (allowance_mm IS NULL OR allowance_mm BETWEEN 0 AND 5)),
  CONSTRAINT part_shape_regions_band CHECK (num_nulls(lower_mm, upper_mm) = CASE WHEN kind = 'DATUM' THEN 2 ELSE 0 END
    AND (lower_mm IS NULL OR lower_mm < upper_mm AND lower_mm >= -5 AND upper_mm <= 5))
);
COMMENT ON TABLE part_shape_regions IS 'Parts of the surface by a box and by where it looks, part frame; one with neither: whatever no other has.';
COMMENT ON COLUMN part_shape_regions.kind IS 'MACHINED: it is cut, the blank must stand outside. FIXED: it stays as the blank is. DATUM: as drawn.';
COMMENT ON COLUMN part_shape_regions.allowance_mm IS 'Stock that is wanted outside the shape; NULL: it is not machined.';
COMMENT ON COLUMN part_shape_regions.lower_mm IS 'Profile tolerance of the shape about the CAD, to upper_mm; NULL: a datum.';
SELECT make_append_only('part_shape_regions');
GRANT SELECT, INSERT ON part_shape_regions TO sixpoint_plant;
GRANT SELECT ON part_shape_regions TO sixpoint_ledger;
