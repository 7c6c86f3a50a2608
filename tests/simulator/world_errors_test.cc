// Each error of the harsher world has the size that is stated of it. Over n draws a standard deviation is known to 1 / sqrt(2 n) of itself
// where they are normal; tolerances are four times that, or as said.
#include "simulator/world_errors.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::simulator {
namespace {

using metrology::kRadPerDeg;

TEST(ScannerField, IsOffAsStatedEverywhereAndIsNoPolynomial) {
  constexpr int kDraws = 4000;
  const Eigen::Vector2d places[] = {{0, 0}, {-11, 12}, {10, -9}};
  double squares[3] = {};
  for (int i = 0; i < kDraws; ++i) {
    const ScannerField field(2, Random(static_cast<std::uint64_t>(i)));
    for (int k = 0; k < 3; ++k) squares[k] += std::pow(1e3 * field.At_mm(places[k].x(), places[k].y()), 2) / kDraws;
  }
  for (const double square : squares) EXPECT_NEAR(std::sqrt(square), 2, 0.1);

  // Of the third order, over the measuring field: what it cannot follow is more than rounding.
  const ScannerField field(2, Random(7));
  constexpr int kSteps = 15;
  Eigen::MatrixXd terms(kSteps * kSteps, 10);
  Eigen::VectorXd off(kSteps * kSteps);
  for (int i = 0; i < kSteps; ++i)
    for (int k = 0; k < kSteps; ++k) {
      const double y = 2.0 * i / (kSteps - 1) - 1, z = 2.0 * k / (kSteps - 1) - 1;
      const int row = kSteps * i + k;
      terms.row(row) << 1, y, z, y * y, y * z, z * z, y * y * y, y * y * z, y * z * z, z * z * z;
      off[row] = 1e3 * field.At_mm(13.8 * y, 12.5 * z);
    }
  const Eigen::VectorXd left = off - terms * terms.colPivHouseholderQr().solve(off);
  EXPECT_GT(std::sqrt(left.squaredNorm() / left.size()), 0.005);
}

TEST(Speckle, IsSharedByNeighboursAndFadesAlongX) {
  const SpeckleDesign design{1.5, 4, 0.3};
  constexpr std::size_t kProfiles = 3000;
  constexpr int kColumns = 200;
  const Speckle speckle(design, 0.1, kProfiles, kColumns, Random(3));
  const auto product = [&](std::size_t profiles, int columns) {
    double sum = 0;
    int count = 0;
    for (std::size_t p = 0; p + profiles < kProfiles; ++p)
      for (int c = 0; c + columns < kColumns; ++c, ++count)
        sum += 1e6 * speckle.At_mm(p, c) * speckle.At_mm(p + profiles, c + columns);
    return sum / count / (1.5 * 1.5);
  };
  // 3000 profiles in steps of a third of the length, 200 columns by four: some 25,000 grains of their own.
  EXPECT_NEAR(product(0, 0), 1, 0.04);
  EXPECT_NEAR(product(0, 1), 0.75, 0.04);
  EXPECT_NEAR(product(0, 4), 0, 0.04);
  EXPECT_NEAR(product(3, 0), std::exp(-1), 0.04);
}

TEST(AxisError, RunsShowReversalWormAndBearing) {
  AxisError axis = AxisError::Draw(0.02, Random(5));
  axis.worm_teeth = 90;
  const EncoderRun run = RunAxis(axis, 0.0003, Random(6));
  ASSERT_EQ(run.commanded_deg.size(), 1522u);
  EXPECT_EQ(run.commanded_deg.front(), -10);
  EXPECT_EQ(run.commanded_deg[760], 370);
  EXPECT_EQ(run.commanded_deg.back(), -10);
  double reversal = 0, cosine = 0, sine = 0;
  int count = 0;
  for (std::size_t i = 0; i <= 760; ++i) {
    EXPECT_EQ(run.direction[i], 1);
    if (run.commanded_deg[i] < 0 || run.commanded_deg[i] >= 360) continue;  // one turn
    const double up = run.error_deg[i], down = run.error_deg[1521 - i];
    reversal += up - down;
    cosine += (up + down) * std::cos(90 * run.commanded_deg[i] * kRadPerDeg);
    sine += (up + down) * std::sin(90 * run.commanded_deg[i] * kRadPerDeg);
    ++count;
  }
  // 720 positions, each read to 0.6 mdeg at most.
  EXPECT_NEAR(reversal / count, axis.reversal_deg, 1e-4);
  EXPECT_NEAR(std::hypot(cosine, sine) / count, axis.worm_deg, 1e-4);
  EXPECT_NEAR(axis.At_deg(12, true), axis.At_deg(372, true), 1e-12);
}

TEST(ArmPlay, SwingsAsFarAsItSays) {
  const ArmPlay play = ArmPlay::Draw(Random(9));
  constexpr int kSwings = 5000;
  metrology::Vector6d squares = metrology::Vector6d::Zero();
  for (int i = 0; i < kSwings; ++i) squares += play.Swing(Random(static_cast<std::uint64_t>(i))).cwiseAbs2() / kSwings;
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::sqrt(squares[k]) / (play.turn_deg[k] * kRadPerDeg), 1, 0.04);
    EXPECT_NEAR(std::sqrt(squares[k + 3]) / (1e-3 * play.shift_um[k]), 1, 0.04);
  }
}

TEST(PinPlay, IsAnywhereWithinACircle) {
  const PinPlay play{2, 0.03};
  Random random(11);
  constexpr int kPins = 5000;
  Eigen::Vector2d off = Eigen::Vector2d::Zero(), tilt = off;
  for (int i = 0; i < kPins; ++i) {
    const Eigen::Vector2d one = play.Off_mm(&random);
    EXPECT_LE(one.norm(), 2 * 2e-3);
    off += one.cwiseAbs2() / kPins;
    tilt += play.Tilt_rad(&random).cwiseAbs2() / kPins;
  }
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(std::sqrt(off[k]), 2e-3, 0.08e-3);
    EXPECT_NEAR(std::sqrt(tilt[k]) / kRadPerDeg, 0.03, 0.0012);
  }
}

TEST(Warmth, StaysInItsRangeAndIsReadAsItsThermometerDoes) {
  constexpr int kPlants = 4000;
  double read = 0, coefficient = 0, measured = 0;
  for (int i = 0; i < kPlants; ++i) {
    const Warmth warmth = Warmth::Draw(Random(static_cast<std::uint64_t>(i)));
    EXPECT_LE(std::abs(warmth.part_c - 20), warmth.half_range_k);
    read += std::pow(warmth.part_read_c - warmth.part_c, 2) / kPlants;
    coefficient += std::pow(warmth.part_um_per_m_k - warmth.part_stated_um_per_m_k, 2) / kPlants;
    measured += warmth.is_measured ? 1.0 / kPlants : 0;
  }
  EXPECT_NEAR(std::sqrt(read), 0.3, 0.015);
  EXPECT_NEAR(std::sqrt(coefficient), 0.5, 0.025);
  EXPECT_NEAR(measured, 0.5, 0.04);
  Warmth warm;
  warm.part_c = 25;
  warm.part_um_per_m_k = 13;
  EXPECT_NEAR(warm.PartSeen(), 1 + 65e-6, 1e-9);
  warm.scales_c = 25;
  warm.scales_um_per_m_k = 13;
  EXPECT_NEAR(warm.PartSeen(), 1, 1e-12);
}

TEST(SmoothForm, HasTheMeanSquareOneAndFadesWithinSomeMillimetres) {
  constexpr int kForms = 3000;
  const Eigen::Vector3d at(1, 2, 20), normal = Eigen::Vector3d::UnitY();
  double square = 0, near = 0, far = 0, other_side = 0;
  for (int i = 0; i < kForms; ++i) {
    const SmoothForm form(Random(static_cast<std::uint64_t>(i)));
    const double here = form.At(at, normal);
    square += here * here / kForms;
    near += here * form.At(at + Eigen::Vector3d(0, 0, 2), normal) / kForms;
    far += here * form.At(at + Eigen::Vector3d(0, 0, 45), normal) / kForms;
    other_side += here * form.At(at, -normal) / kForms;
  }
  EXPECT_NEAR(square, 1, 0.11);
  EXPECT_GT(near, 0.9);
  EXPECT_LT(std::abs(far), 0.3);
  EXPECT_LT(std::abs(other_side), 0.3);
}

TEST(DrawErrors, LeavingOneOutChangesNoOther) {
  const WorldErrors all = DrawErrors(4, {}), without = DrawErrors(4, {"field", "arm"});
  EXPECT_TRUE(all.field && all.arm);
  EXPECT_FALSE(without.field || without.arm);
  EXPECT_EQ(all.noise_um, without.noise_um);
  EXPECT_EQ(all.touch_off_mm, without.touch_off_mm);
  EXPECT_EQ(all.a_axis->reversal_deg, without.a_axis->reversal_deg);
  EXPECT_EQ(all.warmth->part_c, without.warmth->part_c);
  EXPECT_NE(all.noise_um, DrawErrors(5, {}).noise_um);
}

}  // namespace
}  // namespace sixpoint::simulator
