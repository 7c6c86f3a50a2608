#include "services/clients/scan_blocks.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "metrology/cloud/draco_codec.h"
#include "services/runtime/errors.h"
#include "storage/blobs.h"

namespace sixpoint::clients {
namespace {

using ingest::v1::ScanHeader;

std::string LittleEndianDoubles(const Eigen::Vector3d* points_mm, std::size_t count) {
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
  std::string bytes(count * sizeof(Eigen::Vector3d), '\0');
  std::memcpy(bytes.data(), points_mm, bytes.size());  // every platform of ours is little-endian
  return bytes;
}

template <typename Number>
void Append(Number number, std::string* bytes) {
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof number);
  bytes->append(raw, sizeof raw);
}

absl::Status EncodeSpan(const metrology::Points& points_mm, const BlockSpan& span, const ScanHeader& header,
                        OutgoingBlock* block, double* proven_error_um) {
  block->point_count = static_cast<std::int32_t>(span.count);
  block->profile_count = span.profile_count;
  if (header.encoding() == ingest::v1::ENCODING_XYZ_F64) {
    block->payload = LittleEndianDoubles(points_mm.data() + span.first, span.count);
    return absl::OkStatus();
  }
  const double bound_mm =
      header.error_bound_um() > 0 ? header.error_bound_um() * 1e-3 : metrology::kDefaultErrorBoundMm;
  const auto first = points_mm.begin() + static_cast<std::ptrdiff_t>(span.first);
  auto encoded =
      metrology::EncodeBlock(metrology::Points(first, first + static_cast<std::ptrdiff_t>(span.count)), bound_mm);
  if (!encoded.ok()) return encoded.status();
  block->payload = std::move(encoded->bytes);
  *proven_error_um = std::max(*proven_error_um, 1e3 * encoded->proven_error_mm);
  return absl::OkStatus();
}

}  // namespace

std::vector<BlockSpan> SplitIntoBlocks(const metrology::Points& points_mm, int profiles_per_block) {
  constexpr auto kUsualPointCount = static_cast<std::size_t>(metrology::kUsualBlockPointCount);
  std::vector<BlockSpan> spans;
  BlockSpan span;
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    const bool new_profile = i == 0 || points_mm[i].x() != points_mm[i - 1].x();
    const bool full = new_profile && (span.count >= kUsualPointCount || (span.profile_count >= profiles_per_block &&
                                                                         span.count >= kSmallestBlockPointCount));
    if (full || span.count == kGreatestBlockPointCount) {
      spans.push_back(span);
      span = {i, 0, 0};
    }
    if (new_profile || span.count == 0) ++span.profile_count;
    ++span.count;
  }
  if (span.count > 0) spans.push_back(span);
  return spans;
}

absl::StatusOr<OutgoingScan> PrepareScan(ScanHeader header, const metrology::Points& points_mm) {
  if (header.encoding() == ingest::v1::ENCODING_UNSPECIFIED) header.set_encoding(ingest::v1::ENCODING_DRACO);
  if (header.encoding() != ingest::v1::ENCODING_DRACO && header.encoding() != ingest::v1::ENCODING_XYZ_F64) {
    return runtime::Refuse("header.encoding", Encoding_Name(header.encoding()), "DRACO or XYZ_F64 for points");
  }
  if (points_mm.empty()) return runtime::Refuse("scan", "0 points", "at least 1");
  OutgoingScan scan;
  scan.point_count = static_cast<std::int64_t>(points_mm.size());
  double proven_error_um = 0;
  PayloadsDigest digest;
  const bool is_snapshot = header.cloud() == ingest::v1::CLOUD_KIND_SNAPSHOT;
  for (const BlockSpan& span : SplitIntoBlocks(points_mm, is_snapshot ? kNoProfiles : kProfilesPerBlock)) {
    OutgoingBlock block;
    const absl::Status encoded = EncodeSpan(points_mm, span, header, &block, &proven_error_um);
    if (!encoded.ok()) return encoded;
    digest.Add(block.payload);
    scan.payload_bytes += static_cast<std::int64_t>(block.payload.size());
    scan.blocks.push_back(std::move(block));
  }
  header.set_point_count(scan.point_count);
  header.set_sender_error_um(header.sender_error_um() + proven_error_um);
  scan.header = std::move(header);
  scan.sha256 = digest.ToHex();
  return scan;
}

absl::Status AppendRawProfile(const RawProfile& profile, int columns_per_profile, OutgoingBlock* block) {
  int previous = -1;
  for (const RawProfile::Reading& reading : profile.readings) {
    if (reading.column <= previous || reading.column >= columns_per_profile) {
      return runtime::Refuse("profile.column", std::to_string(reading.column),
                             "more than " + std::to_string(previous) + " and less than columns_per_profile, " +
                                 std::to_string(columns_per_profile));
    }
    previous = reading.column;
  }
  std::string mask(static_cast<std::size_t>((columns_per_profile + 7) / 8), '\0');
  for (const RawProfile::Reading& reading : profile.readings) {
    char& byte = mask[static_cast<std::size_t>(reading.column / 8)];
    byte = static_cast<char>(static_cast<unsigned char>(byte) | 1u << reading.column % 8);
  }
  Append(profile.x_mm, &block->payload);
  block->payload += mask;
  for (const RawProfile::Reading& reading : profile.readings) {
    Append(reading.y_steps, &block->payload);
    Append(reading.z_steps, &block->payload);
  }
  block->point_count += static_cast<std::int32_t>(profile.readings.size());
  ++block->profile_count;
  return absl::OkStatus();
}

void PayloadsDigest::Add(std::string_view payload) { digests_.push_back(storage::Sha256Hex(payload)); }

std::string PayloadsDigest::ToHex() const { return storage::Sha256OfDigests(digests_); }

}  // namespace sixpoint::clients
