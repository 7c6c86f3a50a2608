// Forward-only numbered migrations (migrations/V0001__verb_object.sql), each one transaction with its bookkeeping row.
#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace sixpoint::storage {

// Applies what is missing, under an advisory lock. Refuses when an applied file's SHA-256 has changed or a number is
// missing. Returns the schema version after it.
absl::StatusOr<int> Migrate(const std::string& conninfo, const std::string& migrations_folder);

}  // namespace sixpoint::storage
