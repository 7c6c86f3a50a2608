#include "storage/retention.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "storage/blob_collector.h"
#include "storage/blob_references.h"
#include "storage/blob_rows.h"
#include "storage/one_read.h"
#include "storage/scan_keys.h"
#include "storage/scans.h"

namespace sixpoint::storage {
namespace {

constexpr int kDeletedAtOnce = 100;

constexpr char kSelectDeletion[] =
    "SELECT s.scan_id, d.reason, name_of(d.requested_by), coalesce(d.policy_kind, ''), coalesce(d.policy_revision, 0), "
    "d.points_sha256, d.points_bytes, r.record_sequence, r.recorded_at, "
    "to_char(r.recorded_at AT TIME ZONE 'UTC', 'YYYY-MM-DD HH24:MI:SS\"Z\"') FROM scan_deletions d "
    "JOIN scans s USING (scan_key) JOIN record_names r USING (record_id) WHERE d.scan_key = " SIXPOINT_SCAN_KEY("$1");
constexpr char kInsertDeletion[] =
    "INSERT INTO scan_deletions (scan_key, reason, requested_by, policy_kind, policy_revision, points_sha256, "
    "points_bytes, record_id) VALUES (" SIXPOINT_SCAN_KEY("$1") ", $2, $3, $4, $5, $6, $7, $8)";

#define SIXPOINT_BLOBS_OF_SCAN \
  "SELECT unnest(ARRAY[blob_sha256, evidence_sha256]) FROM scan_blocks WHERE scan_key = " SIXPOINT_SCAN_KEY("$1")
constexpr char kLockBlobsOfScan[] = "SELECT b.sha256 FROM blobs b WHERE b.sha256 IN (" SIXPOINT_BLOBS_OF_SCAN
                                    ") "
                                    "AND b.deleted_at IS NULL ORDER BY b.sha256 FOR UPDATE OF b SKIP LOCKED";
// Those of a deletion that somebody else holds just now, or another deletion of the same bytes that is not committed.
constexpr char kNoteLoose[] =
    "INSERT INTO loose_blobs (sha256) SELECT b.sha256 FROM blobs b WHERE b.sha256 IN (" SIXPOINT_BLOBS_OF_SCAN
    ") "
    "AND b.deleted_at IS NULL AND NOT b.sha256 = ANY ($2::bytea[]) "
    "ON CONFLICT (sha256) DO NOTHING";
#undef SIXPOINT_BLOBS_OF_SCAN
// What something refers to: the rest is the collector's. BlobConditions::unreferenced comes between the last two.
constexpr char kSelectLoose[] =
    "SELECT b.sha256 FROM blobs b WHERE b.sha256 > $1 AND b.sha256 IN (SELECT l.sha256 FROM loose_blobs l)";
constexpr char kReferredTo[] = " AND NOT (true";
constexpr char kLooseInOrder[] = ") ORDER BY b.sha256 LIMIT $2 FOR UPDATE OF b SKIP LOCKED";
constexpr char kForgetLoose[] = "DELETE FROM loose_blobs WHERE sha256 = ANY ($1::bytea[])";
constexpr char kDeleteBytes[] =
    "UPDATE blobs b SET bytes = NULL, deleted_at = clock_timestamp(), deletion_reason = $2 "
    "WHERE b.sha256 = ANY ($1::bytea[]) AND b.deleted_at IS NULL";
constexpr char kReturningDeletedBytes[] = " RETURNING b.sha256, b.size_bytes, b.store, coalesce(b.object_id::text, '')";
constexpr char kLeftOverReason[] = "points of its scans were deleted";

constexpr char kSelectPoliciesInForce[] =
    "SELECT p.scan_kind, p.revision, p.keep_days, coalesce(g.after_scan_key, '00000000-0000-0000-0000-000000000000') "
    "FROM retention_policies p LEFT JOIN retention_progress g "
    "ON g.scan_kind = p.scan_kind AND g.policy_revision = p.revision "
    "WHERE p.keep_days IS NOT NULL AND NOT EXISTS ("
    "SELECT 1 FROM retention_policies q WHERE q.scan_kind = p.scan_kind AND q.revision > p.revision) ORDER BY "
    "p.scan_kind";
// In the order of their keys, which is that of time: what was looked at before is not read again. A key is a little older than
// its record, and may be for as long as its transaction took.
constexpr char kSelectDue[] =
    "SELECT s.scan_id, s.stored_bytes, s.scan_key, "
    "EXISTS (SELECT 1 FROM scan_deletions d WHERE d.scan_key = s.scan_key), "
    "n.recorded_at < now() - make_interval(days => $3) FROM scans s "
    "JOIN recorded n ON n.record_id = s.scan_key WHERE s.kind = $1 AND s.scan_key > $2 "
    "AND s.scan_key < least_uuid_of(now() - make_interval(days => $3, hours => 1)) ORDER BY s.scan_key LIMIT $4";
constexpr char kKeepProgress[] =
    "INSERT INTO retention_progress (scan_kind, policy_revision, after_scan_key) VALUES ($1, $2, $3) "
    "ON CONFLICT (scan_kind) DO UPDATE SET policy_revision = excluded.policy_revision, "
    "after_scan_key = excluded.after_scan_key";

struct Freed {
  std::int64_t count = 0;
  std::int64_t bytes = 0;
  std::vector<ClaimedObject> objects;  // to be deleted after the commit
};

ScanDeletion ReadDeletion(const Rows& rows) {
  ScanDeletion deletion;
  deletion.scan_id = rows.Text(0, 0);
  deletion.reason = rows.Text(0, 1);
  deletion.requested_by = rows.Text(0, 2);
  deletion.policy_kind = rows.Text(0, 3);
  deletion.policy_revision = static_cast<int>(rows.Int(0, 4));
  deletion.points_sha256 = rows.Digest(0, 5);
  deletion.points_bytes = rows.Int(0, 6);
  deletion.recorded = {rows.Int(0, 7), rows.Time(0, 8)};
  return deletion;
}

std::vector<std::string> DigestsOf(const Rows& rows) {
  std::vector<std::string> digests;
  for (int row = 0; row < rows.count(); ++row) digests.push_back(rows.Digest(row, 0));
  return digests;
}

// The rows are locked already; this statement sees what was committed before.
absl::StatusOr<Freed> DeleteBytes(Transaction& transaction, const std::string& unneeded,
                                  const std::vector<std::string>& digests, const std::string& reason) {
  Freed freed;
  if (digests.empty()) return freed;
  if (absl::Status announced = AnnounceBlobChange(transaction, "delete_bytes"); !announced.ok()) return announced;
  const absl::StatusOr<Rows> gone =
      transaction.Execute(kDeleteBytes + unneeded + kReturningDeletedBytes, Params().Digests(digests).Text(reason));
  if (!gone.ok()) return gone.status();
  if (absl::Status done = AnnounceBlobChange(transaction, ""); !done.ok()) return done;
  for (int row = 0; row < gone->count(); ++row) {
    ++freed.count;
    freed.bytes += gone->Int(row, 1);
    if (gone->Text(row, 2) == kStoreS3) freed.objects.push_back({gone->Digest(row, 0), gone->Text(row, 3)});
  }
  return gone->Checked(std::move(freed));
}

// What stays because the object store is away is taken by the collector later: it is in the bucket's list.
void DeleteObjects(Database* database, ObjectStore* objects, const std::vector<ClaimedObject>& gone,
                   Deadline deadline) {
  if (objects == nullptr) return;
  for (const ClaimedObject& object : gone) {
    if (!DeleteObject(database, objects, object, deadline).ok()) return;
  }
}

absl::Status CheckPolicyHolds(Transaction& transaction, const RetentionPolicy& policy) {
  const absl::StatusOr<int> newest = NewestPolicyRevision(transaction, policy.scan_kind);
  if (!newest.ok()) return newest.status();
  if (*newest == policy.revision) return absl::OkStatus();
  return absl::AbortedError("retention of " + policy.scan_kind + " scans: revision " + std::to_string(policy.revision) +
                            " is not the newest any more");
}

RecordEntry EntryOf(const ScanRow& scan, const DeletionOrder& order) {
  RecordEntry entry;
  entry.kind = "deletion";
  entry.name = "deletions/" + scan.scan_id;
  entry.inputs = {"scans/" + scan.scan_id};
  entry.blade = scan.blade_serial;
  entry.machine = scan.machine_id;
  entry.method = order.policy ? "retention" : "by name";
  entry.software_version = order.software_version;
  entry.requested_by = order.requested_by;
  if (!order.trace_id.empty()) entry.trace_id = order.trace_id;
  entry.summary_json =
      nlohmann::json(
          {{"reason", order.reason}, {"points_sha256", scan.stored_sha256}, {"points_bytes", scan.stored_bytes}})
          .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return entry;
}

absl::Status InsertDeletion(Transaction& transaction, const ScanDeletion& deletion, const std::string& record_id) {
  Params params;
  params.Text(deletion.scan_id).Text(deletion.reason).Text(deletion.requested_by);
  deletion.policy_kind.empty() ? params.Null().Null() : params.Text(deletion.policy_kind).Int(deletion.policy_revision);
  params.Digest(deletion.points_sha256).Int(deletion.points_bytes).Uuid(record_id);
  return transaction.Execute(kInsertDeletion, params).status();
}

// Bytes of deleted scans that were held by somebody when their scan's points were deleted.
absl::Status SweepLoose(Database* database, ObjectStore* objects, const RetentionOptions& options, Deadline deadline,
                        RetentionDone* done) {
  std::string after_sha256;
  while (options.keep_going()) {
    absl::StatusOr<Transaction> transaction = database->Begin(deadline);
    if (!transaction.ok()) return transaction.status();
    const absl::StatusOr<BlobConditions> conditions = ReadBlobConditions(*transaction);
    if (!conditions.ok()) return conditions.status();
    const absl::StatusOr<Rows> loose =
        transaction->Execute(std::string(kSelectLoose) + kReferredTo + conditions->unreferenced + kLooseInOrder,
                             Params().Digest(after_sha256).Int(kDeletedAtOnce));
    if (!loose.ok()) return loose.status();
    if (loose->count() == 0) return absl::OkStatus();
    const std::vector<std::string> digests = DigestsOf(*loose);
    if (absl::Status read = loose->status(); !read.ok()) return read;
    after_sha256 = digests.back();
    const absl::StatusOr<Freed> freed = DeleteBytes(*transaction, conditions->unneeded, digests, kLeftOverReason);
    if (!freed.ok()) return freed.status();
    const absl::StatusOr<Rows> forgotten = transaction->Execute(kForgetLoose, Params().Digests(digests));
    if (!forgotten.ok()) return forgotten.status();
    if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
    done->freed_count += freed->count;
    done->freed_bytes += freed->bytes;
    DeleteObjects(database, objects, freed->objects, deadline);
  }
  return absl::OkStatus();
}

struct PolicyInForce {
  RetentionPolicy policy;
  std::string after_scan_key;  // everything up to this one is done
};

absl::StatusOr<std::vector<PolicyInForce>> PoliciesInForce(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectPoliciesInForce);
  if (!rows.ok()) return rows.status();
  std::vector<PolicyInForce> in_force;
  for (int row = 0; row < rows->count(); ++row) {
    PolicyInForce& one = in_force.emplace_back();
    one.policy.scan_kind = rows->Text(row, 0);
    one.policy.revision = static_cast<int>(rows->Int(row, 1));
    one.policy.keep_days = static_cast<int>(rows->Int(row, 2));
    one.after_scan_key = rows->Text(row, 3);
  }
  return rows->Checked(std::move(in_force));
}

struct DueScan {
  std::string scan_id;
  std::int64_t stored_bytes = 0;
  std::string scan_key;
  bool deleted = false;  // by name, or before the policy was
};

absl::StatusOr<std::vector<DueScan>> DueScans(Transaction& transaction, const PolicyInForce& in_force) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectDue, Params()
                                                                        .Text(in_force.policy.scan_kind)
                                                                        .Uuid(in_force.after_scan_key)
                                                                        .Int(*in_force.policy.keep_days)
                                                                        .Int(kDeletedAtOnce));
  if (!rows.ok()) return rows.status();
  std::vector<DueScan> due;
  for (int row = 0; row < rows->count() && rows->Bool(row, 4); ++row)
    due.push_back({rows->Text(row, 0), rows->Int(row, 1), rows->Text(row, 2), rows->Bool(row, 3)});
  return rows->Checked(std::move(due));
}

absl::Status KeepProgress(Database* database, const PolicyInForce& in_force, Deadline deadline) {
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<Rows> kept = transaction->Execute(
      kKeepProgress,
      Params().Text(in_force.policy.scan_kind).Int(in_force.policy.revision).Uuid(in_force.after_scan_key));
  if (!kept.ok()) return kept.status();
  return transaction->Commit();
}

DeletionOrder OrderOf(const std::string& scan_id, const RetentionPolicy& policy, const RetentionOptions& options) {
  const std::string reason = "retention: " + policy.scan_kind + " scans are kept " + std::to_string(*policy.keep_days) +
                             " days (policy revision " + std::to_string(policy.revision) + ")";
  return {scan_id, reason, options.requested_by, options.software_version, policy, options.trace_id};
}

// A batch of what is due; false where there was none. ABORTED: the policy is not in force any more.
absl::StatusOr<bool> ApplyToSome(Database* database, ObjectStore* objects, const RetentionOptions& options,
                                 PolicyInForce* in_force, Deadline deadline, RetentionDone* done) {
  const absl::StatusOr<std::vector<DueScan>> due =
      OneRead(*database, deadline, [&](Transaction& transaction) { return DueScans(transaction, *in_force); });
  if (!due.ok()) return due.status();
  for (const DueScan& scan : *due) {
    if (!options.keep_going()) break;
    if (!scan.deleted && !options.dry_run) {
      const DeletionOrder order = OrderOf(scan.scan_id, in_force->policy, options);
      const absl::StatusOr<DeletedPoints> deleted = DeleteScanPoints(database, objects, order, deadline);
      if (!deleted.ok()) return deleted.status();
      done->freed_count += deleted->freed_count;
      done->freed_bytes += deleted->freed_bytes;
    }
    in_force->after_scan_key = scan.scan_key;
    done->scan_count += !scan.deleted;
    done->scan_bytes += scan.deleted ? 0 : scan.stored_bytes;
  }
  if (due->empty() || options.dry_run) return !due->empty();
  if (absl::Status kept = KeepProgress(database, *in_force, deadline); !kept.ok()) return kept;
  return true;
}

}  // namespace

absl::StatusOr<std::optional<ScanDeletion>> FindScanDeletion(Transaction& transaction, const std::string& scan_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectDeletion, Params().Text(scan_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Checked(ReadDeletion(*rows));
}

absl::Status RequirePoints(Transaction& transaction, const std::string& scan_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectDeletion, Params().Text(scan_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return absl::OkStatus();
  const std::string deleted_at = rows->Text(0, 9), reason = rows->Text(0, 1);
  if (absl::Status read = rows->status(); !read.ok()) return read;
  return BytesDeleted("points of scans/" + scan_id, deleted_at, reason);
}

absl::StatusOr<DeletedPoints> DeleteScanPoints(Database* database, ObjectStore* objects, const DeletionOrder& order,
                                               Deadline deadline) {
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  if (absl::Status locked = LockScanId(*transaction, order.scan_id); !locked.ok()) return locked;
  const absl::StatusOr<std::optional<ScanRow>> scan = FindScan(*transaction, order.scan_id);
  if (!scan.ok()) return scan.status();
  if (!scan->has_value()) return absl::NotFoundError("scans/" + order.scan_id + ": not stored");
  absl::StatusOr<std::optional<ScanDeletion>> before = FindScanDeletion(*transaction, order.scan_id);
  if (!before.ok()) return before.status();
  DeletedPoints deleted;
  if (before->has_value()) {
    deleted.deletion = **std::move(before);
    deleted.already_deleted = true;
    return deleted;
  }
  if (order.policy) {
    if (absl::Status holds = CheckPolicyHolds(*transaction, *order.policy); !holds.ok()) return holds;
  }
  const absl::StatusOr<BlobConditions> conditions = ReadBlobConditions(*transaction);
  if (!conditions.ok()) return conditions.status();
  const absl::StatusOr<Rows> locked = transaction->Execute(kLockBlobsOfScan, Params().Text(order.scan_id));
  if (!locked.ok()) return locked.status();

  // Whether its bytes are needed shows only once the scan counts as deleted.
  deleted.deletion = {order.scan_id,
                      order.reason,
                      order.requested_by,
                      order.policy ? order.policy->scan_kind : "",
                      order.policy ? order.policy->revision : 0,
                      (*scan)->stored_sha256,
                      (*scan)->stored_bytes,
                      {}};
  const std::string record_id = NewUuid();
  if (absl::Status inserted = InsertDeletion(*transaction, deleted.deletion, record_id); !inserted.ok())
    return inserted;
  const std::vector<std::string> digests = DigestsOf(*locked);
  if (absl::Status read = locked->status(); !read.ok()) return read;
  const absl::StatusOr<Rows> noted = transaction->Execute(kNoteLoose, Params().Text(order.scan_id).Digests(digests));
  if (!noted.ok()) return noted.status();
  const absl::StatusOr<Freed> freed = DeleteBytes(*transaction, conditions->unneeded, digests, order.reason);
  if (!freed.ok()) return freed.status();
  const absl::StatusOr<Recorded> recorded = AppendRecord(*transaction, record_id, EntryOf(**scan, order));
  if (!recorded.ok()) return recorded.status();
  deleted.deletion.recorded = *recorded;
  if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
  deleted.freed_count = freed->count;
  deleted.freed_bytes = freed->bytes;
  DeleteObjects(database, objects, freed->objects, deadline);
  return deleted;
}

absl::StatusOr<RetentionDone> ApplyRetention(Database* database, ObjectStore* objects, const RetentionOptions& options,
                                             Deadline deadline) {
  RetentionDone done;
  absl::StatusOr<std::vector<PolicyInForce>> in_force = OneRead(*database, deadline, PoliciesInForce);
  if (!in_force.ok()) return in_force.status();
  for (PolicyInForce& one : *in_force) {
    absl::StatusOr<bool> more = true;
    while (more.ok() && *more && options.keep_going())
      more = ApplyToSome(database, objects, options, &one, deadline, &done);
    // Somebody wants to keep them after all; the next time knows the new policy.
    if (!more.ok() && !absl::IsAborted(more.status())) return more.status();
  }
  if (options.dry_run) return done;
  if (absl::Status swept = SweepLoose(database, objects, options, deadline, &done); !swept.ok()) return swept;
  return done;
}

}  // namespace sixpoint::storage
