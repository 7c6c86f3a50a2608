// Paths of a shaped hole on a blade as it stands: by closed forms, by the way back through the machine, and by draws.
#include "metrology/correction/tool_path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "metrology/frames/angles.h"
#include "refusal/refusal.h"
#include "tests/metrology/correction/some_path.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<CorrectedToolPath> Correct(const NominalToolPath& path, const RegisteredPose& pose,
                                          const RotaryAxes& axes = {}, const RotaryLimits& limits = kWideLimits) {
  return CorrectToolPath(path, pose, pose.zero_from_part, axes, limits, kSomeSteps);
}

Eigen::Isometry3d TurnedBy(const Eigen::Vector3d& rotation_deg) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = RotationFromVector(rotation_deg * kRadPerDeg);
  return pose;
}

// A along Y, B along X, both through the origin: B turns the part's 10 degrees back, and A the fan's lean.
TEST(ToolPath, OfAFanOnAPlaneIsTheClosedForm) {
  const NominalToolPath path = FanOnAPlane(11);
  const auto corrected = Correct(path, ExactPose(TurnedBy({10, 0, 0})));
  ASSERT_TRUE(corrected.ok()) << corrected.status();
  ASSERT_EQ(corrected->poses.size(), 11u);
  for (std::size_t k = 0; k < 11; ++k) {
    const CorrectedToolPose& pose = corrected->poses[k];
    const double share = static_cast<double>(k) / 10, lean_rad = 20 * kRadPerDeg * share;
    EXPECT_EQ(pose.start.name, std::to_string(k + 1));
    EXPECT_NEAR(pose.corrected.b_rad, -10 * kRadPerDeg, 1e-13);
    EXPECT_NEAR(pose.corrected.a_rad, -lean_rad, 1e-13);
    const Eigen::Vector3d want = 2 * share * Eigen::Vector3d(std::cos(lean_rad), 0, std::sin(lean_rad));
    EXPECT_LT((pose.start.start_mm - want).norm(), 1e-12);
  }
}

// Of two ways to stand there only one is within the limits; the nominal part goes it too, or the gate would call it another way.
TEST(ToolPath, TheNominalPartGoesTheWayThatTheMachineCan) {
  const RotaryLimits limits{100 * kRadPerDeg, 260 * kRadPerDeg, 100 * kRadPerDeg, 260 * kRadPerDeg};
  const auto corrected = CorrectToolPath(FanOnAPlane(11), ExactPose(TurnedBy({1, 0, 0})), Eigen::Isometry3d::Identity(),
                                         {}, limits, kSomeSteps);
  ASSERT_TRUE(corrected.ok()) << corrected.status();
  for (const CorrectedToolPose& pose : corrected->poses) {
    EXPECT_NEAR(pose.corrected.b_rad, 179 * kRadPerDeg, 1e-12);
    EXPECT_NEAR(pose.nominal_angles.b_rad, 180 * kRadPerDeg, 1e-12);
    EXPECT_NEAR(pose.nominal_angles.a_rad, pose.corrected.a_rad, 1e-12);
  }
}

// The part is moved by a known transform; the commands, through the machine's own chain, come back to the nominal poses on the part.
TEST(ToolPath, ComesBackToTheNominalPosesThroughTheMachine) {
  std::mt19937_64 random(11);
  for (int round = 0; round < 20; ++round) {
    const SomePlace place(random);
    NominalToolPath path = FanOnAPlane(9);
    for (ToolPose& pose : path.poses) pose.tip_in_part_mm += Eigen::Vector3d(3, -20, 8);
    RegisteredPose pose = ExactPose(place.real);
    AngleTable table;  // half an arc minute and a wave of three a turn
    for (int i = 0; i < 72; ++i) {
      table.forward_rad.push_back(1.5e-4 + 5e-5 * std::sin(3 * i * 5 * kRadPerDeg));
      table.backward_rad.push_back(1.2e-4 + 5e-5 * std::sin(3 * i * 5 * kRadPerDeg));
    }
    if (round % 2 == 0) pose.positioning.a.table = pose.positioning.b.table = table;
    const auto corrected = CorrectToolPath(path, pose, place.nominal, SomeAxes(), kWideLimits, kSomeSteps);
    ASSERT_TRUE(corrected.ok()) << corrected.status();
    for (std::size_t k = 0; k < path.poses.size(); ++k) {
      const CorrectedToolPose& at = corrected->poses[k];
      const auto back = [&](const Eigen::Isometry3d& zero_from_part, const RotaryAngles& angles) {
        return (SomeAxes().MachineFromZero(angles.a_rad, angles.b_rad) * zero_from_part).inverse();
      };
      const RotaryAngles reached{pose.positioning.a.Reached(at.corrected.a_rad),
                                 pose.positioning.b.Reached(at.corrected.b_rad)};
      const Eigen::Isometry3d part_from_machine = back(place.real, reached);
      EXPECT_LT((part_from_machine * at.start.start_mm - path.poses[k].tip_in_part_mm).norm(), 1e-9);
      EXPECT_LT((part_from_machine.linear().col(2) - path.poses[k].axis_in_part).norm(), 1e-9);
      const Eigen::Isometry3d nominal = back(place.nominal, at.nominal_angles);
      EXPECT_LT((nominal * at.start.nominal_start_mm - path.poses[k].tip_in_part_mm).norm(), 1e-9);
      EXPECT_LT((nominal.linear().col(2) - path.poses[k].axis_in_part).norm(), 1e-9);
      EXPECT_EQ(at.corrected.a_rad == at.reached.a_rad, round % 2 != 0);
    }
  }
}

// Everything that makes a hole's start uncertain.
RegisteredPose UncertainPose(const SomePlace& place) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  RegisteredPose pose = ExactPose(place.real);
  const auto fill = [&](Eigen::Index rows, Eigen::Index columns, const auto& scale) {
    Eigen::MatrixXd values(rows, columns);
    for (Eigen::Index i = 0; i < rows; ++i)
      for (Eigen::Index j = 0; j < columns; ++j) values(i, j) = normal(random) * scale(i);
    return values;
  };
  const Eigen::MatrixXd noise = fill(6, 6, [](Eigen::Index i) { return i < 3 ? 3e-6 : 2e-4; });
  pose.noise.values = noise * noise.transpose();
  ErrorSource source;
  source.name = "rotation calibration";
  source.degrees_of_freedom = 40;
  source.parameters_per_sigma = Eigen::MatrixXd::Zero(kCalibrationParameterCount, 8);
  source.parameters_per_sigma.middleRows<kAxisParameterCount>(kFirstAxisParameter) =
      fill(8, 8, [](Eigen::Index i) { return i % 4 < 2 ? 4e-6 : 2e-4; });
  source.pose_per_sigma = fill(6, 8, [](Eigen::Index i) { return i < 3 ? 2e-6 : 1e-4; });
  ErrorSource scales = source;
  scales.name = "scales of the linear axes";
  scales.parameters_per_sigma.setZero();
  scales.parameters_per_sigma.middleRows<kLinearParameterCount>(kFirstLinearParameter) =
      fill(6, 8, [](Eigen::Index) { return 2e-6; });
  pose.sources = {source, scales};
  return pose;
}

// Poses with one axis are the holes of a group: the same starts, and as uncertain.
TEST(ToolPath, WithOneAxisIsAHoleGroup) {
  std::mt19937_64 random(21);
  const SomePlace place(random);
  RegisteredPose pose = UncertainPose(place);
  pose.positioning.a.standard_uncertainty_rad = 2e-6;
  Drilling drilling;
  drilling.stretch = 1 + 6e-5;
  drilling.tool_offset_mm = 1e-3;
  NominalToolPath path = FanOnAPlane(4);
  NominalHoleGroup group{"G", path.poses[1].axis_in_part, {}, {}, 0.05, path.inclination_tolerance_rad};
  for (ToolPose& at : path.poses) {
    at.axis_in_part = group.axis_in_part;
    group.holes.push_back({std::to_string(group.holes.size() + 1), at.tip_in_part_mm});
  }
  const auto holes = CorrectGroup(group, pose, place.nominal, SomeAxes(), SomeAxes(), kWideLimits, drilling);
  const auto corrected = CorrectToolPath(path, pose, place.nominal, SomeAxes(), kWideLimits, kSomeSteps, drilling);
  ASSERT_TRUE(holes.ok() && corrected.ok()) << holes.status() << corrected.status();
  for (std::size_t k = 0; k < path.poses.size(); ++k) {
    const CorrectedToolPose& at = corrected->poses[k];
    const CorrectedHole& hole = holes->holes[k];
    EXPECT_NEAR(at.corrected.a_rad, holes->corrected.a_rad, 1e-12);
    EXPECT_NEAR(at.corrected.b_rad, holes->corrected.b_rad, 1e-12);
    EXPECT_LT((at.start.start_mm - hole.start_mm).norm(), 1e-9);
    // Both by differences of 1e-6 rad and 1e-4 mm: rounding of 1e-13 mm is 1e-7 of a slope.
    EXPECT_LT((at.start.covariance_mm2 - hole.covariance_mm2).norm(), 1e-6 * hole.covariance_mm2.norm());
    EXPECT_NEAR(at.start.expanded_uncertainty_um, hole.expanded_uncertainty_um, 1e-5);
    EXPECT_NEAR(at.a_standard_uncertainty_rad, holes->a_standard_uncertainty_rad, 1e-11);
    EXPECT_NEAR(at.b_standard_uncertainty_rad, holes->b_standard_uncertainty_rad, 1e-11);
    ASSERT_EQ(at.start.components.size(), 5u);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(at.start.components[i].source, hole.components[i].source);
    EXPECT_NEAR(at.start.degrees_of_freedom / hole.degrees_of_freedom, 1, 1e-5);
  }
}

// What is stated of each pose, against draws of noise and calibration through the whole path.
TEST(ToolPath, StatesUncertaintiesThatDrawsConfirm) {
  std::mt19937_64 random(31);
  const SomePlace place(random);
  const RegisteredPose pose = UncertainPose(place);
  const NominalToolPath path = FanOnAPlane(5);
  const auto stated = CorrectToolPath(path, pose, place.nominal, SomeAxes(), kWideLimits, kSomeSteps);
  ASSERT_TRUE(stated.ok()) << stated.status();
  const Eigen::MatrixXd noise_factor = pose.noise.values.llt().matrixL();
  std::normal_distribution<double> normal;
  const auto draw = [&](Eigen::Index count) {
    Eigen::VectorXd values(count);
    for (double& value : values) value = normal(random);
    return values;
  };
  constexpr int kDraws = 800;
  std::vector<double> squares(5), widening(5);
  std::vector<int> inside(5);
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::VectorXd axes_draw = draw(8), scales_draw = draw(8);
    Eigen::Isometry3d moved = Perturbed(
        pose.zero_from_part, pose.sources[0].pose_per_sigma * axes_draw + pose.sources[1].pose_per_sigma * scales_draw,
        pose.noise.reference_mm);
    moved = Perturbed(moved, noise_factor * draw(6), pose.noise.reference_mm);
    const RotaryAxes axes = SomeAxes().Perturbed(
        pose.sources[0].parameters_per_sigma.middleRows<kAxisParameterCount>(kFirstAxisParameter) * axes_draw);
    const auto linear = pose.sources[1].parameters_per_sigma.middleRows<kLinearParameterCount>(kFirstLinearParameter);
    const auto solver = PathSolver(axes, {}, kWideLimits);
    ASSERT_TRUE(solver.ok());
    const auto solved = SolveTrajectory(*solver, TargetsOf(path, moved, Eigen::Affine3d::Identity()),
                                        Eigen::VectorXd::Zero(5), {kSomeSteps.rotary_rad, kSomeSteps.linear_mm, 0});
    ASSERT_TRUE(solved.ok()) << solved.status();
    for (std::size_t k = 0; k < 5; ++k) {
      const CorrectedHole& start = stated->poses[k].start;
      const Eigen::VectorXd scale = linear * scales_draw;
      const Eigen::Vector3d at = solved->at(k).reached.segment<3>(kPathX);
      // What the linear axes read of where they should be (linear_axes.cc).
      const Eigen::Vector3d read(at.x() * scale[0] + at.y() * scale[3] + at.z() * scale[4],
                                 at.y() * scale[1] + at.z() * scale[5], at.z() * scale[2]);
      const double off_um = 1e3 * (at - read - start.start_mm).norm();
      squares[k] += off_um * off_um;
      inside[k] += off_um <= start.expanded_uncertainty_um;
    }
  }
  for (std::size_t k = 0; k < 5; ++k) {
    const CorrectedHole& start = stated->poses[k].start;
    EXPECT_GT(start.expanded_uncertainty_um, 0.5);
    // Of 800 draws mostly along one direction: a standard deviation of 5 %, so four of them.
    EXPECT_NEAR(squares[k] / kDraws / (1e6 * start.covariance_mm2.trace()), 1, 0.2) << k;
    EXPECT_GT(100.0 * inside[k] / kDraws, 91.5) << k;  // 95 %, less four standard deviations of 0.8 %
    EXPECT_LT(100.0 * inside[k] / kDraws, 98.5) << k;
  }
}

TEST(ToolPath, NamesTheJointThatIsBeyondItsLimits) {
  RotaryLimits limits = kWideLimits;
  limits.a_minimum_rad = -15 * kRadPerDeg;
  const auto status = Correct(FanOnAPlane(11), ExactPose(TurnedBy({10, 0, 0})), {}, limits).status();
  EXPECT_TRUE(absl::IsOutOfRange(status)) << status;
  const auto violations = ViolationsOf(status);
  ASSERT_EQ(violations.size(), 1u) << status;
  EXPECT_EQ(violations[0].field, "paths[F1].targets[8].A");  // at 16 degrees
  EXPECT_EQ(violations[0].value, "-16 deg, 1 deg beyond");
  EXPECT_EQ(violations[0].wanted, "-15 to 100 deg");
}

// A table of A about Y, and B about Z under the part.
RotaryAxes BUnderThePart() {
  RotaryAxes axes;
  axes.a = {Eigen::Vector3d::UnitY(), {0, 0, -50}};
  axes.b = {Eigen::Vector3d::UnitZ(), {0, 0, -50}};
  return axes;
}

// The axis passes B's at half a degree: from pose to pose B would turn by half a turn.
TEST(ToolPath, RefusesAJumpByPoseAndJoint) {
  NominalToolPath path;
  path.name = "F2";
  for (int k = -3; k <= 3; ++k)
    path.poses.push_back({{0.2 * k, 0, 0}, Eigen::Vector3d(0.05 * k + 0.01, 0.005, 1).normalized()});
  const auto status = Correct(path, ExactPose(Eigen::Isometry3d::Identity()), BUnderThePart()).status();
  EXPECT_TRUE(absl::IsOutOfRange(status)) << status;
  const auto violations = ViolationsOf(status);
  ASSERT_EQ(violations.size(), 1u) << status;
  EXPECT_EQ(violations[0].field, "paths[F2].targets[3].B") << status;
  EXPECT_THAT(violations[0].value, HasSubstr("a step of "));
}

// With a tilt to spare B is led past its own axis; what is left is stated, and the tips lose nothing.
TEST(ToolPath, IsLedPastBWithTheTiltThatIsLeft) {
  NominalToolPath path;
  path.name = "F2";
  path.inclination_tolerance_rad = 1 * kRadPerDeg;
  for (int k = -3; k <= 3; ++k)
    path.poses.push_back({{0.2 * k, 0, 0}, Eigen::Vector3d(0.05 * k, 1e-3, 1).normalized()});
  RegisteredPose pose = ExactPose(Eigen::Isometry3d::Identity());
  pose.noise.values = Matrix6d::Identity() * 1e-10;
  const auto corrected = Correct(path, pose, BUnderThePart());
  ASSERT_TRUE(corrected.ok()) << corrected.status();
  for (std::size_t k = 0; k < path.poses.size(); ++k) {
    const CorrectedToolPose& at = corrected->poses[k];
    EXPECT_EQ(at.b_is_free, k == 3);
    EXPECT_LE(at.tilt_rad, 0.25 * kRadPerDeg);
    const Eigen::Isometry3d part_from_machine =
        BUnderThePart().MachineFromZero(at.reached.a_rad, at.reached.b_rad).inverse();
    EXPECT_LT((part_from_machine * at.start.start_mm - path.poses[k].tip_in_part_mm).norm(), 1e-9);
    const double tilt_rad = std::acos(std::min(1.0, part_from_machine.linear().col(2).dot(path.poses[k].axis_in_part)));
    EXPECT_NEAR(tilt_rad, at.tilt_rad, 1e-7);
  }
  EXPECT_GT(corrected->poses[3].tilt_rad, 1e-4);  // at k = 0, a milliradian from B
  EXPECT_GT(corrected->poses[3].tilt_standard_uncertainty_rad, 5e-6);
}

TEST(ToolPath, EndsWithItsCallerAndTakesSoManyPoses) {
  const RegisteredPose pose = ExactPose(TurnedBy({10, 0, 0}));
  const auto asked_until = [&](int last, int* asked) {
    return CorrectToolPath(FanOnAPlane(40), pose, pose.zero_from_part, RotaryAxes(), kWideLimits, kSomeSteps, {},
                           {"A", "B"}, [=] { return ++*asked < last; })
        .status();
  };
  int asked = 0;
  EXPECT_TRUE(asked_until(1 << 30, &asked).ok());
  EXPECT_GT(asked, 40 * 30);  // each pose in each of the solutions
  for (const int last : {1, 30, asked}) {
    int again = 0;
    EXPECT_TRUE(absl::IsCancelled(asked_until(last, &again))) << last;
    EXPECT_EQ(again, last);
  }
  NominalToolPath many = FanOnAPlane(2);
  many.poses.resize(5001, many.poses[0]);
  const auto violations = ViolationsOf(Correct(many, pose).status());
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "paths[F1].poses");
  EXPECT_EQ(violations[0].value, "5001");
  EXPECT_EQ(violations[0].wanted, "at most 5000");
}

TEST(ToolPath, RefusesWhatIsMalformedByName) {
  const RegisteredPose pose = ExactPose(Eigen::Isometry3d::Identity());
  NominalToolPath path = FanOnAPlane(3);
  path.poses[1].axis_in_part *= 2;
  path.poses[2].tip_in_part_mm.x() = NAN;
  path.position_tolerance_mm = -1;
  const auto violations = ViolationsOf(Correct(path, pose).status());
  ASSERT_EQ(violations.size(), 3u);
  EXPECT_EQ(violations[0].field, "paths[F1].poses[1].axis_in_part");
  EXPECT_EQ(violations[1].field, "paths[F1].poses[2].tip_in_part_mm");
  EXPECT_EQ(violations[2].field, "paths[F1].position_tolerance_mm");
  path = FanOnAPlane(3);
  path.poses.clear();
  EXPECT_TRUE(absl::IsInvalidArgument(Correct(path, pose).status()));
  RegisteredPose bad = pose;
  bad.noise.values(1, 1) = NAN;
  EXPECT_TRUE(absl::IsInvalidArgument(Correct(FanOnAPlane(3), bad).status()));
  // B and Z: a tool along A cannot be turned by it.
  path = FanOnAPlane(2);
  path.poses[1].axis_in_part = {0, 1, 0};
  RotaryAxes axes;
  axes.b.direction = {0, std::sin(60 * kRadPerDeg), std::cos(60 * kRadPerDeg)};
  const auto status = Correct(path, pose, axes).status();
  EXPECT_TRUE(absl::IsOutOfRange(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("paths[F1].targets["));
}

TEST(ToolPath, SameInputsGiveTheSameBits) {
  std::mt19937_64 random(41);
  const SomePlace place(random);
  const RegisteredPose pose = UncertainPose(place);
  const auto solve = [&] {
    return *CorrectToolPath(FanOnAPlane(7), pose, place.nominal, SomeAxes(), kWideLimits, kSomeSteps);
  };
  const CorrectedToolPath one = solve(), other = solve();
  for (std::size_t k = 0; k < one.poses.size(); ++k) {
    EXPECT_EQ(one.poses[k].start.start_mm, other.poses[k].start.start_mm);
    EXPECT_EQ(one.poses[k].start.covariance_mm2, other.poses[k].start.covariance_mm2);
    EXPECT_EQ(one.poses[k].start.expanded_uncertainty_um, other.poses[k].start.expanded_uncertainty_um);
    EXPECT_EQ(one.poses[k].corrected.b_rad, other.poses[k].corrected.b_rad);
  }
}

}  // namespace
}  // namespace sixpoint::metrology
