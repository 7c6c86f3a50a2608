// Content-addressed bytes in PostgreSQL, named by their SHA-256 (lower-case hexadecimal). For small things that belong to a
// row (CAD, NC programs, requests); clouds go through storage/blob_store.h.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <string_view>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

std::string Sha256Hex(std::string_view bytes);
// SHA-256 over digests given in hexadecimal, 32 bytes each: what a scan is known by.
std::string Sha256OfDigests(const std::vector<std::string>& digests);

// In the caller's transaction, before the row that names it. The same bytes twice are one blob, which no collector takes before
// the transaction ends.
absl::StatusOr<std::string> PutBlob(Transaction& transaction, std::string_view bytes);
// DATA_LOSS when the stored bytes no longer have that digest; NOT_FOUND when there are none; FAILED_PRECONDITION when they
// were deleted on purpose.
absl::StatusOr<std::string> GetBlob(Transaction& transaction, const std::string& sha256);

}  // namespace sixpoint::storage
