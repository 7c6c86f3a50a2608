// That the ports a plant is to serve on are free, or its own already.
#pragma once

#include <absl/status/status.h>

#include <set>
#include <string>

namespace sixpoint::cli {

// INVALID_ARGUMENT names the first of `count` ports from `base_port` on that a program holds, unless it is one of `own`. Nothing is
// left listening.
absl::Status RequirePorts(const std::string& host, int base_port, int count, const std::set<int>& own);

}  // namespace sixpoint::cli
