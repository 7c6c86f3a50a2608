// supervisord, as a local plant uses it: its configuration, and orders to it.
#pragma once

#include <string>
#include <vector>

#include "cli/local_plant.h"
#include "cli/subprocess.h"

namespace sixpoint::cli {

// PostgreSQL first, then the services; where root starts them, as the user.
std::string SupervisorConfig(const LocalPlant& plant, const std::string& user);
// As supervisorctl takes it: {"restart", "ingest"}.
Finished Supervisorctl(const LocalPlant& plant, std::vector<std::string> words);
bool SupervisorRuns(const LocalPlant& plant);

}  // namespace sixpoint::cli
