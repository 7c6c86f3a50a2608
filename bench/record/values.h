// Values of a characteristic over thousands of blades, and the search that leads to them, beside SQL written by hand.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace sixpoint::bench {

// Of one characteristic of all blades of a machine, as a stream: rows, ours_s, sql_s, over.
nlohmann::json AskValues(const std::string& conninfo, const std::string& machine);
// By each filter {filter, rows, page, first_s, deep_s, depth, sql_s, over, offset_s}: the first page, beside SQL of that page, and one deep down.
nlohmann::json AskSearch(const std::string& conninfo, const std::string& machine);

}  // namespace sixpoint::bench
