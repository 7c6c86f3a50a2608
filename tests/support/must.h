// What a test stands on, or the end of its program.
#pragma once

#include <absl/status/statusor.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

namespace sixpoint::testing {

template <typename Value>
Value Must(absl::StatusOr<Value> value) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "what a test stands on: %s\n", value.status().ToString().c_str());
  std::exit(1);
}
inline void Must(const absl::Status& status) {
  Must(status.ok() ? absl::StatusOr<int>(0) : absl::StatusOr<int>(status));
}

}  // namespace sixpoint::testing
