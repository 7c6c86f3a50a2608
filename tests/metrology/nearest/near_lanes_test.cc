#include "metrology/nearest/near_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <random>

#include "metrology/nearest/candidates.h"

namespace sixpoint::metrology {
namespace {

struct Seen {
  std::unique_ptr<NearLanes> lanes = std::make_unique<NearLanes>();
  std::vector<LaneBlock> squared;
};

// 64 points against 200 triangles, some of them slivers.
Seen Measured(LaneWidth width) {
  constexpr std::uint32_t kTriangles = 200;
  constexpr std::size_t kBlocks = NearLanes::kMost / NearLanes::kMultiple;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto point = [&] { return Eigen::Vector3d(unit(random), unit(random), unit(random)); };
  Seen seen;
  for (std::size_t i = 0; i < NearLanes::kMost; ++i) {
    const Eigen::Vector3f p = point().cast<float>();
    seen.lanes->x[i] = p.x(), seen.lanes->y[i] = p.y(), seen.lanes->z[i] = p.z();
    seen.lanes->least[i] = seen.lanes->second[i] = std::numeric_limits<float>::infinity();
    seen.lanes->nearest[i] = 0;
  }
  seen.squared.resize(kTriangles * kBlocks);
  for (std::uint32_t t = 0; t < kTriangles; ++t) {
    const Eigen::Vector3d a = point(), ab = 0.3 * point();
    Eigen::Vector3d ac = 0.3 * point();
    if (t % 5 == 0) ac = ab + 1e-4 * ac;
    MeasureOf(width)(ShapeOf(ab, ac), static_cast<float>(a.x()), static_cast<float>(a.y()), static_cast<float>(a.z()),
                     t, NearLanes::kMost, seen.lanes.get(), &seen.squared[t * kBlocks]);
  }
  return seen;
}

bool SameBits(const Seen& one, const Seen& other) {
  return std::memcmp(one.lanes.get(), other.lanes.get(), sizeof(NearLanes)) == 0 &&
         std::memcmp(one.squared.data(), other.squared.data(), one.squared.size() * sizeof(LaneBlock)) == 0;
}

TEST(NearLanes, EveryWidthGivesTheSameBits) {
  const Seen four = Measured(LaneWidth::kFour);
  for (const LaneWidth width : LaneWidths()) EXPECT_TRUE(SameBits(Measured(width), four)) << static_cast<int>(width);
}

TEST(NearLanes, KeepTheLeastAndTheSecond) {
  const Seen seen = Measured(LaneWidths().back());
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
