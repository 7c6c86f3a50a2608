-- A calibration of any kind is calibrations/{id}; those of kind axis were characterisations/{id} before. The names that the journal
-- and results hold are rewritten once, with the append-only triggers off for this transaction alone.

ALTER TABLE record_entries DISABLE TRIGGER USER;
ALTER TABLE record_inputs DISABLE TRIGGER USER;
ALTER TABLE calibrations DISABLE TRIGGER USER;
ALTER TABLE studies DISABLE TRIGGER USER;

UPDATE record_entries SET name = 'calibrations/' || split_part(name, '/', 2) WHERE name LIKE 'characterisations/%';
UPDATE record_inputs SET input_name = 'calibrations/' || split_part(input_name, '/', 2)
  WHERE input_name LIKE 'characterisations/%';
UPDATE calibrations SET inputs = ARRAY(SELECT regexp_replace(input, '^characterisations/', 'calibrations/')
                                       FROM unnest(inputs) WITH ORDINALITY AS named (input, position) ORDER BY position)
  WHERE array_to_string(inputs, ' ') LIKE '%characterisations/%';
UPDATE studies SET inputs = ARRAY(SELECT regexp_replace(input, '^characterisations/', 'calibrations/')
                                  FROM unnest(inputs) WITH ORDINALITY AS named (input, position) ORDER BY position)
  WHERE array_to_string(inputs, ' ') LIKE '%characterisations/%';

ALTER TABLE record_entries ENABLE TRIGGER USER;
ALTER TABLE record_inputs ENABLE TRIGGER USER;
ALTER TABLE calibrations ENABLE TRIGGER USER;
ALTER TABLE studies ENABLE TRIGGER USER;
