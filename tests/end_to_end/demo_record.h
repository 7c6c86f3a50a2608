// What must stand in the database after the simulator's demo, by its own report.
#pragma once

#include <nlohmann/json.hpp>

#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {

// Everything that the plant acknowledged to this machine is there, exactly once, naming inputs, method and software.
void ExpectRecorded(ThrowawayDatabase& database, const nlohmann::json& machine);

}  // namespace sixpoint::testing
