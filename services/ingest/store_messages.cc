#include "services/ingest/store_messages.h"

#include <absl/strings/numbers.h>

#include <utility>

#include "services/ingest/scan_messages.h"
#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::ingest {
namespace {

constexpr int kGreatestKeepDays = 36'525;  // a hundred years
constexpr std::int64_t kGreatestGrace_s = 366 * 86'400;

constexpr char kWhat[] = "the store of clouds";

}  // namespace

void ToProto(const storage::BlobDamage& damage, runtime::StoredWords* words, v1::BlobDamage* out) {
  out->set_sha256(damage.sha256);
  out->set_holder(words->Value<v1::BlobHolder>(damage.store));
  out->set_kind(words->Value<v1::DamageKind>(damage.what));
  out->set_detail(damage.detail);
  runtime::ToProto(damage.found_at, out->mutable_found_at());
}

absl::StatusOr<v1::RetentionPolicy> ToProto(const storage::RetentionPolicy& policy) {
  runtime::StoredWords words("policy " + policy.scan_kind);
  v1::RetentionPolicy out;
  out.set_scan_kind(words.Value<v1::ScanKind>(policy.scan_kind));
  out.set_revision(policy.revision);
  out.set_keep_days(policy.keep_days.value_or(0));
  out.set_requested_by(policy.requested_by);
  runtime::ToProto(policy.recorded.recorded_at, out.mutable_recorded_at());
  out.set_name(runtime::RevisedName("policies", policy.scan_kind, policy.revision));
  return words.Checked(std::move(out));
}

absl::StatusOr<v1::ScanDeletion> ToProto(const storage::ScanDeletion& deletion) {
  runtime::StoredWords words("deletion " + deletion.scan_id);
  v1::ScanDeletion out;
  out.set_name(runtime::NameOf("deletions", deletion.scan_id));
  out.set_scan(runtime::NameOf("scans", deletion.scan_id));
  out.set_reason(deletion.reason);
  out.set_requested_by(deletion.requested_by);
  out.set_policy_kind(words.ValueOrNone<v1::ScanKind>(deletion.policy_kind));
  out.set_policy_revision(deletion.policy_revision);
  out.set_points_sha256(deletion.points_sha256);
  out.set_points_bytes(deletion.points_bytes);
  runtime::ToProto(deletion.recorded.recorded_at, out.mutable_deleted_at());
  out.set_record_sequence(deletion.recorded.sequence);
  return words.Checked(std::move(out));
}

v1::Month ToProto(const storage::MonthUse& month) {
  v1::Month out;
  out.set_month(month.month);
  out.set_partition_count(month.partition_count);
  out.set_row_count(month.row_count);
  out.set_bytes(month.bytes);
  return out;
}

absl::StatusOr<v1::StoreStatus> ToProto(const storage::BlobStatus& status) {
  runtime::StoredWords words(kWhat);
  v1::StoreStatus out;
  out.set_new_blobs(words.Value<v1::BlobHolder>(status.store));
  for (const storage::StoreUse& use : status.uses) {
    v1::HolderUse& to = *out.add_uses();
    to.set_holder(words.Value<v1::BlobHolder>(use.store));
    to.set_kept_count(use.kept_count);
    to.set_kept_bytes(use.kept_bytes);
    to.set_deleted_count(use.deleted_count);
    to.set_deleted_bytes(use.deleted_bytes);
  }
  out.set_checked_count(status.check.progress.checked_count);
  out.set_checked_bytes(status.check.progress.checked_bytes);
  runtime::ToProto(status.check.begun_at, out.mutable_check_begun_at());
  if (status.check.finished_at) runtime::ToProto(*status.check.finished_at, out.mutable_check_finished_at());
  for (const storage::BlobDamage& damage : status.damages) ToProto(damage, &words, out.add_damages());
  return words.Checked(std::move(out));
}

absl::Status CheckRequest(const v1::CheckStoreRequest& request) {
  const std::string& after = request.after_sha256();
  const bool hex = after.size() == 64 && after.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (!after.empty() && !hex) return runtime::Refuse("after_sha256", after, "64 of 0-9, a-f, or nothing");
  if (!(request.rate_mb_s() >= 0 && request.rate_mb_s() <= 1e6)) {
    return runtime::Refuse("rate_mb_s", request.rate_mb_s(), "0 to 1000000");
  }
  return absl::OkStatus();
}

absl::Status CheckRequest(const v1::CollectGarbageRequest& request) {
  if (request.grace_s() >= 0 && request.grace_s() <= kGreatestGrace_s) return absl::OkStatus();
  return runtime::Refuse("grace_s", std::to_string(request.grace_s()), "0 to " + std::to_string(kGreatestGrace_s));
}

absl::Status CheckRequest(const v1::DeleteScanPointsRequest& request) {
  if (const auto id = runtime::IdOf("name", "scans", request.name()); !id.ok()) return id.status();
  const bool blank = request.reason().find_first_not_of(" \t\r\n") == std::string::npos;
  return blank ? runtime::Refuse("reason", "", "why the points go") : absl::OkStatus();
}

absl::Status CheckRequest(const v1::SetRetentionPolicyRequest& request) {
  if (KindText(request.scan_kind()).empty()) {
    return runtime::Refuse("scan_kind", std::to_string(request.scan_kind()), "a known kind");
  }
  if (request.keep_days() < 0 || request.keep_days() > kGreatestKeepDays) {
    return runtime::Refuse("keep_days", std::to_string(request.keep_days()),
                           "1 to " + std::to_string(kGreatestKeepDays) + ", or 0 for ever");
  }
  return absl::OkStatus();
}

std::string PageTokenAfter(const std::string& filters, const storage::RetentionPolicy& last) {
  return runtime::TokenAfterId(filters, last.scan_kind + "." + std::to_string(last.revision));
}

absl::StatusOr<storage::PolicyPage> PageOf(const v1::ListRetentionPoliciesRequest& request) {
  const absl::StatusOr<runtime::IdPage> ids =
      runtime::IdPageOf(runtime::FiltersOf(request), request.page_size(), request.page_token());
  if (!ids.ok()) return ids.status();
  storage::PolicyPage page{request.all_revisions(), "", 0, ids->size};
  if (ids->after_id.empty()) return page;
  const std::size_t dot = ids->after_id.rfind('.');
  page.after_kind = ids->after_id.substr(0, dot);
  if (dot == std::string::npos || !absl::SimpleAtoi(ids->after_id.substr(dot + 1), &page.after_revision))
    return runtime::Refuse("page_token", request.page_token(), "the next_page_token of a page with the same filters");
  return page;
}

}  // namespace sixpoint::ingest
