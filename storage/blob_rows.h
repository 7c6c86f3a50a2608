// Rows of the catalogue of blobs and their locks. Private to storage.
//
// Who may be in whose way: Put holds a shared lock on the row (FOR KEY SHARE, as foreign keys do) until its commit, so
// retention and the collector, which take the row FOR UPDATE SKIP LOCKED, leave it alone; and whoever waits for them sees what they
// left and acts on it. Objects need no lock: each is put once, under an id of its own.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <string_view>

#include "storage/blob_store.h"
#include "storage/database.h"

namespace sixpoint::storage {

inline constexpr char kStorePostgresql[] = "postgresql";
inline constexpr char kStoreS3[] = "s3";
// NULL where an object store holds them.
inline constexpr char kSelectBlobBytes[] = "SELECT bytes FROM blobs WHERE sha256 = $1";

struct BlobRow {
  std::int64_t size_bytes = 0;
  std::string store;
  std::string object_id;                  // of store s3
  std::optional<std::string> deleted_at;  // "2026-11-21 03:25:01Z"
  std::string deletion_reason;
};

// Of the committed row, or of this transaction's own.
absl::StatusOr<std::optional<BlobRow>> FindBlobRow(Transaction& transaction, const std::string& sha256);
// The same, kept as it is until the transaction ends.
absl::StatusOr<std::optional<BlobRow>> HoldBlobRow(Transaction& transaction, const std::string& sha256);

// Puts the row, or finds it and holds it; brings deleted bytes back. A row that claims another object claims this one from now on:
// that one may be gone behind our back, and if not it is the collector's.
absl::Status PutBlobRow(Transaction& transaction, const StagedBlob& blob);

// Announces a change of blobs to its trigger; empty: none.
absl::Status AnnounceBlobChange(Transaction& transaction, const std::string& purpose);

// FAILED_PRECONDITION with reason POINTS_DELETED.
absl::Status BytesDeleted(const std::string& what, const std::string& deleted_at, const std::string& reason);

// Its bytes, checked, or none where an object store holds them. Errors as BlobStore::Get.
struct FoundBlob {
  std::optional<std::string> bytes;
  BlobRow row;
};
absl::StatusOr<FoundBlob> FindBlob(Transaction& transaction, const std::string& sha256);
// The bytes, or DATA_LOSS.
absl::StatusOr<std::string> Verified(const std::string& sha256, std::string bytes);

// FAILED_PRECONDITION with reason OBJECT_STORE_MISSING.
absl::Status HeldElsewhere(const std::string& sha256);

}  // namespace sixpoint::storage
