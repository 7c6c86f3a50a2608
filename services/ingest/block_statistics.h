// What ingest wants to know of a block before it believes it. Plain data: it crosses a process border.
#pragma once

#include <array>
#include <cstdint>

#include "metrology/frames/pose.h"

namespace sixpoint::ingest {

// Where a block ended, so that a profile may go on in the next one.
struct ProfileCursor {
  std::int64_t column_count = 0;  // points so far in the profile; 0 before the first point
  double profile_x_mm = 0;        // its first point's x
};

struct BlockStatistics {
  std::int64_t point_count = 0;
  std::int64_t not_finite_count = 0;
  // Profiles that begin in the block; one that goes on from the block before is not among them.
  std::int64_t begun_profile_count = 0;
  std::uint8_t goes_on = 0;  // 1: the first point belongs to the profile that the block before ended in
  // Over the finite points; sensor frame.
  std::array<double, 3> minimum_mm{};
  std::array<double, 3> maximum_mm{};
  // Most points in one profile, its part in the blocks before included.
  std::int64_t greatest_column_count = 0;
  // How far x ran back behind the profile it was in, at worst; 0 where it never did.
  double greatest_backstep_mm = 0;
  ProfileCursor end;
};

// Points within half a pitch of their profile's first x belong to that profile. Pitch 0: a snapshot, which has none.
BlockStatistics StatisticsOf(const metrology::Points& points_mm, double profile_pitch_mm, const ProfileCursor& begin);

}  // namespace sixpoint::ingest
