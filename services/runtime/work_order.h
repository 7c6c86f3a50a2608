// What an MES calls the work that a blade is worked on for.
#pragma once

#include <absl/status/status.h>

#include <string>

namespace sixpoint::runtime {

// Both may be empty; an operation is one of a work order's.
absl::Status CheckWorkOrder(const std::string& work_order, const std::string& operation);

}  // namespace sixpoint::runtime
