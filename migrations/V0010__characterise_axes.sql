-- How each rotary axis positions, from encoder runs; the standard procedure for Point C; the error curve before a calibration.

CREATE TABLE axis_characterisations (
  characterisation_id text COLLATE "C" NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  axis text NOT NULL,
  inputs text[] NOT NULL,
  request_sha256 text COLLATE "C" NOT NULL,
  reading_count integer NOT NULL,
  reversal_deg double precision[] NOT NULL,
  mean_deg double precision[] NOT NULL,
  long_wave_order integer NOT NULL,
  long_wave_amplitude_deg double precision[] NOT NULL,
  periodic_order integer,
  periodic_amplitude_deg double precision[],
  least_detectable_deg double precision NOT NULL,
  greatest_error_deg double precision[] NOT NULL,
  greatest_error_at_deg double precision NOT NULL,
  greatest_error_forward boolean NOT NULL,
  standard_uncertainty_deg double precision[] NOT NULL,
  compensated_standard_uncertainty_deg double precision[] NOT NULL,
  noise_deg double precision[] NOT NULL,
  forward_error_deg double precision[] NOT NULL,
  backward_error_deg double precision[] NOT NULL,
  table_standard_uncertainty_deg double precision NOT NULL,
  requested_by text NOT NULL,
  software_version text NOT NULL,
  record_sequence bigint NOT NULL,
  recorded_at timestamptz NOT NULL,
  CONSTRAINT axis_characterisations_pk PRIMARY KEY (characterisation_id),
  CONSTRAINT axis_characterisations_machine_fk FOREIGN KEY (machine_id) REFERENCES machines (machine_id),
  CONSTRAINT axis_characterisations_request_fk FOREIGN KEY (request_sha256) REFERENCES blobs (sha256),
  CONSTRAINT axis_characterisations_record_fk FOREIGN KEY (record_sequence) REFERENCES record_entries (record_sequence),
  CONSTRAINT axis_characterisations_record_once UNIQUE (record_sequence),
  CONSTRAINT axis_characterisations_id_form CHECK (characterisation_id ~ '^[0-9a-f-]{36}$'),
  CONSTRAINT axis_characterisations_axis_known CHECK (axis IN ('A', 'B', 'C')),
  CONSTRAINT axis_characterisations_inputs_named CHECK (array_position(inputs, NULL) IS NULL),
  CONSTRAINT axis_characterisations_readings CHECK (reading_count > 0),
  CONSTRAINT axis_characterisations_estimates CHECK (cardinality(reversal_deg) = 2 AND cardinality(mean_deg) = 2
    AND cardinality(long_wave_amplitude_deg) = 2 AND cardinality(greatest_error_deg) = 2
    AND cardinality(standard_uncertainty_deg) = 2 AND cardinality(compensated_standard_uncertainty_deg) = 2
    AND cardinality(noise_deg) = 2
    AND array_position(reversal_deg || mean_deg || long_wave_amplitude_deg || greatest_error_deg || standard_uncertainty_deg
                       || compensated_standard_uncertainty_deg || noise_deg, NULL) IS NULL
    AND 10 > ALL (reversal_deg || mean_deg || long_wave_amplitude_deg || greatest_error_deg || standard_uncertainty_deg
                  || compensated_standard_uncertainty_deg || noise_deg)
    AND -10 < ALL (reversal_deg || mean_deg || long_wave_amplitude_deg || greatest_error_deg || standard_uncertainty_deg
                   || compensated_standard_uncertainty_deg || noise_deg)),
  CONSTRAINT axis_characterisations_uncertainty_positive CHECK (reversal_deg[2] >= 0 AND mean_deg[2] >= 0
    AND long_wave_amplitude_deg[2] >= 0 AND greatest_error_deg[2] >= 0 AND standard_uncertainty_deg[2] >= 0
    AND compensated_standard_uncertainty_deg[2] >= 0 AND noise_deg[2] >= 0 AND table_standard_uncertainty_deg >= 0
    AND table_standard_uncertainty_deg < 10 AND least_detectable_deg >= 0 AND least_detectable_deg < 10),
  CONSTRAINT axis_characterisations_periodic CHECK (long_wave_order BETWEEN 1 AND 3 AND (periodic_order IS NULL
    AND periodic_amplitude_deg IS NULL OR periodic_order > 3 AND cardinality(periodic_amplitude_deg) = 2
    AND array_position(periodic_amplitude_deg, NULL) IS NULL AND 0 <= ALL (periodic_amplitude_deg)
    AND 10 > ALL (periodic_amplitude_deg))),
  CONSTRAINT axis_characterisations_greatest_at CHECK (greatest_error_at_deg >= 0 AND greatest_error_at_deg < 360),
  CONSTRAINT axis_characterisations_table CHECK (cardinality(forward_error_deg) BETWEEN 4 AND 100000
    AND cardinality(backward_error_deg) = cardinality(forward_error_deg)
    AND array_position(forward_error_deg || backward_error_deg, NULL) IS NULL
    AND 5 > ALL (forward_error_deg || backward_error_deg) AND -5 < ALL (forward_error_deg || backward_error_deg)),
  CONSTRAINT axis_characterisations_software_named CHECK (software_version <> '')
);
CREATE INDEX axis_characterisations_by_machine ON axis_characterisations (machine_id, axis, record_sequence);
COMMENT ON TABLE axis_characterisations IS 'Of a machine and axis the one of the greatest record_sequence is in force.';
COMMENT ON COLUMN axis_characterisations.request_sha256 IS 'The request as it came, with its encoder run.';
COMMENT ON COLUMN axis_characterisations.reversal_deg IS 'Here and below: value, standard uncertainty.';
COMMENT ON COLUMN axis_characterisations.periodic_order IS 'Periods in a turn; NULL where none stands out of the noise.';
COMMENT ON COLUMN axis_characterisations.forward_error_deg IS
  'Reached minus commanded at equal steps from 0 over a turn, coming from smaller angles; backward_error_deg from greater ones.';

CREATE TRIGGER axis_characterisations_append_only BEFORE UPDATE OR DELETE ON axis_characterisations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER axis_characterisations_no_truncate BEFORE TRUNCATE ON axis_characterisations
  FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();

ALTER TABLE calibrations DROP CONSTRAINT calibrations_method_fits_kind,
  ADD CONSTRAINT calibrations_method_fits_kind CHECK (kind = 'sensor' AND method IN ('JOINT', 'SEQUENTIAL')
                                                      OR kind = 'rotation' AND method IN ('LINES', 'POINT_C', 'STANDARD'));

ALTER TABLE rotation_calibrations ADD COLUMN axes text[] NOT NULL DEFAULT '{A,B}',
  ADD CONSTRAINT rotation_calibrations_axes_two CHECK (cardinality(axes) = 2 AND array_position(axes, NULL) IS NULL
    AND axes[1] IN ('A', 'B', 'C') AND axes[2] IN ('A', 'B', 'C') AND axes[1] <> axes[2]);
COMMENT ON COLUMN rotation_calibrations.axes IS
  'The machine''s letters of what the other columns call a (on the bed) and b (carried by it).';

-- Poses from before this migration have none: NULL.
ALTER TABLE rotation_calibration_poses ADD COLUMN before_um double precision,
  ADD CONSTRAINT rotation_calibration_poses_before CHECK (before_um >= 0 AND before_um < 1e9);
COMMENT ON COLUMN rotation_calibration_poses.before_um IS
  'Distance from the axes of the machine''s record, the sphere where it suits them best.';
