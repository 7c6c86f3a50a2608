// The work of ComputeBudget: why each start is as uncertain as it is, by first order and by draws. Pure.
#pragma once

#include <absl/status/statusor.h>

#include <functional>

#include "services/correction/inputs.h"
#include "sixpoint/correction/v1/correction.pb.h"

namespace sixpoint::correction {

// INVALID_ARGUMENT with "draws" where it is not what the contract takes. Of a path of the tool: at the pose where its tip is most
// uncertain. Statuses as CorrectBlade's.
absl::StatusOr<v1::Budget> BudgetOf(const Inputs& inputs, int draws, const std::function<bool()>& keep_going);

}  // namespace sixpoint::correction
