#include "storage/blob_store.h"

#include <atomic>
#include <chrono>
#include <limits>
#include <utility>
#include <vector>

#include "storage/blob_check.h"
#include "storage/blob_rows.h"
#include "storage/blobs.h"
#include "storage/bucket_owner.h"
#include "storage/one_read.h"
#include "storage/reasons.h"

namespace sixpoint::storage {
namespace {

// What was found is believed for so long: asking before each block would be a request of its own each time.
constexpr std::chrono::minutes kBelieved{1};

// Asks where the last answer was no OK, or too long ago.
class AskedNowAndThen {
 public:
  template <typename Ask>
  absl::Status Ok(const Ask& ask) {
    const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
    if (now < ok_until_) return absl::OkStatus();
    const absl::Status answer = ask();
    if (answer.ok()) ok_until_ = now + std::chrono::steady_clock::duration(kBelieved).count();
    return answer;
  }

 private:
  std::atomic<std::chrono::steady_clock::rep> ok_until_ = std::numeric_limits<std::chrono::steady_clock::rep>::min();
};

class PostgresqlBlobStore final : public BlobStore {
 public:
  PostgresqlBlobStore(std::unique_ptr<ObjectStore> objects, std::int64_t most_bytes)
      : BlobStore(std::move(objects)), most_bytes_(most_bytes) {}
  absl::StatusOr<StagedBlob> Stage(Database& database, std::string_view bytes, Deadline deadline) override {
    const absl::Status room = room_.Ok([&] { return RequireRoom(database, deadline); });
    if (!room.ok()) return room;
    return StagedBlob{Sha256Hex(bytes), bytes, ""};
  }
  std::string name() const override { return kStorePostgresql; }

 private:
  absl::Status RequireRoom(Database& database, Deadline deadline) const {
    const absl::StatusOr<std::vector<StoreUse>> uses = OneRead(database, deadline, ReadStoreUse);
    if (!uses.ok()) return uses.status();
    for (const StoreUse& use : *uses) {
      if (use.store != kStorePostgresql || use.kept_bytes < most_bytes_) continue;
      return WithReason(absl::ResourceExhaustedError("clouds in PostgreSQL: " + std::to_string(use.kept_bytes) +
                                                     " bytes, want less than " + std::to_string(most_bytes_) +
                                                     ": an object store (--blob-store), or a retention policy"),
                        kCloudStoreFull);
    }
    return absl::OkStatus();
  }
  const std::int64_t most_bytes_;
  AskedNowAndThen room_;
};

class ObjectBlobStore final : public BlobStore {
 public:
  explicit ObjectBlobStore(std::unique_ptr<ObjectStore> objects) : BlobStore(std::move(objects)) {}

  absl::StatusOr<StagedBlob> Stage(Database& database, std::string_view bytes, Deadline deadline) override {
    // What we put into another plant's bucket would be its garbage.
    const absl::Status own = own_.Ok([&] { return RequireOwnBucket(database, objects(), deadline); });
    if (!own.ok()) return own;
    StagedBlob blob{Sha256Hex(bytes), bytes, NewUuid()};
    const absl::Status put = objects()->Put(ObjectKeyOf(blob.sha256, blob.object_id), bytes, blob.sha256, deadline);
    if (!put.ok()) return put;
    return blob;
  }
  std::string name() const override { return kStoreS3; }

 private:
  AskedNowAndThen own_;
};

}  // namespace

absl::Status BlobStore::Put(Transaction& transaction, const StagedBlob& blob) { return PutBlobRow(transaction, blob); }

absl::StatusOr<std::string> BlobStore::Get(Database& database, const std::string& sha256, Deadline deadline,
                                           const std::function<absl::Status(Transaction&)>& may) const {
  const auto find = [&](Transaction& transaction) -> absl::StatusOr<FoundBlob> {
    const absl::Status asked = may ? may(transaction) : absl::OkStatus();
    return asked.ok() ? FindBlob(transaction, sha256) : asked;
  };
  // The row may have claimed another object meanwhile: what is not where it said is looked for once more.
  for (int attempt = 0; attempt < 2; ++attempt) {
    absl::StatusOr<FoundBlob> found = OneRead(database, deadline, find);
    if (!found.ok()) return found.status();
    if (found->bytes) return *std::move(found->bytes);
    if (objects_ == nullptr) return HeldElsewhere(sha256);
    absl::StatusOr<std::string> bytes =
        objects_->Get(ObjectKeyOf(sha256, found->row.object_id), found->row.size_bytes, deadline);
    if (bytes.ok()) return Verified(sha256, *std::move(bytes));
    if (absl::IsDataLoss(bytes.status())) {
      return absl::DataLossError("blob " + sha256 + ": " + std::string(bytes.status().message()));
    }
    if (!absl::IsNotFound(bytes.status())) return bytes.status();
  }
  return absl::DataLossError("blob " + sha256 + ": its bytes are missing from store " + kStoreS3);
}

std::unique_ptr<BlobStore> MakePostgresqlBlobStore(std::unique_ptr<ObjectStore> objects, std::int64_t most_bytes) {
  return std::make_unique<PostgresqlBlobStore>(std::move(objects), most_bytes);
}

std::unique_ptr<BlobStore> MakeObjectBlobStore(std::unique_ptr<ObjectStore> objects) {
  return std::make_unique<ObjectBlobStore>(std::move(objects));
}

std::string ObjectKeyOf(const std::string& sha256, const std::string& object_id) {
  return "sha256/" + sha256.substr(0, 2) + "/" + sha256.substr(2, 2) + "/" + sha256 + "/" + object_id;
}

}  // namespace sixpoint::storage
