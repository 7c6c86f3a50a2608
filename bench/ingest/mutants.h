// Uploads with something wrong in them: none may hurt the service.
#pragma once

#include <sys/types.h>

#include <nlohmann/json.hpp>
#include <string>

#include "bench/ingest/upload_stream.h"

namespace sixpoint::bench {

struct MutantOptions {
  Endpoint ingest;
  pid_t ingest_pid = 0;
  std::string encoding;
  int count = 500;
  std::uint64_t seed = 1;
};

// One after the other; after every 500, and at the end: the same process, health SERVING, a sound upload works.
nlohmann::json UploadMutants(const MutantOptions& options);

}  // namespace sixpoint::bench
