// Displacements with direction, pitches and bores in closed form: exact cylinders at random poses.
#include "metrology/inspection/hole_displacement.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "metrology/frames/angles.h"
#include "metrology/inspection/bore.h"
#include "metrology/inspection/hole_error.h"
#include "metrology/inspection/pitch.h"
#include "metrology/kinematics/rotary_axes.h"
#include "tests/metrology/inspection/simulated_pin.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// In a frame of its own the hole leans by `lean` from z (the normal) towards x; turned and moved anywhere, metres from the origin.
struct PlacedHole {
  Eigen::Isometry3d part_from_hole = Eigen::Isometry3d::Identity();
  double lean_rad = 0, more_lean_rad = 0, aside_rad = 0;
  double x_mm = 0, y_mm = 0, diameter_mm = 0.44;

  NominalPin Nominal() const {
    NominalPin pin;
    pin.start_mm = part_from_hole.translation();
    pin.axis = part_from_hole.linear() * Vector3d(std::sin(lean_rad), 0, std::cos(lean_rad));
    pin.normal = part_from_hole.linear().col(2);
    pin.hole_diameter_mm = diameter_mm;
    pin.hole_depth_mm = 6;
    return pin;
  }
  // Leaned further in the plane of x and z, then by aside_rad out of it.
  SimulatedPin Drilled() const {
    const double lean = lean_rad + more_lean_rad, aside = std::tan(aside_rad) * std::cos(more_lean_rad);
    SimulatedPin pin;
    pin.start_mm = part_from_hole * Vector3d(x_mm, y_mm, 0);
    pin.axis = part_from_hole.linear() * Vector3d(std::sin(lean), aside, std::cos(lean)).normalized();
    pin.radius_mm = diameter_mm / 2;
    pin.noise_mm = 0;
    return pin;
  }
};

PlacedHole AnyHole(std::mt19937_64* random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  PlacedHole hole;
  hole.part_from_hole.linear() = RotationFromVector({3 * unit(*random), 3 * unit(*random), 3 * unit(*random)});
  hole.part_from_hole.translation() = Vector3d(6357, 10 * unit(*random), 330 * unit(*random));
  hole.lean_rad = (35 + 25 * unit(*random)) * kRadPerDeg;
  hole.more_lean_rad = 0.01 * unit(*random);
  hole.aside_rad = 0.01 * unit(*random);
  hole.x_mm = 0.08 * unit(*random);
  hole.y_mm = 0.08 * unit(*random);
  return hole;
}

Points OnCylinder(const SimulatedPin& pin, double lowest_mm, double highest_mm, std::mt19937_64* random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(pin.axis);
  Points points;
  for (int i = 0; i < 900; ++i) {
    const double angle = 2 * M_PI * unit(*random);
    points.push_back(pin.start_mm + (lowest_mm + (highest_mm - lowest_mm) * unit(*random)) * pin.axis +
                     pin.radius_mm * (across * Eigen::Vector2d(std::cos(angle), std::sin(angle))));
  }
  return points;
}

MeasuredHole MeasuredBy(const NominalPin& nominal, const PinFit& fit, int index) {
  const HoleError error = HoleErrorOf(nominal, fit, fit.noise_covariance);
  MeasuredHole hole;
  hole.index = index;
  hole.start_in_part_mm = error.start_in_part_mm;
  hole.axis_in_part = error.axis_in_part;
  hole.start_per_parameter = error.start_per_parameter;
  return hole;
}

// 6 km-long coordinates of double precision hold 1e-9 mm, the fit ends at steps of 1e-9: 1e-6 mm and rad leave room.
TEST(HoleDisplacement, IsThatOfExactPinsAtAnyPose) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 60; ++i) {
    const PlacedHole hole = AnyHole(&random);
    const NominalPin nominal = hole.Nominal();
    const PinFit fit = FitPin(nominal, OnCylinder(hole.Drilled(), 0.2, 5, &random));
    ASSERT_TRUE(fit.measured) << fit.reason;
    const HoleDisplacement found = DisplacementOf(nominal, fit, MeasuredBy(nominal, fit, i));
    EXPECT_EQ(found.directions.reference, SurfaceReference::kHoleAxis);
    EXPECT_LT((found.directions.along - hole.part_from_hole.linear().col(0)).norm(), 1e-12);
    EXPECT_LT((found.directions.across - hole.part_from_hole.linear().col(1)).norm(), 1e-12);
    EXPECT_NEAR(found.along.value_mm, hole.x_mm, 1e-6);
    EXPECT_NEAR(found.across.value_mm, hole.y_mm, 1e-6);
    EXPECT_NEAR(found.inclination_along.value_rad, hole.more_lean_rad, 1e-6);
    EXPECT_NEAR(found.inclination_across.value_rad, hole.aside_rad, 1e-6);
  }
}

TEST(HoleDisplacement, OfAnUprightHoleIsToldFromThePart) {
  const Vector3d tilted = Vector3d(0.08, 0, 1).normalized();  // 4.6 deg
  const SurfaceDirections by_x = SurfaceDirectionsOf(tilted, Vector3d::UnitZ());
  EXPECT_EQ(by_x.reference, SurfaceReference::kPartX);
  EXPECT_LT((by_x.along - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((by_x.across - Vector3d::UnitY()).norm(), 1e-12);
  const SurfaceDirections by_z = SurfaceDirectionsOf(Vector3d::UnitX(), Vector3d(1, 0, 0.05).normalized());
  EXPECT_EQ(by_z.reference, SurfaceReference::kPartZ);
  EXPECT_NEAR(by_z.along.dot(Vector3d(1, 0, 0.05)), 0, 1e-12);
  EXPECT_GT(by_z.along.z(), 0.99);
  const SurfaceDirections leaning = SurfaceDirectionsOf(Vector3d(0.09, 0, 1).normalized(), Vector3d::UnitZ());
  EXPECT_EQ(leaning.reference, SurfaceReference::kHoleAxis);  // 5.1 deg
}

// Two causes in the surface: one of 3 um at 40 deg known well, one of 2 um at 110 deg known by six readings alone (five degrees of freedom).
// Other positionings move the hole by 50 um, and are none of it.
TEST(HoleDisplacement, IsUncertainInEachDirectionByWhatLiesThere) {
  const double directions_deg[] = {40, 110}, sigmas_mm[] = {0.003, 0.002};
  const double freedoms[] = {std::numeric_limits<double>::infinity(), 5};
  NominalPin nominal;
  nominal.axis = Vector3d(0.6, 0, 0.8);
  nominal.normal = Vector3d::UnitZ();
  MeasuredHole hole;
  hole.axis_in_part = nominal.axis;
  hole.start_per_parameter.topLeftCorner<2, 2>().setIdentity();  // the surface's x and y are the parameters themselves
  hole.moved.push_back({Vector3d(0.03, 0.04, 0), nominal.axis});
  PinFit fit;
  fit.across = Eigen::Matrix<double, 3, 2>::Identity();
  for (int i = 0; i < 2; ++i) {
    Eigen::Matrix<double, 5, Eigen::Dynamic> per_sigma = Eigen::Matrix<double, 5, Eigen::Dynamic>::Zero(5, 1);
    per_sigma(0, 0) = sigmas_mm[i] * std::cos(directions_deg[i] * kRadPerDeg);
    per_sigma(1, 0) = sigmas_mm[i] * std::sin(directions_deg[i] * kRadPerDeg);
    hole.sources.push_back({"cause " + std::to_string(i), freedoms[i], true, per_sigma});
  }
  const HoleDisplacement found = DisplacementOf(nominal, fit, hole);
  EXPECT_GT(found.along.expanded_uncertainty_mm,
            0.03);  // with the other positioning: 30 um / sqrt 3 of standard uncertainty
  const SurfaceUncertainty& u = found.in_stated_positioning;
  for (int turn_deg = 0; turn_deg < 180; turn_deg += 7) {
    const Eigen::Vector2d towards(std::cos(turn_deg * kRadPerDeg), std::sin(turn_deg * kRadPerDeg));
    double variance_mm2 = 0;
    for (int i = 0; i < 2; ++i)
      variance_mm2 += std::pow(sigmas_mm[i] * std::cos((directions_deg[i] - turn_deg) * kRadPerDeg), 2);
    EXPECT_NEAR(towards.dot(u.covariance_mm2 * towards), variance_mm2, 1e-12);
  }
  // Across the first cause only the second is left: Student's 97.5 % quantile of five degrees of freedom, which no direction exceeds.
  EXPECT_NEAR(u.coverage_factor, 2.571, 0.002);
}

// Two holes that share an error whole: the pitch has none of it, and each hole all.
TEST(HolePitch, HasNothingOfWhatMovesBothAlike) {
  std::mt19937_64 random(12);
  PlacedHole one = AnyHole(&random), next = one;
  one.more_lean_rad = one.aside_rad = next.more_lean_rad = next.aside_rad = 0;
  next.part_from_hole.translation() += 1.3 * one.part_from_hole.linear().col(1);
  next.x_mm = one.x_mm + 0.02;
  next.y_mm = one.y_mm - 0.05;
  std::vector<MeasuredHole> measured;
  for (const PlacedHole* hole : {&one, &next}) {
    const PinFit fit = FitPin(hole->Nominal(), OnCylinder(hole->Drilled(), 0.2, 5, &random));
    ASSERT_TRUE(fit.measured) << fit.reason;
    measured.push_back(MeasuredBy(hole->Nominal(), fit, static_cast<int>(measured.size())));
    Eigen::Matrix<double, 5, Eigen::Dynamic> shared(5, 2), own(5, 1);
    shared << 3e-3, 0, 0, 4e-3, 0, 0, 0, 0, 1e-3, 0;
    own << 1e-3, 1e-3, 0, 0, 0;
    measured.back().sources = {{"calibrations", 20, true, shared}, {"points of the pin", 1e9, false, own}};
  }
  const HolePitch pitch = PitchOf({one.Nominal().start_mm, 0.44, &measured[0], nullptr},
                                  {next.Nominal().start_mm, 0.5, &measured[1], nullptr});
  ASSERT_TRUE(pitch.values) << pitch.reason;
  EXPECT_NEAR(pitch.nominal_mm, 1.3, 1e-9);
  EXPECT_NEAR(pitch.values->along_row.value_mm, 1.25, 1e-6);
  EXPECT_NEAR(pitch.values->distance.value_mm, std::hypot(1.25, 0.02), 1e-6);
  EXPECT_NEAR(pitch.values->over_nominal_diameter.value, 1.25 / 0.47, 1e-5);
  EXPECT_FALSE(pitch.values->over_measured_diameter);
  const auto& components = pitch.values->along_row.budget.components;
  for (const UncertaintyComponent& component : components)
    EXPECT_TRUE(component.source != "calibrations" || component.variance < 1e-12);
  // Across the lean a displacement is that of the axis: (1, 1) um of each hole along one unit direction, 1.96 sigma of both.
  const Eigen::RowVectorXd moves = one.part_from_hole.linear().col(1).transpose() * measured[0].start_per_parameter *
                                   measured[0].sources[1].per_sigma;
  EXPECT_NEAR(pitch.values->along_row.expanded_uncertainty_mm, 1.959964 * std::sqrt(2.0) * moves.norm(), 1e-9);
  const ValueEffects alone = EffectsOf(one.part_from_hole.linear().col(1).transpose() * measured[0].start_per_parameter,
                                       measured[0].sources, 0);
  EXPECT_GT(StateLength(0, alone).expanded_uncertainty_mm, 2 * pitch.values->along_row.expanded_uncertainty_mm);
  EXPECT_EQ(
      PitchOf({one.Nominal().start_mm, 0.44, nullptr, nullptr}, {next.Nominal().start_mm, 0.5, &measured[1], nullptr})
          .reason,
      "the hole was not measured");
}

TEST(FitBore, IsThatOfExactBoresAtAnyPose) {
  std::mt19937_64 random(13);
  for (int i = 0; i < 40; ++i) {
    PlacedHole hole = AnyHole(&random);
    hole.diameter_mm = 1 + 0.05 * i;
    const NominalPin nominal = hole.Nominal();
    const PinFit fit = FitBore(nominal, OnCylinder(hole.Drilled(), -3, -0.3, &random), {}, {});
    ASSERT_TRUE(fit.measured) << fit.reason;
    const HoleDisplacement found = DisplacementOf(nominal, fit, MeasuredBy(nominal, fit, i));
    EXPECT_NEAR(found.along.value_mm, hole.x_mm, 1e-6);
    EXPECT_NEAR(found.across.value_mm, hole.y_mm, 1e-6);
    EXPECT_NEAR(found.inclination_along.value_rad, hole.more_lean_rad, 1e-6);
    EXPECT_NEAR(found.inclination_across.value_rad, hole.aside_rad, 1e-6);
    EXPECT_NEAR(2 * fit.radius_mm, hole.diameter_mm, 1e-6);
  }
}

TEST(FitBore, SaysWhyItMeasuresNothing) {
  std::mt19937_64 random(14);
  PlacedHole hole = AnyHole(&random);
  const auto reason = [&](const Points& points) { return FitBore(hole.Nominal(), points, {}, {}).reason; };
  EXPECT_NE(reason(OnCylinder(hole.Drilled(), -3, -0.3, &random)).find("too narrow"), std::string::npos);
  hole.diameter_mm = 2;
  Points points = OnCylinder(hole.Drilled(), -3, -0.3, &random), one_side;
  const Vector3d side = TangentBasis(hole.Drilled().axis).col(0);
  for (const Vector3d& point : points)
    if ((point - hole.Drilled().start_mm).dot(side) > 0.4) one_side.push_back(point);
  EXPECT_NE(reason(one_side).find("deg of the circumference"), std::string::npos) << reason(one_side);
  points.resize(100);
  EXPECT_NE(reason(points).find("inside of the hole"), std::string::npos);
  const Points rim = OnCylinder(hole.Drilled(), -0.9, -0.3, &random);  // 0.5 mm of it is under the mouth
  EXPECT_NE(reason(rim).find("of its length"), std::string::npos) << reason(rim);
}

}  // namespace
}  // namespace sixpoint::metrology
