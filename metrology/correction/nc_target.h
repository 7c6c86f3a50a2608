// Where a program has to take a hole, or the tool along a path.
#pragma once

#include <absl/status/status.h>

#include <map>
#include <string>

namespace sixpoint::metrology {

// The hole's start in machine coordinates and the commands of the machine's two rotary axes: what the words of a marked block become.
struct NcTarget {
  double x_mm = 0, y_mm = 0, z_mm = 0;
  double a_deg = 0, b_deg = 0;
  // A pose of a tool path: whose, and which one, from 1. Its key is "path/number". Empty, 0: a hole.
  std::string path = {};
  int number = 0;
};

// How many poses each path has.
using NcPaths = std::map<std::string, int>;
NcPaths PathsOf(const std::map<std::string, NcTarget>& targets);
// INVALID_ARGUMENT unless each path is there whole: poses from 1 on, without a gap, each under its own key, and no
// hole's group has a path's name.
absl::Status CheckPaths(const std::map<std::string, NcTarget>& targets);

}  // namespace sixpoint::metrology
