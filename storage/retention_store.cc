#include "storage/retention_store.h"

#include <utility>

#include "storage/one_read.h"
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
  absl::StatusOr<std::optional<std::string>> FindAnswer(const RecordedRequest& request,
                                                        Deadline deadline) const override {
    return storage::FindAnswer(*database_, request, deadline);
  }
  absl::StatusOr<std::string> Record(const RecordedRequest& request, RetentionPolicy policy, const RecordEntry& entry,
                                     const AnswerOf<RetentionPolicy>& answer_of, Deadline deadline) override {
    return RecordOnce(*database_, request, deadline, [&](Transaction& transaction) -> absl::StatusOr<std::string> {
      const absl::StatusOr<RetentionPolicy> set = SetRetentionPolicy(transaction, policy, entry);
      if (!set.ok()) return set.status();
      return answer_of(*set);
    });
  }
  absl::StatusOr<RetentionDone> Apply(const RetentionOptions& options, Deadline deadline) override {
    return ApplyRetention(database_, blobs_->objects(), options, deadline);
  }

 private:
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
