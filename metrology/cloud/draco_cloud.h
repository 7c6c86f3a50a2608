// Between Draco's own types and bytes. Private to metrology/cloud.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace draco {
class PointCloud;
}

namespace sixpoint::metrology {

// Sequential: the order of points is kept. `quantise` sets up the encoder's attributes where they are floats.
struct DracoQuantiser {
  int bits = 0;  // 0: integers, kept as they are
  const float* origin = nullptr;
  float range = 0;
};
absl::StatusOr<std::string> EncodeCloud(const draco::PointCloud& cloud, const DracoQuantiser& quantiser);

// Of an integer attribute: differences of two still fit 32 bits.
inline constexpr double kGreatestSteps = 1 << 30;
// Half a step is the bound; less the last bit, so that rounding cannot exceed it.
inline constexpr double kJustBelow = 1 - 1e-9;
// An attribute of one integer a point, told apart by its metadata `name`.
void AddIntegers(const std::string& name, const std::vector<std::int32_t>& values, draco::PointCloud* cloud);

// How a cloud's POSITION was quantised by whoever encoded it; bits 0: it was not.
struct DracoQuantisation {
  int bits = 0;
  std::array<float, 3> origin{};
  float range = 0;
};
absl::StatusOr<DracoQuantisation> QuantisationOf(std::string_view bytes);

// INVALID_ARGUMENT unless the bytes decode to that many points. May throw what the decoder throws.
absl::StatusOr<std::unique_ptr<draco::PointCloud>> DecodeCloud(std::string_view bytes, std::int64_t point_count);

}  // namespace sixpoint::metrology
