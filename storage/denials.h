// Calls that were refused for who asked (V0014): a table of their own, never under the journal's lock.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

struct Denial {
  std::string area, method, caller, peer_address, reason,
      sentence;  // as the table's comments say; cut to what it holds
  std::int64_t count = 0;
  Instant first_denied_at, last_denied_at;  // the service's clock
};

absl::Status AppendDenials(Transaction& transaction, std::vector<Denial> denials);

}  // namespace sixpoint::storage
