// The target and the path of a registered blade's repair, by kernels alone: scans in, a plan out.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>

#include "metrology/milling/repair_plan.h"
#include "services/clients/registered_blade.h"
#include "services/runtime/call.h"
#include "storage/repairs.h"

namespace sixpoint::correction {

struct RepairCounts {
  std::int64_t below_line = 0, above_line = 0;
  std::int64_t left_out = 0;  // farther from the CAD than asked, or beyond the heights
};

struct PlannedRepair {
  metrology::RepairPlan plan;
  RepairCounts counts;
};

// INVALID_ARGUMENT under the request's names, or that pins stand in the blade; RESOURCE_EXHAUSTED: more points than are taken.
absl::StatusOr<PlannedRepair> PlanRepairOf(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                                           const storage::RepairMethodRow& method, int threads,
                                           const runtime::Caller& caller);

}  // namespace sixpoint::correction
