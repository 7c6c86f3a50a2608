// How the machines stand, beside SQL over the same summaries.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace sixpoint::bench {

// Of all machines: rows, ours_s, sql_s, over.
nlohmann::json AskFleet(const std::string& conninfo);

}  // namespace sixpoint::bench
