// Points by cells: all that are near, wherever they lie, and no more memory than there are points.
#include "metrology/milling/point_cells.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

std::vector<std::size_t> Near(const PointCells& cells, const Vector3d& centre_mm, double reach_mm) {
  std::vector<std::size_t> near;
  cells.Near(centre_mm, reach_mm, [&](std::size_t i) { near.push_back(i); });
  return near;
}

TEST(PointCells, FindAllThatBruteForceFinds) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> place(0, 4);
  Points points;
  for (int i = 0; i < 3000; ++i) points.emplace_back(place(random), place(random), place(random));
  const PointCells cells(points, 0.75);
  for (const double reach_mm : {0.2, 0.75, 2.0, 50.0}) {  // within a cell, over some, and over all
    const Vector3d centre(place(random), place(random), place(random));
    const std::vector<std::size_t> near = Near(cells, centre, reach_mm);
    const std::set<std::size_t> found(near.begin(), near.end());
    EXPECT_EQ(found.size(), near.size());  // each once
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double off = (points[i] - centre).cwiseAbs().maxCoeff();
      if (off <= reach_mm) {
        EXPECT_EQ(found.count(i), 1u) << i;
      } else if (off > reach_mm + 0.75) {
        EXPECT_EQ(found.count(i), 0u) << i;
      }
    }
  }
}

TEST(PointCells, TakeNoMemoryForTheSpaceBetween) {
  // A table over this box would have more cells than there is memory: it would throw, or be killed.
  const double far = 1e12, huge = std::numeric_limits<double>::max();
  const Points points = {{0, 0, 0}, {far, -far, far}, {0.1, 0, 0}, {huge, huge, -huge}};
  const PointCells cells(points, 0.5);
  EXPECT_EQ(Near(cells, Vector3d::Zero(), 0.3), (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(Near(cells, points[1], 0.3), (std::vector<std::size_t>{1}));
  EXPECT_EQ(Near(cells, points[3], 0.3), (std::vector<std::size_t>{3}));
  EXPECT_EQ(Near(cells, Vector3d::Zero(), 2e12).size(), 3u);  // more cells than can be gone through
}

TEST(PointCells, LeaveOutWhatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  const PointCells cells({{nan, 0, 0}, {0, infinite, 0}, {0, 0, 0}}, 1);
  EXPECT_EQ(Near(cells, Vector3d::Zero(), 1e300), (std::vector<std::size_t>{2}));
  EXPECT_TRUE(Near(cells, {nan, 0, 0}, 1).empty());
  EXPECT_TRUE(Near(PointCells({}, 1), Vector3d::Zero(), 1).empty());
}

}  // namespace
}  // namespace sixpoint::metrology
