#include "storage/blob_collector.h"

#include <set>
#include <utility>
#include <vector>

#include "storage/blob_references.h"
#include "storage/blob_rows.h"
#include "storage/blob_store.h"
#include "storage/bucket_owner.h"

namespace sixpoint::storage {
namespace {

constexpr int kBatch = 200;
constexpr char kObjectPrefix[] = "sha256/";

// The conditions of BlobConditions::unreferenced come between the parts.
constexpr char kSelectCandidates[] =
    "SELECT b.sha256, b.size_bytes, b.store, b.deleted_at IS NULL FROM blobs b "
    "WHERE b.sha256 > $1 AND b.stored_at <= clock_timestamp() - make_interval(secs => $2)";
constexpr char kInOrder[] = " ORDER BY b.sha256 LIMIT $3";
constexpr char kLocked[] = " FOR UPDATE OF b SKIP LOCKED";
// A statement of its own, so that it sees what was committed before the locks were had.
constexpr char kDeleteRows[] = "DELETE FROM blobs b WHERE b.sha256 = ANY ($1::bytea[])";
constexpr char kReturning[] = " RETURNING b.sha256, b.size_bytes, b.store, b.deleted_at IS NULL";
constexpr char kSelectClaimed[] =
    "SELECT sha256 FROM blobs WHERE sha256 = ANY ($1::bytea[]) AND store = 's3' AND deleted_at IS NULL";

void Count(const Rows& rows, Collected* collected) {
  for (int row = 0; row < rows.count(); ++row) {
    ++collected->blob_count;
    if (rows.Bool(row, 3)) collected->blob_bytes += rows.Int(row, 1);
  }
}

struct Batch {
  std::string last_sha256;  // empty: the end
  std::vector<std::string> objects;
};

// One transaction, so that uploads wait no longer than that for a row.
absl::StatusOr<Batch> CollectRows(Database* database, const CollectOptions& options, const std::string& after_sha256,
                                  Deadline deadline, Collected* collected) {
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<BlobConditions> conditions = ReadBlobConditions(*transaction);
  if (!conditions.ok()) return conditions.status();
  const absl::StatusOr<Rows> candidates =
      transaction->Execute(kSelectCandidates + conditions->unreferenced + kInOrder + (options.dry_run ? "" : kLocked),
                           Params().Digest(after_sha256).Real(static_cast<double>(options.grace.count())).Int(kBatch));
  if (!candidates.ok()) return candidates.status();
  Batch batch;
  std::vector<std::string> digests;
  for (int row = 0; row < candidates->count(); ++row) digests.push_back(candidates->Digest(row, 0));
  if (absl::Status read = candidates->status(); !read.ok()) return read;
  if (!digests.empty()) batch.last_sha256 = digests.back();
  if (options.dry_run) {
    Count(*candidates, collected);
    return batch;
  }
  if (digests.empty()) return batch;
  if (absl::Status announced = AnnounceBlobChange(*transaction, "collect"); !announced.ok()) return announced;
  const absl::StatusOr<Rows> gone =
      transaction->Execute(kDeleteRows + conditions->unreferenced + kReturning, Params().Digests(digests));
  if (!gone.ok()) return gone.status();
  if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
  Count(*gone, collected);
  for (int row = 0; row < gone->count(); ++row) {
    if (gone->Text(row, 2) == kStoreS3 && gone->Bool(row, 3)) batch.objects.push_back(gone->Digest(row, 0));
  }
  return gone->Checked(std::move(batch));
}

// Empty where the key is none of ours: what others keep in the bucket is not touched.
std::string DigestOfKey(const std::string& key) {
  const std::string sha256 = key.substr(key.rfind('/') + 1);
  const bool hex = sha256.size() == 64 && sha256.find_first_not_of("0123456789abcdef") == std::string::npos;
  return hex && ObjectKeyOf(sha256) == key ? sha256 : "";
}

absl::StatusOr<std::set<std::string>> ClaimedOf(Database* database, const std::vector<std::string>& digests,
                                                Deadline deadline) {
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<Rows> rows = transaction->Execute(kSelectClaimed, Params().Digests(digests));
  if (!rows.ok()) return rows.status();
  std::set<std::string> claimed;
  for (int row = 0; row < rows->count(); ++row) claimed.insert(rows->Digest(row, 0));
  return rows->Checked(std::move(claimed));
}

absl::Status CollectObjects(Database* database, ObjectStore* objects, const CollectOptions& options, Deadline deadline,
                            Collected* collected) {
  std::string next;
  do {
    const absl::StatusOr<ObjectStore::ListPage> page = objects->List(kObjectPrefix, next, deadline);
    if (!page.ok()) return page.status();
    std::vector<std::string> digests;
    std::vector<std::int64_t> sizes;
    for (const ObjectStore::Listed& object : page->objects) {
      const std::string sha256 = DigestOfKey(object.key);
      if (sha256.empty() || object.modified_at + options.grace > std::chrono::system_clock::now()) continue;
      digests.push_back(sha256);
      sizes.push_back(object.size_bytes);
    }
    const absl::StatusOr<std::set<std::string>> claimed = ClaimedOf(database, digests, deadline);
    if (!claimed.ok()) return claimed.status();
    for (std::size_t i = 0; i < digests.size() && options.keep_going(); ++i) {
      if (claimed->count(digests[i]) != 0) continue;
      const absl::StatusOr<bool> gone =
          options.dry_run ? true : DeleteUnclaimedObject(database, objects, digests[i], deadline);
      if (!gone.ok()) return gone.status();
      if (*gone) {
        ++collected->object_count;
        collected->object_bytes += sizes[i];
      }
    }
    next = page->next;
  } while (!next.empty() && options.keep_going());
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<bool> DeleteUnclaimedObject(Database* database, ObjectStore* objects, const std::string& sha256,
                                           Deadline deadline) {
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<bool> taken = TryTakeDigest(*transaction, sha256);
  if (!taken.ok()) return taken.status();
  if (!*taken) return false;
  const absl::StatusOr<std::optional<BlobRow>> row = FindBlobRow(*transaction, sha256);
  if (!row.ok()) return row.status();
  if (row->has_value() && (*row)->store == kStoreS3 && !(*row)->deleted_at) return false;
  if (absl::Status own = RequireOwnBucket(*transaction, objects); !own.ok()) return own;
  if (absl::Status gone = objects->Delete(ObjectKeyOf(sha256), deadline); !gone.ok()) return gone;
  return true;  // the end of the transaction gives the digest back
}

absl::StatusOr<Collected> CollectGarbage(Database* database, ObjectStore* objects, const CollectOptions& options,
                                         Deadline deadline) {
  Collected collected;
  std::string after_sha256;
  do {
    const absl::StatusOr<Batch> batch = CollectRows(database, options, after_sha256, deadline, &collected);
    if (!batch.ok()) return batch.status();
    after_sha256 = batch->last_sha256;
    if (objects == nullptr) continue;
    for (const std::string& sha256 : batch->objects) {
      const absl::StatusOr<bool> gone = DeleteUnclaimedObject(database, objects, sha256, deadline);
      if (!gone.ok()) return gone.status();
    }
  } while (!after_sha256.empty() && options.keep_going());
  if (objects == nullptr || !options.keep_going()) return collected;
  if (absl::Status swept = CollectObjects(database, objects, options, deadline, &collected); !swept.ok()) return swept;
  return collected;
}

}  // namespace sixpoint::storage
