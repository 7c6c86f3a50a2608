#include "tests/support/tamperings.h"

#include <cstdio>
#include <cstdlib>

#include "bench/ground/blade_rows.h"
#include "bench/ground/transactions.h"
#include "storage/calibrations.h"
#include "storage/ledger.h"
#include "storage/record.h"
#include "tests/support/sample_calibrations.h"

namespace sixpoint::testing {
namespace {

using bench::Begin;
using bench::Commit;
using bench::Must;

// An inspection, its holes and the journal's rows of it.
constexpr char kOfAll[] = "(SELECT inspection_id FROM inspections ORDER BY inspection_id LIMIT 1)";
// The last entry.
constexpr char kOfLast[] = "(SELECT record_id FROM record_names ORDER BY record_sequence DESC LIMIT 1)";

std::string With(const char* begin, const char* key, const char* end = "") { return std::string(begin) + key + end; }

std::vector<std::string> DeleteEntry(const char* key) {
  std::vector<std::string> sql = {With("CREATE TEMP TABLE gone AS SELECT ", key, " AS id")};
  for (const char* of :
       {"inspection_holes WHERE inspection_id", "inspection_scans WHERE inspection_id",
        "inspections WHERE inspection_id", "requests WHERE record_id", "record_roots WHERE record_id",
        "record_inputs WHERE record_id", "record_entries WHERE record_id", "record_names WHERE record_id"})
    sql.push_back(std::string("DELETE FROM ") + of + " = (SELECT id FROM gone)");
  return sql;
}

std::vector<std::string> And(std::vector<std::string> first, const std::vector<std::string>& then) {
  first.insert(first.end(), then.begin(), then.end());
  return first;
}

// Everything since the first of the two heads.
std::vector<std::string> SetBack() {
  std::vector<std::string> sql = {
      "CREATE TEMP TABLE gone AS SELECT record_id AS id FROM ledger_leaves WHERE leaf_index >= (SELECT min(tree_size) "
      "FROM ledger_heads)"};
  for (const char* of : {"inspection_holes WHERE inspection_id",
                         "inspection_scans WHERE inspection_id",
                         "inspections WHERE inspection_id",
                         "correction_holes WHERE correction_id",
                         "correction_groups WHERE correction_id",
                         "corrections WHERE correction_id",
                         "registration_scans WHERE registration_id",
                         "registration_agreements WHERE registration_id",
                         "registration_datums WHERE registration_id",
                         "registration_error_sources WHERE registration_id",
                         "registrations WHERE registration_id",
                         "scan_blocks WHERE scan_key",
                         "scans WHERE scan_key",
                         "blades WHERE record_id",
                         "requests WHERE record_id",
                         "record_roots WHERE record_id",
                         "record_inputs WHERE record_id",
                         "record_entries WHERE record_id",
                         "ledger_contents WHERE record_id",
                         "ledger_leaves WHERE record_id",
                         "record_names WHERE record_id"})
    sql.push_back(std::string("DELETE FROM ") + of + " IN (SELECT id FROM gone)");
  sql.emplace_back(
      "DELETE FROM ledger_nodes n WHERE ((n.node_index + 1) << n.level) > (SELECT count(*) FROM ledger_leaves)");
  sql.emplace_back("DELETE FROM ledger_heads WHERE tree_size > (SELECT count(*) FROM ledger_leaves)");
  return sql;
}

const std::string kChangeFigure =
    With("UPDATE inspections SET deviation_point_count = deviation_point_count - 1 WHERE inspection_id = ", kOfAll);

std::vector<Tampering> OfResults() {
  return {
      {"a figure of a result changed", "inspections", {kChangeFigure}},
      {"a figure changed by its last bit",
       "registrations",
       {"UPDATE registrations SET reference_mm[1] = 1.2500000000000002 WHERE registration_id = "
        "(SELECT registration_id FROM registrations ORDER BY 1 LIMIT 1)"}},
      {"a hole's verdict changed",
       "inspection_holes",
       {With("UPDATE inspection_holes SET verdict = 'NOT_CONFORM' WHERE position_index = 1 AND inspection_id = ",
             kOfAll)}},
      {"a hole deleted",
       "inspection_holes",
       {With("DELETE FROM inspection_holes WHERE position_index = 1 AND inspection_id = ", kOfAll)}},
      {"a hole forged",
       "inspection_holes",
       {With("CREATE TEMP TABLE forged AS SELECT * FROM inspection_holes WHERE position_index = 1 AND inspection_id = ",
             kOfAll),
        "UPDATE forged SET position_index = 1000, hole_name = 'forged'",
        "INSERT INTO inspection_holes SELECT * FROM forged"}},
      {"two results swapped between blades",
       "inspections",
       {"UPDATE inspections SET blade_serial = CASE blade_serial WHEN 'SN-0' THEN 'SN-1' ELSE 'SN-0' END "
        "WHERE blade_serial IN ('SN-0', 'SN-1')"}},
      {"two holes' rows swapped",
       "inspection_holes",
       {With("UPDATE inspection_holes SET hole_name = 'other' WHERE position_index = 0 AND inspection_id = ", kOfAll),
        With("UPDATE inspection_holes SET hole_name = 'H0' WHERE position_index = 1 AND inspection_id = ", kOfAll),
        With("UPDATE inspection_holes SET hole_name = 'H1' WHERE position_index = 0 AND inspection_id = ", kOfAll)}},
      {"until when a program may be used changed",
       "corrections",
       {"UPDATE corrections SET valid_until = valid_until + interval '1 year' WHERE correction_id = "
        "(SELECT correction_id FROM corrections ORDER BY 1 LIMIT 1)"}},
      {"a program put beside a correction",
       "corrections",
       {"UPDATE corrections SET nc_template_sha256 = sha256('a'), nc_program_sha256 = sha256('b') WHERE correction_id "
        "= "
        "(SELECT correction_id FROM corrections ORDER BY 1 LIMIT 1)"}},
      {"a result without an entry forged",
       "inspections",
       {With("CREATE TEMP TABLE forged AS SELECT * FROM inspections WHERE inspection_id = ", kOfAll),
        "UPDATE forged SET inspection_id = (left(inspection_id::text, 24) || 'ffffffffffff')::uuid",
        "INSERT INTO inspections SELECT * FROM forged"}},
      {"a table replaced by a view that shows the old value to whoever checks",
       "inspections",
       {"ALTER TABLE inspections RENAME TO inspections_kept",
        "CREATE VIEW inspections AS SELECT * FROM inspections_kept", "GRANT SELECT ON inspections TO sixpoint_ledger"}},
      // Of this session and, where it is committed, of those that come.
      {"functions of another schema put before the built-in ones",
       "inspection_holes",
       {"CREATE SCHEMA evil", "GRANT USAGE ON SCHEMA evil TO PUBLIC",
        "CREATE FUNCTION evil.set_config(text, text, boolean) RETURNS text LANGUAGE sql AS $$ SELECT CASE $1 WHEN "
        "'search_path' THEN $2 ELSE pg_catalog.set_config($1, $2, $3) END $$",
        "CREATE FUNCTION evil.to_json(text) RETURNS json LANGUAGE sql AS $$ SELECT pg_catalog.to_json(CASE $1 WHEN "
        "'forged' THEN 'H0' ELSE $1 END) $$",
        With("UPDATE inspection_holes SET hole_name = 'forged' WHERE hole_name = 'H0' AND inspection_id = ", kOfAll),
        "DO $$ DECLARE login name; BEGIN FOR login IN SELECT rolname FROM pg_roles WHERE rolname IN (session_user, "
        "'sixpoint_plant') LOOP EXECUTE format('ALTER ROLE %I IN DATABASE %I SET search_path = evil, pg_catalog, "
        "public', login, current_database()); END LOOP; END $$",
        "SET LOCAL search_path = evil, pg_catalog, public"}},
      {"the month's partition renamed, as though it had been detached, and a figure changed",
       "inspections",
       {"DO $$ DECLARE part regclass; BEGIN FOR part IN SELECT inhrelid::regclass FROM pg_inherits WHERE inhparent = "
        "'record_entries'::regclass LOOP EXECUTE format('ALTER TABLE %s RENAME TO %I', part, 'kept_' || "
        "part::oid); END LOOP; END $$",
        kChangeFigure}},
  };
}

std::vector<Tampering> OfJournal() {
  return {
      {"a summary of the journal changed",
       "record_entries",
       {With("UPDATE record_entries SET summary = summary || '{\"residual_rms_um\": 1.0}' WHERE record_id = ",
             kOfAll)}},
      {"who asked changed",
       "record_entries",
       {With("UPDATE record_entries SET requested_by = 'machine 2' WHERE record_id = ", kOfAll)}},
      {"when it was recorded changed",
       "record_names",
       {With("UPDATE record_names SET recorded_at = recorded_at - interval '1 second' WHERE record_id = ", kOfAll)}},
      {"when it was recorded changed in the journal",
       "record_entries",
       {With("UPDATE record_entries SET recorded_at = recorded_at - interval '1 microsecond' WHERE record_id = ",
             kOfAll)}},
      {"its name changed",
       "record_names",
       {With("UPDATE record_names SET name = 'inspections/another' WHERE record_id = ", kOfAll)}},
      {"an entry deleted with all its rows", "record_names", DeleteEntry(kOfAll)},
      {"the last entry deleted with all its rows, and its leaf", "heads",
       And({With("CREATE TEMP TABLE last_leaf AS SELECT ", kOfLast, " AS id"),
            "DELETE FROM ledger_leaves WHERE record_id = (SELECT id FROM last_leaf)",
            "DELETE FROM ledger_contents WHERE record_id = (SELECT id FROM last_leaf)",
            "DELETE FROM ledger_heads WHERE tree_size > (SELECT count(*) FROM ledger_leaves)"},
           DeleteEntry(kOfLast))},
      {"the database set back to an older state", "heads", SetBack()},
      {"two entries swapped in their order",
       "record_names",
       {"CREATE TEMP TABLE two AS SELECT record_id, record_sequence FROM record_names ORDER BY record_sequence DESC "
        "LIMIT 2",
        "UPDATE record_names SET record_sequence = record_sequence + 1000000 WHERE record_id IN (SELECT record_id FROM "
        "two)",
        "UPDATE record_names n SET record_sequence = (SELECT t.record_sequence FROM two t WHERE t.record_id <> "
        "n.record_id) "
        "WHERE n.record_id IN (SELECT record_id FROM two)",
        "UPDATE record_entries e SET record_sequence = (SELECT t.record_sequence FROM two t WHERE t.record_id <> "
        "e.record_id) "
        "WHERE e.record_id IN (SELECT record_id FROM two)"}},
      {"the target of an edge changed",
       "record_inputs",
       {With("UPDATE record_inputs SET input_id = (SELECT record_id FROM record_names WHERE name = 'artefacts/a1@1') "
             "WHERE position_index = 0 AND record_id = ",
             kOfAll)}},
      {"two edges swapped",
       "record_inputs",
       {With("UPDATE record_inputs SET position_index = 1000 WHERE position_index = 0 AND record_id = ", kOfAll),
        With("UPDATE record_inputs SET position_index = 0 WHERE position_index = 1 AND record_id = ", kOfAll),
        With("UPDATE record_inputs SET position_index = 1 WHERE position_index = 1000 AND record_id = ", kOfAll)}},
      {"an edge deleted",
       "record_inputs",
       {With("DELETE FROM record_inputs WHERE position_index = 0 AND record_id = ", kOfAll)}},
      {"what recalls walk deleted", "record_roots", {"TRUNCATE record_roots"}},
      {"an entry forged before the first",
       "record_names",
       {"ALTER TABLE record_names DROP CONSTRAINT record_names_sequence_positive",
        "INSERT INTO record_names (record_id, name, record_sequence, recorded_at) SELECT (left(record_id::text, 24) || "
        "'ffffffffffff')::uuid, 'inspections/forged', '-9223372036854775808'::bigint, recorded_at FROM record_names "
        "ORDER BY "
        "record_sequence LIMIT 1"}},
      {"an entry forged in a gap",
       "record_names",
       {"INSERT INTO record_names (record_id, name, record_sequence, recorded_at) SELECT "
        "(left(record_id::text, 24) || 'ffffffffffff')::uuid, 'inspections/forged', g.free, recorded_at FROM "
        "record_names, (SELECT min(s) AS free FROM "
        "generate_series(1, (SELECT max(record_sequence) FROM record_names)) s WHERE s NOT IN (SELECT record_sequence "
        "FROM "
        "record_names)) g ORDER BY record_sequence DESC LIMIT 1"}},
  };
}

std::vector<Tampering> OfInputs() {
  return {
      {"the digest of a scan's block changed",
       "scan_blocks",
       {"UPDATE scan_blocks SET blob_sha256 = (SELECT sha256 FROM blobs ORDER BY sha256 DESC LIMIT 1) WHERE "
        "block_index = 0 AND scan_key = "
        "(SELECT scan_key FROM scans ORDER BY 1 LIMIT 1)"}},
      {"bytes of a blob changed",
       "blobs",
       {"UPDATE blobs SET bytes = set_byte(bytes, 0, 255 - get_byte(bytes, 0)) WHERE store = 'postgresql'"}},
      {"bytes of a scan deleted and no deletion written",
       "blobs",
       {"UPDATE blobs SET deleted_at = now(), deletion_reason = 'policy' WHERE sha256 = (SELECT blob_sha256 FROM "
        "scan_blocks LIMIT 1)"}},
      {"bytes of a part's surface deleted as though by retention",
       "blobs",
       {"UPDATE blobs SET bytes = NULL, deleted_at = now(), deletion_reason = 'policy' WHERE sha256 = (SELECT "
        "surface_sha256 FROM tessellations LIMIT 1)"}},
      {"a blob's row deleted",
       "blobs",
       {"DELETE FROM blobs WHERE sha256 = (SELECT blob_sha256 FROM scan_blocks LIMIT 1)"}},
      {"a parameter of a calibration changed",
       "sensor_calibrations",
       {"UPDATE sensor_calibrations SET alpha_deg = alpha_deg + 1e-9"}},
      {"until when a calibration holds changed",
       "calibrations",
       {"UPDATE calibrations SET valid_until = valid_until + interval '1 day'"}},
      {"why a calibration was withdrawn changed",
       "calibration_events",
       {"UPDATE calibration_events SET reason = 'routine'"}},
      {"a withdrawal deleted", "calibration_events", {"DELETE FROM calibration_events"}},
      {"a part's tolerance changed",
       "part_hole_groups",
       {"UPDATE part_hole_groups SET position_tolerance_mm = 2 * position_tolerance_mm"}},
      {"a part's surface exchanged",
       "tessellations",
       {"UPDATE tessellations SET triangle_count = triangle_count + 1, surface_sha256 = cad_sha256"}},
      {"the direction of a machine's axis changed",
       "machine_joints",
       {"UPDATE machine_joints SET sign = -sign WHERE axis = 'C'"}},
  };
}

std::vector<Tampering> OfLedger() {
  const std::string clear = "TRUNCATE ledger_leaves, ledger_contents, ledger_nodes, ledger_heads";
  return {
      {"a leaf's digest overwritten",
       "ledger_leaves",
       {"UPDATE ledger_leaves SET content_sha256 = sha256('') WHERE leaf_index = 3"}},
      {"a leaf deleted", "ledger_leaves", {"DELETE FROM ledger_leaves WHERE leaf_index = 3"}},
      {"what was sealed of an entry deleted, and a row changed",
       "ledger_contents",
       {With("DELETE FROM ledger_contents WHERE record_id = ", kOfAll), kChangeFigure}},
      {"a row changed and its leaf written to match",
       "heads",
       {"TRUNCATE ledger_leaves, ledger_contents, ledger_nodes", kChangeFigure},
       Reseal::kYes},
      {"a row changed, its leaf and the last head written to match without the key",
       "heads",
       {clear, kChangeFigure},
       Reseal::kYes},
      {"the whole ledger made anew with another key", "heads", {clear, kChangeFigure}, Reseal::kAnotherKey},
      {"a head's root overwritten", "heads", {"UPDATE ledger_heads SET root_sha256 = sha256('')"}},
      {"a kept subtree overwritten",
       "ledger_nodes",
       {"DELETE FROM ledger_nodes", "INSERT INTO ledger_nodes VALUES (8, 0, sha256(''))"}},
  };
}

}  // namespace

const std::vector<Tampering>& Tamperings() {
  static const auto* const all = [] {
    auto* const made = new std::vector<Tampering>();
    for (const auto& some : {OfResults(), OfJournal(), OfInputs(), OfLedger()})
      made->insert(made->end(), some.begin(), some.end());
    return made;
  }();
  return *all;
}

std::vector<ledger::Head> AddTamperedPlant(storage::Database* database, const ledger::SigningKey& key,
                                           int blade_count) {
  const bench::Registry registry = bench::MakeRegistry(database);
  const auto seal = [&] {
    storage::Transaction transaction = Begin(database);
    Must(absl::StatusOr<int>(storage::BeginLedger(transaction).ok() ? absl::StatusOr<int>(0)
                                                                    : absl::InternalError("no ledger")));
    for (bool more = true; more;) more = Must(storage::SealEntries(transaction, 1000)).more;
    const storage::LedgerEnd end = Must(storage::ReadLedgerEnd(transaction));
    ledger::Head head;
    head.plant_id = Must(storage::PlantId(transaction));
    head.tree_size = end.size;
    head.root = Must(storage::RootOf(transaction, {0, end.size}));
    head.record_sequence = end.record_sequence;
    head.signed_at = "2026-11-25T01:02:03Z";
    head = Must(key.Sign(head));
    if (!storage::KeepHead(transaction, {head, key.public_pem()}).ok()) std::exit(1);
    Commit(&transaction);
    return head;
  };
  {
    storage::Transaction rolled_back = Begin(database);
    storage::RecordEntry entry;
    entry.kind = "scan";
    entry.name = "scans/never";
    entry.software_version = "test";
    Must(storage::AppendRecord(rolled_back, storage::NewUuid(), entry));
  }
  {
    storage::Transaction transaction = Begin(database);
    Must(transaction.Execute(
        "INSERT INTO part_hole_groups VALUES ('p1', 1, 0, 'G0', 0.5, 3, 0, 60, '{0,0,1}', 0.1, 1)"));
    Must(transaction.Execute(
        "INSERT INTO machine_joints VALUES ('m1', 1, 'part', 9, 'C', 'rotary', '{0,0,1}', '{0,0,0}', 1, -360, 360)"));
    Commit(&transaction);
  }
  std::vector<ledger::Head> heads;
  for (int blade = 0; blade < blade_count; ++blade) {
    if (blade == blade_count - 1) heads.push_back(seal());
    bench::AddBlade(database, registry, "SN-" + std::to_string(blade), {2, 1, 3});
    if (blade > 0) continue;
    storage::Transaction transaction = Begin(database);
    storage::CalibrationRow row = testing::SampleSensorCalibration();
    row.calibration_id = storage::NewUuid();
    row.machine_id = "m1";
    row.request_sha256 =
        Must(transaction.Execute("SELECT sha256 FROM blobs WHERE store = 'postgresql' ORDER BY sha256 DESC LIMIT 1"))
            .Digest(0, 0);
    row.valid_from = std::chrono::system_clock::now() - std::chrono::hours(2);
    row.valid_until = row.valid_from + std::chrono::hours(24);
    row.requested_by = "engineer";
    row.software_version = "test";
    storage::RecordEntry entry;
    entry.kind = "calibration";
    entry.name = row.name();
    entry.machine = "m1";
    entry.inputs = {"machines/m1@1"};
    entry.software_version = "test";
    Must(storage::InsertCalibration(transaction, row, entry));
    Must(storage::WithdrawCalibration(transaction, row, {"knocked", "engineer", "test", {}}));
    Commit(&transaction);
  }
  heads.push_back(seal());
  return heads;
}

absl::Status Tamper(storage::Transaction& transaction, const Tampering& tampering) {
  absl::Status done = transaction.Execute("SET LOCAL session_replication_role = replica").status();
  for (const std::string& sql : tampering.sql) {
    if (!done.ok()) return done;
    const absl::StatusOr<storage::Rows> did = transaction.Execute(sql);
    done = did.status();
    // A tampering that meets no row finds nothing out.
    if (did.ok() && sql.rfind("UPDATE", 0) == 0 && did->affected() == 0) return absl::InternalError(sql + ": no row");
  }
  if (!done.ok() || tampering.reseal == Reseal::kNo) return done;
  if (done = storage::BeginLedger(transaction); !done.ok()) return done;
  for (bool more = true; more;) {
    const absl::StatusOr<storage::Sealed> sealed = storage::SealEntries(transaction, 1000);
    if (!sealed.ok()) return sealed.status();
    more = sealed->more;
  }
  if (tampering.reseal != Reseal::kAnotherKey) return done;
  const ledger::SigningKey key = *ledger::SigningKey::OfPem(*ledger::SigningKey::NewPem());
  const absl::StatusOr<storage::LedgerEnd> end = storage::ReadLedgerEnd(transaction);
  ledger::Head head;
  head.plant_id = *storage::PlantId(transaction);
  head.tree_size = end->size;
  head.root = *storage::RootOf(transaction, {0, end->size});
  head.record_sequence = end->record_sequence;
  head.signed_at = "2026-11-25T01:02:03Z";
  return storage::KeepHead(transaction, {*key.Sign(head), key.public_pem()});
}

}  // namespace sixpoint::testing
