// Sign-ins that failed lately, of an account or from an address (V0017), so that who guesses has to wait longer and longer. Kept under
// a digest: an account that is not there counts like one that is.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "storage/database.h"

namespace sixpoint::storage {

// So many may fail without a quiet quarter of an hour between them. The next waits half a minute after the last, each further one
// twice as long, a quarter of an hour at most.
struct FailureCounter {
  std::string of;  // an account, as it was typed; or an address
  int free_count = 5;
};

// What one try counts on. No account is an address, whatever is typed.
struct FailureCounters {
  std::optional<FailureCounter> account, address;
};

// Until when sign-ins of one of them wait; none: now they may.
absl::StatusOr<std::optional<Instant>> SignInsWaitUntil(Transaction& transaction, const FailureCounters& counters);

// One of both.
struct SignInStart {
  std::optional<Instant> waits_until, counted_at;
};
// Counts one as failed before it is judged, so that many at once count as many; locks both counters, and nothing else. Nothing is
// counted where it has to wait.
absl::StatusOr<SignInStart> BeginSignIn(Transaction& transaction, const FailureCounters& counters);
// One of those that were counted went well: the account begins anew, the address is given back this one, for others may guess from it.
absl::Status SignInWentWell(Transaction& transaction, const FailureCounters& counters, Instant counted_at);
// It was not judged, or came to nothing by no fault of who tried: as if it had not been begun, unless the counter began anew since.
absl::Status GiveSignInBack(Transaction& transaction, const FailureCounters& counters, Instant counted_at);
// Some that are long over. In a transaction of its own: who holds rows of others while he waits for his own counters waits for ever.
absl::Status ForgetSignInFailures(Transaction& transaction);

}  // namespace sixpoint::storage
