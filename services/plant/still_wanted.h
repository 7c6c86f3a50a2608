// Whether a handler's client still waits for what it asked to be done.
#pragma once

#include <grpcpp/grpcpp.h>

#include "storage/one_write.h"

namespace sixpoint::plant {

// What is given once is not given to who is gone. Valid while the call lasts.
inline storage::StillWanted StillWantedBy(const grpc::ServerContext& context) {
  return [&context] { return !context.IsCancelled(); };
}

}  // namespace sixpoint::plant
