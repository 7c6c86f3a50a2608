-- A retention policy destroys data: each is in the journal, as policies/{kind}@{revision}. Those set before are not.

ALTER TABLE retention_policies
  ADD COLUMN record_sequence bigint,
  ADD CONSTRAINT retention_policies_record_fk FOREIGN KEY (record_sequence) REFERENCES record_entries (record_sequence),
  ADD CONSTRAINT retention_policies_record_once UNIQUE (record_sequence);
COMMENT ON COLUMN retention_policies.record_sequence IS 'Of its journal entry; NULL only where it was set before V0021.';

DO $$
DECLARE
  known text;
BEGIN
  SELECT pg_get_expr(conbin, conrelid) INTO STRICT known FROM pg_constraint
    WHERE conname = 'record_entries_kind_known' AND conrelid = 'record_entries'::regclass;
  EXECUTE 'ALTER TABLE record_entries DROP CONSTRAINT record_entries_kind_known, '
    'ADD CONSTRAINT record_entries_kind_known CHECK (' || known || ' OR kind = ''policy'')';
END
$$;
