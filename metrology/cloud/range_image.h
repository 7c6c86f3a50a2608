// A line scan kept as the range image that it is, in a stock Draco point cloud (docs/stored_clouds.md).
//
// A line scanner's point is told by its profile's encoder reading x, its column and its depth z; its y follows from the
// column's ray in the laser plane. So a block holds four integer attributes, each coded by its difference from the point
// before: x, column and z in steps, and by how many steps y differs from the ray. x, column and y cost next to nothing;
// z costs little more than its noise. The rays' fan is fitted to each block and goes with it, as the cloud's metadata.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string_view>
#include <vector>

#include "metrology/cloud/draco_codec.h"
#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// What the sensor's maker says. The rays leave (y, z) = (0, mid_range) of the sensor frame, in equal angles.
struct ScannerFan {
  int column_count = 0;
  double line_angle_rad = 0;
  double mid_range_mm = 0;
};

// The step that keeps a coordinate within the bound.
double StepFor(double error_bound_mm);
// The same for coordinates that are whole multiples of raw_step_mm: a multiple of it, so that they stay exact where one
// raw step is all that the bound allows.
double StepFor(double error_bound_mm, double raw_step_mm);

// `columns`: of each point; empty where the sender did not tell, then they are found from the fan. Whatever the points
// are, each coordinate is kept within half a step: points off their rays only cost bytes.
// INVALID_ARGUMENT: no points, not as many columns as points, a coordinate that is not finite or beyond 2^30 steps, a
// step that is not positive, a fan without columns or angle.
absl::StatusOr<EncodedBlock> EncodeRangeImage(const Points& points_mm, const std::vector<int>& columns,
                                              const ScannerFan& fan, double step_mm);

// Whether the header's first 11 bytes are those of a range image: a sequential Draco cloud with metadata.
bool IsRangeImage(std::string_view bytes);

// In this process, and without a guard against bombs (the count of points stands behind the metadata): only for blocks
// that were encoded by EncodeRangeImage and whose digest was checked. INVALID_ARGUMENT for anything else.
absl::StatusOr<Points> DecodeRangeImage(std::string_view bytes, std::int64_t expected_point_count);

}  // namespace sixpoint::metrology
