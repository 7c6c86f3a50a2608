-- A NULL among an array's elements was taken: compared with anything it gives NULL, which a CHECK lets pass.

CREATE OR REPLACE FUNCTION is_triple(v double precision[]) RETURNS boolean LANGUAGE sql IMMUTABLE AS $$
  SELECT v IS NULL OR coalesce(cardinality(v) = 3 AND array_ndims(v) = 1 AND abs(v[1]) < 1e7 AND abs(v[2]) < 1e7
                               AND abs(v[3]) < 1e7, false)
$$;
CREATE OR REPLACE FUNCTION is_unit(v double precision[]) RETURNS boolean LANGUAGE sql IMMUTABLE AS $$
  SELECT v IS NULL OR (is_triple(v) AND abs(sqrt(v[1] * v[1] + v[2] * v[2] + v[3] * v[3]) - 1) <= 1e-6)
$$;

-- Every array of every table, {column}_whole; tables made later say so themselves.
DO $$
DECLARE
  held record;
BEGIN
  FOR held IN
    SELECT c.oid::regclass AS held_by, c.relname, a.attname FROM pg_class c
      JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0 AND NOT a.attisdropped
      JOIN pg_type t ON t.oid = a.atttypid AND t.typcategory = 'A'
      WHERE c.relkind = 'r' AND c.relnamespace = 'public'::regnamespace ORDER BY c.relname, a.attnum
  LOOP
    EXECUTE format('ALTER TABLE %s ADD CONSTRAINT %I CHECK (array_position(%I, NULL) IS NULL)', held.held_by,
                   held.relname || '_' || held.attname || '_whole', held.attname);
  END LOOP;
END
$$;
