// That the ports a plant is to serve on are free, or its own already.
#pragma once

#include <absl/status/status.h>

#include <set>
#include <string>

namespace sixpoint::cli {

// INVALID_ARGUMENT names the first of a plant's ports from that one on which a program holds, unless it is one of `own`, and the
// option by which it is another. Nothing is left listening.
absl::Status RequirePorts(const std::string& option, const std::string& host, int first_port, const std::set<int>& own);

}  // namespace sixpoint::cli
