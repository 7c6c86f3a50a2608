// Rows of the catalogue of blobs and their locks. Private to storage.
//
// Who may be in whose way: Put holds a shared lock on the row (FOR KEY SHARE, as foreign keys do) until its commit, so
// retention and the collector, which take the row FOR UPDATE SKIP LOCKED, leave it alone; and whoever waits for them sees what they
// left and acts on it. Objects have no rows until the commit, so their digest is locked as well (shared by Put, exclusive
// by whoever deletes the object).
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <string_view>

#include "storage/database.h"
#include "storage/object_store.h"

namespace sixpoint::storage {

inline constexpr char kStorePostgresql[] = "postgresql";
inline constexpr char kStoreS3[] = "s3";

struct BlobRow {
  std::int64_t size_bytes = 0;
  std::string store;
  std::optional<std::string> deleted_at;  // "2026-11-21 03:25:01Z"
  std::string deletion_reason;
};

// Of the committed row, or of this transaction's own.
absl::StatusOr<std::optional<BlobRow>> FindBlobRow(Transaction& transaction, const std::string& sha256);
// The same, kept as it is until the transaction ends.
absl::StatusOr<std::optional<BlobRow>> HoldBlobRow(Transaction& transaction, const std::string& sha256);

// Until the transaction ends.
absl::Status ShareDigest(Transaction& transaction, const std::string& sha256);
// False where a Put holds it.
absl::StatusOr<bool> TryTakeDigest(Transaction& transaction, const std::string& sha256);

// Puts the row, or finds it and holds it; brings deleted bytes back. `bytes` none: an object holds them already.
absl::Status PutBlobRow(Transaction& transaction, const std::string& sha256, std::int64_t size_bytes,
                        std::optional<std::string_view> bytes);

// Announces a change of blobs to its trigger; empty: none.
absl::Status AnnounceBlobChange(Transaction& transaction, const std::string& purpose);

// FAILED_PRECONDITION with reason POINTS_DELETED.
absl::Status BytesDeleted(const std::string& what, const std::string& deleted_at, const std::string& reason);

// Get of both stores; `objects` null: PostgreSQL's only.
absl::StatusOr<std::string> ReadBlob(Transaction& transaction, const std::string& sha256, ObjectStore* objects);

}  // namespace sixpoint::storage
