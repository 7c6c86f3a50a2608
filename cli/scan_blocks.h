// A scan cut into blocks for upload.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::cli {

// Points [first, first + count) of a scan.
struct BlockSpan {
  std::size_t first = 0;
  std::size_t count = 0;
};

// Cuts at profile borders (where x changes), after `profiles_per_block` profiles; a block has at least 4096 points where
// there are more (clouds without profiles) and at most 131072, whatever the profiles are. Order and number are kept.
std::vector<BlockSpan> SplitIntoBlocks(const metrology::Points& points_mm, int profiles_per_block = 64);

inline constexpr std::size_t kSmallestBlockPointCount = 4096;
inline constexpr std::size_t kGreatestBlockPointCount = 131072;

struct EncodedScan {
  struct Block {
    std::int32_t point_count = 0;
    std::string payload;
  };
  std::vector<Block> blocks;
  std::int64_t point_count = 0;
  // Greatest coordinate error that the encoding put in, as proven by decoding.
  double proven_error_um = 0;
  std::int64_t payload_bytes = 0;
};

// Draco blocks within the error bound; the same points give the same bytes.
absl::StatusOr<EncodedScan> EncodeScan(const metrology::Points& points_mm, double error_bound_um = 0.25);

}  // namespace sixpoint::cli
