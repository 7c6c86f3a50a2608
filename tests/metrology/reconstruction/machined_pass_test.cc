// Machined surfaces with a known tool: one that gives way by a share of what it removes, and is too short besides.
#include "metrology/reconstruction/machined_pass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/metrology/reconstruction/blank_worlds.h"

namespace sixpoint::metrology {
namespace {

constexpr double kSpacing_mm = 0.4;

class MachinedPass : public ::testing::Test {
 protected:
  MachinedPass() {
    ShapeRegion edge, body;
    edge.name = "edge";
    edge.where.minimum_mm = Eigen::Vector3d(5, -100, -100);
    edge.lower_mm = -0.1;
    edge.upper_mm = 0.02;
    body.name = "body";
    body.rest = true;
    body.kind = RegionKind::kFixed;
    body.lower_mm = -0.05;
    body.upper_mm = 0.05;
    regions_ = {edge, body};
  }
  // Of the edge alone: what stood there, and what the tool left of it.
  std::vector<PassPatch> Cut(const std::function<double(const Eigen::Vector3d&)>& stock_mm, double share,
                             double offset_mm, double noise_mm = 0) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal(0, 1);
    std::vector<PassPatch> patches;
    for (const DesignPlace& place : design_.places) {
      PassPatch& patch = patches.emplace_back();
      patch.place_mm = place.point_mm;
      patch.normal = place.normal;
      patch.region = RegionAt(regions_, place.point_mm, place.normal);
      patch.standard_uncertainty_mm = 0.001;
      const double noise = noise_mm * normal(random);
      patch.rest_mm = noise;
      if (patch.region != 0) continue;
      // rest = offset + share * removed, removed = stock - rest
      const double stock = stock_mm(place.point_mm);
      const double rest = (offset_mm + share * stock) / (1 + share);
      patch.rest_mm = rest + noise;
      patch.removed_mm = stock - rest - noise;
    }
    return patches;
  }
  JudgedPass Judge(const std::vector<PassPatch>& patches) {
    return JudgePass(design_, regions_, patches, {3, 1.5 * kSpacing_mm, 0.9});
  }

  std::shared_ptr<const Surface> surface_ = testing::LensBlade({10, 2.5, 12}, 60);
  DesignPlaces design_ = *SampleDesign(surface_, kSpacing_mm, 2);
  std::vector<ShapeRegion> regions_;
};

double Waved(const Eigen::Vector3d& x) { return 0.4 + 0.2 * std::sin(0.5 * x.z()); }

TEST_F(MachinedPass, IsDoneWhereAllIsWithin) {
  const JudgedPass judged = Judge(Cut(Waved, 0, 0.005));
  EXPECT_EQ(judged.outcome, PassOutcome::kDone) << judged.remark;
  EXPECT_EQ(judged.remark, "");
  EXPECT_NEAR(*judged.regions[0].mean_rest_mm, 0.005, 1e-12);
  EXPECT_NEAR(*judged.regions[0].least_upper_spare_mm, 0.02 - 0.005 - 0.003, 1e-12);
  EXPECT_NEAR(*judged.regions[0].least_lower_spare_mm, 0.1 + 0.005 - 0.003, 1e-12);
  EXPECT_GT(judged.regions[0].seen_part, 0.99);
  EXPECT_FALSE(judged.regions[1].mean_rest_mm.has_value());
}

TEST_F(MachinedPass, LearnsHowTheToolGivesWayAndTheNextPassEndsOnTheShape) {
  const auto patches = Cut(Waved, 0.2, 0.008, 0.001);
  const JudgedPass judged = Judge(patches);
  ASSERT_EQ(judged.outcome, PassOutcome::kAnotherPass);
  EXPECT_EQ(judged.remark, "edge: material stands higher than it may, or may do so");
  EXPECT_NEAR(*judged.regions[0].deflection_share, 0.2, 0.01);
  EXPECT_NEAR(*judged.regions[0].offset_mm, 0.008, 0.003);
  const PassCompensation compensation(regions_, judged.regions, patches, 1.5);
  // Machined again by the same tool, commanded deeper: rest = offset - deeper + share * removed.
  double worst_mm = 0;
  for (const PassPatch& patch : patches) {
    const double deeper_mm = compensation.At(patch.place_mm, patch.normal, 0);
    if (patch.region != 0) {
      EXPECT_EQ(deeper_mm, 0);
      continue;
    }
    const double before_mm = (0.008 + 0.2 * Waved(patch.place_mm)) / 1.2;
    worst_mm = std::max(worst_mm, std::abs((0.008 - deeper_mm + 0.2 * before_mm) / 1.2));
  }
  EXPECT_LT(worst_mm, 0.004);
}

// Within its profile tolerance, and still not where the shape is.
TEST_F(MachinedPass, WhatStandsAboveTheShapeMayBeLimitedToo) {
  const auto patches = Cut(Waved, 0, 0.012);
  EXPECT_EQ(Judge(patches).outcome, PassOutcome::kDone);
  const JudgedPass judged = JudgePass(design_, regions_, patches, {3, 1.5 * kSpacing_mm, 0.9, 0.01});
  EXPECT_EQ(judged.outcome, PassOutcome::kAnotherPass);
  EXPECT_NEAR(*judged.regions[0].least_upper_spare_mm, 0.01 - 0.012 - 0.003, 1e-12);
}

TEST_F(MachinedPass, ACommandStaysWithinTheTolerance) {
  const auto patches = Cut(Waved, 0.2, 0.09);
  const PassCompensation compensation(regions_, Judge(patches).regions, patches, 1.5);
  for (const PassPatch& patch : patches)
    if (patch.region == 0) {
      EXPECT_LE(compensation.At(patch.place_mm, patch.normal, -0.08), 0.02 + 1e-12);
    }
}

TEST_F(MachinedPass, TooLowIsScrapAndMayBeTooLowIsNotDetermined) {
  EXPECT_EQ(Judge(Cut(Waved, 0, -0.104)).outcome, PassOutcome::kScrap);
  const JudgedPass doubt = Judge(Cut(Waved, 0, -0.099));
  EXPECT_EQ(doubt.outcome, PassOutcome::kNotDetermined);
  EXPECT_EQ(doubt.remark, "edge: within its uncertainty it is too low");
  // Too high where nothing is cut.
  auto patches = Cut(Waved, 0, 0);
  for (PassPatch& patch : patches)
    if (patch.region == 1) patch.rest_mm = 0.06;
  const JudgedPass high = Judge(patches);
  EXPECT_EQ(high.outcome, PassOutcome::kScrap);
  EXPECT_EQ(high.remark, "body: beyond its profile tolerance where no pass mends it");
}

TEST_F(MachinedPass, WhatWasNotSeenIsNotDone) {
  auto patches = Cut(Waved, 0, 0.005);
  patches.erase(std::remove_if(patches.begin(), patches.end(),
                               [](const PassPatch& patch) { return patch.region == 0 && patch.place_mm.z() > 4; }),
                patches.end());
  const JudgedPass judged = Judge(patches);
  EXPECT_EQ(judged.outcome, PassOutcome::kNotDetermined);
  EXPECT_EQ(judged.remark, "edge: too little of it was seen");
}

// Where as much was removed everywhere nobody can tell a short tool from one that gives way: the less deep command is taken.
TEST_F(MachinedPass, WhatIsTheSameEverywhereIsTakenForGivingWay) {
  const JudgedPass judged = Judge(Cut([](const Eigen::Vector3d&) { return 0.5; }, 0, 0.05));
  EXPECT_NEAR(*judged.regions[0].deflection_share, 0.05 / 0.45, 1e-9);
  EXPECT_NEAR(*judged.regions[0].offset_mm, 0, 1e-9);
}

}  // namespace
}  // namespace sixpoint::metrology
