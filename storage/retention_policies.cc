// How long points are kept, by kind; what is done about it is in retention.cc.
#include <utility>

#include "storage/each_row.h"
#include "storage/retention.h"

namespace sixpoint::storage {
namespace {

constexpr char kLockPolicies[] = "SELECT pg_advisory_xact_lock(hashtextextended('retention_policies/' || $1, 0))";

constexpr char kInsertPolicy[] =
    "INSERT INTO retention_policies (scan_kind, revision, keep_days, requested_by, record_id) "
    "VALUES ($1, $2, $3, $4, $5)";
#define SIXPOINT_SELECT_POLICIES                                                                        \
  "SELECT p.scan_kind, p.revision, p.keep_days, name_of(p.requested_by), record_sequence, recorded_at " \
  "FROM retention_policies p JOIN record_names USING (record_id) WHERE "
constexpr char kSelectPolicy[] = SIXPOINT_SELECT_POLICIES "p.scan_kind = $1 AND p.revision = $2";
constexpr char kSelectPolicies[] = SIXPOINT_SELECT_POLICIES
    "($1 OR NOT EXISTS (SELECT 1 FROM retention_policies q "
    "WHERE q.scan_kind = p.scan_kind AND q.revision > p.revision)) "
    "AND ($2 = '' OR p.scan_kind > $2 OR (p.scan_kind = $2 AND p.revision < $3)) "
    "ORDER BY p.scan_kind, p.revision DESC LIMIT $4";
#undef SIXPOINT_SELECT_POLICIES
constexpr char kSelectNewestPolicy[] = "SELECT max(revision) FROM retention_policies WHERE scan_kind = $1";

RetentionPolicy ReadPolicy(const Rows& rows, int row) {
  RetentionPolicy policy;
  policy.scan_kind = rows.Text(row, 0);
  policy.revision = static_cast<int>(rows.Int(row, 1));
  if (!rows.IsNull(row, 2)) policy.keep_days = static_cast<int>(rows.Int(row, 2));
  policy.requested_by = rows.Text(row, 3);
  policy.recorded = {rows.Int(row, 4), rows.Time(row, 5)};
  return policy;
}

}  // namespace

absl::StatusOr<int> NewestPolicyRevision(Transaction& transaction, const std::string& scan_kind) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectNewestPolicy, Params().Text(scan_kind));
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->IsNull(0, 0) ? 0 : static_cast<int>(rows->Int(0, 0)));
}

absl::StatusOr<RetentionPolicy> SetRetentionPolicy(Transaction& transaction, RetentionPolicy policy,
                                                   RecordEntry entry) {
  const absl::StatusOr<Rows> locked = transaction.Execute(kLockPolicies, Params().Text(policy.scan_kind));
  if (!locked.ok()) return locked.status();
  const absl::StatusOr<int> newest = NewestPolicyRevision(transaction, policy.scan_kind);
  if (!newest.ok()) return newest.status();
  policy.revision = *newest + 1;
  entry.kind = "policy";
  entry.name = "policies/" + policy.scan_kind + "@" + std::to_string(policy.revision);
  const std::string record_id = NewUuid();
  Params params;
  params.Text(policy.scan_kind).Int(policy.revision);
  params.OptionalInt(policy.keep_days);
  params.Text(policy.requested_by).Uuid(record_id);
  if (const auto inserted = transaction.Execute(kInsertPolicy, params); !inserted.ok()) return inserted.status();
  const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, record_id, entry);
  if (!recorded.ok()) return recorded.status();
  policy.recorded = *recorded;
  return policy;
}

absl::StatusOr<std::optional<RetentionPolicy>> FindRetentionPolicy(Transaction& transaction,
                                                                   const std::string& scan_kind, int revision) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectPolicy, Params().Text(scan_kind).Int(revision));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Checked(ReadPolicy(*rows, 0));
}

absl::StatusOr<std::vector<RetentionPolicy>> ListRetentionPolicies(Transaction& transaction, const PolicyPage& page) {
  return AllRows(transaction, kSelectPolicies,
                 Params().Bool(page.all_revisions).Text(page.after_kind).Int(page.after_revision).Int(page.limit),
                 ReadPolicy);
}

}  // namespace sixpoint::storage
