// Clients that upload and resume while others kill the services; afterwards, whether everything acknowledged is there.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "bench/ingest/upload_stream.h"

namespace sixpoint::bench {

struct FaultOptions {
  Endpoint ingest;
  std::string conninfo;
  int client_count = 8;
  std::uint64_t seed = 1;
  std::string acks_file;  // JSON: [[sent, acknowledged], ...] by the monotonic clock, s
};

// Uploads until standard input ends, then checks record and database against what was acknowledged.
nlohmann::json UploadThroughFaults(const FaultOptions& options);

}  // namespace sixpoint::bench
