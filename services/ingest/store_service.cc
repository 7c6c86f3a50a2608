#include "services/ingest/store_service.h"

#include <utility>

#include "services/ingest/scan_messages.h"
#include "services/ingest/store_messages.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/pages.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"

namespace sixpoint::ingest {
namespace {

using runtime::ToGrpc;

constexpr std::chrono::seconds kBetweenMessages{1};
constexpr std::chrono::hours kLeastObjectGrace{1};  // an upload is in the middle of it for a minute at most
constexpr int kGreatestDamageCount = 100;           // in one status
// A call that was cut off says so, unlike one that had nothing more to do.
absl::Status CutOff(const grpc::ServerContext& context) {
  return context.IsCancelled() ? runtime::Stopped(context, "what was done is kept") : absl::OkStatus();
}

// Progress as messages, about one a second.
class ProgressWriter {
 public:
  explicit ProgressWriter(grpc::ServerWriter<v1::CheckStoreResponse>* writer) : writer_(writer) {}
  void Take(const storage::CheckProgress& progress) {
    next_.set_after_sha256(progress.after_sha256);
    next_.set_checked_count(progress.checked_count);
    next_.set_checked_bytes(progress.checked_bytes);
    next_.set_damaged_count(progress.damaged_count);
    if (std::chrono::steady_clock::now() - sent_at_ > kBetweenMessages) Send();
  }
  void Take(const storage::BlobDamage& damage) {
    runtime::Log(
        runtime::LogLevel::kError, "damaged blob",
        {{"sha256", damage.sha256}, {"store", damage.store}, {"what", damage.what}, {"detail", damage.detail}});
    ToProto(damage, &words_, next_.add_damages());
    if (next_.damages_size() >= kGreatestDamageCount) Send();
  }
  void Finish(bool complete) {
    next_.set_complete(complete);
    Send();
  }
  bool open() const { return open_; }
  const absl::Status& status() const { return words_.status(); }

 private:
  void Send() {
    open_ = open_ && writer_->Write(next_);
    next_.clear_damages();
    sent_at_ = std::chrono::steady_clock::now();
  }
  grpc::ServerWriter<v1::CheckStoreResponse>* const writer_;
  v1::CheckStoreResponse next_;
  runtime::StoredWords words_{"a damaged blob"};
  std::chrono::steady_clock::time_point sent_at_ = std::chrono::steady_clock::now();
  bool open_ = true;
};

}  // namespace

CloudStoreService::CloudStoreService(std::shared_ptr<storage::RetentionStore> retention,
                                     std::shared_ptr<storage::BlobKeeping> blobs, std::unique_ptr<StoreKeeper> keeper)
    : retention_(std::move(retention)), blobs_(std::move(blobs)), keeper_(std::move(keeper)) {}

grpc::Status CloudStoreService::CheckStore(grpc::ServerContext* context, const v1::CheckStoreRequest* request,
                                           grpc::ServerWriter<v1::CheckStoreResponse>* writer) {
  if (absl::Status sound = CheckRequest(*request); !sound.ok()) return ToGrpc(sound);
  const auto slot = checks_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  ProgressWriter progress(writer);
  storage::CheckOptions options;
  options.rate_mb_s = request->rate_mb_s();
  options.keep_going = [&, alive = runtime::KeepGoing(*context)] { return progress.open() && alive(); };
  options.on_progress = [&](const storage::CheckProgress& now) { progress.Take(now); };
  options.on_damage = [&](const storage::BlobDamage& damage) { progress.Take(damage); };
  storage::CheckProgress from;
  from.after_sha256 = request->after_sha256();
  const absl::Status checked = blobs_->Check(options, from, runtime::DeadlineOf(*context));
  const bool complete = checked.ok() && options.keep_going();
  progress.Finish(complete);
  if (!progress.status().ok()) return ToGrpc(progress.status());
  if (!checked.ok() || complete) return ToGrpc(checked);
  return ToGrpc(runtime::Stopped(*context, "go on from after_sha256"));
}

grpc::Status CloudStoreService::CollectGarbage(grpc::ServerContext* context, const v1::CollectGarbageRequest* request,
                                               v1::CollectGarbageResponse* response) {
  if (absl::Status sound = CheckRequest(*request); !sound.ok()) return ToGrpc(sound);
  storage::CollectOptions options;
  if (request->grace_s() > 0) options.grace = std::chrono::seconds(request->grace_s());
  options.object_grace = std::max<std::chrono::seconds>(options.grace, kLeastObjectGrace);
  options.dry_run = request->dry_run();
  options.keep_going = runtime::KeepGoing(*context);
  const absl::StatusOr<storage::Collected> collected = blobs_->Collect(options, runtime::DeadlineOf(*context));
  if (!collected.ok()) return ToGrpc(collected.status());
  response->set_blob_count(collected->blob_count);
  response->set_blob_bytes(collected->blob_bytes);
  response->set_object_count(collected->object_count);
  response->set_object_bytes(collected->object_bytes);
  return ToGrpc(CutOff(*context));
}

grpc::Status CloudStoreService::GetStoreStatus(grpc::ServerContext* context, const v1::GetStoreStatusRequest*,
                                               v1::StoreStatus* response) {
  const absl::StatusOr<storage::BlobStatus> status =
      blobs_->Status(kGreatestDamageCount, runtime::DeadlineOf(*context));
  if (!status.ok()) return ToGrpc(status.status());
  return runtime::Answer(ToProto(*status), response);
}

grpc::Status CloudStoreService::DeleteScanPoints(grpc::ServerContext* context,
                                                 const v1::DeleteScanPointsRequest* request,
                                                 v1::DeleteScanPointsResponse* response) {
  if (absl::Status sound = CheckRequest(*request); !sound.ok()) return ToGrpc(sound);
  const storage::DeletionOrder order{*runtime::IdOf("name", "scans", request->name()),
                                     request->reason(),
                                     runtime::RequestedBy(*context),
                                     runtime::SoftwareVersion(),
                                     std::nullopt,
                                     runtime::TraceIdOf(*context)};
  const auto deleted = retention_->DeletePoints(order, runtime::DeadlineOf(*context));
  if (absl::IsNotFound(deleted.status())) {
    return ToGrpc(runtime::Failure(errors::v1::SCAN_NOT_FOUND, "name: " + request->name() + ", want a stored scan",
                                   {{"resource", request->name()}}));
  }
  if (!deleted.ok()) return ToGrpc(deleted.status());
  absl::StatusOr<v1::ScanDeletion> deletion = ToProto(deleted->deletion);
  if (!deletion.ok()) return ToGrpc(deletion.status());
  *response->mutable_deletion() = *std::move(deletion);
  response->set_already_deleted(deleted->already_deleted);
  response->set_freed_bytes(deleted->freed_bytes);
  return grpc::Status::OK;
}

grpc::Status CloudStoreService::GetScanDeletion(grpc::ServerContext* context, const v1::GetScanDeletionRequest* request,
                                                v1::ScanDeletion* response) {
  const absl::StatusOr<std::string> scan_id = runtime::IdOf("name", "deletions", request->name());
  if (!scan_id.ok()) return ToGrpc(scan_id.status());
  const absl::StatusOr<std::optional<storage::ScanDeletion>> deletion =
      retention_->FindDeletion(*scan_id, runtime::DeadlineOf(*context));
  if (!deletion.ok()) return ToGrpc(deletion.status());
  if (!deletion->has_value())
    return ToGrpc(runtime::Failure(errors::v1::DELETION_NOT_FOUND,
                                   "name: " + request->name() + ", want one of a scan whose points were deleted",
                                   {{"resource", request->name()}}));
  return runtime::Answer(ToProto(**deletion), response);
}

grpc::Status CloudStoreService::SetRetentionPolicy(grpc::ServerContext* context,
                                                   const v1::SetRetentionPolicyRequest* request,
                                                   v1::RetentionPolicy* response) {
  if (absl::Status sound = CheckRequest(*request); !sound.ok()) return ToGrpc(sound);
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::RetentionPolicy>> {
    runtime::Made<storage::RetentionPolicy> made;
    made.row.scan_kind = KindText(request->scan_kind());
    if (request->keep_days() > 0) made.row.keep_days = request->keep_days();
    made.entry.software_version = runtime::SoftwareVersion();
    if (made.row.keep_days) made.entry.summary_json = "{\"keep_days\": " + std::to_string(*made.row.keep_days) + "}";
    return made;
  };
  return runtime::Answer(
      runtime::RecordedResult<v1::RetentionPolicy>(retention_.get(), "ingest.SetRetentionPolicy", *request,
                                                   runtime::CallerOf(*context), make, ToProto),
      response);
}

grpc::Status CloudStoreService::ListRetentionPolicies(grpc::ServerContext* context,
                                                      const v1::ListRetentionPoliciesRequest* request,
                                                      v1::ListRetentionPoliciesResponse* response) {
  absl::StatusOr<storage::PolicyPage> page = PageOf(*request);
  if (!page.ok()) return ToGrpc(page.status());
  const int size = page->limit;
  page->limit = size + 1;
  const auto policies = retention_->ListPolicies(*page, runtime::DeadlineOf(*context));
  if (!policies.ok()) return ToGrpc(policies.status());
  const absl::StatusOr<const storage::RetentionPolicy*> last = runtime::AddPage(
      *policies, size, [](const storage::RetentionPolicy& policy) { return ToProto(policy); },
      response->mutable_policies());
  if (!last.ok()) return ToGrpc(last.status());
  if (*last != nullptr) response->set_next_page_token(PageTokenAfter(runtime::FiltersOf(*request), **last));
  return grpc::Status::OK;
}

grpc::Status CloudStoreService::ApplyRetention(grpc::ServerContext* context, const v1::ApplyRetentionRequest* request,
                                               v1::ApplyRetentionResponse* response) {
  storage::RetentionOptions options;
  options.software_version = runtime::SoftwareVersion();
  options.requested_by = runtime::RequestedBy(*context);
  options.trace_id = runtime::TraceIdOf(*context);
  options.dry_run = request->dry_run();
  options.keep_going = runtime::KeepGoing(*context);
  const auto done = retention_->Apply(options, runtime::DeadlineOf(*context));
  if (!done.ok()) return ToGrpc(done.status());
  response->set_scan_count(done->scan_count);
  response->set_scan_bytes(done->scan_bytes);
  response->set_freed_bytes(done->freed_bytes);
  return ToGrpc(CutOff(*context));
}

grpc::Status CloudStoreService::AdoptBucket(grpc::ServerContext* context, const v1::AdoptBucketRequest*,
                                            v1::AdoptBucketResponse* response) {
  absl::StatusOr<std::string> before = blobs_->AdoptBucket(runtime::DeadlineOf(*context));
  if (!before.ok()) return ToGrpc(before.status());
  runtime::Log(runtime::LogLevel::kWarning, "the bucket is this plant's from now on",
               {{"requested_by", runtime::RequestedBy(*context)}, {"owner_before", *before}});
  response->set_owner_before(*std::move(before));
  return grpc::Status::OK;
}

grpc::Status CloudStoreService::ListMonths(grpc::ServerContext* context, const v1::ListMonthsRequest*,
                                           v1::ListMonthsResponse* response) {
  const auto months = blobs_->Months(runtime::DeadlineOf(*context));
  if (!months.ok()) return ToGrpc(months.status());
  for (const storage::MonthUse& month : *months) *response->add_months() = ToProto(month);
  return grpc::Status::OK;
}

grpc::Status CloudStoreService::MakeMonths(grpc::ServerContext* context, const v1::MakeMonthsRequest* request,
                                           v1::MakeMonthsResponse* response) {
  const absl::StatusOr<int> made = blobs_->MakeMonths(request->months_ahead(), runtime::DeadlineOf(*context));
  if (made.ok()) response->set_made_count(*made);
  return ToGrpc(made.status());
}

}  // namespace sixpoint::ingest
