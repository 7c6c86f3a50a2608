-- What grows with every blade is kept by months, made ahead of time; a month that is to leave the plant is detached whole.

-- The least UUID of version 7 of that moment (RFC 9562, 5.7).
CREATE FUNCTION least_uuid_of(moment timestamptz) RETURNS uuid LANGUAGE sql IMMUTABLE AS $$
  SELECT (lpad(to_hex(floor(extract(epoch FROM moment) * 1000)::bigint), 12, '0') || '00000000000000000000')::uuid
$$;

-- Tables before those that refer to them.
CREATE VIEW partitioned_tables AS
  WITH RECURSIVE refers (referring, referred) AS (
    SELECT k.conrelid, k.confrelid FROM pg_constraint k
      JOIN pg_partitioned_table p ON p.partrelid = k.conrelid JOIN pg_partitioned_table q ON q.partrelid = k.confrelid
      WHERE k.contype = 'f' AND k.conrelid <> k.confrelid
    UNION SELECT r.referring, k.confrelid FROM refers r JOIN pg_constraint k ON k.conrelid = r.referred AND k.contype = 'f'
      JOIN pg_partitioned_table q ON q.partrelid = k.confrelid)
  SELECT c.oid::regclass AS held_by, c.relname::text AS name,
         format_type(a.atttypid, NULL) = 'uuid' AS by_uuid,
         (SELECT count(DISTINCT r.referred) FROM refers r WHERE r.referring = c.oid)::integer AS depth
  FROM pg_partitioned_table p JOIN pg_class c ON c.oid = p.partrelid AND c.relnamespace = 'public'::regnamespace
  JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum = p.partattrs[0];
COMMENT ON VIEW partitioned_tables IS 'What is kept by months; by_uuid: by a UUID of version 7, else by a time.';

CREATE FUNCTION partition_name(held_by text, month date) RETURNS text LANGUAGE sql IMMUTABLE AS $$
  SELECT held_by || '_' || to_char(month, 'YYYY_MM')
$$;

-- Attached rather than created in place: readers never wait. Its foreign keys make writers and it wait for each other, once a month
-- for less than a second; where a writer holds on for longer than the lock's timeout, it is made later.
CREATE FUNCTION make_partition(held_by regclass, name text, by_uuid boolean, month date) RETURNS boolean
LANGUAGE plpgsql SET timezone = 'UTC' SET lock_timeout = '2s' AS $$
DECLARE
  made text := partition_name(name, month);
  first timestamptz := month::timestamptz;
  past timestamptz := (month + interval '1 month')::timestamptz;
BEGIN
  IF to_regclass('public.' || made) IS NOT NULL OR to_regclass('detached.' || made) IS NOT NULL THEN
    RETURN false;
  END IF;
  EXECUTE format('CREATE TABLE public.%I (LIKE %s INCLUDING DEFAULTS INCLUDING CONSTRAINTS INCLUDING STORAGE)', made, held_by);
  PERFORM make_append_only(format('public.%I', made)::regclass);
  EXECUTE format('ALTER TABLE %s ATTACH PARTITION public.%I FOR VALUES FROM (%L) TO (%L)', held_by, made,
                 CASE WHEN by_uuid THEN least_uuid_of(first)::text ELSE first::text END,
                 CASE WHEN by_uuid THEN least_uuid_of(past)::text ELSE past::text END);
  RETURN true;
END
$$;

CREATE FUNCTION make_partitions(months_ahead integer) RETURNS integer
LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp SET timezone = 'UTC' SET lock_timeout = '2s' AS $$
DECLARE
  made integer := 0;
  held record;
  month date;
BEGIN
  IF months_ahead NOT BETWEEN 0 AND 120 THEN
    RAISE EXCEPTION 'months_ahead: %, want 0 to 120', months_ahead USING ERRCODE = 'invalid_parameter_value';
  END IF;
  PERFORM pg_advisory_xact_lock(6021, 3);
  FOR month IN SELECT generate_series(date_trunc('month', clock_timestamp()),
                                      date_trunc('month', clock_timestamp()) + make_interval(months => months_ahead),
                                      '1 month')::date LOOP
    FOR held IN SELECT * FROM partitioned_tables ORDER BY depth, name LOOP
      made := made + make_partition(held.held_by, held.name, held.by_uuid, month)::integer;
    END LOOP;
  END LOOP;
  RETURN made;
END
$$;
COMMENT ON FUNCTION make_partitions(integer) IS
  'This month''s partition of everything that is kept by months and those of so many months ahead, where they are not there yet; '
  'how many it made. A plant whose month has no partition can record nothing.';

CREATE SCHEMA detached;
COMMENT ON SCHEMA detached IS 'Months that were taken out of the plant, one table for each: to be written elsewhere and dropped.';

-- Those that refer to others first. Names stay: what another month says of a thing of this one can still be read. Blobs that a
-- detached month refers to are kept as long as its tables are there.
CREATE FUNCTION detach_month(month date) RETURNS integer
LANGUAGE plpgsql SET search_path = public SET timezone = 'UTC' SET lock_timeout = '10s' AS $$
DECLARE
  held record;
  reference record;
  gone text;
  detached integer := 0;
BEGIN
  IF month <> date_trunc('month', month)::date OR month + interval '2 months' > clock_timestamp() THEN
    RAISE EXCEPTION 'month: %, want the first day of a month that ended a month ago', month
      USING ERRCODE = 'invalid_parameter_value';
  END IF;
  FOR held IN SELECT * FROM partitioned_tables ORDER BY depth DESC, name LOOP
    gone := partition_name(held.name, month);
    CONTINUE WHEN to_regclass('public.' || gone) IS NULL;
    EXECUTE format('ALTER TABLE %s DETACH PARTITION public.%I', held.held_by, gone);
    FOR reference IN SELECT conname FROM pg_constraint
        JOIN pg_partitioned_table p ON p.partrelid = confrelid
        WHERE conrelid = to_regclass('public.' || gone) AND contype = 'f' LOOP
      EXECUTE format('ALTER TABLE public.%I DROP CONSTRAINT %I', gone, reference.conname);
    END LOOP;
    EXECUTE format('ALTER TABLE public.%I SET SCHEMA detached', gone);
    EXECUTE format('GRANT SELECT ON detached.%I TO sixpoint_ingest', gone);  -- whose collector asks who refers to a blob
    detached := detached + 1;
  END LOOP;
  RETURN detached;
END
$$;

CREATE FUNCTION drop_requests_before(month date) RETURNS integer
LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp SET timezone = 'UTC' SET lock_timeout = '2s' AS $$
DECLARE
  past record;
  dropped integer := 0;
BEGIN
  IF month > date_trunc('month', clock_timestamp() - interval '1 month')::date THEN
    RAISE EXCEPTION 'month: %, want one that ended a month ago: retries may still come', month
      USING ERRCODE = 'invalid_parameter_value';
  END IF;
  FOR past IN SELECT inhrelid::regclass AS partition FROM pg_inherits JOIN pg_class c ON c.oid = inhrelid
      WHERE inhparent = 'requests'::regclass AND c.relname < partition_name('requests', month) LOOP
    EXECUTE format('DROP TABLE %s', past.partition);
    dropped := dropped + 1;
  END LOOP;
  RETURN dropped;
END
$$;
COMMENT ON FUNCTION drop_requests_before(date) IS 'Months of kept requests that end before it; how many.';

SELECT make_partitions(3);
