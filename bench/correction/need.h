// What a bench cannot go on without.
#pragma once

#include <absl/status/statusor.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

namespace sixpoint::bench {

// Ends the program with 2 where there is no value.
template <typename Value>
Value Need(absl::StatusOr<Value> value, const char* what) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "%s: %s\n", what, value.status().ToString().c_str());
  std::exit(2);
}

}  // namespace sixpoint::bench
