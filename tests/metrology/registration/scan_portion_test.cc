#include "metrology/registration/scan_portion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

LineScan SomeScan() {
  LineScan scan;
  scan.id = "s";
  scan.v0_mm = {3, -2, 5};
  scan.a_rad = 0.3;
  scan.b_rad = -1.1;
  scan.stretch = 1.0001;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-20, 20);
  for (int i = 0; i < 10'000; ++i) scan.points_mm.emplace_back(place(random), place(random), place(random));
  for (std::size_t i = 0; i < scan.points_mm.size(); i += 97)
    scan.points_mm[i].y() = std::numeric_limits<double>::quiet_NaN();
  return scan;
}

Thinning Dense() {
  Thinning thinning;
  thinning.target_count = 700;
  thinning.dense_places_mm = {Vector3d(1, 2, 3), Vector3d(-8, 4, 0)};
  return thinning;
}

// Pieces of different lengths, one of them empty.
std::vector<Points> Cut(const Points& points) {
  std::vector<Points> pieces;
  std::size_t from = 0;
  for (std::size_t length = 1; from < points.size(); length = (length * 7) % 1009) {
    const std::size_t to = std::min(points.size(), from + length);
    pieces.emplace_back(points.begin() + static_cast<std::ptrdiff_t>(from),
                        points.begin() + static_cast<std::ptrdiff_t>(to));
    if (pieces.size() == 3) pieces.emplace_back();
    from = to;
  }
  return pieces;
}

void ExpectSame(const ScanPortion& one, const ScanPortion& other) {
  EXPECT_EQ(one.sensor.values_nm(), other.sensor.values_nm());
  EXPECT_EQ(one.sensor.origin_mm(), other.sensor.origin_mm());
  EXPECT_EQ(one.dense_sensor_mm, other.dense_sensor_mm);
  EXPECT_EQ(one.dense_zero_mm, other.dense_zero_mm);
  EXPECT_EQ(one.scan_point_count, other.scan_point_count);
  EXPECT_EQ(one.out_of_reach_count, other.out_of_reach_count);
}

TEST(Thinner, GivesTheSameBitsOfPiecesOnAnyNumberOfThreads) {
  const LineScan scan = SomeScan();
  const ScanPortion whole = Thin(scan, {}, Dense());
  ASSERT_GT(whole.sensor.size(), 500u);
  ASSERT_GT(whole.dense_sensor_mm.size(), 100u);
  const std::vector<Points> pieces = Cut(scan.points_mm);
  const auto count = static_cast<std::int64_t>(scan.points_mm.size());
  Thinning sparse;
  sparse.target_count = 90;
  for (const int threads : {1, 2, 5}) {
    Thinner one(scan, count, {}, Dense()), other(scan, count, {}, sparse);
    const auto piece = [&](std::size_t i) -> absl::StatusOr<Points> { return pieces[i]; };
    ASSERT_TRUE(Thinner::AddPieces(pieces.size(), piece, threads, {&one, &other}).ok());
    ExpectSame(one.Take(), whole);
    ExpectSame(other.Take(), Thin(scan, {}, sparse));
  }
}

TEST(Thinner, EndsWithTheFirstPieceThatCannotBeMade) {
  const LineScan scan = SomeScan();
  Thinner thinner(scan, 10'000, {}, Dense());
  const auto piece = [&](std::size_t i) -> absl::StatusOr<Points> {
    if (i == 3) return absl::DataLossError("the fourth");
    return scan.points_mm;
  };
  EXPECT_EQ(Thinner::AddPieces(9, piece, 2, {&thinner}).message(), "the fourth");
}

// Whatever changes a portion's points changes them; another name or another dense place does not.
TEST(Thinner, TellsWhatItsPortionFollowsFrom) {
  const LineScan scan = SomeScan();
  const auto of = [](const LineScan& of_scan, const MachineCalibration& calibration, const Thinning& thinning) {
    return Thinner(of_scan, 10'000, calibration, thinning).Determinants();
  };
  const std::vector<double> usual = of(scan, {}, Dense());
  EXPECT_EQ(usual, of(scan, {}, Dense()));
  LineScan named = scan;
  named.id = "t";
  EXPECT_EQ(usual, of(named, {}, Dense()));
  LineScan moved = scan;
  moved.v0_mm.x() += 1e-9;
  EXPECT_NE(usual, of(moved, {}, Dense()));
  LineScan warm = scan;
  warm.stretch += 1e-9;
  EXPECT_NE(usual, of(warm, {}, Dense()));
  Thinning fewer = Dense();
  fewer.target_count = 100;
  EXPECT_NE(usual, of(scan, {}, fewer));
  MachineCalibration mounted = MachineCalibration::Exact();
  mounted.sensor.t_sm_mm.z() = 1e-9;
  EXPECT_NE(usual, of(scan, mounted, Dense()));
  MachineCalibration bent = MachineCalibration::Exact();
  bent.sensor.field = {20, 20};
  bent.sensor.measured_field.emplace().terms_mm[0] = 1e-6;
  EXPECT_NE(usual, of(scan, bent, Dense()));
  MachineCalibration otherwise = bent;
  otherwise.sensor.measured_field->terms_mm[1] = 1e-6;
  EXPECT_NE(of(scan, bent, Dense()), of(scan, otherwise, Dense()));
}

}  // namespace
}  // namespace sixpoint::metrology
