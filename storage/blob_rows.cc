#include "storage/blob_rows.h"

#include <utility>

#include "storage/blobs.h"
#include "storage/reasons.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_BLOB_COLUMNS                                                                        \
  "SELECT size_bytes, store, to_char(deleted_at AT TIME ZONE 'UTC', 'YYYY-MM-DD HH24:MI:SS\"Z\"'), " \
  "coalesce(deletion_reason, ''), object_id FROM blobs WHERE sha256 = $1"
constexpr char kSelectRow[] = SIXPOINT_BLOB_COLUMNS;
constexpr char kHoldRow[] = SIXPOINT_BLOB_COLUMNS " FOR KEY SHARE";
#undef SIXPOINT_BLOB_COLUMNS
constexpr char kInsertRow[] =
    "INSERT INTO blobs (sha256, size_bytes, bytes, store, object_id) VALUES ($1, $2, $3, $4, $5) "
    "ON CONFLICT (sha256) DO NOTHING";
constexpr char kRestoreRow[] =
    "UPDATE blobs SET bytes = $2, store = $3, object_id = $4, deleted_at = NULL, deletion_reason = NULL "
    "WHERE sha256 = $1 AND bytes IS NULL";
constexpr char kAnnounce[] = "SELECT set_config('sixpoint.blob_change', $1, true)";
// A row that is found and then collected is put again; twice in a row is not chance.
constexpr int kPutAttempts = 5;

absl::StatusOr<std::optional<BlobRow>> ReadBlobRow(Transaction& transaction, const char* sql,
                                                   const std::string& sha256) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, Params().Digest(sha256));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  BlobRow row;
  row.size_bytes = rows->Int(0, 0);
  row.store = rows->Text(0, 1);
  if (!rows->IsNull(0, 2)) row.deleted_at = rows->Text(0, 2);
  row.deletion_reason = rows->Text(0, 3);
  if (!rows->IsNull(0, 4)) row.object_id = rows->Text(0, 4);
  return rows->Checked(std::move(row));
}

// What comes after the digest: bytes, or the object that holds them.
void AddHolder(const StagedBlob& blob, Params* params) {
  if (blob.object_id.empty()) {
    params->Bytes(blob.bytes).Text(kStorePostgresql).Null();
  } else {
    params->Null().Text(kStoreS3).Uuid(blob.object_id);
  }
}

absl::Status RestoreRow(Transaction& transaction, const StagedBlob& blob) {
  if (absl::Status announced = AnnounceBlobChange(transaction, "restore_bytes"); !announced.ok()) return announced;
  Params params;
  params.Digest(blob.sha256);
  AddHolder(blob, &params);
  if (const absl::StatusOr<Rows> restored = transaction.Execute(kRestoreRow, params); !restored.ok()) {
    return restored.status();
  }
  return AnnounceBlobChange(transaction, "");
}

}  // namespace

absl::StatusOr<std::optional<BlobRow>> FindBlobRow(Transaction& transaction, const std::string& sha256) {
  return ReadBlobRow(transaction, kSelectRow, sha256);
}

absl::StatusOr<std::optional<BlobRow>> HoldBlobRow(Transaction& transaction, const std::string& sha256) {
  return ReadBlobRow(transaction, kHoldRow, sha256);
}

absl::Status AnnounceBlobChange(Transaction& transaction, const std::string& purpose) {
  return transaction.Execute(kAnnounce, Params().Text(purpose)).status();
}

absl::Status PutBlobRow(Transaction& transaction, const StagedBlob& blob) {
  Params params;
  params.Digest(blob.sha256).Int(static_cast<std::int64_t>(blob.bytes.size()));
  AddHolder(blob, &params);
  for (int attempt = 0; attempt < kPutAttempts; ++attempt) {
    const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertRow, params);
    if (!inserted.ok()) return inserted.status();
    if (inserted->affected() == 1) return absl::OkStatus();
    const absl::StatusOr<std::optional<BlobRow>> row = HoldBlobRow(transaction, blob.sha256);
    if (!row.ok()) return row.status();
    if (!row->has_value()) continue;  // collected between the two statements
    // Bytes that a caller wants in PostgreSQL come here from the object store too: their readers may know only this one.
    const bool held_here = (*row)->store == kStorePostgresql && !(*row)->deleted_at;
    return held_here ? absl::OkStatus() : RestoreRow(transaction, blob);
  }
  return absl::UnavailableError("blob " + blob.sha256 + ": collected again and again while it was put");
}

absl::Status BytesDeleted(const std::string& what, const std::string& deleted_at, const std::string& reason) {
  return WithReason(absl::FailedPreconditionError(what + ": its bytes were deleted at " + deleted_at +
                                                  ", reason: " + reason + "; want something that is kept"),
                    kPointsDeleted);
}

absl::Status HeldElsewhere(const std::string& sha256) {
  return WithReason(
      absl::FailedPreconditionError("blob " + sha256 +
                                    ": held by an object store, want this service configured with it (--blob-store)"),
      kObjectStoreMissing);
}

absl::StatusOr<std::string> Verified(const std::string& sha256, std::string bytes) {
  if (const std::string found = Sha256Hex(bytes); found != sha256) {
    return absl::DataLossError("blob " + sha256 + ": the stored bytes have SHA-256 " + found);
  }
  return bytes;
}

absl::StatusOr<FoundBlob> FindBlob(Transaction& transaction, const std::string& sha256) {
  // Bytes may move or go between the statements: what is not where the row said is looked for once more.
  for (int attempt = 0; attempt < 2; ++attempt) {
    absl::StatusOr<std::optional<BlobRow>> row = FindBlobRow(transaction, sha256);
    if (!row.ok()) return row.status();
    if (!row->has_value()) return absl::NotFoundError("blob " + sha256 + ": not stored");
    if ((*row)->deleted_at) return BytesDeleted("blob " + sha256, *(*row)->deleted_at, (*row)->deletion_reason);
    if ((*row)->store != kStorePostgresql) return FoundBlob{std::nullopt, **std::move(row)};
    const absl::StatusOr<Rows> rows = transaction.ExecuteBinary(kSelectBlobBytes, Params().Digest(sha256));
    if (!rows.ok()) return rows.status();
    if (rows->count() == 0 || rows->IsNull(0, 0)) continue;
    absl::StatusOr<std::string> bytes = Verified(sha256, rows->Bytes(0, 0));
    if (!bytes.ok()) return bytes.status();
    return rows->Checked(FoundBlob{*std::move(bytes), **std::move(row)});
  }
  return absl::DataLossError("blob " + sha256 + ": its bytes are missing from store " + kStorePostgresql);
}

}  // namespace sixpoint::storage
