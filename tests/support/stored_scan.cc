#include "tests/support/stored_scan.h"

#include <cstdio>
#include <cstdlib>

#include "storage/blobs.h"
#include "storage/record.h"
#include "storage/scans.h"
#include "tests/support/must.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

// As if it had been recorded then: its key says when, and chooses the month.
void MakeOlder(storage::Transaction& transaction, const std::string& scan_id, int days) {
  Must(
      transaction.Execute("SELECT make_partition(held_by, name, by_uuid, date_trunc('month', now() - "
                          "make_interval(days => $1))::date) FROM partitioned_tables ORDER BY depth, name",
                          storage::Params().Int(days)));
  Must(transaction.Execute("SET LOCAL session_replication_role = replica"));  // no triggers, no foreign keys
  for (const char* change :
       {"UPDATE scan_blocks SET scan_key = older", "UPDATE scans SET scan_key = older",
        "UPDATE record_inputs SET record_id = older",
        "UPDATE record_entries SET record_id = older, recorded_at = recorded_at - make_interval(days => $2)",
        "UPDATE record_names SET record_id = older"}) {
    const bool by_key = std::string(change).find("scan_key") != std::string::npos;
    Must(transaction.Execute(std::string(change) +
                                 " FROM (SELECT record_id AS newer, (left(least_uuid_of(now() - "
                                 "make_interval(days => $2))::text, "
                                 "14) || right(record_id::text, 22))::uuid AS older FROM record_names WHERE name = "
                                 "'scans/' || $1) n WHERE " +
                                 (by_key ? "scan_key" : "record_id") + " = newer",
                             storage::Params().Text(scan_id).Int(days)));
  }
  Must(transaction.Execute("SET LOCAL session_replication_role = DEFAULT"));
}

}  // namespace

void PutScanSubjects(storage::Database* database) {
  storage::Transaction transaction = Must(database->Begin(Soon()));
  RegisterMachine(transaction, "m1", 3);
  RegisterArtefact(transaction, "p1", 2);
  if (!transaction.Commit().ok()) std::exit(1);
}

std::string PutCloud(storage::Database* database, storage::BlobStore* store, const std::string& bytes) {
  const storage::StagedBlob staged = Must(store->Stage(*database, bytes, Soon(60)));
  storage::Transaction transaction = Must(database->Begin(Soon(60)));
  if (!store->Put(transaction, staged).ok() || !transaction.Commit().ok()) std::exit(1);
  return staged.sha256;
}

void PutScan(storage::Database* database, storage::BlobStore* store, const std::string& scan_id,
             const std::string& kind, const std::vector<std::string>& blocks, int days_ago) {
  storage::Transaction transaction = Must(database->Begin(Soon(60)));
  storage::ScanRow scan;
  scan.scan_id = scan_id;
  scan.machine_id = "m1";
  scan.machine_revision = 1;
  scan.artefact_id = "p1";
  scan.artefact_revision = 1;
  scan.kind = kind;
  scan.profile_pitch_mm = 0.05;
  scan.columns_per_profile = 100;
  scan.encoding = scan.stored_encoding = "draco";
  scan.profile_count = static_cast<int>(blocks.size());
  scan.block_count = static_cast<int>(blocks.size());
  std::vector<storage::ScanBlockRow> rows;
  std::string whole;
  for (const std::string& block : blocks) {
    storage::ScanBlockRow& row = rows.emplace_back();
    row.point_count = 1;
    const storage::StagedBlob staged = Must(store->Stage(*database, block, Soon(60)));
    if (!store->Put(transaction, staged).ok()) std::exit(1);
    row.blob_sha256 = staged.sha256;
    row.first_profile = static_cast<int>(rows.size()) - 1;
    row.profile_count = 1;
    row.sent_sha256 = storage::Sha256Hex(block);
    scan.point_count += 1;
    scan.stored_bytes += static_cast<std::int64_t>(block.size());
    whole += block;
  }
  scan.stored_sha256 = scan.sent_sha256 = storage::Sha256Hex(whole);
  storage::RecordEntry entry;
  entry.kind = "scan";
  entry.name = "scans/" + scan_id;
  entry.machine = "m1";
  entry.software_version = "test";
  Must(storage::InsertScan(transaction, scan, rows, entry));
  if (days_ago > 0) MakeOlder(transaction, scan_id, days_ago);
  if (!transaction.Commit().ok()) std::exit(1);
}

}  // namespace sixpoint::testing
