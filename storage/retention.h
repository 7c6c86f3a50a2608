// How long points of scans are kept, and their deletion. Scans, their values and every result stay for ever; what goes is
// bytes that no kept scan and nothing else uses, and the journal says so.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/object_store.h"
#include "storage/record.h"

namespace sixpoint::storage {

struct RetentionPolicy {
  std::string scan_kind;
  int revision = 0;              // set by SetRetentionPolicy
  std::optional<int> keep_days;  // none: for ever
  std::string requested_by;
  Recorded recorded;  // set by SetRetentionPolicy
};
// The next revision, and the journal's entry of it, policies/{kind}@{revision}: a policy destroys data.
absl::StatusOr<RetentionPolicy> SetRetentionPolicy(Transaction& transaction, RetentionPolicy policy, RecordEntry entry);
// 0: the kind has none.
absl::StatusOr<int> NewestPolicyRevision(Transaction& transaction, const std::string& scan_kind);
// By kind, the newest revision first; `all_revisions` false: only that.
absl::StatusOr<std::optional<RetentionPolicy>> FindRetentionPolicy(Transaction& transaction,
                                                                   const std::string& scan_kind, int revision);

struct PolicyPage {
  bool all_revisions = false;
  std::string after_kind;  // with after_revision: the last one of the page before; empty: from the first
  int after_revision = 0;
  int limit = 0;
};
absl::StatusOr<std::vector<RetentionPolicy>> ListRetentionPolicies(Transaction& transaction, const PolicyPage& page);

struct ScanDeletion {
  std::string scan_id;
  std::string reason;
  std::string requested_by;
  std::string policy_kind;  // empty: a person's wish
  int policy_revision = 0;
  std::string points_sha256;
  std::int64_t points_bytes = 0;
  Recorded recorded;
};
absl::StatusOr<std::optional<ScanDeletion>> FindScanDeletion(Transaction& transaction, const std::string& scan_id);
// OK while the scan's points are kept; else FAILED_PRECONDITION with reason POINTS_DELETED, when and why. For every reader of
// a scan's points, before the first block: blocks that other scans share are still there.
absl::Status RequirePoints(Transaction& transaction, const std::string& scan_id);

// The part of a deletion that the caller says.
struct DeletionOrder {
  std::string scan_id;
  std::string reason;
  std::string requested_by;
  std::string software_version;
  std::optional<RetentionPolicy> policy;
  std::string trace_id{};  // of the call that asks for it; empty: none
};
struct DeletedPoints {
  ScanDeletion deletion;
  bool already_deleted = false;  // before: nothing was done
  std::int64_t freed_count = 0;  // blobs whose bytes went
  std::int64_t freed_bytes = 0;
};
// Durable once it returns OK. NOT_FOUND: no such scan. FAILED_PRECONDITION (reason POLICY_CHANGED): the policy is no longer
// the newest. Bytes that an upload holds just now stay until the sweep of ApplyRetention.
absl::StatusOr<DeletedPoints> DeleteScanPoints(Database* database, ObjectStore* objects, const DeletionOrder& order,
                                               Deadline deadline);

struct RetentionOptions {
  std::string software_version;
  std::string requested_by;
  std::string trace_id;  // of the call; empty: none
  bool dry_run = false;
  std::function<bool()> keep_going = [] { return true; };
};
struct RetentionDone {
  std::int64_t scan_count = 0;
  std::int64_t scan_bytes = 0;   // as stored, shared blocks included
  std::int64_t freed_count = 0;  // 0 in a dry run: what is shared shows only then
  std::int64_t freed_bytes = 0;
};
// Every scan older than its kind's policy, oldest first, then the sweep of loose bytes. Reads what became due since the last time.
absl::StatusOr<RetentionDone> ApplyRetention(Database* database, ObjectStore* objects, const RetentionOptions& options,
                                             Deadline deadline);

}  // namespace sixpoint::storage
