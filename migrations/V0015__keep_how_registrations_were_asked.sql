-- What was asked of a registration beyond its method, and the evidence that says whether to believe it.

ALTER TABLE registrations DROP CONSTRAINT registrations_method_known, DROP CONSTRAINT registrations_outcome_known;
ALTER TABLE registrations
  ADD CONSTRAINT registrations_method_known
    CHECK (method IN ('BEST_FIT', 'LOCAL', 'SIX_POINT', 'SIX_POINT_NORMALS', 'ALLOWANCE')),
  ADD CONSTRAINT registrations_outcome_known
    CHECK (outcome IN ('CONVERGED', 'NOT_CONVERGED', 'NOT_DETERMINED', 'TOO_LITTLE_OVERLAP', 'INFEASIBLE')),
  ADD COLUMN weakest_direction_in_words text NOT NULL DEFAULT '',
  ADD COLUMN noise_sigma_um double precision,
  ADD COLUMN model_sigma_um double precision,
  ADD COLUMN information_kept double precision,
  ADD COLUMN surface_part double precision,
  ADD COLUMN least_stock_mm double precision,
  ADD COLUMN lacking_mm double precision,
  ADD COLUMN disagreement_um double precision,
  ADD COLUMN disagreement_ratio double precision,
  ADD COLUMN options jsonb NOT NULL DEFAULT '{}',
  ADD COLUMN detail jsonb NOT NULL DEFAULT '{}';
ALTER TABLE registrations
  ADD CONSTRAINT registrations_infeasible_is_allowance CHECK (outcome <> 'INFEASIBLE' OR method = 'ALLOWANCE'),
  ADD CONSTRAINT registrations_sigmas_finite CHECK (noise_sigma_um >= 0 AND noise_sigma_um < 1e9
    AND model_sigma_um >= 0 AND model_sigma_um < 1e9),
  ADD CONSTRAINT registrations_parts_of_one CHECK (information_kept BETWEEN 0 AND 1 AND surface_part BETWEEN 0 AND 1),
  ADD CONSTRAINT registrations_stock_of_allowance CHECK ((least_stock_mm IS NULL) = (lacking_mm IS NULL)
    AND (least_stock_mm IS NULL OR method = 'ALLOWANCE') AND abs(least_stock_mm) <= 100 AND lacking_mm BETWEEN 0 AND 100),
  ADD CONSTRAINT registrations_lacking_is_infeasible CHECK (lacking_mm IS NULL OR lacking_mm = 0 OR outcome <> 'CONVERGED'),
  ADD CONSTRAINT registrations_disagreement_whole CHECK ((disagreement_um IS NULL) = (disagreement_ratio IS NULL)
    AND disagreement_um >= 0 AND disagreement_um < 1e9 AND disagreement_ratio >= 0 AND disagreement_ratio < 1e15),
  ADD CONSTRAINT registrations_options_object CHECK (jsonb_typeof(options) = 'object'),
  ADD CONSTRAINT registrations_detail_object CHECK (jsonb_typeof(detail) = 'object');
COMMENT ON COLUMN registrations.weakest_direction_in_words IS 'By the part''s axes. Empty before this migration.';
COMMENT ON COLUMN registrations.noise_sigma_um IS 'Of a point. This and the figures after it: NULL where the method has none.';
COMMENT ON COLUMN registrations.model_sigma_um IS 'Of a patch beyond its points'' noise: casting, sensor, CAD.';
COMMENT ON COLUMN registrations.information_kept IS
  'Of what the points say along the weakest direction, the part that the robust loss kept.';
COMMENT ON COLUMN registrations.surface_part IS 'Of the CAD''s area, the part that the scans cover.';
COMMENT ON COLUMN registrations.least_stock_mm IS 'ALLOWANCE: of any patch, at the pose that is best or lacks least.';
COMMENT ON COLUMN registrations.lacking_mm IS 'ALLOWANCE: by how much that falls short of the stock asked for.';
COMMENT ON COLUMN registrations.disagreement_um IS
  'Greatest displacement of a point of the part from the best fit of the same scans to this pose; NULL where not compared.';
COMMENT ON COLUMN registrations.disagreement_ratio IS 'That, by its standard uncertainty; more than 3 is flagged.';
COMMENT ON COLUMN registrations.options IS
  'What was asked: sixpoint.registration.v1.FitOptions in its canonical JSON; every number reads back to the same double.';
COMMENT ON COLUMN registrations.detail IS
  'Evidence that has no column of its own: sixpoint.registration.v1.Evidence in its canonical JSON.';
CREATE INDEX registrations_beyond_agreement ON registrations (record_sequence) WHERE disagreement_ratio > 3;

CREATE TABLE registration_agreements (
  registration_id text COLLATE "C" NOT NULL,
  position_index integer NOT NULL,
  scan_id text COLLATE "C" NOT NULL,
  other_scan_id text COLLATE "C" NOT NULL,
  patch_count bigint NOT NULL,
  difference_rms_um double precision NOT NULL,
  expected_rms_um double precision NOT NULL,
  CONSTRAINT registration_agreements_pk PRIMARY KEY (registration_id, position_index),
  CONSTRAINT registration_agreements_once UNIQUE (registration_id, scan_id, other_scan_id),
  CONSTRAINT registration_agreements_scan_fk FOREIGN KEY (registration_id, scan_id)
    REFERENCES registration_scans (registration_id, scan_id),
  CONSTRAINT registration_agreements_other_scan_fk FOREIGN KEY (registration_id, other_scan_id)
    REFERENCES registration_scans (registration_id, scan_id),
  CONSTRAINT registration_agreements_of_two CHECK (scan_id <> other_scan_id),
  CONSTRAINT registration_agreements_position_from_zero CHECK (position_index >= 0),
  CONSTRAINT registration_agreements_values CHECK (patch_count > 0 AND difference_rms_um >= 0 AND difference_rms_um < 1e15
    AND expected_rms_um >= 0 AND expected_rms_um < 1e15)
);
COMMENT ON TABLE registration_agreements IS
  'Two scans where they see the same surface; differing far beyond noise: a rotary axis is not where its calibration says.';
COMMENT ON COLUMN registration_agreements.difference_rms_um IS 'Of the two scans'' offsets, patch by patch.';
COMMENT ON COLUMN registration_agreements.expected_rms_um IS 'From the scanner''s noise alone.';
CREATE TRIGGER registration_agreements_append_only BEFORE UPDATE OR DELETE ON registration_agreements
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER registration_agreements_no_truncate BEFORE TRUNCATE ON registration_agreements
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
