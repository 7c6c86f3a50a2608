// What a repair is asked for, checked and as the kernel takes it.
#pragma once

#include <absl/status/statusor.h>

#include "metrology/milling/repair_plan.h"
#include "services/runtime/call.h"
#include "sixpoint/correction/v1/repair.pb.h"
#include "storage/repairs.h"

namespace sixpoint::correction {

// INVALID_ARGUMENT with all that is wrong with it.
absl::StatusOr<storage::RepairMethodRow> RepairMethodOf(const v1::PlanRepairRequest& request);

// surface: the part's, which lives longer.
metrology::RepairOptions RepairOptionsOf(const storage::RepairMethodRow& method, const metrology::Surface& surface,
                                         int threads, const runtime::Caller& caller);

// What was asked for it: computed once more it gives the same.
v1::PlanRepairRequest RequestOf(const v1::Repair& recorded);

}  // namespace sixpoint::correction
