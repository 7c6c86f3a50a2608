// supervisord, as a local plant uses it: its configuration, and orders to it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "cli/local_plant.h"
#include "cli/subprocess.h"

namespace sixpoint::cli {

// The database alone is what a migration needs.
enum class Programs { kDatabase, kAll };
std::string SupervisorConfig(const LocalPlant& plant, Programs programs);
// As supervisorctl takes it: {"restart", "ingest"}. supervisord runs as the service user, and so does what orders it.
Finished Supervisorctl(const std::filesystem::path& config, std::vector<std::string> words);
bool SupervisorRuns(const LocalPlant& plant);
// By program: RUNNING, STARTING, BACKOFF, ... Empty where no supervisor answers.
std::map<std::string, std::string> ProgramStates(const LocalPlant& plant);

}  // namespace sixpoint::cli
