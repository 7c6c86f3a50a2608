// A read that is a transaction of its own: how the stores ask what needs no other read beside it.
#pragma once

#include <absl/status/statusor.h>

#include <utility>

#include "storage/database.h"

namespace sixpoint::storage {

// work(transaction) gives a StatusOr; it is given back once the connection is free again.
template <typename Work>
auto OneRead(Database& database, Deadline deadline, const Work& work) -> decltype(work(std::declval<Transaction&>())) {
  absl::StatusOr<Transaction> transaction = database.Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  return work(*transaction);
}

}  // namespace sixpoint::storage
