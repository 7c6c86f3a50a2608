// A part's points with how far each is off the CAD, as a stock Draco point cloud (docs/stored_clouds.md): the place, which only has to be found
// again, and the deviation, which was measured, each at its own precision.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

struct DeviationPoints {
  Points in_part_mm;
  std::vector<double> deviations_mm;  // of each, signed, positive outside
};

struct DeviationPrecision {
  double place_mm = 5e-3;         // greatest error of a coordinate, and
  double deviation_mm = 0.05e-3;  // of a deviation
};

struct EncodedDeviations {
  std::string bytes;
  // As found by decoding `bytes`.
  double proven_place_error_mm = 0, proven_deviation_error_mm = 0;
};

// Order is kept. Wherever the part stands in its CAD's coordinates: places are kept about an origin. INVALID_ARGUMENT: no points, not as many
// deviations, what is not finite, precisions that are not positive, or that 30 bits do not hold.
absl::StatusOr<EncodedDeviations> EncodeDeviations(const DeviationPoints& points, const DeviationPrecision& precision);

// In this process, and without a guard against bombs: only for bytes that EncodeDeviations wrote and whose digest was checked.
// INVALID_ARGUMENT for anything else.
absl::StatusOr<DeviationPoints> DecodeDeviations(std::string_view bytes, std::int64_t expected_point_count);

}  // namespace sixpoint::metrology
