// Clouds as stock Draco point clouds: one attribute POSITION, float32 x 3, sensor frame, mm. What machines and files bring;
// what ingest encodes itself it keeps as range images (range_image.h).
//
// Order is kept (sequential method), so profile and column stay recoverable. Quantisation is chosen from a stated error
// bound and the real error is measured by decoding again. Any stock Draco decoder reads what EncodeBlock writes.
// The 1.5.5 decoder is not safe on untrusted bytes: 58 bytes can declare ten million points, and a mutated 8 KB file
// has cost 11 GB. So: InspectHeader before every decode, and untrusted blocks only in a process of limited memory and
// time. All functions are thread-safe.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// The bound that is used where none is stated.
inline constexpr double kDefaultErrorBoundMm = 0.25e-3;
// A block is some tens of profiles: what senders should cut a scan into.
inline constexpr int kUsualBlockPointCount = 65536;
// No line scanner has more.
inline constexpr int kGreatestColumnCount = 65536;

struct EncodedBlock {
  std::string bytes;
  // Greatest |decoded - given| over every coordinate of every point, as found by decoding `bytes`.
  double proven_error_mm = 0;
};

// INVALID_ARGUMENT: no points, a coordinate that is not finite, a bound that is not positive, or one that float32
// cannot hold at these coordinates (Draco quantises in float32: 0.25 um is held for |coordinate| up to 250 mm).
absl::StatusOr<EncodedBlock> EncodeBlock(const Points& points_mm, double error_bound_mm);

struct ReencodedBlock {
  Points points_mm;
  std::string bytes;
};
// The same points, to the last bit, in bytes that this encoder wrote: what processes that are not limited may decode instead of
// bytes from outside. Decodes both, so untrusted blocks only in a process of limited memory and time. As DecodeBlock refuses;
// RESOURCE_EXHAUSTED: the encoder found no memory.
absl::StatusOr<ReencodedBlock> ReencodeBlock(std::string_view bytes, std::int64_t expected_point_count);

struct DracoHeader {
  int minor_version = 0;
  std::int64_t point_count = 0;
};

// Reads the first 15 bytes only. INVALID_ARGUMENT unless they say: DRACO, version 2.0..2.3, a point cloud, the
// sequential method, no flags, and 1..limit points.
absl::StatusOr<DracoHeader> InspectHeader(std::string_view bytes, std::int64_t point_count_limit);

// Decodes either form in this process. INVALID_ARGUMENT for anything but a range image or one float32 x 3 POSITION of
// exactly that many finite points.
absl::StatusOr<Points> DecodeBlock(std::string_view bytes, std::int64_t expected_point_count);

double GreatestDifferenceMm(const Points& a, const Points& b);

}  // namespace sixpoint::metrology
