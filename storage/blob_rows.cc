#include "storage/blob_rows.h"

#include <utility>

#include "storage/blob_store.h"
#include "storage/blobs.h"
#include "storage/reasons.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_BLOB_COLUMNS                                                                        \
  "SELECT size_bytes, store, to_char(deleted_at AT TIME ZONE 'UTC', 'YYYY-MM-DD HH24:MI:SS\"Z\"'), " \
  "coalesce(deletion_reason, '') FROM blobs WHERE sha256 = $1"
constexpr char kSelectRow[] = SIXPOINT_BLOB_COLUMNS;
constexpr char kHoldRow[] = SIXPOINT_BLOB_COLUMNS " FOR KEY SHARE";
#undef SIXPOINT_BLOB_COLUMNS
constexpr char kSelectBytes[] = "SELECT bytes FROM blobs WHERE sha256 = $1";
constexpr char kInsertRow[] =
    "INSERT INTO blobs (sha256, size_bytes, bytes, store) VALUES ($1, $2, $3, $4) ON CONFLICT (sha256) DO NOTHING";
constexpr char kRestoreRow[] =
    "UPDATE blobs SET bytes = $2, store = $3, deleted_at = NULL, deletion_reason = NULL "
    "WHERE sha256 = $1 AND bytes IS NULL AND (deleted_at IS NOT NULL OR store <> $3)";
constexpr char kAnnounce[] = "SELECT set_config('sixpoint.blob_change', $1, true)";
constexpr char kShareDigest[] = "SELECT pg_advisory_xact_lock_shared(hashtextextended('blobs/' || $1, 0))";
constexpr char kTryTakeDigest[] = "SELECT pg_try_advisory_xact_lock(hashtextextended('blobs/' || $1, 0))";
// A row that is found and then collected is put again; twice in a row is not chance.
constexpr int kAttempts = 5;

absl::StatusOr<std::optional<BlobRow>> ReadRow(Transaction& transaction, const char* sql, const std::string& sha256) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, Params().Digest(sha256));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  BlobRow row;
  row.size_bytes = rows->Int(0, 0);
  row.store = rows->Text(0, 1);
  if (!rows->IsNull(0, 2)) row.deleted_at = rows->Text(0, 2);
  row.deletion_reason = rows->Text(0, 3);
  return rows->Checked(std::move(row));
}

absl::StatusOr<std::string> Verified(const std::string& sha256, std::string bytes) {
  if (const std::string found = Sha256Hex(bytes); found != sha256) {
    return absl::DataLossError("blob " + sha256 + ": the stored bytes have SHA-256 " + found);
  }
  return bytes;
}

absl::Status RestoreRow(Transaction& transaction, const std::string& sha256, std::optional<std::string_view> bytes) {
  if (absl::Status announced = AnnounceBlobChange(transaction, "restore_bytes"); !announced.ok()) return announced;
  Params params;
  params.Digest(sha256);
  bytes ? params.Bytes(*bytes) : params.Null();
  params.Text(bytes ? kStorePostgresql : kStoreS3);
  if (const absl::StatusOr<Rows> restored = transaction.Execute(kRestoreRow, params); !restored.ok()) {
    return restored.status();
  }
  return AnnounceBlobChange(transaction, "");
}

}  // namespace

absl::StatusOr<std::optional<BlobRow>> FindBlobRow(Transaction& transaction, const std::string& sha256) {
  return ReadRow(transaction, kSelectRow, sha256);
}

absl::StatusOr<std::optional<BlobRow>> HoldBlobRow(Transaction& transaction, const std::string& sha256) {
  return ReadRow(transaction, kHoldRow, sha256);
}

absl::Status ShareDigest(Transaction& transaction, const std::string& sha256) {
  return transaction.Execute(kShareDigest, Params().Text(sha256)).status();
}

absl::StatusOr<bool> TryTakeDigest(Transaction& transaction, const std::string& sha256) {
  const absl::StatusOr<Rows> taken = transaction.Execute(kTryTakeDigest, Params().Text(sha256));
  if (!taken.ok()) return taken.status();
  return taken->Checked(taken->Bool(0, 0));
}

absl::Status AnnounceBlobChange(Transaction& transaction, const std::string& purpose) {
  return transaction.Execute(kAnnounce, Params().Text(purpose)).status();
}

absl::Status PutBlobRow(Transaction& transaction, const std::string& sha256, std::int64_t size_bytes,
                        std::optional<std::string_view> bytes) {
  Params params;
  params.Digest(sha256).Int(size_bytes);
  bytes ? params.Bytes(*bytes) : params.Null();
  params.Text(bytes ? kStorePostgresql : kStoreS3);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertRow, params);
    if (!inserted.ok()) return inserted.status();
    if (inserted->affected() == 1) return absl::OkStatus();
    const absl::StatusOr<std::optional<BlobRow>> row = HoldBlobRow(transaction, sha256);
    if (!row.ok()) return row.status();
    if (!row->has_value()) continue;  // collected between the two statements
    // Bytes that a caller wants in PostgreSQL come here from the object store too: their readers may know only this one.
    const bool elsewhere = bytes.has_value() && (*row)->store != kStorePostgresql;
    if ((*row)->deleted_at || elsewhere) return RestoreRow(transaction, sha256, bytes);
    return absl::OkStatus();
  }
  return absl::UnavailableError("blob " + sha256 + ": collected again and again while it was put");
}

absl::Status BytesDeleted(const std::string& what, const std::string& deleted_at, const std::string& reason) {
  return WithReason(absl::FailedPreconditionError(what + ": its bytes were deleted at " + deleted_at +
                                                  ", reason: " + reason + "; want something that is kept"),
                    kPointsDeleted);
}

absl::StatusOr<std::string> ReadBlob(Transaction& transaction, const std::string& sha256, ObjectStore* objects) {
  absl::Status lost;
  // Bytes may move or go between the statements: what is not where the row said is looked for once more.
  for (int attempt = 0; attempt < 2; ++attempt) {
    const absl::StatusOr<Rows> rows = transaction.ExecuteBinary(kSelectBytes, Params().Digest(sha256));
    if (!rows.ok()) return rows.status();
    if (rows->count() == 0) return absl::NotFoundError("blob " + sha256 + ": not stored");
    if (!rows->IsNull(0, 0)) return Verified(sha256, rows->Bytes(0, 0));
    const absl::StatusOr<std::optional<BlobRow>> row = FindBlobRow(transaction, sha256);
    if (!row.ok()) return row.status();
    if (!row->has_value()) return absl::NotFoundError("blob " + sha256 + ": not stored");
    if ((*row)->deleted_at) return BytesDeleted("blob " + sha256, *(*row)->deleted_at, (*row)->deletion_reason);
    lost = absl::DataLossError("blob " + sha256 + ": its bytes are missing from store " + (*row)->store);
    if ((*row)->store == kStorePostgresql) continue;
    if (objects == nullptr) {
      return WithReason(
          absl::FailedPreconditionError(
              "blob " + sha256 + ": held by an object store, want this service configured with it (--blob-store)"),
          kObjectStoreMissing);
    }
    absl::StatusOr<std::string> bytes = objects->Get(ObjectKeyOf(sha256), (*row)->size_bytes, transaction.deadline());
    if (bytes.ok()) return Verified(sha256, *std::move(bytes));
    if (absl::IsDataLoss(bytes.status())) {
      return absl::DataLossError("blob " + sha256 + ": " + std::string(bytes.status().message()));
    }
    if (!absl::IsNotFound(bytes.status())) return bytes.status();
  }
  return lost;
}

}  // namespace sixpoint::storage
