// A picture of points in three colours each.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

namespace sixpoint::report {

struct Picture {
  std::string name;
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> rgb;  // rows from above, three bytes a point
};

inline constexpr int kMostPixels = 4000;  // along a side

// INVALID_ARGUMENT: no points, more than kMostPixels along a side, or bytes that are not as many as the points'.
absl::Status Check(const Picture& picture);

// As PNG: the same points, the same bytes.
absl::StatusOr<std::string> ToPng(const Picture& picture);

}  // namespace sixpoint::report
