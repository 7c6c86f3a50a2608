// Takes away what nothing refers to: rows of blobs that no foreign key points at, and objects that no row claims. Safe
// beside running uploads: whatever a Put holds is left alone, and the foreign keys are the last word.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "storage/database.h"
#include "storage/object_store.h"

namespace sixpoint::storage {

struct CollectOptions {
  // Younger ones are left: what was put may be about to be referred to.
  std::chrono::seconds grace = std::chrono::hours(24);
  bool dry_run = false;  // counts only
  std::function<bool()> keep_going = [] { return true; };
};
struct Collected {
  std::int64_t blob_count = 0;
  std::int64_t blob_bytes = 0;  // of those that still had bytes
  // Of failed uploads, and of blobs whose bytes were deleted while the object store was away.
  std::int64_t object_count = 0;
  std::int64_t object_bytes = 0;
};
// `objects` null: none. Stops early, with what it has, where keep_going says so; CANCELLED is for callers.
absl::StatusOr<Collected> CollectGarbage(Database* database, ObjectStore* objects, const CollectOptions& options,
                                         Deadline deadline);

// Deletes the object unless a row claims it or a Put is at it; OK with false then. FAILED_PRECONDITION: the bucket is another plant's
// (storage/bucket_owner.h), asked before each.
absl::StatusOr<bool> DeleteUnclaimedObject(Database* database, ObjectStore* objects, const std::string& sha256,
                                           Deadline deadline);

}  // namespace sixpoint::storage
