#include "cli/scan_blocks.h"

#include <algorithm>

#include "metrology/cloud/draco_codec.h"

namespace sixpoint::cli {

std::vector<BlockSpan> SplitIntoBlocks(const metrology::Points& points_mm, int profiles_per_block) {
  std::vector<BlockSpan> spans;
  BlockSpan span;
  int profile_count = 0;
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const bool new_profile = i == 0 || points_mm[i].x() != points_mm[i - 1].x();
    if (new_profile) ++profile_count;
    const bool full = new_profile && profile_count > profiles_per_block && span.count >= kSmallestBlockPointCount;
    if (full || span.count == kGreatestBlockPointCount) {
      spans.push_back(span);
      span = {i, 0};
      profile_count = 1;
    }
    ++span.count;
  }
  if (span.count > 0) spans.push_back(span);
  return spans;
}

absl::StatusOr<EncodedScan> EncodeScan(const metrology::Points& points_mm, double error_bound_um) {
  EncodedScan scan;
  scan.point_count = static_cast<std::int64_t>(points_mm.size());
  for (const BlockSpan& span : SplitIntoBlocks(points_mm)) {
    const auto first = points_mm.begin() + static_cast<std::ptrdiff_t>(span.first);
    const metrology::Points block(first, first + static_cast<std::ptrdiff_t>(span.count));
    absl::StatusOr<metrology::EncodedBlock> encoded = metrology::EncodeBlock(block, error_bound_um * 1e-3);
    if (!encoded.ok()) return encoded.status();
    scan.proven_error_um = std::max(scan.proven_error_um, encoded->proven_error_mm * 1e3);
    scan.payload_bytes += static_cast<std::int64_t>(encoded->bytes.size());
    scan.blocks.push_back({static_cast<std::int32_t>(span.count), std::move(encoded->bytes)});
  }
  if (scan.blocks.empty()) return absl::InvalidArgumentError("scan: 0 points, want at least 1");
  return scan;
}

}  // namespace sixpoint::cli
