// Sign-ins that failed lately, of an account or from an address (V0017), so that who guesses has to wait longer and longer. Kept under
// a digest: an account that is not there counts like one that is.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

// So many may fail without a quiet quarter of an hour between them. The next waits half a minute after the last, each further one
// twice as long, a quarter of an hour at most.
struct FailureCounter {
  std::string of;  // "users/jane", or an address
  int free_count = 5;
};

// Until when sign-ins of one of them wait; none: now they may.
absl::StatusOr<std::optional<Instant>> SignInsWaitUntil(Transaction& transaction,
                                                        const std::vector<FailureCounter>& counters);
// Counts one as failed before it is judged, so that many at once count as many; locks both counters. As SignInsWaitUntil, in which
// case nothing is counted. Also forgets what is long over.
absl::StatusOr<std::optional<Instant>> BeginSignIn(Transaction& transaction,
                                                   const std::vector<FailureCounter>& counters);
// One of those that were counted went well: the account begins anew, the address is given back this one, for others may guess from it.
absl::Status SignInWentWell(Transaction& transaction, const std::string& account, const FailureCounter& address);

}  // namespace sixpoint::storage
