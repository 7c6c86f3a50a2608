// A handler's work on the database in one transaction.
#pragma once

#include <grpcpp/grpcpp.h>

#include <utility>

#include "services/plant/still_wanted.h"
#include "services/runtime/call.h"
#include "storage/one_write.h"

namespace sixpoint::plant {

// work(transaction) gives a StatusOr. Committed where it went well.
template <typename Work>
auto InTransaction(storage::Database* database, const grpc::ServerContext& context, const Work& work)
    -> decltype(work(std::declval<storage::Transaction&>())) {
  return storage::OneWrite(*database, runtime::DeadlineOf(context), StillWantedBy(context), work);
}

}  // namespace sixpoint::plant
