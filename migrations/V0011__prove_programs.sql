-- A program is read back and proven before it is given. Both are nullable: the release before gives programs without.
ALTER TABLE corrections
  ADD COLUMN nc_reader_version text,
  ADD COLUMN nc_pose_count integer,
  ADD COLUMN nc_greatest_difference_um double precision,
  ADD COLUMN nc_greatest_tilt_deg double precision,
  ADD COLUMN nc_work_offset_codes text[],
  ADD COLUMN nc_work_offsets double precision[],
  ADD CONSTRAINT corrections_nc_proof_whole CHECK (
    num_nonnulls(nc_reader_version, nc_pose_count, nc_greatest_difference_um, nc_greatest_tilt_deg) IN (0, 4)
    AND char_length(nc_reader_version) BETWEEN 1 AND 64 AND nc_pose_count > 0
    AND nc_greatest_difference_um BETWEEN 0 AND 1e6 AND nc_greatest_tilt_deg BETWEEN 0 AND 180),
  ADD CONSTRAINT corrections_nc_work_offset_codes_known CHECK (cardinality(nc_work_offset_codes) BETWEEN 1 AND 6
    AND char_length(array_to_string(nc_work_offset_codes, '')) <= 48 AND array_position(nc_work_offset_codes, NULL) IS NULL),
  ADD CONSTRAINT corrections_nc_work_offsets_stated CHECK (array_position(nc_work_offsets, NULL) IS NULL),
  ADD CONSTRAINT corrections_nc_work_offsets_whole CHECK ((nc_work_offset_codes IS NULL) = (nc_work_offsets IS NULL)
    AND cardinality(nc_work_offsets) = 5 * cardinality(nc_work_offset_codes));

COMMENT ON COLUMN corrections.nc_reader_version IS
  'What read the written program back and proved it (metrology/correction/nc_reader.h); NULL: no program was made.';
COMMENT ON COLUMN corrections.nc_pose_count IS 'Poses at which a hole was reached or cut by the program.';
COMMENT ON COLUMN corrections.nc_greatest_difference_um IS 'Of those poses from the correction''s, on the part.';
COMMENT ON COLUMN corrections.nc_greatest_tilt_deg IS 'Of the tool''s direction on the part at those poses.';
COMMENT ON COLUMN corrections.nc_work_offset_codes IS 'Of the offsets that were stated for the control: G54 to G59.';
COMMENT ON COLUMN corrections.nc_work_offsets IS
  'Machine less program coordinates, five for each code: X, Y, Z in mm, the first and the second rotary axis in deg.';
