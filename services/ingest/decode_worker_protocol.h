// Between ingest and sixpoint-decode-worker, over one socket, one request at a time. Both ends are of the same build.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "services/ingest/block_statistics.h"

namespace sixpoint::ingest {

inline constexpr std::uint32_t kDecodeMagic = 0x53495831;  // "SIX1"
inline constexpr std::uint32_t kGreatestPayloadBytes = 8U << 20;

// Followed by payload_bytes bytes.
struct DecodeRequest {
  std::uint32_t magic = kDecodeMagic;
  std::uint32_t payload_bytes = 0;
  std::int64_t point_count = 0;
  double profile_pitch_mm = 0;  // 0: a snapshot
  ProfileCursor begin;
};

// Followed by reencoded_bytes bytes: the same points as our own encoder writes them; none where it writes the payload again.
struct DecodeReply {
  std::uint32_t magic = kDecodeMagic;
  std::uint32_t decoded = 0;  // 1: statistics hold; 0: message says what is wrong
  std::uint32_t reencoded_bytes = 0;
  BlockStatistics statistics;
  std::array<char, 256> message{};  // ends with a NUL
};

static_assert(std::is_trivially_copyable_v<DecodeRequest> && std::is_trivially_copyable_v<DecodeReply>);

}  // namespace sixpoint::ingest
