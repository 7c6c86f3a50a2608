// Writes the blades of a plan through the storage layer, and then what becomes of some of them.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "seed/plan.h"
#include "seed/registry.h"

namespace sixpoint::seed {

// What is left of a blade that a withdrawal may come to.
struct ToRejudge {
  int index = 0;
  std::string inspection_id, verdict;
};

struct Written {
  std::int64_t results = 0;  // registrations, corrections and inspections
  std::int64_t scans = 0;
  std::vector<std::string> thick, twisted;  // serials of bad castings, in their order
  std::vector<ToRejudge> to_rejudge;
};

// Over one connection: whoever records waits for the journal's lock, and several wait for each other. on_blades is told how many
// are there.
absl::StatusOr<Written> WriteBlades(storage::Database* database, const Plan& plan, const Registry& registry,
                                    const std::function<void(int)>& on_blades);

struct Withdrawn {
  std::string calibration, machine;
};
struct Rejudged {
  std::string inspection, rejudges, was, now;
};
struct Aftermath {
  std::vector<Withdrawn> withdrawn;
  std::vector<Rejudged> rejudged;
};
// Withdraws what the plan says, and judges again by the newest calibrations. Its last commit waits for the disk: what came before is
// then there to stay, too.
absl::StatusOr<Aftermath> WriteAftermath(storage::Database* database, const Plan& plan, const Registry& registry,
                                         Written* written);

}  // namespace sixpoint::seed
