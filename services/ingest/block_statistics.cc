#include "services/ingest/block_statistics.h"

#include <algorithm>

namespace sixpoint::ingest {

BlockStatistics StatisticsOf(const metrology::Points& points_mm, double profile_pitch_mm, const ProfileCursor& begin) {
  BlockStatistics statistics;
  statistics.point_count = static_cast<std::int64_t>(points_mm.size());
  statistics.end = begin;
  Eigen::Vector3d minimum_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d maximum_mm = Eigen::Vector3d::Zero();
  bool any_finite = false;
  ProfileCursor& cursor = statistics.end;
  for (const Eigen::Vector3d& p : points_mm) {
    if (!p.allFinite()) {
      ++statistics.not_finite_count;
      continue;
    }
    minimum_mm = any_finite ? minimum_mm.cwiseMin(p) : p;
    maximum_mm = any_finite ? maximum_mm.cwiseMax(p) : p;
    any_finite = true;
    if (!(profile_pitch_mm > 0)) continue;
    const double ahead_mm = p.x() - cursor.profile_x_mm;
    if (cursor.column_count > 0 && ahead_mm < 0.5 * profile_pitch_mm) {
      ++cursor.column_count;
      if (statistics.begun_profile_count == 0) statistics.goes_on = 1;
      if (ahead_mm <= -0.5 * profile_pitch_mm) {
        statistics.greatest_backstep_mm = std::max(statistics.greatest_backstep_mm, -ahead_mm);
      }
    } else {
      cursor = {1, p.x()};
      ++statistics.begun_profile_count;
    }
    statistics.greatest_column_count = std::max(statistics.greatest_column_count, cursor.column_count);
  }
  for (int i = 0; i < 3; ++i) {
    statistics.minimum_mm[static_cast<std::size_t>(i)] = minimum_mm[i];
    statistics.maximum_mm[static_cast<std::size_t>(i)] = maximum_mm[i];
  }
  return statistics;
}

}  // namespace sixpoint::ingest
