// Where the other services listen.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "services/runtime/server.h"

namespace sixpoint::runtime {

// As --peer says, or else where a plant on one machine has it: plant, ingest, calibration or registration, which others call.
std::string PeerAddress(const ServerOptions& options, const std::string& area);
std::shared_ptr<grpc::Channel> ConnectToPeer(const ServerOptions& options, const std::string& area);

}  // namespace sixpoint::runtime
