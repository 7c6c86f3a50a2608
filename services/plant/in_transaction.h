// A handler's work on the database in one transaction.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <utility>

#include "services/runtime/call.h"
#include "storage/database.h"

namespace sixpoint::plant {

// work(transaction) gives a StatusOr. Committed where it went well.
template <typename Work>
auto InTransaction(storage::Database* database, const grpc::ServerContext& context, const Work& work)
    -> decltype(work(std::declval<storage::Transaction&>())) {
  absl::StatusOr<storage::Transaction> transaction = database->Begin(runtime::DeadlineOf(context));
  if (!transaction.ok()) return transaction.status();
  auto done = work(*transaction);
  if (!done.ok()) return done;
  // What is given once is not given to who is gone.
  if (context.IsCancelled()) return absl::CancelledError("the client went away");
  if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
  return done;
}

}  // namespace sixpoint::plant
