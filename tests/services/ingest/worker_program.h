// The decode worker that was built with the tests.
#pragma once

#include <cstdlib>
#include <string>

namespace sixpoint::ingest {

inline std::string WorkerProgram() {
  const char* folder = std::getenv("SIXPOINT_BIN_DIR");
  return std::string(folder == nullptr ? "." : folder) + "/sixpoint-decode-worker";
}

}  // namespace sixpoint::ingest
