#include "metrology/inspection/hole_regions.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Every region in turn, as the header words it.
std::size_t OneByOne(const std::vector<HoleRegion>& regions, const Vector3d& point) {
  std::size_t nearest = regions.size();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < regions.size(); ++k) {
    const Vector3d from = point - regions[k].start_mm;
    const double height = from.dot(regions[k].axis);
    if (height < regions[k].lowest_mm || height > regions[k].highest_mm) continue;
    const double square = (from - height * regions[k].axis).squaredNorm();
    if (square >= regions[k].radius_mm * regions[k].radius_mm || square >= least) continue;
    nearest = k;
    least = square;
  }
  return nearest;
}

// Rows of holes as a blade has them, metres from the origin, their regions overlapping.
std::vector<HoleRegion> Rows(std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  std::vector<HoleRegion> regions;
  for (int row = 0; row < 4; ++row) {
    const Vector3d axis = Vector3d(normal(*random), normal(*random), normal(*random)).normalized();
    const Vector3d along = axis.unitOrthogonal();
    for (int hole = 0; hole < 12; ++hole)
      regions.push_back({Vector3d(6350, -20 * row, 330) + 0.9 * hole * along, axis, 0.7, -1, 25});
  }
  return regions;
}

TEST(HoleRegions, FindsWhatAskingAllOfThemFinds) {
  std::mt19937_64 random(1);
  const std::vector<HoleRegion> rows = Rows(&random);
  const HoleRegions regions(rows);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  int inside = 0;
  for (int i = 0; i < 400'000; ++i) {
    // About an axis, up to its borders and a little beyond; every tenth anywhere.
    const HoleRegion& region = rows[static_cast<std::size_t>(unit(random) * static_cast<double>(rows.size()))];
    const Vector3d off = Vector3d(normal(random), normal(random), normal(random)) * (i % 10 == 0 ? 30 : 0.5);
    const Vector3d point = region.start_mm + (28 * unit(random) - 2) * region.axis + off;
    const std::size_t found = regions.At(point);
    ASSERT_EQ(found, OneByOne(rows, point)) << point.transpose();
    inside += found < rows.size();
  }
  EXPECT_GT(inside, 100'000);
}

TEST(HoleRegions, HoldsItsBordersAsStated) {
  const HoleRegion region{Vector3d(10, 20, 30), Vector3d::UnitZ(), 1, -1, 25};
  const HoleRegions regions({region});
  EXPECT_EQ(regions.At({10, 20, 29}), 0u);  // the lowest
  EXPECT_EQ(regions.At({10, 20, 55}), 0u);  // the highest
  EXPECT_EQ(regions.At({11, 20, 30}), 1u);  // on the radius
  EXPECT_EQ(regions.At({10.99, 20, 30}), 0u);
  EXPECT_EQ(regions.At({10, 20, 28.99}), 1u);
  EXPECT_EQ(regions.At(Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())), 1u);
}

// Of two axes that are equally near the first; one within a region of any size.
TEST(HoleRegions, TakesTheNearestAndOfEqualsTheFirst) {
  const HoleRegions regions({{Vector3d(0, 0, 0), Vector3d::UnitZ(), 3, -1, 25},
                             {Vector3d(2, 0, 0), Vector3d::UnitZ(), 3, -1, 25},
                             {Vector3d(0, 0, 0), Vector3d::UnitZ(), 1e6, -1e6, 1e6}});
  EXPECT_EQ(regions.At({1, 0, 1}), 0u);
  EXPECT_EQ(regions.At({1.5, 0, 1}), 1u);
  EXPECT_EQ(regions.At({500, 0, 1}), 2u);
  EXPECT_EQ(HoleRegions({}).At({0, 0, 0}), 0u);
}

}  // namespace
}  // namespace sixpoint::metrology
