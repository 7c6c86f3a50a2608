#include "storage/blob_collector.h"

#include <cstdio>
#include <set>
#include <utility>
#include <vector>

#include "storage/blob_references.h"
#include "storage/blob_rows.h"
#include "storage/blob_store.h"
#include "storage/bucket_owner.h"

namespace sixpoint::storage {
namespace {

constexpr int kCollectedAtOnce = 200;

// The conditions of BlobConditions::unreferenced come between the parts.
constexpr char kSelectCandidates[] =
    "SELECT b.sha256, b.size_bytes, b.store, b.deleted_at IS NULL FROM blobs b "
    "WHERE b.sha256 > $1 AND b.stored_at <= clock_timestamp() - make_interval(secs => $2)";
constexpr char kAmongLoose[] = " AND b.sha256 IN (SELECT l.sha256 FROM loose_blobs l WHERE l.sha256 > $1)";
constexpr char kInOrder[] = " ORDER BY b.sha256 LIMIT $3";
constexpr char kLocked[] = " FOR UPDATE OF b SKIP LOCKED";
// A statement of its own, so that it sees what was committed before the locks were had.
constexpr char kDeleteRows[] = "DELETE FROM blobs b WHERE b.sha256 = ANY ($1::bytea[])";
constexpr char kReturningDeletedRows[] =
    " RETURNING b.sha256, b.size_bytes, b.store, b.deleted_at IS NULL, coalesce(b.object_id::text, '')";
constexpr char kForgetCollected[] =
    "DELETE FROM loose_blobs l WHERE l.sha256 = ANY ($1::bytea[]) "
    "AND NOT EXISTS (SELECT 1 FROM blobs b WHERE b.sha256 = l.sha256)";
constexpr char kSelectClaimed[] =
    "SELECT object_id FROM blobs WHERE sha256 = ANY ($1::bytea[]) AND store = 's3' AND deleted_at IS NULL";

void Count(const Rows& rows, Collected* collected) {
  for (int row = 0; row < rows.count(); ++row) {
    ++collected->blob_count;
    if (rows.Bool(row, 3)) collected->blob_bytes += rows.Int(row, 1);
  }
}

struct Batch {
  std::string last_sha256;  // empty: the end
  std::vector<ClaimedObject> objects;
};

// One transaction, so that uploads wait no longer than that for a row.
absl::StatusOr<Batch> CollectRows(Database* database, const CollectOptions& options, const std::string& after_sha256,
                                  Deadline deadline, Collected* collected) {
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<BlobConditions> conditions = ReadBlobConditions(*transaction);
  if (!conditions.ok()) return conditions.status();
  const absl::StatusOr<Rows> candidates = transaction->Execute(
      kSelectCandidates + std::string(options.part ? kAmongLoose : "") + conditions->unreferenced + kInOrder +
          (options.dry_run ? "" : kLocked),
      Params().Digest(after_sha256).Real(static_cast<double>(options.grace.count())).Int(kCollectedAtOnce));
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
      transaction->Execute(kDeleteRows + conditions->unreferenced + kReturningDeletedRows, Params().Digests(digests));
  if (!gone.ok()) return gone.status();
  const absl::StatusOr<Rows> forgotten = transaction->Execute(kForgetCollected, Params().Digests(digests));
  if (!forgotten.ok()) return forgotten.status();
  if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
  Count(*gone, collected);
  for (int row = 0; row < gone->count(); ++row) {
    if (gone->Text(row, 2) == kStoreS3 && gone->Bool(row, 3))
      batch.objects.push_back({gone->Digest(row, 0), gone->Text(row, 4)});
  }
  return gone->Checked(std::move(batch));
}

// None where the key is none of ours: what others keep in the bucket is not touched.
std::optional<ClaimedObject> ObjectOfKey(const std::string& key) {
  const std::size_t slash = key.rfind('/');
  if (slash == std::string::npos || slash < 64) return std::nullopt;
  ClaimedObject object{key.substr(slash - 64, 64), key.substr(slash + 1)};
  const bool hex = object.sha256.find_first_not_of("0123456789abcdef") == std::string::npos;
  const bool ours = hex && IsUuid(object.object_id) && ObjectKeyOf(object.sha256, object.object_id) == key;
  return ours ? std::optional(std::move(object)) : std::nullopt;
}

absl::StatusOr<std::set<std::string>> ClaimedIds(Database* database, const std::vector<ClaimedObject>& objects,
                                                 Deadline deadline) {
  std::vector<std::string> digests;
  for (const ClaimedObject& object : objects) digests.push_back(object.sha256);
  absl::StatusOr<Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<Rows> rows = transaction->Execute(kSelectClaimed, Params().Digests(digests));
  if (!rows.ok()) return rows.status();
  std::set<std::string> claimed;
  for (int row = 0; row < rows->count(); ++row) claimed.insert(rows->Text(row, 0));
  return rows->Checked(std::move(claimed));
}

absl::Status CollectObjects(Database* database, ObjectStore* objects, const CollectOptions& options,
                            const std::string& prefix, Deadline deadline, Collected* collected) {
  std::string next;
  do {
    const absl::StatusOr<ObjectStore::ListPage> page = objects->List(prefix, next, deadline);
    if (!page.ok()) return page.status();
    std::vector<ClaimedObject> listed;
    std::vector<std::int64_t> sizes;
    for (const ObjectStore::Listed& object : page->objects) {
      std::optional<ClaimedObject> ours = ObjectOfKey(object.key);
      if (!ours || object.modified_at + options.object_grace > std::chrono::system_clock::now()) continue;
      listed.push_back(*std::move(ours));
      sizes.push_back(object.size_bytes);
    }
    const absl::StatusOr<std::set<std::string>> claimed = ClaimedIds(database, listed, deadline);
    if (!claimed.ok()) return claimed.status();
    for (std::size_t i = 0; i < listed.size() && options.keep_going(); ++i) {
      if (claimed->count(listed[i].object_id) != 0) continue;
      const absl::Status gone =
          options.dry_run ? absl::OkStatus() : DeleteObject(database, objects, listed[i], deadline);
      if (!gone.ok()) return gone;
      ++collected->object_count;
      collected->object_bytes += sizes[i];
    }
    next = page->next;
  } while (!next.empty() && options.keep_going());
  return absl::OkStatus();
}

// Of a part, those that begin with one of its bytes.
std::vector<std::string> PrefixesOf(const std::optional<int>& part) {
  if (!part) return {"sha256/"};
  std::vector<std::string> prefixes;
  for (int byte = *part; byte < 256; byte += kCollectParts) {
    char prefix[16];
    std::snprintf(prefix, sizeof prefix, "sha256/%02x/", byte);
    prefixes.emplace_back(prefix);
  }
  return prefixes;
}

}  // namespace

absl::Status DeleteObject(Database* database, ObjectStore* objects, const ClaimedObject& object, Deadline deadline) {
  if (absl::Status own = RequireOwnBucket(*database, objects, deadline); !own.ok()) return own;
  return objects->Delete(ObjectKeyOf(object.sha256, object.object_id), deadline);
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
    for (const ClaimedObject& object : batch->objects) {
      if (absl::Status gone = DeleteObject(database, objects, object, deadline); !gone.ok()) return gone;
    }
  } while (!after_sha256.empty() && options.keep_going());
  if (objects == nullptr) return collected;
  for (const std::string& prefix : PrefixesOf(options.part)) {
    if (!options.keep_going()) break;
    const absl::Status swept = CollectObjects(database, objects, options, prefix, deadline, &collected);
    if (!swept.ok()) return swept;
  }
  return collected;
}

}  // namespace sixpoint::storage
