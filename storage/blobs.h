// Content-addressed bytes in PostgreSQL, named by their SHA-256 (lower-case hexadecimal).
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <string_view>

#include "storage/database.h"

namespace sixpoint::storage {

std::string Sha256Hex(std::string_view bytes);

// In the caller's transaction, before the row that names it. The same bytes twice are one blob.
absl::StatusOr<std::string> PutBlob(Transaction& transaction, std::string_view bytes);
// DATA_LOSS when the stored bytes no longer have that digest; NOT_FOUND when there are none.
absl::StatusOr<std::string> GetBlob(Transaction& transaction, const std::string& sha256);

}  // namespace sixpoint::storage
