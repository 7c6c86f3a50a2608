// What Prometheus needs to watch a plant on this machine: where the services are seen, and by which certificate (docs/observing.md).
#pragma once

#include <string>

#include "cli/local_plant.h"

namespace sixpoint::cli {

// For Prometheus on this machine, run by whoever may read the local user's certificate.
std::string PrometheusConfig(const LocalPlant& plant);

}  // namespace sixpoint::cli
