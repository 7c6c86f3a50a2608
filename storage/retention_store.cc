#include "storage/retention_store.h"

#include <utility>

#include "storage/one_read.h"

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
  absl::StatusOr<std::vector<RetentionPolicy>> ListPolicies(bool all_revisions, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return ListRetentionPolicies(t, all_revisions); });
  }
  absl::StatusOr<DeletedPoints> DeletePoints(const DeletionOrder& order, Deadline deadline) override {
    return DeleteScanPoints(database_, blobs_->objects(), order, deadline);
  }
  absl::StatusOr<RetentionPolicy> SetPolicy(RetentionPolicy policy, Deadline deadline) override {
    absl::StatusOr<Transaction> transaction = database_->Begin(deadline);
    if (!transaction.ok()) return transaction.status();
    absl::StatusOr<RetentionPolicy> set = SetRetentionPolicy(*transaction, std::move(policy));
    if (!set.ok()) return set;
    if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
    return set;
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
