-- Calls that were refused for who asked. No part of the journal and never under its lock: strangers ask as often as they like. A
-- service writes so many rows a minute at most, each with how often it was.
CREATE TABLE denials (
  denial_id uuid NOT NULL,
  area text COLLATE "C" NOT NULL,
  method text COLLATE "C" NOT NULL,
  caller text NOT NULL,
  peer_address text NOT NULL,
  reason text COLLATE "C" NOT NULL,
  sentence text NOT NULL,
  denied_count bigint NOT NULL,
  first_denied_at timestamptz NOT NULL,
  last_denied_at timestamptz NOT NULL,
  CONSTRAINT denials_pk PRIMARY KEY (denial_id),
  CONSTRAINT denials_count_positive CHECK (denied_count > 0),
  CONSTRAINT denials_times CHECK (isfinite(first_denied_at) AND isfinite(last_denied_at)),
  CONSTRAINT denials_texts CHECK (octet_length(area) <= 64 AND octet_length(method) <= 200 AND octet_length(caller) <= 200
    AND octet_length(peer_address) <= 200 AND octet_length(reason) <= 64 AND octet_length(sentence) <= 1000)
) PARTITION BY RANGE (denial_id);
CREATE INDEX denials_by_caller ON denials (caller);
COMMENT ON TABLE denials IS 'Who was refused what, and why; alike ones of a moment in one row.';
COMMENT ON COLUMN denials.method IS 'Service/Method; * where there were more different ones than are kept.';
COMMENT ON COLUMN denials.caller IS
  'By the certificate shown, such as users/jane, even where it does not count; empty: nobody''s, or more than are kept.';
COMMENT ON COLUMN denials.peer_address IS 'Of the first of them.';
COMMENT ON COLUMN denials.reason IS 'errors.v1.ErrorReason.';
COMMENT ON COLUMN denials.first_denied_at IS 'This and last_denied_at by the service''s clock.';

SELECT make_append_only('denials');
GRANT SELECT, INSERT ON denials TO sixpoint_plant, sixpoint_ingest, sixpoint_calibration, sixpoint_registration,
  sixpoint_correction, sixpoint_inspection;
SELECT make_partitions(3);
