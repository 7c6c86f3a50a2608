#include "tests/support/fake_scans.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "storage/blobs.h"
#include "storage/reasons.h"

namespace sixpoint::testing {

using storage::Deadline;

namespace {

bool Matches(const std::string& wanted, const std::string& value) { return wanted.empty() || wanted == value; }

absl::Status Deleted(const std::string& what, const std::string& reason) {
  return storage::WithReason(absl::FailedPreconditionError(what + ": its bytes were deleted, reason: " + reason),
                             storage::kPointsDeleted);
}

}  // namespace

void FakeScans::Fail(absl::Status failure) {
  const auto lock = record_.Lock();
  record_.Fail(std::move(failure));
}

std::vector<storage::JournalEntry> FakeScans::entries() const {
  const auto lock = record_.Lock();
  return record_.entries();
}

const FakeScans::Stored* FakeScans::Known(const std::string& scan_id) const {
  const auto found =
      std::find_if(scans_.begin(), scans_.end(), [&](const Stored& scan) { return scan.row.scan_id == scan_id; });
  return found == scans_.end() ? nullptr : &*found;
}

absl::StatusOr<std::optional<storage::ScanRow>> FakeScans::Find(const std::string& scan_id, Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  const Stored* known = Known(scan_id);
  return known == nullptr ? std::nullopt : std::optional(known->row);
}

absl::StatusOr<std::vector<storage::ScanRow>> FakeScans::List(const storage::ScanFilter& filter,
                                                              std::int64_t before_sequence, int limit, Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  std::vector<storage::ScanRow> listed;
  for (auto scan = scans_.rbegin(); scan != scans_.rend() && static_cast<int>(listed.size()) < limit; ++scan) {
    const storage::ScanRow& row = scan->row;
    if ((before_sequence == 0 || row.recorded.sequence < before_sequence) &&
        Matches(filter.machine_id, row.machine_id) && Matches(filter.artefact_id, row.artefact_id.value_or("")) &&
        Matches(filter.blade_serial, row.blade_serial.value_or("")) && Matches(filter.kind, row.kind) &&
        filter.part_id.empty() && Contains(filter.recorded, row.recorded.recorded_at))
      listed.push_back(row);
  }
  return listed;
}

absl::Status FakeScans::RequirePoints(const std::string& scan_id, Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  const auto deletion = deletions_.find(scan_id);
  return deletion == deletions_.end() ? absl::OkStatus()
                                      : Deleted("points of scans/" + scan_id, deletion->second.reason);
}

absl::StatusOr<std::optional<std::string>> FakeScans::BlobOf(const std::string& scan_id, const std::string& blob_sha256,
                                                             storage::Deadline deadline) const {
  if (const absl::Status kept = RequirePoints(scan_id, deadline); !kept.ok()) return kept;
  const auto blocks = Blocks(scan_id, deadline);
  if (!blocks.ok()) return blocks.status();
  for (const storage::ScanBlockRow& block : *blocks) {
    if (block.blob_sha256 != blob_sha256 && block.evidence_sha256 != blob_sha256) continue;
    absl::StatusOr<std::string> bytes = Payload(blob_sha256, deadline);
    if (!bytes.ok()) return bytes.status();
    return *std::move(bytes);
  }
  return std::nullopt;
}

absl::StatusOr<std::vector<storage::ScanBlockRow>> FakeScans::Blocks(const std::string& scan_id, Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  const Stored* known = Known(scan_id);
  return known == nullptr ? std::vector<storage::ScanBlockRow>() : known->blocks;
}

absl::StatusOr<std::string> FakeScans::Payload(const std::string& blob_sha256, Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  if (deleted_payloads_.count(blob_sha256) > 0) return Deleted("blob " + blob_sha256, "");
  const auto found = payloads_.find(blob_sha256);
  if (found == payloads_.end()) return absl::NotFoundError("blob " + blob_sha256 + ": not stored");
  return found->second;
}

absl::StatusOr<storage::KnownScan> FakeScans::Join(
    const storage::ScanUploadRow& upload,
    const std::function<absl::StatusOr<bool>(const storage::ScanUploadRow& known)>& goes_on, Deadline) {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  storage::KnownScan known;
  if (const Stored* stored = Known(upload.scan_id)) {
    known.complete = stored->row;
    return known;
  }
  if (const auto begun = uploads_.find(upload.scan_id); begun != uploads_.end()) {
    const absl::StatusOr<bool> same = goes_on(begun->second.row);
    if (!same.ok()) return same.status();
    known.upload = begun->second.row;
    if (*same) return known;
  }
  known.upload = storage::Begun(upload);
  uploads_[upload.scan_id] = {known.upload, {}};
  return known;
}

absl::StatusOr<bool> FakeScans::AddBlock(const storage::ScanUploadRow& after, storage::ScanBlockRow block,
                                         std::string_view payload, std::string_view evidence, Deadline) {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  const auto upload = uploads_.find(after.scan_id);
  if (upload == uploads_.end() || upload->second.row.next_block != after.next_block - 1) return false;
  for (const std::string_view bytes : {payload, evidence}) {
    if (bytes.empty()) continue;
    const std::string sha256 = storage::Sha256Hex(bytes);
    (bytes.data() == payload.data() ? block.blob_sha256 : block.evidence_sha256) = sha256;
    payloads_[sha256] = bytes;
    deleted_payloads_.erase(sha256);
  }
  // Who it is of was said when it began.
  storage::ScanUploadRow row = after;
  row.header = upload->second.row.header;
  row.machine_revision = upload->second.row.machine_revision;
  row.artefact_revision = upload->second.row.artefact_revision;
  upload->second.row = row;
  upload->second.blocks.push_back(std::move(block));
  return true;
}

absl::StatusOr<std::vector<storage::ScanBlockRow>> FakeScans::UploadedBlocks(const std::string& scan_id,
                                                                             Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  const auto upload = uploads_.find(scan_id);
  return upload == uploads_.end() ? std::vector<storage::ScanBlockRow>() : upload->second.blocks;
}

absl::StatusOr<std::optional<storage::CompletedScan>> FakeScans::Complete(
    const std::string& scan_id,
    const std::function<absl::StatusOr<storage::MadeScan>(const storage::ScanUploadRow&,
                                                          const std::vector<storage::ScanBlockRow>&)>& make,
    Deadline) {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  if (const Stored* stored = Known(scan_id)) return storage::CompletedScan{stored->row, true};
  const auto upload = uploads_.find(scan_id);
  if (upload == uploads_.end()) return std::nullopt;
  absl::StatusOr<storage::MadeScan> made = make(upload->second.row, upload->second.blocks);
  if (!made.ok()) return made.status();
  made->row.recorded = record_.Next();
  record_.Append(std::move(made->entry), made->row.recorded);
  scans_.push_back({made->row, std::move(upload->second.blocks)});
  uploads_.erase(upload);
  return storage::CompletedScan{std::move(made->row), false};
}

absl::StatusOr<std::optional<storage::ScanDeletion>> FakeScans::FindDeletion(const std::string& scan_id,
                                                                             Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  const auto found = deletions_.find(scan_id);
  return found == deletions_.end() ? std::nullopt : std::optional(found->second);
}

absl::StatusOr<std::vector<storage::RetentionPolicy>> FakeScans::ListPolicies(const storage::PolicyPage& page,
                                                                              Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  std::vector<storage::RetentionPolicy> listed;
  for (const auto& [kind, revisions] : policies_)
    for (auto policy = revisions.rbegin(); policy != revisions.rend(); ++policy) {
      const bool on_page = page.after_kind.empty() || kind > page.after_kind ||
                           (kind == page.after_kind && policy->revision < page.after_revision);
      const bool wanted = page.all_revisions || policy == revisions.rbegin();
      if (on_page && wanted && static_cast<int>(listed.size()) < page.limit) listed.push_back(*policy);
    }
  return listed;
}

bool FakeScans::IsNeeded(const std::string& blob_sha256) const {
  const auto has = [&](const std::vector<storage::ScanBlockRow>& blocks) {
    return std::any_of(blocks.begin(), blocks.end(),
                       [&](const storage::ScanBlockRow& block) { return block.blob_sha256 == blob_sha256; });
  };
  return std::any_of(scans_.begin(), scans_.end(),
                     [&](const Stored& scan) { return deletions_.count(scan.row.scan_id) == 0 && has(scan.blocks); }) ||
         std::any_of(uploads_.begin(), uploads_.end(), [&](const auto& upload) { return has(upload.second.blocks); });
}

absl::StatusOr<storage::DeletedPoints> FakeScans::Delete(const storage::DeletionOrder& order) {
  const Stored* scan = Known(order.scan_id);
  if (scan == nullptr) return absl::NotFoundError("scans/" + order.scan_id + ": not stored");
  storage::DeletedPoints deleted;
  if (const auto before = deletions_.find(order.scan_id); before != deletions_.end()) {
    deleted.deletion = before->second;
    deleted.already_deleted = true;
    return deleted;
  }
  if (order.policy && policies_[order.policy->scan_kind].size() != static_cast<std::size_t>(order.policy->revision))
    return absl::AbortedError("retention of " + order.policy->scan_kind + " scans: another revision is the newest");
  deleted.deletion.scan_id = order.scan_id;
  deleted.deletion.reason = order.reason;
  deleted.deletion.requested_by = order.requested_by;
  if (order.policy) deleted.deletion.policy_kind = order.policy->scan_kind;
  if (order.policy) deleted.deletion.policy_revision = order.policy->revision;
  deleted.deletion.points_sha256 = scan->row.stored_sha256;
  deleted.deletion.points_bytes = scan->row.stored_bytes;
  deleted.deletion.recorded = record_.Next();
  storage::RecordEntry entry;
  entry.kind = "deletion";
  entry.name = "deletions/" + order.scan_id;
  entry.inputs = {"scans/" + order.scan_id};
  entry.requested_by = order.requested_by;
  record_.Append(std::move(entry), deleted.deletion.recorded);
  deletions_[order.scan_id] = deleted.deletion;
  for (const storage::ScanBlockRow& block : scan->blocks) {
    const auto payload = payloads_.find(block.blob_sha256);
    if (payload == payloads_.end() || IsNeeded(block.blob_sha256)) continue;
    ++deleted.freed_count;
    deleted.freed_bytes += static_cast<std::int64_t>(payload->second.size());
    payloads_.erase(payload);
    deleted_payloads_.insert(block.blob_sha256);
  }
  return deleted;
}

absl::StatusOr<storage::DeletedPoints> FakeScans::DeletePoints(const storage::DeletionOrder& order, Deadline) {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  return Delete(order);
}

std::optional<storage::RetentionPolicy> FakeScans::Policy(const std::string& name) const {
  const storage::NamedId named = storage::IdOfName(name);
  return policies_.at(named.id).at(static_cast<std::size_t>(named.revision) - 1);
}

absl::StatusOr<std::optional<storage::RetentionPolicy>> FakeScans::FindRecorded(const storage::RecordedRequest& request,
                                                                                Deadline) const {
  const auto lock = record_.Lock();
  return record_.Kept<storage::RetentionPolicy>(request, [this](const std::string& name) { return Policy(name); });
}

absl::StatusOr<storage::RetentionPolicy> FakeScans::Record(const storage::RecordedRequest& request,
                                                           storage::RetentionPolicy policy,
                                                           const storage::RecordEntry& entry, Deadline) {
  const auto lock = record_.Lock();
  const auto name_of = [](const storage::RetentionPolicy& set) {
    return "policies/" + set.scan_kind + "@" + std::to_string(set.revision);
  };
  const auto work = [&]() -> absl::StatusOr<storage::RetentionPolicy> {
    std::vector<storage::RetentionPolicy>& revisions = policies_[policy.scan_kind];
    policy.revision = static_cast<int>(revisions.size()) + 1;
    policy.recorded = record_.Next();
    storage::RecordEntry named = entry;
    named.kind = "policy";
    named.name = name_of(policy);
    record_.Append(std::move(named), policy.recorded);
    revisions.push_back(policy);
    return policy;
  };
  return record_.Once<storage::RetentionPolicy>(
      request, [this](const std::string& name) { return Policy(name); }, work, name_of);
}

absl::StatusOr<storage::RetentionDone> FakeScans::Apply(const storage::RetentionOptions& options, Deadline) {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  storage::RetentionDone done;
  for (const Stored& scan : scans_) {
    const auto revisions = policies_.find(scan.row.kind);
    if (revisions == policies_.end() || !revisions->second.back().keep_days || deletions_.count(scan.row.scan_id) > 0)
      continue;
    const storage::RetentionPolicy& policy = revisions->second.back();
    if (scan.row.recorded.recorded_at + std::chrono::hours(24) * *policy.keep_days >= std::chrono::system_clock::now())
      continue;
    ++done.scan_count;
    done.scan_bytes += scan.row.stored_bytes;
    if (options.dry_run) continue;
    const auto deleted =
        Delete({scan.row.scan_id, "retention", options.requested_by, options.software_version, policy});
    if (!deleted.ok()) return deleted.status();
    done.freed_count += deleted->freed_count;
    done.freed_bytes += deleted->freed_bytes;
  }
  return done;
}

absl::Status FakeBlobKeeping::Check(const storage::CheckOptions& options, const storage::CheckProgress& from,
                                    Deadline) {
  if (during_check) during_check();
  storage::CheckProgress progress = from;
  for (const storage::BlobDamage& damage : damages) {
    options.on_damage(damage);
    ++progress.checked_count;
    ++progress.damaged_count;
    options.on_progress(progress);
  }
  return failure;
}

absl::StatusOr<storage::Collected> FakeBlobKeeping::Collect(const storage::CollectOptions&, Deadline) {
  if (!failure.ok()) return failure;
  return collected;
}

absl::StatusOr<storage::BlobStatus> FakeBlobKeeping::Status(int, Deadline) const {
  if (!failure.ok()) return failure;
  return status;
}

absl::StatusOr<std::vector<storage::MonthUse>> FakeBlobKeeping::Months(Deadline) const {
  if (!failure.ok()) return failure;
  return months;
}

absl::StatusOr<int> FakeBlobKeeping::MakeMonths(int months_ahead, Deadline) {
  if (!failure.ok()) return failure;
  const int made = std::max(0, months_ahead + 1 - static_cast<int>(months.size()));
  months.resize(months.size() + static_cast<std::size_t>(made), {"2026-11", 17, 0, 0});
  return made;
}

absl::StatusOr<std::string> FakeBlobKeeping::AdoptBucket(Deadline) {
  if (!failure.ok()) return failure;
  return std::exchange(owner, "ours");
}

}  // namespace sixpoint::testing
