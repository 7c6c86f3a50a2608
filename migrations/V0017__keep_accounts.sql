-- People who sign in (docs/access.md): accounts, what was done to them, when their sessions ended, and failed sign-ins. Names of
-- persons stand in append-only tables in the columns requested_by and subject alone.
CREATE TABLE accounts (
  name text COLLATE "C" NOT NULL,
  sign_in_method text COLLATE "C" NOT NULL,
  roles text[] NOT NULL,
  password_phc text,
  issuer text COLLATE "C",
  issuer_subject text COLLATE "C",
  disabled boolean NOT NULL DEFAULT false,
  created_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  changed_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  newest_session_at timestamptz,
  CONSTRAINT accounts_pk PRIMARY KEY (name),
  CONSTRAINT accounts_one_subject UNIQUE (issuer, issuer_subject),
  CONSTRAINT accounts_name CHECK (name ~ '^users/[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}$'),
  CONSTRAINT accounts_roles CHECK (cardinality(roles) BETWEEN 1 AND 4 AND array_position(roles, NULL) IS NULL
    AND roles <@ ARRAY['engineer', 'quality', 'mes-reader', 'admin']),
  CONSTRAINT accounts_method CHECK (CASE sign_in_method
    WHEN 'password' THEN password_phc IS NOT NULL AND issuer IS NULL AND issuer_subject IS NULL
    WHEN 'oidc' THEN password_phc IS NULL AND issuer IS NOT NULL AND issuer_subject IS NOT NULL
    ELSE false END),
  CONSTRAINT accounts_sizes CHECK (octet_length(sign_in_method) <= 16 AND octet_length(password_phc) <= 256 AND octet_length(issuer) <= 1024
    AND octet_length(issuer_subject) <= 255),
  CONSTRAINT accounts_times CHECK (isfinite(created_at) AND isfinite(changed_at) AND isfinite(newest_session_at))
);
COMMENT ON TABLE accounts IS 'Who may sign in, as it stands now; what was done to it is in account_events.';
COMMENT ON COLUMN accounts.name IS 'users/jane, as the record names who asked.';
COMMENT ON COLUMN accounts.sign_in_method IS 'password, or oidc: the plant''s identity provider.';
COMMENT ON COLUMN accounts.password_phc IS 'What argon2id makes of the password, with its parameters and salt.';
COMMENT ON COLUMN accounts.issuer IS 'Of the identity provider; with issuer_subject it is one person, whatever he is called.';

COMMENT ON COLUMN accounts.newest_session_at IS
  'The latest moment that a session of it was dated by, which may be ahead of a clock that was set back: an end is not before it. NULL: none yet.';

CREATE TABLE account_events (
  event_id uuid NOT NULL,
  subject text COLLATE "C" NOT NULL,
  event text COLLATE "C" NOT NULL,
  roles text[] NOT NULL,
  requested_by text NOT NULL,
  recorded_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  CONSTRAINT account_events_pk PRIMARY KEY (event_id),
  CONSTRAINT account_events_event CHECK (event IN ('created', 'roles_set', 'password_set', 'disabled', 'enabled',
    'signed_in', 'signed_out')),
  CONSTRAINT account_events_roles CHECK (cardinality(roles) BETWEEN 1 AND 4 AND array_position(roles, NULL) IS NULL
    AND roles <@ ARRAY['engineer', 'quality', 'mes-reader', 'admin']),
  CONSTRAINT account_events_sizes CHECK (octet_length(subject) BETWEEN 1 AND 200 AND octet_length(requested_by) BETWEEN 1 AND 200)
);
CREATE INDEX account_events_by_subject ON account_events (subject, recorded_at);
COMMENT ON TABLE account_events IS 'Who did what to which account, and who signed in, when.';
COMMENT ON COLUMN account_events.subject IS 'Whose account: users/jane.';
COMMENT ON COLUMN account_events.roles IS 'Of the account, from this event on.';
COMMENT ON COLUMN account_events.requested_by IS 'Who did it: users/it, services/gateway for a sign-in.';

CREATE TABLE session_ends (
  account text COLLATE "C" NOT NULL,
  ended_before timestamptz NOT NULL,
  CONSTRAINT session_ends_pk PRIMARY KEY (account),
  CONSTRAINT session_ends_account CHECK (octet_length(account) BETWEEN 1 AND 128),
  CONSTRAINT session_ends_time CHECK (isfinite(ended_before))
);
CREATE INDEX session_ends_recent ON session_ends (ended_before);
COMMENT ON TABLE session_ends IS
  'Sessions of that account that began before that moment have ended: a sign-out, or a change of the account. Every service reads it each second.';

CREATE TABLE sign_in_failures (
  of_sha256 bytea NOT NULL,
  failed_count integer NOT NULL,
  first_failed_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  last_failed_at timestamptz NOT NULL DEFAULT clock_timestamp(),
  blocked_until timestamptz NOT NULL,
  CONSTRAINT sign_in_failures_pk PRIMARY KEY (of_sha256),
  CONSTRAINT sign_in_failures_digest CHECK (octet_length(of_sha256) = 32),
  CONSTRAINT sign_in_failures_count CHECK (failed_count >= 0),
  CONSTRAINT sign_in_failures_times CHECK (isfinite(first_failed_at) AND isfinite(last_failed_at) AND isfinite(blocked_until))
);
CREATE INDEX sign_in_failures_by_time ON sign_in_failures (last_failed_at);
COMMENT ON TABLE sign_in_failures IS
  'Sign-ins that failed lately, so that the next must wait; also of accounts that are not there, for nobody is to learn which are.';
COMMENT ON COLUMN sign_in_failures.of_sha256 IS
  'Of the account''s name or the address, each with its kind before it: what people type into the wrong field is kept nowhere.';
COMMENT ON COLUMN sign_in_failures.blocked_until IS 'Sign-ins before are refused unseen.';

SELECT make_append_only('account_events');
GRANT SELECT, INSERT, UPDATE (roles, password_phc, disabled, changed_at, newest_session_at) ON accounts TO sixpoint_plant;
GRANT SELECT, INSERT ON account_events TO sixpoint_plant;
GRANT SELECT, INSERT, UPDATE (ended_before) ON session_ends TO sixpoint_plant;
GRANT SELECT ON session_ends TO sixpoint_ingest, sixpoint_calibration, sixpoint_registration, sixpoint_correction,
  sixpoint_inspection;
GRANT SELECT, INSERT, DELETE, UPDATE (failed_count, first_failed_at, last_failed_at, blocked_until) ON sign_in_failures
  TO sixpoint_plant;
