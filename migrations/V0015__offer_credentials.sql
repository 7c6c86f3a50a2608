-- First certificates by a one-time code, and certificates that follow others. Neither holds a key that anybody could use: the first
-- are sealed under a code that nobody keeps, the second are public.
CREATE TABLE credential_offers (
  pickup_sha256 bytea NOT NULL,
  sealed bytea NOT NULL,
  identity text NOT NULL,
  offered_by text NOT NULL,
  offered_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  expires_at timestamptz NOT NULL,
  CONSTRAINT credential_offers_pk PRIMARY KEY (pickup_sha256),
  CONSTRAINT credential_offers_digest CHECK (octet_length(pickup_sha256) = 32),
  CONSTRAINT credential_offers_sizes CHECK (octet_length(sealed) BETWEEN 1 AND 65536 AND octet_length(identity) <= 128
    AND octet_length(offered_by) <= 200),
  CONSTRAINT credential_offers_ends CHECK (expires_at > offered_at AND expires_at <= offered_at + interval '31 days')
);
COMMENT ON TABLE credential_offers IS
  'Sealed credentials that wait for whoever has their code; a row goes when it is taken or over. Not of the record.';
COMMENT ON COLUMN credential_offers.pickup_sha256 IS 'Of the pickup id, so that who reads this table cannot take them.';

CREATE TABLE certificate_renewals (
  public_key_sha256 bytea NOT NULL,
  serial text COLLATE "C" NOT NULL,
  identity text NOT NULL,
  certificate_pem text NOT NULL,
  not_after timestamptz NOT NULL,
  offered_by text NOT NULL,
  offered_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT certificate_renewals_pk PRIMARY KEY (public_key_sha256, serial),
  CONSTRAINT certificate_renewals_digest CHECK (octet_length(public_key_sha256) = 32),
  CONSTRAINT certificate_renewals_sizes CHECK (octet_length(serial) <= 64 AND octet_length(identity) <= 128
    AND octet_length(certificate_pem) <= 16384 AND octet_length(offered_by) <= 200),
  CONSTRAINT certificate_renewals_ends CHECK (isfinite(not_after))
);
COMMENT ON TABLE certificate_renewals IS 'Certificates of the plant''s authority that wait for the holders of their keys.';
COMMENT ON COLUMN certificate_renewals.public_key_sha256 IS 'Of its SubjectPublicKeyInfo, by which the holder is known.';

SELECT make_append_only('certificate_renewals');
GRANT SELECT, INSERT, DELETE ON credential_offers TO sixpoint_plant;
GRANT SELECT, INSERT ON certificate_renewals TO sixpoint_plant;
