// Whose clouds a bucket holds. An object in it (kOwnerKey) names the plant and the life of its database that it belongs to: a copy of the
// plant, or the same one restored from a backup, knows fewer clouds than the bucket has, and would take the rest for garbage.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>

#include "storage/database.h"
#include "storage/object_store.h"

namespace sixpoint::storage {

inline constexpr char kOwnerKey[] = "sixpoint-plant";

// "plant {uuid}, database {system identifier}/{timeline}": another server's data, a restored dump and a recovery to a point in time
// differ, a restart does not.
absl::StatusOr<std::string> BucketOwnerHere(Transaction& transaction);

// OK where the bucket says that it is ours; an empty one that says nothing says so from now on. FAILED_PRECONDITION names whose it is.
// With no transaction open: it asks the object store.
absl::Status RequireOwnBucket(Database& database, ObjectStore* objects, Deadline deadline);

// A person's decision: of `here` (BucketOwnerHere) from now on, whoever's it was. What it said before; empty: nothing.
absl::StatusOr<std::string> AdoptBucket(const std::string& here, ObjectStore* objects, Deadline deadline);

}  // namespace sixpoint::storage
