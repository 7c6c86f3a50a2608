// A whole plant's history, made up and written through the storage layer, for benches and pages.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "seed/plan.h"

namespace sixpoint::seed {

struct Request {
  Options options;
  bool into_used_plant = false;
};

// What was planted, by its names. FAILED_PRECONDITION where the plant holds anything that was not seeded, unless told, and where this
// seed was sown in it already. on_blades is told how many are there.
absl::StatusOr<nlohmann::json> SeedPlant(const std::string& conninfo, const Request& request,
                                         const std::function<void(int)>& on_blades);

}  // namespace sixpoint::seed
