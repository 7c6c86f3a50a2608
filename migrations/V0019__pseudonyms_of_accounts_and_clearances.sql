-- Persons of accounts and of clearances stand under their pseudonyms too where nothing is ever changed, and go with the name.
CREATE FUNCTION keep_pseudonym_of_subject() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  NEW.subject := pseudonym_of(NEW.subject);
  NEW.requested_by := pseudonym_of(NEW.requested_by);
  RETURN NEW;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON account_events FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_subject();

CREATE FUNCTION keep_pseudonym_of_holder() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  NEW.holder := pseudonym_of(NEW.holder);
  NEW.requested_by := pseudonym_of(NEW.requested_by);
  RETURN NEW;
END
$$;
CREATE TRIGGER pseudonyms BEFORE INSERT ON clearance_events FOR EACH ROW EXECUTE FUNCTION keep_pseudonym_of_holder();

-- Who has no pseudonym yet was cleared for nothing.
CREATE OR REPLACE FUNCTION clearance_holder(of_identity text) RETURNS text
LANGUAGE sql STABLE SECURITY DEFINER SET search_path = public, pg_temp AS $$
  SELECT coalesce((SELECT 'persons/' || p.pseudonym FROM persons p
                   WHERE of_identity LIKE 'users/%' AND p.user_name = substr(of_identity, 7)), of_identity)
$$;

-- As V0016 has it. An account that somebody may still sign in by, or whose sessions may still live, is not forgotten.
CREATE OR REPLACE FUNCTION forget_person(of_user text) RETURNS text
LANGUAGE plpgsql SECURITY DEFINER SET search_path = public, pg_temp AS $$
DECLARE
  was text;
BEGIN
  PERFORM 1 FROM accounts a WHERE a.name = 'users/' || of_user FOR UPDATE;  -- nobody enables it meanwhile
  IF EXISTS (SELECT 1 FROM accounts a WHERE a.name = 'users/' || of_user AND NOT a.disabled) THEN
    RAISE EXCEPTION 'name: users/%, an account that counts, want it disabled before it is forgotten', of_user
      USING ERRCODE = 'restrict_violation';
  END IF;
  IF EXISTS (SELECT 1 FROM session_ends s WHERE s.account = 'users/' || of_user
             AND s.ended_before > clock_timestamp() - interval '20 minutes') THEN
    RAISE EXCEPTION 'name: users/%, whose sessions ended less than 20 minutes ago, want it forgotten after that', of_user
      USING ERRCODE = 'restrict_violation';
  END IF;
  UPDATE persons SET user_name = NULL, forgotten_at = clock_timestamp() WHERE user_name = of_user RETURNING pseudonym INTO was;
  DELETE FROM certificate_renewals WHERE identity = 'users/' || of_user;
  DELETE FROM credential_offers WHERE identity = 'users/' || of_user;
  UPDATE certificate_renewals SET offered_by = 'persons/' || was WHERE offered_by = 'users/' || of_user AND was IS NOT NULL;
  UPDATE credential_offers SET offered_by = 'persons/' || was WHERE offered_by = 'users/' || of_user AND was IS NOT NULL;
  DELETE FROM accounts WHERE name = 'users/' || of_user AND disabled;
  DELETE FROM session_ends WHERE account = 'users/' || of_user;
  RETURN was;
END
$$;
