// Takes away what nothing refers to: rows of blobs that no foreign key points at, and objects that no row claims. Safe
// beside running uploads: whatever a Put holds is left alone, and the foreign keys are the last word.
//
// Asking of each blob who refers to it reads the whole catalogue. What runs each hour reads what is said to be loose (table
// loose_blobs) and one part of the bucket after another; the whole is read when a person asks.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "storage/database.h"
#include "storage/object_store.h"

namespace sixpoint::storage {

inline constexpr int kCollectParts = 128;

struct CollectOptions {
  // Younger ones are left: what was put may be about to be referred to.
  std::chrono::seconds grace = std::chrono::hours(24);
  // Of objects that no row claims; longer than an upload may take from the object to its row.
  std::chrono::seconds object_grace = std::chrono::hours(24);
  // Only loose blobs, and objects of this part of kCollectParts; none: everything.
  std::optional<int> part;
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

// An object that a row claimed, or might.
struct ClaimedObject {
  std::string sha256;
  std::string object_id;
};
// Deletes one that no row claims. With no transaction open. FAILED_PRECONDITION: the bucket is another plant's
// (storage/bucket_owner.h), asked before each.
absl::Status DeleteObject(Database* database, ObjectStore* objects, const ClaimedObject& object, Deadline deadline);

}  // namespace sixpoint::storage
