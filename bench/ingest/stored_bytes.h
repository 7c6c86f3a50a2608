// What a point costs when it is stored, ours beside what else one would do.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace sixpoint::bench {

// Cuts the scans into blocks of that many profiles, encodes each in every form on one core, and writes what general
// compressors may try themselves on into `folder`: raw.bin (int32 y, z of each point, as RAW_PROFILES has them) and
// xyz.bin (doubles).
nlohmann::json CompareStoredBytes(const std::vector<std::string>& scan_files, int profiles_per_block,
                                  double error_bound_um, const std::string& folder);

}  // namespace sixpoint::bench
