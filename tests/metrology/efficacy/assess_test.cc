#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "metrology/efficacy/efficacy.h"
#include "metrology/frames/angles.h"
#include "tests/metrology/efficacy/simulated_cuts.h"

namespace sixpoint::metrology {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const OffsetEstimate& Of(const Efficacy& efficacy, OffsetComponent component) {
  for (const OffsetEstimate& offset : efficacy.offsets)
    if (offset.component == component) return offset;
  ADD_FAILURE() << "no such component";
  return efficacy.offsets.front();
}

Efficacy Assess(const std::vector<BladeOutcome>& blades, const EfficacyOptions& options = {}) {
  const auto efficacy = AssessEfficacy(blades, {}, options);
  EXPECT_TRUE(efficacy.ok()) << efficacy.status();
  return efficacy.ok() ? *efficacy : Efficacy{};
}

CutWorld Still() {
  CutWorld world;
  world.blade_mm = world.hole_mm = world.blade_rad = world.hole_rad = 0;
  return world;
}

// Without noise the planted offset comes out to the last nanometre but one, whatever A and B the holes were drilled at.
TEST(Efficacy, FindsAPlantedOffsetOfTurnedHoles) {
  CutWorld world = Still();
  world.offset_mm = {0.031, -0.017, 0.5};
  const Efficacy efficacy = Assess(Cut(world, 1));
  EXPECT_NEAR(Of(efficacy, OffsetComponent::kX).value, 0.031, 2e-9);
  EXPECT_NEAR(Of(efficacy, OffsetComponent::kY).value, -0.017, 2e-9);
  // Every hole is drilled along Z: half a millimetre of it does not show, and is not said to be 0.
  EXPECT_THAT(efficacy.not_determined, ElementsAre(OffsetComponent::kZ));
  EXPECT_TRUE(Of(efficacy, OffsetComponent::kX).offered);
  EXPECT_TRUE(Of(efficacy, OffsetComponent::kY).offered);
  EXPECT_FALSE(efficacy.angles_used);
  EXPECT_THAT(efficacy.reasons, IsEmpty());
}

// Zeros of the axes beside it: 0.02 deg at some 60 mm are 20 um that depend on the hole. Second order of 0.02 deg: 60 mm e^2 / 2 = 4 nm.
TEST(Efficacy, TellsRotaryZerosFromAnOffset) {
  CutWorld world = Still();
  world.offset_mm = {0.010, 0.020, 0};
  world.a_zero_rad = 0.02 * kRadPerDeg;
  world.b_zero_rad = -0.01 * kRadPerDeg;
  const Efficacy efficacy = Assess(Cut(world, 2));
  EXPECT_TRUE(efficacy.angles_used);
  ASSERT_TRUE(efficacy.condition_number);
  EXPECT_NEAR(Of(efficacy, OffsetComponent::kA).value, 0.02 * kRadPerDeg, 2e-7);
  EXPECT_NEAR(Of(efficacy, OffsetComponent::kB).value, -0.01 * kRadPerDeg, 2e-7);
  EXPECT_NEAR(Of(efficacy, OffsetComponent::kX).value, 0.010, 2e-5);
  EXPECT_NEAR(Of(efficacy, OffsetComponent::kY).value, 0.020, 2e-5);
}

// With A = 90 deg the axis B stands along the tool: turning about it turns no hole.
TEST(Efficacy, AnAxisThatTurnsNoHoleIsNotDetermined) {
  std::vector<BladeOutcome> blades = Cut(Still(), 3);
  for (BladeOutcome& blade : blades)
    for (HoleOutcome& hole : blade.holes) {
      hole.a_rad = 90 * kRadPerDeg;
      const Eigen::Matrix3d machine_from_part =
          RotaryAxes().MachineFromZero(hole.a_rad, hole.b_rad).linear() * hole.zero_from_part.linear();
      hole.predicted_axis = hole.found_axis = machine_from_part.transpose() * Eigen::Vector3d::UnitZ();
    }
  EXPECT_THAT(Assess(blades).not_determined, ElementsAre(OffsetComponent::kZ, OffsetComponent::kB));
}

// Another CAD frame is another description of the same holes.
TEST(Efficacy, AnotherPartFrameChangesNothing) {
  CutWorld world;
  world.harsh = true;
  world.offset_mm = {0.02, 0.01, 0};
  const Efficacy before = Assess(Cut(world, 4));
  world.part_from_other =
      Eigen::Translation3d(900, -300, 40) * Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized());
  const Efficacy after = Assess(Cut(world, 4));
  ASSERT_EQ(before.offsets.size(), after.offsets.size());
  for (std::size_t i = 0; i < before.offsets.size(); ++i) {
    EXPECT_NEAR(before.offsets[i].value, after.offsets[i].value, 1e-10);
    EXPECT_NEAR(*before.offsets[i].expanded_uncertainty, *after.offsets[i].expanded_uncertainty, 1e-10);
  }
  for (std::size_t i = 0; i < before.holes.size(); ++i)
    EXPECT_NEAR((before.holes[i].mean_in_machine_mm - after.holes[i].mean_in_machine_mm).norm(), 0, 1e-10);
}

// One hole of sixteen lies 25 um off on every blade: it is named, with how much, and no other.
TEST(Efficacy, NamesTheHoleThatIsOffOnEveryBlade) {
  const RotaryAxes axes;
  std::vector<BladeOutcome> blades = Cut({}, 5);
  for (BladeOutcome& blade : blades)
    for (HoleOutcome& hole : blade.holes)
      if (hole.hole == "G2/H3")
        hole.found_start_mm +=
            hole.zero_from_part.linear().transpose() *
            (axes.MachineFromZero(hole.a_rad, hole.b_rad).linear().transpose() * Eigen::Vector3d(0.025, 0, 0));
  const Efficacy efficacy = Assess(blades);
  ASSERT_EQ(efficacy.holes.size(), 16u);
  for (const HoleBias& hole : efficacy.holes) {
    EXPECT_EQ(hole.significant, hole.hole == "G2/H3") << hole.hole << " " << *hole.adjusted_p;
    if (hole.hole != "G2/H3") continue;
    EXPECT_EQ(hole.blade_count, 12);
    // Noise of 6 um and its median, over twelve blades: standard uncertainty some 2 um.
    EXPECT_NEAR(hole.own_in_machine_mm->x(), 0.025, 0.007);
    EXPECT_NEAR(hole.own_in_machine_mm->y(), 0, 0.007);
    EXPECT_GT(*hole.own_expanded_uncertainty_mm, 0);
  }
}

TEST(Efficacy, TooFewBladesOfferNothing) {
  CutWorld world;
  world.offset_mm = {0.1, 0.1, 0};
  for (const int count : {1, 2, 4}) {
    world.blade_count = count;
    const Efficacy efficacy = Assess(Cut(world, 6));
    EXPECT_THAT(efficacy.reasons, Contains(NotOffered::kTooFewBlades)) << count;
    EXPECT_NEAR(Of(efficacy, OffsetComponent::kX).value, 0.1, 0.05);  // and is told all the same
    EXPECT_EQ(Of(efficacy, OffsetComponent::kX).expanded_uncertainty.has_value(), count > 1);
    EXPECT_FALSE(Of(efficacy, OffsetComponent::kX).offered);
  }
}

// What the inspections share does not average out: 20 um of it leave nothing of an offset of 15.
TEST(Efficacy, WhatAllInspectionsShareStaysInTheUncertainty) {
  CutWorld world = Still();
  world.offset_mm = {0.015, 0, 0};
  std::vector<BladeOutcome> blades = Cut(world, 7);
  for (BladeOutcome& blade : blades)
    for (HoleOutcome& hole : blade.holes) {
      hole.position_standard_uncertainty_mm = 0.020 * std::sqrt(2.0);
      hole.shared_part = 1;
    }
  const Efficacy efficacy = Assess(blades);
  EXPECT_NEAR(Of(efficacy, OffsetComponent::kX).standard_uncertainty, 0.020, 1e-9);
  EXPECT_NEAR(*Of(efficacy, OffsetComponent::kX).expanded_uncertainty, 1.96 * 0.020, 1e-4);
  EXPECT_THAT(efficacy.reasons, ElementsAre(NotOffered::kWithinUncertainty));
}

TEST(Efficacy, WhatMovesIsNotOfferedAsAConstant) {
  CutWorld world;
  world.offset_mm = {0.05, 0, 0};
  world.drift_mm_a_day = 0.008;
  const Efficacy efficacy = Assess(Cut(world, 8));
  EXPECT_THAT(efficacy.reasons, Contains(NotOffered::kDrifts));
  ASSERT_EQ(efficacy.trends.size(), 2u);
  EXPECT_TRUE(efficacy.trends[0].significant);
  EXPECT_NEAR(efficacy.trends[0].slope.slope, 0.008, 0.004);
  EXPECT_FALSE(efficacy.trends[1].significant);
}

TEST(Efficacy, ANewestBladeThatDoesNotFitIsTold) {
  std::vector<BladeOutcome> blades = Cut({}, 9);
  EXPECT_FALSE(Assess(blades).newest_off);
  for (HoleOutcome& hole : blades.back().holes)
    hole.found_start_mm +=
        hole.zero_from_part.linear().transpose() *
        (RotaryAxes().MachineFromZero(hole.a_rad, hole.b_rad).linear().transpose() * Eigen::Vector3d(0.08, 0, 0));
  const Efficacy efficacy = Assess(blades);
  EXPECT_TRUE(efficacy.newest_off);
  EXPECT_THAT(efficacy.reasons, Contains(NotOffered::kNewestBladeOff));
}

// 0.1 mm between blades and 0.02 within, of 60 blades: 9 % and 2.4 % standard error.
TEST(Efficacy, TellsSpreadWithinFromBetween) {
  CutWorld world;
  world.blade_count = 60;
  world.blade_mm = 0.1;
  world.hole_mm = 0.02;
  const Efficacy efficacy = Assess(Cut(world, 10));
  ASSERT_EQ(efficacy.spreads.size(), 2u);
  for (const ComponentSpread& spread : efficacy.spreads) {
    EXPECT_NEAR(std::sqrt(*spread.variance.between_variance), 0.1, 0.03);
    EXPECT_NEAR(std::sqrt(*spread.variance.within_variance), 0.02, 0.0015);
    EXPECT_EQ(spread.variance.between_freedom, 59);
  }
}

TEST(Efficacy, RefusesByFieldValueAndWanted) {
  const auto refusal = [](const std::function<void(std::vector<BladeOutcome>*)>& spoil) {
    std::vector<BladeOutcome> blades = Cut({}, 11);
    spoil(&blades);
    const auto efficacy = AssessEfficacy(blades, {});
    EXPECT_EQ(efficacy.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(efficacy.status().message());
  };
  using Blades = std::vector<BladeOutcome>*;
  EXPECT_THAT(refusal([](Blades b) { b->clear(); }), HasSubstr("blades: 0 of them, want 1 to 1000"));
  EXPECT_THAT(refusal([](Blades b) { (*b)[1].blade = "SN-1"; }), HasSubstr("blades[1].blade: SN-1, want a name"));
  EXPECT_THAT(refusal([](Blades b) { (*b)[2].holes.clear(); }), HasSubstr("blades[2].holes: none"));
  EXPECT_THAT(refusal([](Blades b) { (*b)[2].time_days = 0; }), HasSubstr("blades[2].time_days: 0, want in order"));
  EXPECT_THAT(refusal([](Blades b) { (*b)[0].holes[1].hole = "G1/H1"; }), HasSubstr("blades[0].holes[1].hole: G1/H1"));
  EXPECT_THAT(refusal([](Blades b) { (*b)[0].holes[0].found_axis *= 2; }),
              HasSubstr("found_axis: 2, want of length 1"));
  EXPECT_THAT(refusal([](Blades b) { (*b)[0].holes[0].position_standard_uncertainty_mm = 0; }), HasSubstr("want > 0"));
  EXPECT_THAT(refusal([](Blades b) { (*b)[0].holes[0].shared_part = 2; }), HasSubstr("shared_part: 2, want 0 to 1"));
  EXPECT_THAT(refusal([](Blades b) { (*b)[0].holes[0].found_start_mm[1] = std::nan(""); }), HasSubstr("a point"));
  EfficacyOptions options;
  options.least_blades = 2;
  EXPECT_THAT(std::string(AssessEfficacy(Cut({}, 11), {}, options).status().message()),
              HasSubstr("least_blades: 2, want 3 to 1000"));
}

}  // namespace
}  // namespace sixpoint::metrology
