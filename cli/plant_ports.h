// That the ports a plant is to serve on are free, or its own already.
#pragma once

#include <absl/status/status.h>

#include <set>
#include <string>

namespace sixpoint::cli {

struct PortsWish {
  std::string option;  // by which they are others
  std::string host;
  int first = 0, count = 1;
  std::string wanted;  // in a refusal
};
// INVALID_ARGUMENT names the first of the ports that a program holds, unless it is one of `own`. Nothing is left listening.
absl::Status RequirePorts(const PortsWish& wish, const std::set<int>& own);

}  // namespace sixpoint::cli
