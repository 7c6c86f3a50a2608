// A write that is a transaction of its own: how the stores change what keeps no answer for its request.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <utility>

#include "storage/database.h"

namespace sixpoint::storage {

// Asked last before a commit. No: whoever asked is gone, so nothing is done and the write is CANCELLED.
using StillWanted = std::function<bool()>;

// work(transaction) gives a Status or StatusOr. Committed where it went well and is still wanted.
template <typename Work>
auto OneWrite(Database& database, Deadline deadline, const StillWanted& still_wanted, const Work& work)
    -> decltype(work(std::declval<Transaction&>())) {
  absl::StatusOr<Transaction> transaction = database.Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  auto done = work(*transaction);
  if (!done.ok()) return done;
  if (!still_wanted()) return absl::CancelledError("the client went away");
  if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
  return done;
}

// The same of work that nobody waits for.
template <typename Work>
auto OneWrite(Database& database, Deadline deadline, const Work& work) -> decltype(work(std::declval<Transaction&>())) {
  return OneWrite(
      database, deadline, [] { return true; }, work);
}

}  // namespace sixpoint::storage
