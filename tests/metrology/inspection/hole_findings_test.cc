// What a hole is measured by, and what is said where it is not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"
#include "tests/metrology/inspection/pinned_block.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// The block's two holes, this wide; a pin of 0.97 of it in the first, where one is wanted.
PinnedBlock Block(double diameter_mm, bool with_pin) {
  PinnedBlock plant = MakePinnedBlock();
  plant.pins.resize(with_pin ? 1 : 0);
  for (SimulatedPin& pin : plant.pins) pin.radius_mm = 0.97 * diameter_mm / 2;
  for (InspectedHole& hole : plant.holes) {
    hole.pin.gauge.reset();
    hole.pin.hole_diameter_mm = diameter_mm;
  }
  return plant;
}

struct Extra {
  int bore_count = 0;  // of each hole's wall, from 0.3 to 2 mm deep, drilled 20 um along x
  int chip_count = 0;  // 1 mm over the second hole
};

std::vector<LineScan> Scans(const PinnedBlock& plant, const Extra& extra) {
  std::mt19937_64 random(5);
  std::vector<LineScan> scans = ScansOf(plant, &random, 500);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    Points points;
    for (const InspectedHole& hole : plant.holes) {
      const Eigen::Matrix<double, 3, 2> across = TangentBasis(hole.pin.axis);
      for (int i = 0; i < extra.bore_count; ++i) {
        const double angle = 2 * M_PI * unit(random), deep_mm = 0.8 + 1.5 * unit(random);
        points.push_back(hole.pin.start_mm + Vector3d(0.02, 0, 0) - deep_mm * hole.pin.axis +
                         hole.pin.hole_diameter_mm / 2 * (across * Eigen::Vector2d(std::cos(angle), std::sin(angle))));
      }
    }
    for (int i = 0; i < extra.chip_count; ++i)
      points.push_back(plant.holes[1].pin.start_mm +
                       Vector3d(0.2 * normal(random), 0.2 * normal(random), 1 + 0.1 * normal(random)));
    const LineScan more = Scanned(plant, plant.b_deg[s], points, &random);
    scans[s].points_mm.insert(scans[s].points_mm.end(), more.points_mm.begin(), more.points_mm.end());
  }
  return scans;
}

BladeFindings InspectHoles(const PinnedBlock& plant, const std::vector<LineScan>& scans, int threads = 2) {
  InspectionOptions options;
  options.threads = threads;
  BladeInspection inspection(plant.surface, plant.holes, plant.pose, plant.sensor, plant.axes, options);
  for (const LineScan& scan : scans) EXPECT_TRUE(inspection.Add(scan).ok());
  return *inspection.Finish();
}

TEST(HoleFindings, AreOfThePinWhereOneStandsAndElseOfTheBore) {
  const PinnedBlock plant = Block(2, true);
  const BladeFindings without = InspectHoles(plant, Scans(plant, {})),
                      with = InspectHoles(plant, Scans(plant, {150, 0}));
  EXPECT_EQ(without.holes[0].instrument, HoleInstrument::kPin) << without.holes[0].reason;
  EXPECT_EQ(without.holes[1].instrument, HoleInstrument::kNone);
  EXPECT_NE(without.holes[1].bore_reason.find("inside of the hole"), std::string::npos) << without.holes[1].bore_reason;
  EXPECT_FALSE(without.pitches.at(0).values);
  EXPECT_EQ(without.pitches[0].reason, "the next hole was not measured");

  // The pin's bits are the same, whatever of the bore was seen.
  const HoleFinding &pin = with.holes[0], &alone = without.holes[0];
  EXPECT_EQ(pin.instrument, HoleInstrument::kPin);
  EXPECT_EQ(pin.error.start_in_part_mm, alone.error.start_in_part_mm);
  EXPECT_EQ(pin.error.axis_in_part, alone.error.axis_in_part);
  EXPECT_EQ(pin.position_expanded_uncertainty_mm, alone.position_expanded_uncertainty_mm);
  EXPECT_EQ(pin.pin_diameter->seen.expanded_uncertainty_mm, alone.pin_diameter->seen.expanded_uncertainty_mm);

  const HoleFinding& bore = with.holes[1];
  ASSERT_EQ(bore.instrument, HoleInstrument::kBore) << bore.bore_reason;
  EXPECT_FALSE(bore.pin_diameter);
  EXPECT_NEAR(bore.hole_diameter.found->diameter.value_mm, 2, 2e-3);
  EXPECT_LT((bore.error.start_in_part_mm - plant.holes[1].pin.start_mm - Vector3d(0.02, 0, 0)).norm(), 2e-3);
  EXPECT_EQ(bore.position_verdict, Verdict::kConform);
  ASSERT_TRUE(with.pitches.at(0).values);
  EXPECT_FALSE(with.pitches[0].values->over_measured_diameter);  // of the pin's hole no play is stated
}

TEST(HoleFindings, OfABoreUnderAChipAndOfANarrowOneSayNothing) {
  const PinnedBlock wide = Block(2, false);
  const BladeFindings chip = InspectHoles(wide, Scans(wide, {150, 20}));
  EXPECT_EQ(chip.holes[0].instrument, HoleInstrument::kBore) << chip.holes[0].bore_reason;
  EXPECT_EQ(chip.holes[1].instrument, HoleInstrument::kNone);
  EXPECT_NE(chip.holes[1].bore_reason.find("a pin or a chip"), std::string::npos) << chip.holes[1].bore_reason;
  const PinnedBlock narrow = Block(0.44, false);
  for (const HoleFinding& hole : InspectHoles(narrow, Scans(narrow, {150, 0})).holes) {
    EXPECT_EQ(hole.instrument, HoleInstrument::kNone);
    EXPECT_NE(hole.bore_reason.find("too narrow"), std::string::npos) << hole.bore_reason;
  }
}

TEST(HoleFindings, SayAHolesDiameterOnlyWhereThePlayIsStated) {
  PinnedBlock plant = MakePinnedBlock();
  plant.holes[0].pin.gauge = GaugePin{0.44, 1e-3, 0.02};
  plant.holes[1].pin.gauge.reset();
  const BladeFindings findings = InspectHoles(plant, Scans(plant, {}));
  const HoleFinding &stated = findings.holes[0], &unstated = findings.holes[1];
  ASSERT_TRUE(stated.hole_diameter.found) << stated.reason;
  EXPECT_NEAR(stated.hole_diameter.found->half_interval_mm, 0.01, 1e-9);
  EXPECT_NEAR(stated.hole_diameter.found->diameter.value_mm, 0.45, 1e-9);
  EXPECT_NEAR(stated.hole_diameter.found->diameter.expanded_uncertainty_mm, 0.01 + 1.96e-3, 1e-5);
  EXPECT_FALSE(unstated.hole_diameter.found);
  EXPECT_NE(unstated.hole_diameter.reason.find("play"), std::string::npos);
  const auto has = [](const StatedLength& length, const char* source) {
    const auto& all = length.budget.components;
    return std::any_of(all.begin(), all.end(), [&](const auto& one) { return one.source == source; });
  };
  EXPECT_TRUE(has(stated.pin_diameter->own, kPinCertificate));
  EXPECT_TRUE(has(unstated.pin_diameter->own, kSeenOtherwise));
  EXPECT_TRUE(has(stated.pin_diameter->seen, kPinPoints));
  // A certificate takes no part in what was seen: 0.44 mm with or without it.
  EXPECT_NEAR(stated.pin_diameter->seen.value_mm, 0.44, stated.pin_diameter->seen.expanded_uncertainty_mm + 1e-4);
}

TEST(HoleFindings, HaveBudgetsThatAddUpToWhatIsStated) {
  PinnedBlock plant = MakePinnedBlock();
  for (InspectedHole& hole : plant.holes) hole.pin.gauge = GaugePin{0.44, 1e-3, 0.01};
  CalibrationCovariance calibrations = CalibrationCovariance::Zero();
  calibrations.diagonal().head<14>().setConstant(1e-10);
  plant.pose.sources = {SourceOf("calibrations", calibrations)};
  plant.pose.sources[0].degrees_of_freedom = 5;
  ActOnPose(PoseSensitivity::Zero(), &plant.pose.sources);
  const BladeFindings findings = InspectHoles(plant, Scans(plant, {}));
  const auto adds_up = [](const UncertaintyBudget& budget, double expanded, double bound) {
    double variance = 0, before = 1e300;
    std::vector<UncertaintyComponent> normal;
    for (const UncertaintyComponent& one : budget.components) {
      EXPECT_LE(one.variance, before) << one.source;
      before = one.variance;
      if (one.source == kPlayInHole) continue;
      variance += one.variance;
      normal.push_back(one);
    }
    EXPECT_NEAR(1.959964 * WideningOf(0.95, EffectiveDegreesOfFreedom(normal)) * std::sqrt(variance) + bound, expanded,
                1e-9 * expanded);
  };
  for (const HoleFinding& hole : findings.holes) {
    const HoleDisplacement& at = *hole.displacement;
    for (const StatedLength* length : {&at.along, &at.across, &hole.pin_diameter->seen, &hole.pin_diameter->own})
      adds_up(length->budget, 1e3 * length->expanded_uncertainty_mm, 0);
    for (const StatedAngle* angle : {&at.inclination_along, &at.inclination_across})
      adds_up(angle->budget, 1e6 * angle->expanded_uncertainty_rad, 0);
    adds_up(hole.hole_diameter.found->diameter.budget, 1e3 * hole.hole_diameter.found->diameter.expanded_uncertainty_mm,
            1e3 * hole.hole_diameter.found->half_interval_mm);
  }
  const HolePitch::Values& values = *findings.pitches.at(0).values;
  adds_up(values.along_row.budget, 1e3 * values.along_row.expanded_uncertainty_mm, 0);
  adds_up(values.over_nominal_diameter.budget, values.over_nominal_diameter.expanded_uncertainty, 0);
}

TEST(HoleFindings, AreTheSameBitsOnAnyNumberOfThreads) {
  const PinnedBlock plant = Block(2, true);
  const std::vector<LineScan> scans = Scans(plant, {150, 0});
  const BladeFindings one = InspectHoles(plant, scans, 1), four = InspectHoles(plant, scans, 4);
  for (int i = 0; i < 2; ++i) {
    const HoleFinding &a = one.holes[i], &b = four.holes[i];
    EXPECT_EQ(a.displacement->along.value_mm, b.displacement->along.value_mm);
    EXPECT_EQ(a.displacement->across.expanded_uncertainty_mm, b.displacement->across.expanded_uncertainty_mm);
    EXPECT_EQ(a.form->along_rms_um, b.form->along_rms_um);
    EXPECT_EQ(a.pin_radius_mm, b.pin_radius_mm);
  }
  const StatedLength &a = one.pitches.at(0).values->along_row, &b = four.pitches.at(0).values->along_row;
  EXPECT_EQ(a.value_mm, b.value_mm);
  EXPECT_EQ(a.expanded_uncertainty_mm, b.expanded_uncertainty_mm);
}

// 20 um at its top, seen over nearly all of 6 mm: the chord's middle is a quarter of that off. A straight one has noise of a fifth of a
// micrometre in its means.
TEST(HoleFindings, SayThatAPinIsBent) {
  PinnedBlock plant = MakePinnedBlock();
  std::mt19937_64 random(9);
  const auto form = [&](double bend_mm) {
    Points points;
    std::vector<Vector3d> views;
    for (int i = 0; i < 6; ++i)
      views.push_back(Vector3d(std::cos(60 * i * kRadPerDeg), std::sin(60 * i * kRadPerDeg), -0.6).normalized());
    const SimulatedPin& pin = plant.pins[0];
    for (Vector3d point : SeenFrom(pin, views, 300, &random)) {
      const double height = (point - pin.start_mm).dot(pin.axis) / pin.length_mm;
      points.push_back(point + bend_mm * height * height * TangentBasis(pin.axis).col(0));
    }
    NominalPin nominal = plant.holes[0].pin;
    nominal.gauge.reset();
    const PinFit fit = FitPin(nominal, points);
    EXPECT_TRUE(fit.measured) << fit.reason;
    return FormOf(fit);
  };
  const CylinderForm bent = form(0.02), straight = form(0);
  EXPECT_TRUE(bent.exceeds_noise);
  EXPECT_NEAR(bent.bend_um, 5, 0.5);
  EXPECT_GT(bent.along_range_um, 3);
  EXPECT_FALSE(straight.exceeds_noise);
  EXPECT_EQ(straight.per_sigma.cols(), 0);
  EXPECT_LT(straight.around_rms_um, 0.3);
}

}  // namespace
}  // namespace sixpoint::metrology
