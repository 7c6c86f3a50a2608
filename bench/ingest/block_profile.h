// Where the time of one block goes, step by step as services/ingest/upload.cc takes them, in one thread.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace sixpoint::bench {

nlohmann::json ProfileBlocks(const std::string& conninfo, int profiles_per_block, int block_count);

}  // namespace sixpoint::bench
