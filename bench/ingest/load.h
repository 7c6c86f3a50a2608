// Machines that stream raw profiles at line rate, or as fast as ingest takes them.
#pragma once

#include <nlohmann/json.hpp>

#include "bench/ingest/upload_stream.h"

namespace sixpoint::bench {

struct LoadOptions {
  Endpoint ingest;
  int machine_count = 8;
  double seconds = 15;
  double profiles_per_s = 300;  // of one machine; 0: as fast as ingest takes them
  int profiles_per_block = 48;
  int blocks_per_scan = 25;
  int column_count = 1280;
  std::uint64_t seed = 1;
};

// An acknowledgement's time counts from when the block was due (its last profile measured), not from when it could be
// sent: a machine that falls behind shows here.
nlohmann::json StreamScans(const LoadOptions& options);

// Scans of one block of 4 profiles x 100 columns, by four machines.
// Whole request streams of such scans, as gRPC frames their messages, one a file: for a generator that only sends bytes.
nlohmann::json WriteUploadBodies(const std::string& folder, int count, const std::string& scan_id);
nlohmann::json StreamSmallScans(const Endpoint& ingest, int scan_count, std::uint64_t seed);

}  // namespace sixpoint::bench
