// Who refers to blobs, as the schema itself says: tables that come later count without anyone remembering them here. Private
// to storage.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "storage/database.h"

namespace sixpoint::storage {

// Conditions on `b`, a row of blobs, to be appended to a WHERE.
struct BlobConditions {
  // " AND NOT EXISTS (...)" for every referring column.
  std::string unreferenced;
  // The same, but blocks of scans whose points are deleted do not count.
  std::string unneeded;
};
absl::StatusOr<BlobConditions> ReadBlobConditions(Transaction& transaction);

}  // namespace sixpoint::storage
