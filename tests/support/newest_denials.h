// What the table of denials holds, which no code of the product reads.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "storage/denials.h"

namespace sixpoint::testing {

// Newest first.
absl::StatusOr<std::vector<storage::Denial>> NewestDenials(storage::Transaction& transaction, int limit);

}  // namespace sixpoint::testing
