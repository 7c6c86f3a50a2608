#include "storage/blob_store.h"

#include <atomic>
#include <chrono>
#include <limits>
#include <utility>

#include "storage/blob_rows.h"
#include "storage/blobs.h"
#include "storage/bucket_owner.h"

namespace sixpoint::storage {
namespace {

class PostgresqlBlobStore final : public BlobStore {
 public:
  explicit PostgresqlBlobStore(std::unique_ptr<ObjectStore> objects) : BlobStore(std::move(objects)) {}
  absl::StatusOr<std::string> Put(Transaction& transaction, std::string_view bytes) override {
    return PutBlob(transaction, bytes);
  }
  std::string name() const override { return kStorePostgresql; }
};

class ObjectBlobStore final : public BlobStore {
 public:
  explicit ObjectBlobStore(std::unique_ptr<ObjectStore> objects) : BlobStore(std::move(objects)) {}

  // An object whose transaction is rolled back has no row; the collector finds it in the bucket's list.
  absl::StatusOr<std::string> Put(Transaction& transaction, std::string_view bytes) override {
    if (absl::Status own = RequireOwn(transaction); !own.ok()) return own;
    const std::string sha256 = Sha256Hex(bytes);
    const auto size_bytes = static_cast<std::int64_t>(bytes.size());
    if (absl::Status shared = ShareDigest(transaction, sha256); !shared.ok()) return shared;
    const absl::StatusOr<bool> held = IsHeld(transaction, sha256, size_bytes);
    if (!held.ok()) return held.status();
    if (!*held) {
      const absl::Status put = objects()->Put(ObjectKeyOf(sha256), bytes, sha256, transaction.deadline());
      if (!put.ok()) return put;
    }
    if (absl::Status stored = PutBlobRow(transaction, sha256, size_bytes, std::nullopt); !stored.ok()) return stored;
    return sha256;
  }
  std::string name() const override { return kStoreS3; }

 private:
  // What we put into another plant's bucket would be its garbage. Asked now and then: each answer is a request of its own.
  absl::Status RequireOwn(Transaction& transaction) {
    const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
    if (now < own_until_) return absl::OkStatus();
    const absl::Status own = RequireOwnBucket(transaction, objects());
    if (own.ok()) own_until_ = now + std::chrono::steady_clock::duration(kBelieved).count();
    return own;
  }
  static constexpr std::chrono::minutes kBelieved{1};
  std::atomic<std::chrono::steady_clock::rep> own_until_ = std::numeric_limits<std::chrono::steady_clock::rep>::min();

  // A row alone is not believed: an object that went behind our back is put again.
  absl::StatusOr<bool> IsHeld(Transaction& transaction, const std::string& sha256, std::int64_t size_bytes) {
    const absl::StatusOr<std::optional<BlobRow>> row = HoldBlobRow(transaction, sha256);
    if (!row.ok()) return row.status();
    if (!row->has_value() || (*row)->deleted_at) return false;
    if ((*row)->store == kStorePostgresql) return true;
    const absl::StatusOr<std::int64_t> size = objects()->SizeOf(ObjectKeyOf(sha256), transaction.deadline());
    if (absl::IsNotFound(size.status())) return false;
    if (!size.ok()) return size.status();
    return *size == size_bytes;
  }
};

}  // namespace

absl::StatusOr<std::string> BlobStore::Get(Transaction& transaction, const std::string& sha256) {
  return ReadBlob(transaction, sha256, objects_.get());
}

std::unique_ptr<BlobStore> MakePostgresqlBlobStore(std::unique_ptr<ObjectStore> objects) {
  return std::make_unique<PostgresqlBlobStore>(std::move(objects));
}

std::unique_ptr<BlobStore> MakeObjectBlobStore(std::unique_ptr<ObjectStore> objects) {
  return std::make_unique<ObjectBlobStore>(std::move(objects));
}

std::string ObjectKeyOf(const std::string& sha256) {
  return "sha256/" + sha256.substr(0, 2) + "/" + sha256.substr(2, 2) + "/" + sha256;
}

}  // namespace sixpoint::storage
