#include "metrology/nearest/near_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "metrology/nearest/candidates.h"
#include "metrology/nearest/nearest_triangle.h"

namespace sixpoint::metrology {
namespace {

constexpr std::uint32_t kTriangles = 200;
constexpr std::size_t kBlocks = NearLanes::kMost / NearLanes::kMultiple;

// 64 points and 200 triangles, some of them slivers.
struct Drawn {
  Points points, vertices;  // three of each triangle
};

Drawn Draw() {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto point = [&] { return Eigen::Vector3d(unit(random), unit(random), unit(random)); };
  Drawn drawn;
  for (std::size_t i = 0; i < NearLanes::kMost; ++i) drawn.points.push_back(point());
  for (std::uint32_t t = 0; t < kTriangles; ++t) {
    const Eigen::Vector3d a = point(), ab = 0.3 * point();
    Eigen::Vector3d ac = 0.3 * point();
    if (t % 5 == 0) ac = ab + 1e-4 * ac;
    drawn.vertices.insert(drawn.vertices.end(), {a, a + ab, a + ac});
  }
  return drawn;
}

struct Seen {
  std::unique_ptr<NearLanes> lanes = std::make_unique<NearLanes>();
  std::vector<LaneBlock> squared;
  double SquaredAt(std::uint32_t triangle, std::size_t point) const {
    return static_cast<double>(
        squared[triangle * kBlocks + point / NearLanes::kMultiple].at[point % NearLanes::kMultiple]);
  }
};

TriangleShape ShapeAt(const Drawn& drawn, std::uint32_t t) {
  const Eigen::Vector3d& a = drawn.vertices[3 * t];
  return ShapeOf(drawn.vertices[3 * t + 1] - a, drawn.vertices[3 * t + 2] - a);
}

Seen Measured(const Drawn& drawn, LaneWidth width) {
  Seen seen;
  for (std::size_t i = 0; i < NearLanes::kMost; ++i) {
    const Eigen::Vector3f p = drawn.points[i].cast<float>();
    seen.lanes->Set(i, p.x(), p.y(), p.z());
  }
  seen.squared.resize(kTriangles * kBlocks);
  for (std::uint32_t t = 0; t < kTriangles; ++t) {
    const Eigen::Vector3f a = drawn.vertices[3 * t].cast<float>();
    MeasureOf(width)(ShapeAt(drawn, t), a.x(), a.y(), a.z(), t, NearLanes::kMost, seen.lanes.get(),
                     &seen.squared[t * kBlocks]);
  }
  return seen;
}

// So that nothing is ruled out that is the nearest.
TEST(NearLanes, EveryWidthIsWithinItsTolerance) {
  const Drawn drawn = Draw();
  for (const LaneWidth width : LaneWidths()) {
    const Seen seen = Measured(drawn, width);
    for (std::uint32_t t = 0; t < kTriangles; ++t) {
      const float tolerance = ToleranceOf(ShapeAt(drawn, t), drawn.vertices[3 * t].cast<float>(), std::sqrt(3.f));
      for (std::size_t i = 0; i < NearLanes::kMost; ++i) {
        NearestTriangle exact;
        TakeNearer(drawn.vertices, {{3 * t, 3 * t + 1, 3 * t + 2}, t}, drawn.points[i], &exact);
        EXPECT_NEAR(std::sqrt(seen.SquaredAt(t, i)), std::sqrt(exact.distance_squared), static_cast<double>(tolerance))
            << static_cast<int>(width) << " floats, triangle " << t << ", point " << i;
      }
    }
  }
}

TEST(NearLanes, KeepTheLeastAndTheSecond) {
  const Seen seen = Measured(Draw(), LaneWidths().back());
  for (std::size_t i = 0; i < NearLanes::kMost; ++i) {
    float least = std::numeric_limits<float>::infinity(), second = least;
    for (std::size_t k = i / NearLanes::kMultiple; k < seen.squared.size(); k += 4) {
      const float here = seen.squared[k].at[i % NearLanes::kMultiple];
      second = std::min(second, std::max(least, here));
      least = std::min(least, here);
    }
    EXPECT_EQ(seen.lanes->least[i], least);
    EXPECT_EQ(seen.lanes->second[i], second);
    EXPECT_EQ(seen.squared[4 * seen.lanes->nearest[i] + i / NearLanes::kMultiple].at[i % NearLanes::kMultiple], least);
  }
}

TEST(NearLanes, TheWidestIsUsedUnlessAskedOtherwise) {
  EXPECT_EQ(UsedLaneWidth(), LaneWidths().back());
  UseLaneWidth(LaneWidth::kFour);
  EXPECT_EQ(UsedLaneWidth(), LaneWidth::kFour);
  UseLaneWidth(LaneWidths().back());
}

}  // namespace
}  // namespace sixpoint::metrology
