#include "services/ingest/block_statistics.h"

#include <gtest/gtest.h>

#include <limits>

namespace sixpoint::ingest {
namespace {

using metrology::Points;

TEST(StatisticsOf, CountsColumnsOfTheFullestProfile) {
  const Points points_mm = {{0, 0, 1}, {0, 1, 2}, {0.1, 0, -3}, {0.1, 1, 0}, {0.1, 2, 0}, {0.2, 7, 0}};
  const BlockStatistics statistics = StatisticsOf(points_mm, 0.1, {});
  EXPECT_EQ(statistics.point_count, 6);
  EXPECT_EQ(statistics.greatest_column_count, 3);
  EXPECT_EQ(statistics.greatest_backstep_mm, 0);
  EXPECT_EQ(statistics.minimum_mm, (std::array<double, 3>{0, 0, -3}));
  EXPECT_EQ(statistics.maximum_mm, (std::array<double, 3>{0.2, 7, 2}));
  EXPECT_EQ(statistics.end.column_count, 1);
  EXPECT_EQ(statistics.end.profile_x_mm, 0.2);
}

TEST(StatisticsOf, CarriesAProfileOverIntoTheNextBlock) {
  const BlockStatistics first = StatisticsOf({{0.3, 0, 0}, {0.3, 1, 0}}, 0.1, {});
  const BlockStatistics second = StatisticsOf({{0.3001, 2, 0}, {0.4, 0, 0}}, 0.1, first.end);
  EXPECT_EQ(second.greatest_column_count, 3);
  EXPECT_EQ(second.end.column_count, 1);
  EXPECT_FALSE(first.goes_on);
  EXPECT_EQ(first.begun_profile_count, 1);
  EXPECT_TRUE(second.goes_on);
  EXPECT_EQ(second.begun_profile_count, 1);
  EXPECT_FALSE(StatisticsOf({{0.5, 0, 0}}, 0.1, second.end).goes_on);
}

TEST(StatisticsOf, MeasuresHowFarXRunsBackwards) {
  const BlockStatistics first = StatisticsOf({{5, 0, 0}}, 0.1, {});
  EXPECT_NEAR(StatisticsOf({{4.75, 0, 0}}, 0.1, first.end).greatest_backstep_mm, 0.25, 1e-12);
  // Less than half a pitch is the encoder's and the quantiser's noise.
  EXPECT_EQ(StatisticsOf({{4.96, 0, 0}}, 0.1, first.end).greatest_backstep_mm, 0);
  // An endless slow creep backwards is no way round it.
  EXPECT_GT(StatisticsOf({{4.96, 0, 0}, {4.92, 0, 0}, {4.88, 0, 0}}, 0.1, first.end).greatest_backstep_mm, 0.1);
}

TEST(StatisticsOf, CountsNoProfilesOfASnapshot) {
  const BlockStatistics statistics = StatisticsOf({{5, 0, 1}, {-3, 1, 2}, {4, 2, -7}}, 0, {});
  EXPECT_EQ(statistics.minimum_mm, (std::array<double, 3>{-3, 0, -7}));
  EXPECT_EQ(statistics.begun_profile_count, 0);
  EXPECT_EQ(statistics.greatest_column_count, 0);
  EXPECT_EQ(statistics.greatest_backstep_mm, 0);
  EXPECT_EQ(statistics.end.column_count, 0);
}

TEST(StatisticsOf, CountsWhatIsNotFiniteAndLeavesItOut) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const BlockStatistics statistics = StatisticsOf({{nan, 0, 0}, {1, 2, 3}, {1, -infinity, 0}}, 0.1, {});
  EXPECT_EQ(statistics.not_finite_count, 2);
  EXPECT_EQ(statistics.minimum_mm, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(statistics.maximum_mm, (std::array<double, 3>{1, 2, 3}));
}

}  // namespace
}  // namespace sixpoint::ingest
