// What a service says of itself, asked from outside.
#pragma once

#include <grpcpp/security/credentials.h>

#include <chrono>
#include <memory>
#include <string>

namespace sixpoint::cli {

// SERVING or NOT_SERVING as it answers; NOT_REACHED where nothing listens; SILENT where something listens and says nothing;
// NOT_TRUSTED where its certificate is not of the plant's authority, does not hold any more or names another host. By a connection
// of its own: one that stands may answer long after a service accepts no other. `credentials` may be nobody's
// (services/runtime/credentials.h).
std::string ServiceHealth(const std::string& address, const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                          std::chrono::milliseconds patience);

}  // namespace sixpoint::cli
