#include "storage/retention_store.h"

#include <utility>

#include "storage/bucket_owner.h"
#include "storage/one_read.h"
#include "storage/reasons.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

class PostgresRetention final : public RetentionStore {
 public:
  PostgresRetention(Database* database, std::shared_ptr<BlobStore> blobs)
      : database_(database), blobs_(std::move(blobs)) {}

  absl::StatusOr<std::optional<ScanDeletion>> FindDeletion(const std::string& scan_id,
                                                           Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return FindScanDeletion(t, scan_id); });
  }
  absl::StatusOr<std::vector<RetentionPolicy>> ListPolicies(const PolicyPage& page, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return ListRetentionPolicies(t, page); });
  }
  absl::StatusOr<DeletedPoints> DeletePoints(const DeletionOrder& order, Deadline deadline) override {
    return DeleteScanPoints(database_, blobs_->objects(), order, deadline);
  }
  absl::StatusOr<std::optional<RetentionPolicy>> FindRecorded(const RecordedRequest& request,
                                                              Deadline deadline) const override {
    return storage::FindRecorded<RetentionPolicy>(*database_, request, deadline, FindNamed);
  }
  absl::StatusOr<RetentionPolicy> Record(const RecordedRequest& request, RetentionPolicy policy,
                                         const RecordEntry& entry, Deadline deadline) override {
    RecordEntry kept = entry;
    kept.request = KeptRequestOf(request);
    return RecordOnce<RetentionPolicy>(*database_, request, deadline, FindNamed,
                                       [&](Transaction& t) { return SetRetentionPolicy(t, policy, kept); });
  }
  absl::StatusOr<RetentionDone> Apply(const RetentionOptions& options, Deadline deadline) override {
    return ApplyRetention(database_, blobs_->objects(), options, deadline);
  }

 private:
  static absl::StatusOr<std::optional<RetentionPolicy>> FindNamed(Transaction& t, const std::string& name) {
    const NamedId named = IdOfName(name);
    return FindRetentionPolicy(t, named.id, named.revision);
  }
  Database* const database_;
  const std::shared_ptr<BlobStore> blobs_;
};

class PostgresBlobKeeping final : public BlobKeeping {
 public:
  PostgresBlobKeeping(Database* database, std::shared_ptr<BlobStore> blobs)
      : database_(database), blobs_(std::move(blobs)) {}

  absl::Status Check(const CheckOptions& options, const CheckProgress& from, Deadline deadline) override {
    return CheckBlobs(database_, blobs_->objects(), options, from, deadline);
  }
  absl::StatusOr<Collected> Collect(const CollectOptions& options, Deadline deadline) override {
    return CollectGarbage(database_, blobs_->objects(), options, deadline);
  }
  absl::StatusOr<BlobStatus> Status(int damage_limit, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) -> absl::StatusOr<BlobStatus> {
      absl::StatusOr<CheckState> check = ReadCheckState(t);
      if (!check.ok()) return check.status();
      absl::StatusOr<std::vector<StoreUse>> uses = ReadStoreUse(t);
      if (!uses.ok()) return uses.status();
      absl::StatusOr<std::vector<BlobDamage>> damages = ListDamages(t, damage_limit);
      if (!damages.ok()) return damages.status();
      return BlobStatus{*std::move(check), *std::move(uses), *std::move(damages), blobs_->name()};
    });
  }
  absl::StatusOr<std::vector<MonthUse>> Months(Deadline deadline) const override {
    return OneRead(*database_, deadline, ListMonths);
  }
  absl::StatusOr<std::string> AdoptBucket(Deadline deadline) override {
    if (blobs_->objects() == nullptr)
      return WithReason(
          absl::FailedPreconditionError("bucket: none, want this service configured with one (--blob-store)"),
          kObjectStoreMissing);
    const absl::StatusOr<std::string> here = OneRead(*database_, deadline, BucketOwnerHere);
    if (!here.ok()) return here;
    return storage::AdoptBucket(*here, blobs_->objects(), deadline);
  }
  absl::StatusOr<int> MakeMonths(int months_ahead, Deadline deadline) override {
    return storage::MakeMonths(*database_, months_ahead, deadline);
  }

 private:
  Database* const database_;
  const std::shared_ptr<BlobStore> blobs_;
};

}  // namespace

std::shared_ptr<RetentionStore> RetentionIn(Database* database, std::shared_ptr<BlobStore> blobs) {
  return std::make_shared<PostgresRetention>(database, std::move(blobs));
}

std::shared_ptr<BlobKeeping> BlobKeepingIn(Database* database, std::shared_ptr<BlobStore> blobs) {
  return std::make_shared<PostgresBlobKeeping>(database, std::move(blobs));
}

}  // namespace sixpoint::storage
