#include "storage/blob_check.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "refusal/message_text.h"
#include "storage/blob_rows.h"
#include "storage/blob_store.h"
#include "storage/blobs.h"
#include "storage/each_row.h"
#include "storage/reasons.h"

namespace sixpoint::storage {
namespace {

constexpr int kPage = 100;
constexpr std::size_t kLongestDetail = 1000;  // the table takes no more than four times that
constexpr std::chrono::milliseconds kLongestNap{100};

constexpr char kSelectBlobs[] =
    "SELECT sha256, size_bytes, store, coalesce(object_id::text, '') FROM blobs WHERE sha256 > $1 AND deleted_at IS "
    "NULL ORDER BY sha256 LIMIT $2";
constexpr char kInsertDamage[] =
    "INSERT INTO blob_damages (sha256, store, what, detail) SELECT $1::bytea, $2::text, $3::text, $4::text "
    "WHERE NOT EXISTS (SELECT 1 FROM blob_damages WHERE sha256 = $1 AND what = $3)";
constexpr char kSelectBlobDamages[] =
    "SELECT sha256, store, what, detail, found_at FROM blob_damages ORDER BY damage_id DESC LIMIT $1";
constexpr char kSelectState[] =
    "SELECT after_sha256, checked_count, checked_bytes, damaged_count, begun_at, finished_at FROM blob_check_progress";
constexpr char kUpdateProgress[] =
    "UPDATE blob_check_progress SET after_sha256 = $1, checked_count = $2, checked_bytes = $3, damaged_count = $4";
constexpr char kUpdateFinished[] =
    "UPDATE blob_check_progress SET after_sha256 = '', checked_count = 0, checked_bytes = 0, damaged_count = 0, "
    "begun_at = clock_timestamp(), finished_at = clock_timestamp()";
constexpr char kSelectUse[] =
    "SELECT store, sum(kept_count), sum(kept_bytes), sum(deleted_count), sum(deleted_bytes) FROM blob_use "
    "GROUP BY store ORDER BY store";
constexpr char kAddUpUse[] = "SELECT add_up_blob_use()";

struct Listed {
  std::string sha256;
  std::int64_t size_bytes = 0;
  std::string store;
  std::string object_id;
};

absl::StatusOr<std::vector<Listed>> ReadPage(Database* database, const std::string& after_sha256, Deadline deadline) {
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  return AllRows(*transaction, kSelectBlobs, Params().Digest(after_sha256).Int(kPage),
                 [](const Rows& rows, int row) -> Listed {
                   return {rows.Digest(row, 0), rows.Int(row, 1), rows.Text(row, 2), rows.Text(row, 3)};
                 });
}

// NOT_FOUND: not where the row says.
absl::StatusOr<std::string> ReadBytes(Database* database, ObjectStore* objects, const Listed& blob, Deadline deadline) {
  if (blob.store == kStoreS3) {
    if (objects == nullptr) return HeldElsewhere(blob.sha256);
    return objects->Get(ObjectKeyOf(blob.sha256, blob.object_id), blob.size_bytes, deadline);
  }
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<Rows> rows = transaction->ExecuteBinary(kSelectBlobBytes, Params().Digest(blob.sha256));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0 || rows->IsNull(0, 0)) return absl::NotFoundError("no bytes in the row");
  return rows->Checked(rows->Bytes(0, 0));
}

std::optional<BlobDamage> DamageOf(const Listed& blob, const absl::StatusOr<std::string>& bytes) {
  const auto damaged = [&blob](const std::string& what, const std::string& detail) {
    return BlobDamage{blob.sha256, blob.store, what, detail, std::chrono::system_clock::now()};
  };
  const std::string size_text = std::to_string(blob.size_bytes) + " bytes";
  if (absl::IsNotFound(bytes.status())) return damaged("missing", "gone, want " + size_text);
  if (absl::IsDataLoss(bytes.status())) return damaged("size", "longer than " + size_text);
  if (!bytes.ok()) return damaged("unreadable", std::string(bytes.status().message()));
  if (static_cast<std::int64_t>(bytes->size()) != blob.size_bytes) {
    return damaged("size", std::to_string(bytes->size()) + " bytes, want " + std::to_string(blob.size_bytes));
  }
  const std::string found = Sha256Hex(*bytes);
  if (found != blob.sha256) return damaged("digest", "SHA-256 " + found);
  return std::nullopt;
}

// The store is away, full or misconfigured: that says nothing about this blob. PostgreSQL's INTERNAL does: data_corrupted.
bool SaysNothingOfTheBlob(const Listed& blob, const absl::Status& status) {
  if (status.ok() || absl::IsNotFound(status) || absl::IsDataLoss(status)) return false;
  return blob.store != kStorePostgresql || !absl::IsInternal(status);
}

// OK with false where the blob moved or went on purpose while it was read.
absl::StatusOr<bool> KeepDamage(Database* database, const Listed& blob, const BlobDamage& damage, Deadline deadline) {
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<std::optional<BlobRow>> row = FindBlobRow(*transaction, damage.sha256);
  if (!row.ok()) return row.status();
  if (!row->has_value() || (*row)->deleted_at || (*row)->store != blob.store || (*row)->object_id != blob.object_id)
    return false;
  const absl::StatusOr<Rows> kept = transaction->Execute(
      kInsertDamage,
      Params().Digest(damage.sha256).Text(damage.store).Text(damage.what).Text(Tame(damage.detail, kLongestDetail)));
  if (!kept.ok()) return kept.status();
  if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
  return true;
}

// Until the bytes so far fit the rate, in naps short enough to stop.
void KeepRate(const CheckOptions& options, std::chrono::steady_clock::time_point begin, std::int64_t bytes) {
  if (options.rate_mb_s <= 0) return;
  const auto until = begin + std::chrono::microseconds(static_cast<std::int64_t>(bytes / options.rate_mb_s));
  while (options.keep_going() && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(
        std::min<std::chrono::steady_clock::duration>(kLongestNap, until - std::chrono::steady_clock::now()));
  }
}

}  // namespace

absl::Status CheckBlobs(Database* database, ObjectStore* objects, const CheckOptions& options, CheckProgress from,
                        Deadline deadline) {
  CheckProgress& progress = from;
  const auto begin = std::chrono::steady_clock::now();
  std::int64_t bytes_here = 0;
  for (;;) {
    const absl::StatusOr<std::vector<Listed>> page = ReadPage(database, progress.after_sha256, deadline);
    if (!page.ok()) return page.status();
    if (page->empty()) return absl::OkStatus();
    for (const Listed& blob : *page) {
      if (!options.keep_going()) return absl::OkStatus();
      const absl::StatusOr<std::string> bytes = ReadBytes(database, objects, blob, deadline);
      if (SaysNothingOfTheBlob(blob, bytes.status())) return bytes.status();
      if (const std::optional<BlobDamage> damage = DamageOf(blob, bytes)) {
        const absl::StatusOr<bool> true_damage = KeepDamage(database, blob, *damage, deadline);
        if (!true_damage.ok()) return true_damage.status();
        if (*true_damage) {
          ++progress.damaged_count;
          options.on_damage(*damage);
        }
      }
      progress.after_sha256 = blob.sha256;
      ++progress.checked_count;
      progress.checked_bytes += blob.size_bytes;
      bytes_here += blob.size_bytes;
      options.on_progress(progress);
      KeepRate(options, begin, bytes_here);
    }
  }
}

absl::StatusOr<CheckState> ReadCheckState(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectState);
  if (!rows.ok()) return rows.status();
  if (rows->count() != 1) return absl::InternalError("blob_check_progress: no row, want one");
  CheckState state;
  state.progress = {rows->Digest(0, 0), rows->Int(0, 1), rows->Int(0, 2), rows->Int(0, 3)};
  state.begun_at = rows->Time(0, 4);
  if (!rows->IsNull(0, 5)) state.finished_at = rows->Time(0, 5);
  return rows->Checked(std::move(state));
}

absl::Status KeepCheckProgress(Transaction& transaction, const CheckProgress& progress) {
  return transaction
      .Execute(kUpdateProgress, Params()
                                    .Digest(progress.after_sha256)
                                    .Int(progress.checked_count)
                                    .Int(progress.checked_bytes)
                                    .Int(progress.damaged_count))
      .status();
}

absl::Status KeepCheckFinished(Transaction& transaction) { return transaction.Execute(kUpdateFinished).status(); }

absl::StatusOr<std::vector<StoreUse>> ReadStoreUse(Transaction& transaction) {
  return AllRows(transaction, kSelectUse, Params(), [](const Rows& rows, int row) -> StoreUse {
    return {rows.Text(row, 0), rows.Int(row, 1), rows.Int(row, 2), rows.Int(row, 3), rows.Int(row, 4)};
  });
}

absl::Status AddUpStoreUse(Transaction& transaction) { return transaction.Execute(kAddUpUse).status(); }

absl::StatusOr<std::vector<BlobDamage>> ListDamages(Transaction& transaction, int limit) {
  return AllRows(transaction, kSelectBlobDamages, Params().Int(limit), [](const Rows& rows, int row) -> BlobDamage {
    return {rows.Digest(row, 0), rows.Text(row, 1), rows.Text(row, 2), rows.Text(row, 3), rows.Time(row, 4)};
  });
}

}  // namespace sixpoint::storage
