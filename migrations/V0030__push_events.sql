-- Where events are sent to without being asked for: an MES names an address, and the plant posts what the journal gets. What is to be
-- sent is the journal itself; kept here are who asked for it, and how far each has come.

CREATE TABLE webhooks (
  webhook_id text COLLATE "C" NOT NULL,
  url text NOT NULL,
  kinds text[] NOT NULL,
  machine_id text COLLATE "C" NOT NULL,
  blade_serial text COLLATE "C" NOT NULL,
  part_id text COLLATE "C" NOT NULL,
  verdicts text[] NOT NULL,
  begins_after bigint NOT NULL,
  secret bytea NOT NULL,
  reader text NOT NULL,
  requested_by text NOT NULL,
  request_id uuid NOT NULL,
  recorded_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT webhooks_pk PRIMARY KEY (webhook_id),
  CONSTRAINT webhooks_request_once UNIQUE (request_id),
  CONSTRAINT webhooks_id_form CHECK (webhook_id ~ '^[A-Za-z0-9._-]{1,64}$'),
  CONSTRAINT webhooks_url_form CHECK (url ~ '^https?://' AND octet_length(url) <= 1024),
  CONSTRAINT webhooks_begins CHECK (begins_after >= 0),
  CONSTRAINT webhooks_secret CHECK (octet_length(secret) = 32),
  CONSTRAINT webhooks_kinds CHECK (cardinality(kinds) <= 32 AND octet_length(kinds::text) <= 4096 AND array_position(kinds, NULL) IS NULL),
  CONSTRAINT webhooks_verdicts CHECK (cardinality(verdicts) <= 16 AND octet_length(verdicts::text) <= 2048
    AND array_position(verdicts, NULL) IS NULL),
  CONSTRAINT webhooks_texts CHECK (octet_length(machine_id) <= 64 AND octet_length(blade_serial) <= 64 AND octet_length(part_id) <= 64
    AND octet_length(reader) <= 200 AND octet_length(requested_by) <= 200)
);
COMMENT ON TABLE webhooks IS 'To whom events are sent, as it was asked for. Ends with its row in webhook_withdrawals; names are given once for ever.';
COMMENT ON COLUMN webhooks.kinds IS 'What is empty lets all through, here and in the next four columns.';
COMMENT ON COLUMN webhooks.begins_after IS 'Events past this number are sent.';
COMMENT ON COLUMN webhooks.secret IS 'What is sent is signed with it (HMAC), so it is kept as it is.';
COMMENT ON COLUMN webhooks.reader IS 'By whose clearances is left out what may not be seen: his who asked for it.';

CREATE TABLE webhook_withdrawals (
  webhook_id text COLLATE "C" NOT NULL,
  requested_by text NOT NULL,
  request_id uuid NOT NULL,
  recorded_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT webhook_withdrawals_pk PRIMARY KEY (webhook_id),
  CONSTRAINT webhook_withdrawals_webhook_fk FOREIGN KEY (webhook_id) REFERENCES webhooks (webhook_id),
  CONSTRAINT webhook_withdrawals_texts CHECK (octet_length(webhook_id) <= 64 AND octet_length(requested_by) <= 200)
);
COMMENT ON TABLE webhook_withdrawals IS 'That nothing more is sent there, for ever.';

CREATE TABLE webhook_deliveries (
  webhook_id text COLLATE "C" NOT NULL,
  looked_at_sequence bigint NOT NULL,
  delivered_sequence bigint NOT NULL DEFAULT 0,
  delivered_at timestamptz,
  failing_since timestamptz,
  failure_count integer NOT NULL DEFAULT 0,
  last_failure text NOT NULL DEFAULT '',
  CONSTRAINT webhook_deliveries_pk PRIMARY KEY (webhook_id),
  CONSTRAINT webhook_deliveries_webhook_fk FOREIGN KEY (webhook_id) REFERENCES webhooks (webhook_id),
  CONSTRAINT webhook_deliveries_counts CHECK (looked_at_sequence >= 0 AND delivered_sequence >= 0 AND failure_count >= 0),
  CONSTRAINT webhook_deliveries_texts CHECK (octet_length(webhook_id) <= 64 AND octet_length(last_failure) <= 500)
);
COMMENT ON TABLE webhook_deliveries IS 'How far each has come, so that a restart goes on from there. Not part of the record: changed in place.';
COMMENT ON COLUMN webhook_deliveries.looked_at_sequence IS 'Everything up to it was taken by the receiver, or is not for him.';
COMMENT ON COLUMN webhook_deliveries.delivered_sequence IS 'The last event that he took; 0: none yet.';
COMMENT ON COLUMN webhook_deliveries.failing_since IS 'NULL: the last attempt went well.';

CREATE FUNCTION keep_pseudonym_of_webhook() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  NEW.reader := pseudonym_of(NEW.reader);
  NEW.requested_by := pseudonym_of(NEW.requested_by);
  RETURN NEW;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON webhooks FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_webhook();
CREATE FUNCTION keep_pseudonym_of_withdrawal() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  NEW.requested_by := pseudonym_of(NEW.requested_by);
  RETURN NEW;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON webhook_withdrawals FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_withdrawal();

SELECT make_append_only('webhooks');
SELECT make_append_only('webhook_withdrawals');
GRANT SELECT, INSERT ON webhooks, webhook_withdrawals TO sixpoint_plant;
GRANT SELECT, INSERT, UPDATE ON webhook_deliveries TO sixpoint_plant;
