// The same blocks through the tools that one would take without ingest.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace sixpoint::bench {

// Raw blocks as bytea, one transaction each, by that many connections.
nlohmann::json InsertBlocks(const std::string& conninfo, int connection_count, double seconds, int profiles_per_block,
                            bool compressible);

// A gRPC server that reads UploadScan streams, acknowledges every block and stores nothing. Serves until standard input
// ends; prints the address first.
int ServeSink(const std::string& address, const std::shared_ptr<grpc::ServerCredentials>& credentials);

}  // namespace sixpoint::bench
