// One blade of `bench/run repair`, from its cloud to its path, and what that path removes of the true blade.
#pragma once

#include <nlohmann/json.hpp>

#include "bench/repair/judged_blade.h"

namespace sixpoint::bench {

// Adds plan_over_distance_passes, gouge_um and what else is measured of it.
void RunPlan(const DrawnBlade& drawn, std::size_t points, int thread_count, nlohmann::json* figures);

}  // namespace sixpoint::bench
