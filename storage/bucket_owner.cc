#include "storage/bucket_owner.h"

#include "refusal/message_text.h"
#include "storage/blobs.h"
#include "storage/one_read.h"
#include "storage/reasons.h"

namespace sixpoint::storage {
namespace {

constexpr char kSelectOwner[] =
    "SELECT 'plant ' || plant_id || ', database ' || (SELECT system_identifier FROM pg_control_system()) || '/' || "
    "(SELECT timeline_id FROM pg_control_checkpoint()) FROM plant_identity";
constexpr char kClouds[] = "sha256/";
constexpr std::int64_t kLongestOwner = 1000;  // bytes; ours is a tenth of that

absl::Status PutOwner(ObjectStore* objects, const std::string& owner, Deadline deadline) {
  return objects->Put(kOwnerKey, owner, Sha256Hex(owner), deadline);
}

// Empty: the bucket does not say.
absl::StatusOr<std::string> OwnerOf(ObjectStore* objects, Deadline deadline) {
  absl::StatusOr<std::string> owner = objects->Get(kOwnerKey, kLongestOwner, deadline);
  if (absl::IsNotFound(owner.status())) return "";
  return owner;
}

}  // namespace

absl::StatusOr<std::string> BucketOwnerHere(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectOwner);
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->Text(0, 0));
}

absl::Status RequireOwnBucket(Database& database, ObjectStore* objects, Deadline deadline) {
  const absl::StatusOr<std::string> here = OneRead(database, deadline, BucketOwnerHere);
  if (!here.ok()) return here.status();
  absl::StatusOr<std::string> owner = OwnerOf(objects, deadline);
  if (!owner.ok()) return owner.status();
  if (owner->empty()) {
    const absl::StatusOr<ObjectStore::ListPage> clouds = objects->List(kClouds, "", deadline);
    if (!clouds.ok()) return clouds.status();
    if (!clouds->objects.empty())
      return WithReason(
          absl::FailedPreconditionError(
              "bucket: holds clouds and does not say whose, want an empty one, or `sixpoint store adopt-bucket`"),
          kBucketOfAnother);
    if (absl::Status put = PutOwner(objects, *here, deadline); !put.ok()) return put;
    owner = OwnerOf(objects, deadline);  // another plant may have done the same at the same moment
    if (!owner.ok()) return owner.status();
  }
  if (*owner == *here) return absl::OkStatus();
  return WithReason(
      absl::FailedPreconditionError("bucket: of " + Tame(*owner, kLongestOwner) + ", want one of " + *here +
                                    "; after a restore look at `sixpoint store collect --dry-run`, then `sixpoint "
                                    "store adopt-bucket`"),
      kBucketOfAnother);
}

absl::StatusOr<std::string> AdoptBucket(const std::string& here, ObjectStore* objects, Deadline deadline) {
  absl::StatusOr<std::string> before = OwnerOf(objects, deadline);
  if (!before.ok() && !absl::IsDataLoss(before.status())) return before;
  if (absl::Status put = PutOwner(objects, here, deadline); !put.ok()) return put;
  return before.ok() ? *before : "something that is no owner's name";
}

}  // namespace sixpoint::storage
