#pragma once

#include <absl/status/status.h>

#include <string>

namespace sixpoint::correction {

// What the kernel says of a hole's pose that cannot be taken, as a reason of the contract; anything else stays what it is.
absl::Status PoseFailure(const absl::Status& status, const std::string& registration, const std::string& group);

}  // namespace sixpoint::correction
