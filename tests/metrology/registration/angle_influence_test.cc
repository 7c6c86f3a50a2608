// A machine whose axes do not stand where they are commanded: registered and corrected by their tables, and without them.
#include "metrology/registration/angle_influence.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "metrology/calibration/axis_characterisation.h"
#include "metrology/correction/correct.h"
#include "metrology/frames/angles.h"
#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

constexpr double kScatterRad = 0.0008 * kRadPerDeg;  // of one positioning

// As published of the SARIX's B axis: 0.005 deg of reversal, 0.003 deg of periodic error, +-0.015 deg at most; A like it.
struct TrueAxis {
  double mean, once, phase, periodic, reversal;
  double Reached(double command, Travel travel) const {
    return command + mean + once * std::sin(command + phase) + periodic * std::cos(30 * command - phase) +
           (travel == Travel::kForward ? reversal : -reversal) / 2;
  }
};
const TrueAxis kTrueA{0.002 * kRadPerDeg, 0.009 * kRadPerDeg, 0.4, 0.0015 * kRadPerDeg, 0.002 * kRadPerDeg};
const TrueAxis kTrueB{0.001 * kRadPerDeg, 0.009 * kRadPerDeg, 0.4, 0.0015 * kRadPerDeg, 0.005 * kRadPerDeg};

AxisPositioning Characterised(const TrueAxis& axis, std::mt19937_64* random) {
  std::normal_distribution<double> scatter(0, kScatterRad);
  std::vector<AxisReading> run;
  for (const Travel travel : {Travel::kForward, Travel::kBackward})
    for (int i = 0; i <= 380; ++i) {
      const double command = (-10 + (travel == Travel::kForward ? i : 380 - i)) * kRadPerDeg;
      run.push_back({command, axis.Reached(command, travel) + scatter(*random), travel});
    }
  const auto found = CharacteriseAxis(run);
  EXPECT_TRUE(found.ok()) << found.status();
  if (!found.ok()) return {};
  return {found->table, found->compensated_standard_uncertainty_rad.value};
}

// Axes that neither meet nor lie along Y and X, beside the blade.
MachineCalibration SkewedMachine() {
  MachineCalibration machine = MachineCalibration::Exact();
  machine.axes.a = {Eigen::Vector3d(1e-3, 1, -2e-3).normalized(), {10, 40, -230}};
  machine.axes.b = {Eigen::Vector3d(1, -1e-3, 3e-3).normalized(), {12, 42, -228}};
  return machine;
}

constexpr int kScans = 5, kPointsOfAScan = 300;

const Points& PointsOnBlade() {
  static const auto* points = new Points(Spread(*BladeSurface(), kScans * kPointsOfAScan, 1).points_mm);
  return *points;
}

struct Measured {
  MachineCalibration machine = MachineCalibration::Exact();  // with the tables
  std::vector<LineScan> scans;
  Travel a_travel = Travel::kForward, b_travel = Travel::kForward;
};

// The blade from five sides within half a turn, all come to one way; the scanner reads machine coordinates.
Measured Scans(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  Measured run;
  run.machine = SkewedMachine();
  run.machine.positioning.a = Characterised(kTrueA, &random);
  run.machine.positioning.b = Characterised(kTrueB, &random);
  run.a_travel = seed % 2 == 0 ? Travel::kForward : Travel::kBackward;
  run.b_travel = seed % 3 == 0 ? Travel::kForward : Travel::kBackward;
  const double a_command = 10 * kRadPerDeg;
  const double a_rad = kTrueA.Reached(a_command, run.a_travel) + kScatterRad * normal(random);
  for (int view = 0; view < kScans; ++view) {
    LineScan scan;
    scan.id = "b" + std::to_string(30 * view);
    scan.a_rad = a_command;
    scan.b_rad = 30 * view * kRadPerDeg;
    const double b_rad = kTrueB.Reached(scan.b_rad, run.b_travel) + kScatterRad * normal(random);
    const Eigen::Isometry3d machine_from_part = run.machine.axes.MachineFromZero(a_rad, b_rad) * BladePose();
    for (int i = 0; i < kPointsOfAScan; ++i)
      scan.points_mm.push_back(machine_from_part *
                                   PointsOnBlade()[static_cast<std::size_t>(kPointsOfAScan * view + i)] +
                               kNoiseMm * Eigen::Vector3d(normal(random), normal(random), normal(random)));
    run.scans.push_back(std::move(scan));
  }
  return run;
}

struct AngledFit {
  PoseFit fit;
  std::vector<AngleInfluence> angles;
};

absl::StatusOr<PoseFit> FitOnMachine(const std::vector<ScanPortion>& portions, const MachineCalibration& machine) {
  return FitToSurface(*BladeSurface(), portions, StartPose(), machine, FitOptions());
}

AngledFit FitWithAngles(const std::vector<LineScan>& scans, const MachineCalibration& machine) {
  std::vector<ScanPortion> portions;
  for (const LineScan& scan : scans) portions.push_back(Thin(scan, machine, Thinning()));
  AngledFit registered;
  const auto fit = FitOnMachine(portions, machine);
  EXPECT_TRUE(fit.ok()) << fit.status();
  if (!fit.ok()) return registered;
  EXPECT_EQ(fit->outcome, Outcome::kConverged);
  registered.fit = *fit;
  registered.angles = InfluencesOf(UncertainAngles(portions, machine.positioning), portions, Placed(registered.fit));
  registered.fit.placed->covariance.values += PoseCovarianceOf(registered.angles);
  return registered;
}

Vector6d ErrorOf(const PoseFit& fit) {
  const Eigen::Isometry3d change = Placed(fit).zero_from_part * BladePose().inverse(Eigen::Isometry);
  Vector6d error;
  error << VectorFromRotation(change.linear()),
      change * Placed(fit).covariance.reference_mm - Placed(fit).covariance.reference_mm;
  return error;
}

// Without the part's form, which this world has none of.
Matrix6d WithoutForm(const PlacedPose& placed) {
  Matrix6d covariance = placed.covariance.values;
  for (const ErrorSource& source : placed.sources)
    if (source.name == kFormDeviation) covariance -= source.pose_per_sigma * source.pose_per_sigma.transpose();
  return covariance;
}

double Whitened(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  return error.dot(covariance.llt().solve(error)) / static_cast<double>(error.size());
}

RegisteredPose RegisteredPoseOf(const AngledFit& registered, const MachineCalibration& machine) {
  const PlacedPose& placed = Placed(registered.fit);
  RegisteredPose pose(placed.zero_from_part, placed.noise_covariance, {});
  pose.positioning = machine.positioning;
  pose.angles = registered.angles;
  return pose;
}

NominalHoleGroup OneHole() {
  NominalHoleGroup group;
  group.name = "G1";
  group.nominal = {20 * kRadPerDeg, -35 * kRadPerDeg};
  group.axis_in_part = BladePose().linear().transpose() *
                       SkewedMachine().axes.MachineFromZero(20 * kRadPerDeg, -35 * kRadPerDeg).linear().transpose() *
                       Eigen::Vector3d::UnitZ();
  group.holes = {{"H1", kPartCentreMm + Eigen::Vector3d(5, 2, 20)}};
  return group;
}

// The pose in the plant's own figures: with the tables what is left is what the covariance says, without them ten times it
// and more. The hole starts, drilled at angles that come to the command by any way, are judged by the same draws.
TEST(AxisTables, TakeTheAnglesErrorOutOfPosesAndHolesAndSayWhatIsLeft) {
  constexpr int kRuns = 30;
  double pose_nees = 0, plain_nees = 0, hole_nees = 0, stated_nees = 0;
  double square_um2 = 0, plain_square_um2 = 0, hole_square_um2 = 0, plain_hole_square_um2 = 0;
  int holes_inside = 0;
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(0, 1);
  const NominalHoleGroup group = OneHole();
  const RotaryLimits limits{-100 * kRadPerDeg, 100 * kRadPerDeg, -360 * kRadPerDeg, 360 * kRadPerDeg};
  for (int seed = 1; seed <= kRuns; ++seed) {
    const Measured run = Scans(static_cast<std::uint64_t>(seed));
    MachineCalibration plain = run.machine;
    plain.positioning = {};
    const AngledFit with = FitWithAngles(run.scans, run.machine), without = FitWithAngles(run.scans, plain);
    ASSERT_EQ(with.angles.size(), 6u);  // one A, five B
    ASSERT_TRUE(without.angles.empty());
    pose_nees += Whitened(ErrorOf(with.fit), WithoutForm(Placed(with.fit))) / kRuns;
    plain_nees += Whitened(ErrorOf(without.fit), WithoutForm(Placed(without.fit))) / kRuns;
    stated_nees += Whitened(ErrorOf(with.fit), Placed(with.fit).covariance.values) / kRuns;
    square_um2 +=
        std::pow(1e3 * GreatestDisplacement(*BladeSurface(), Placed(with.fit).zero_from_part, BladePose()), 2) / kRuns;
    plain_square_um2 +=
        std::pow(1e3 * GreatestDisplacement(*BladeSurface(), Placed(without.fit).zero_from_part, BladePose()), 2) /
        kRuns;

    const Travel a_travel = normal(random) > 0 ? Travel::kForward : Travel::kBackward;
    const Travel b_travel = normal(random) > 0 ? Travel::kForward : Travel::kBackward;
    const double a_scatter = kScatterRad * normal(random), b_scatter = kScatterRad * normal(random);
    for (const bool by_tables : {true, false}) {
      const AngledFit& registered = by_tables ? with : without;
      const MachineCalibration& machine = by_tables ? run.machine : plain;
      const auto corrected =
          CorrectGroup(group, RegisteredPoseOf(registered, machine), BladePose(), machine.axes, machine.axes, limits);
      ASSERT_TRUE(corrected.ok()) << corrected.status();
      const double a_rad = kTrueA.Reached(corrected->corrected.a_rad, a_travel) + a_scatter;
      const double b_rad = kTrueB.Reached(corrected->corrected.b_rad, b_travel) + b_scatter;
      const CorrectedHole& hole = corrected->holes[0];
      const Eigen::Vector3d error_mm =
          hole.start_mm - machine.axes.MachineFromZero(a_rad, b_rad) * (BladePose() * group.holes[0].start_in_part_mm);
      if (by_tables) {
        hole_nees += Whitened(error_mm, hole.covariance_mm2) / kRuns;
        holes_inside += 1e3 * error_mm.norm() <= hole.expanded_uncertainty_um;
      }
      (by_tables ? hole_square_um2 : plain_hole_square_um2) += 1e6 * error_mm.squaredNorm() / kRuns;
    }
  }
  RecordProperty("pose_um", std::to_string(std::sqrt(square_um2)));
  RecordProperty("pose_without_um", std::to_string(std::sqrt(plain_square_um2)));
  RecordProperty("hole_um", std::to_string(std::sqrt(hole_square_um2)));
  RecordProperty("hole_without_um", std::to_string(std::sqrt(plain_hole_square_um2)));
  std::printf(
      "rms over %d runs: pose %.2f um with tables, %.2f without; hole %.2f, %.2f; squared error over covariance: "
      "pose %.3f, %.1f without; hole %.3f, %d inside U95\n",
      kRuns, std::sqrt(square_um2), std::sqrt(plain_square_um2), std::sqrt(hole_square_um2),
      std::sqrt(plain_hole_square_um2), pose_nees, plain_nees, hole_nees, holes_inside);
  // 30 runs of 6 values: 1 +- 0.11 (one sigma); A turns against B, which the scatter of the residuals shows too.
  EXPECT_GT(pose_nees, 0.75);
  EXPECT_LT(pose_nees, 1.25);
  EXPECT_GT(plain_nees, 10);
  // What angles leave beyond what is stated of them counts as form: too much is said, by less than twice.
  EXPECT_GT(stated_nees, 0.25);
  EXPECT_LT(stated_nees, pose_nees);
  EXPECT_LT(hole_nees, 1.35);   // 180 values: +- 0.105
  EXPECT_GE(holes_inside, 26);  // 95 % of 30 is 28.5; 25 and fewer come once in 60
  EXPECT_LT(square_um2, plain_square_um2 / 4);
  EXPECT_LT(hole_square_um2, plain_hole_square_um2 / 1.5);
}

// By what the pose follows an angle: against the points turned by hand, and no influence where no table is.
TEST(AngleInfluence, IsTheDerivativeOfThePose) {
  const Measured run = Scans(3);
  const AngledFit registered = FitWithAngles(run.scans, run.machine);
  ASSERT_EQ(registered.angles.size(), 6u);
  // All B angles greater by d turn the pose by -d about the B axis, as one body.
  Vector6d together = Vector6d::Zero();
  for (const AngleInfluence& angle : registered.angles)
    if (angle.axis == AngleInfluence::Axis::kB) together += angle.pose_per_rad;
  const AxisLine& b = run.machine.axes.b;
  const Eigen::Vector3d reference = Placed(registered.fit).covariance.reference_mm;
  // To where a fit of the same points, moved as one body, comes to rest.
  EXPECT_LT((together.head<3>() + b.direction).norm(), 1e-3) << together.transpose();
  const Eigen::Vector3d lever = b.direction.cross(reference - b.point_mm);
  EXPECT_LT((together.tail<3>() + lever).norm(), 1e-3 * lever.norm()) << together.transpose();
}

TEST(AngleInfluence, OneTableOnlyOfItsAxis) {
  Measured run = Scans(4);
  run.machine.positioning.a = {};
  const AngledFit registered = FitWithAngles(run.scans, run.machine);
  ASSERT_EQ(registered.angles.size(), 5u);
  for (const AngleInfluence& angle : registered.angles) EXPECT_EQ(angle.axis, AngleInfluence::Axis::kB);
}

// Each alone: against fits of the same scans with that angle taken greater.
TEST(AngleInfluence, OfEachAngleIsWhatARefitShows) {
  const Measured run = Scans(5);
  const AngledFit registered = FitWithAngles(run.scans, run.machine);
  ASSERT_EQ(registered.angles.size(), 6u);
  constexpr double kStepRad = 3e-5;  // 2 um at the blade: by less single points change their patch
  for (const AngleInfluence& angle : registered.angles) {
    const auto refit = [&](double by_rad) {
      std::vector<ScanPortion> portions;
      for (LineScan scan : run.scans) {
        const double command = angle.axis == AngleInfluence::Axis::kA ? scan.a_rad : scan.b_rad;
        if (std::abs(command - angle.commanded_rad) < kSameCommandRad)
          (angle.axis == AngleInfluence::Axis::kA ? scan.a_rad : scan.b_rad) += by_rad;
        portions.push_back(Thin(scan, run.machine, Thinning()));
      }
      return ErrorOf(*FitOnMachine(portions, run.machine));
    };
    Vector6d seen = (refit(kStepRad) - refit(-kStepRad)) / (2 * kStepRad);
    Vector6d stated = angle.pose_per_rad;
    seen.head<3>() *= 18;  // mm, the blade's size
    stated.head<3>() *= 18;
    EXPECT_LT((seen - stated).norm(), 0.05 * stated.norm() + 0.05) << angle.commanded_rad / kRadPerDeg;
  }
}

// An axis that has a figure and no table: its angles are uncertain all the same, in the pose and in what is drilled by it.
TEST(AngleInfluence, AFigureWithoutATableIsTakenToo) {
  Measured run = Scans(4);
  run.machine.positioning.a = {};
  run.machine.positioning.b = {};
  run.machine.positioning.b.standard_uncertainty_rad = 0.005 * kRadPerDeg;
  const AngledFit registered = FitWithAngles(run.scans, run.machine);
  ASSERT_EQ(registered.angles.size(), 5u);
  for (const AngleInfluence& angle : registered.angles) {
    EXPECT_EQ(angle.reached_rad, angle.commanded_rad);
    EXPECT_DOUBLE_EQ(angle.standard_uncertainty_rad, 0.005 * kRadPerDeg);
    EXPECT_EQ(angle.half_reversal_rad, 0);
  }
  const NominalHoleGroup group = OneHole();
  const RotaryLimits limits{-100 * kRadPerDeg, 100 * kRadPerDeg, -360 * kRadPerDeg, 360 * kRadPerDeg};
  const auto corrected = CorrectGroup(group, RegisteredPoseOf(registered, run.machine), BladePose(), run.machine.axes,
                                      run.machine.axes, limits);
  ASSERT_TRUE(corrected.ok()) << corrected.status();
  // By the lever about B, in closed form.
  const Eigen::Vector3d zero = registered.fit.placed->zero_from_part * group.holes[0].start_in_part_mm;
  const AxisLine& b = run.machine.axes.b;
  const double lever_mm = b.direction.cross(zero - b.point_mm).norm();
  double drilling_um2 = 0;
  for (const UncertaintyComponent& one : corrected->holes[0].components)
    if (one.source == "angles of the drilling") drilling_um2 = one.variance;
  EXPECT_NEAR(std::sqrt(drilling_um2), 1e3 * lever_mm * 0.005 * kRadPerDeg, 1e-6);
}

// Without a table nothing changes: the same bits.
TEST(AxisTables, LeaveACommandAloneWhereThereIsNone) {
  const AxisPositioning none;
  EXPECT_EQ(none.Reached(0.7), 0.7);
  EXPECT_EQ(none.CommandFor(0.7), 0.7);
  EXPECT_EQ(none.StandardUncertaintyAt(0.7), 0);
  std::mt19937_64 random(1);
  const AxisPositioning some = Characterised(kTrueA, &random);
  EXPECT_NEAR(some.Reached(some.CommandFor(0.7)), 0.7, 1e-12);
  EXPECT_NEAR(some.HalfReversalAt(0.7), kTrueA.reversal / 2, 0.0005 * kRadPerDeg);
}

}  // namespace
}  // namespace sixpoint::metrology
