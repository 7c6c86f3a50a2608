// Scans cut into blocks and encoded, ready for upload.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "metrology/frames/pose.h"
#include "sixpoint/ingest/v1/ingest.pb.h"

namespace sixpoint::clients {

// Points [first, first + count) of a scan.
struct BlockSpan {
  std::size_t first = 0;
  std::size_t count = 0;
  int profile_count = 0;
};

// Cuts at profile borders (where x changes), after `profiles_per_block` profiles or 65536 points; a block has at least
// 4096 points where there are more (clouds without profiles) and at most 131072, whatever the profiles are. Order and
// number are kept.
inline constexpr int kProfilesPerBlock = 64;
inline constexpr int kNoProfiles = std::numeric_limits<int>::max();  // of a snapshot: blocks by their points alone
inline constexpr std::size_t kSmallestBlockPointCount = 4096;
inline constexpr std::size_t kGreatestBlockPointCount = 131072;
std::vector<BlockSpan> SplitIntoBlocks(const metrology::Points& points_mm, int profiles_per_block = kProfilesPerBlock);

struct OutgoingBlock {
  std::int32_t point_count = 0;
  int profile_count = 0;
  std::string payload;
};

// A scan as it goes out: the same input gives the same bytes.
struct OutgoingScan {
  ingest::v1::ScanHeader header;
  std::vector<OutgoingBlock> blocks;
  std::int64_t point_count = 0;
  std::int64_t payload_bytes = 0;
  std::string sha256;  // ScanEnd.sha256
};

// In header.encoding: XYZ_F64, or DRACO (where it is UNSPECIFIED too) within header.error_bound_um (0: 0.25 um), then
// header.sender_error_um grows by what that cost, as proven by decoding. Sets encoding and point_count of the header.
// INVALID_ARGUMENT: no points, another encoding, and what EncodeBlock refuses.
absl::StatusOr<OutgoingScan> PrepareScan(ingest::v1::ScanHeader header, const metrology::Points& points_mm);

// One laser line as the sensor gives it.
struct RawProfile {
  struct Reading {
    int column = 0;
    std::int32_t y_steps = 0, z_steps = 0;  // of header.raw_step_um
  };
  double x_mm = 0;                // the encoder's reading
  std::vector<Reading> readings;  // by growing column
};
// Adds one profile to a block of ENCODING_RAW_PROFILES. INVALID_ARGUMENT: columns that do not grow or lie beyond
// columns_per_profile; then the block is as it was.
absl::Status AppendRawProfile(const RawProfile& profile, int columns_per_profile, OutgoingBlock* block);

// SHA-256 over the SHA-256 digests of payloads: ScanEnd.sha256 and Scan.sha256.
class PayloadsDigest {
 public:
  void Add(std::string_view payload);
  // Lower-case hexadecimal, of what was added so far.
  std::string ToHex() const;

 private:
  std::vector<std::string> digests_;
};

}  // namespace sixpoint::clients
