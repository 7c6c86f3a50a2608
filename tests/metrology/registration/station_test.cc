// Three twisted blades in one fixture, nearer to each other than their boxes are, each clamped off by an error of its own, and scanned together
// with the plate that they stand on, clamps and chips. The scene knows nothing of how points are told apart.
#include "metrology/registration/station.h"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>

#include "metrology/frames/angles.h"
#include "metrology/registration/register.h"
#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::size_t kPointsOfBlade = 10'000, kPointsOfPlate = 5'000, kPointsOfClamp = 500, kChips = 200;

struct Fixture {
  std::vector<Isometry3d> nominal;  // zero_from_part
  double capture_mm = 0;

  Station At(std::size_t station) const {
    Station at{nominal[station], capture_mm, {}};
    for (std::size_t k = 0; k < nominal.size(); ++k)
      if (k != station) at.neighbours.push_back(nominal[k]);
    return at;
  }
};

// Side by side, flank to flank: the blade is 5 mm thick at its root, its box 13 mm. The last one is turned by 4 degrees.
Fixture SideBySide(double pitch_mm, double capture_mm) {
  Fixture fixture;
  fixture.capture_mm = capture_mm;
  for (int k = 0; k < 3; ++k) {
    Vector6d moved = Vector6d::Zero();
    moved.tail<3>() = BladePose().linear() * Vector3d(0, pitch_mm * (k - 1), 0);
    if (k == 2) moved.head<3>() = BladePose().linear() * Vector3d(0, 0, 4 * kRadPerDeg);
    fixture.nominal.push_back(Perturbed(BladePose(), moved, BladePose() * kPartCentreMm));
  }
  return fixture;
}

// Up to 0.6 mm along each axis, 1 mm together, and half a degree.
std::vector<Isometry3d> ClampedOff(const Fixture& fixture, std::mt19937_64* random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Isometry3d> truth;
  for (const Isometry3d& nominal : fixture.nominal) {
    Vector6d off;
    for (int i = 0; i < 6; ++i) off[i] = (i < 3 ? 0.5 * kRadPerDeg / std::sqrt(3) : 0.6) * unit(*random);
    truth.push_back(Perturbed(nominal, off, nominal * kPartCentreMm));
  }
  return truth;
}

// What a scanner sees from four sides, from above by 35 degrees: the whole fixture each time, but for the blade that is not there. Nothing hides
// anything: more is seen of neighbours and fixture than would be.
std::vector<ScanPortion> Scan(const Fixture& fixture, const std::vector<Isometry3d>& truth,
                              std::optional<std::size_t> absent, std::mt19937_64* random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::normal_distribution<double> noise(0, kNoiseMm);
  const Isometry3d& middle = fixture.nominal[1];
  std::vector<ScanPortion> portions;
  for (int view = 0; view < 4; ++view) {
    const Eigen::Matrix3d zero_from_sensor =
        middle.linear() * (Eigen::AngleAxisd(view * 90 * kRadPerDeg + 0.3, Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(55 * kRadPerDeg, Vector3d::UnitY()))
                              .toRotationMatrix();
    const Vector3d to_scanner = zero_from_sensor.col(2);
    ScanPortion& portion = portions.emplace_back();
    portion.id = std::to_string(view);
    portion.zero_from_sensor.linear() = zero_from_sensor;
    const auto add = [&](const Isometry3d& pose, const Vector3d& from_centre_mm) {
      const Vector3d zero_mm =
          pose * (kPartCentreMm + from_centre_mm) + Vector3d(noise(*random), noise(*random), noise(*random));
      portion.sensor.Add(zero_from_sensor.transpose() * zero_mm);
    };
    for (std::size_t k = 0; k < truth.size(); ++k) {
      if (k == absent) continue;
      const SpreadSamples samples = Spread(*BladeSurface(), kPointsOfBlade, (*random)());
      for (std::size_t i = 0; i < samples.points_mm.size(); ++i)
        if ((truth[k].linear() * samples.normals[i]).dot(to_scanner) > 0.25)
          add(truth[k], samples.points_mm[i] - kPartCentreMm);
    }
    // The plate under the roots, clamps that stand on it beside each station, and chips.
    for (std::size_t i = 0; i < kPointsOfPlate; ++i)
      add(middle, Vector3d(30 * unit(*random), 30 * unit(*random), -20.3));
    for (const Isometry3d& nominal : fixture.nominal)
      for (std::size_t i = 0; i < kPointsOfClamp; ++i)
        add(nominal,
            Vector3d(14.5 + 3 * std::abs(unit(*random)), 2 * unit(*random), -20 + 2 * std::abs(unit(*random))));
    for (std::size_t i = 0; i < kChips; ++i)
      add(middle, Vector3d(25 * unit(*random), 25 * unit(*random), 25 * unit(*random)));
  }
  return portions;
}

absl::StatusOr<Registered> RegisterAt(const Fixture& fixture, std::size_t station, std::vector<ScanPortion> portions,
                                      bool coarse_start = false, int threads = 2) {
  RegistrationTask task;
  task.station = fixture.At(station);
  task.zero_from_part_nominal = task.station->zero_from_part_nominal;
  task.options.coarse_start = coarse_start;
  task.options.thread_count = threads;
  for (ScanPortion& portion : portions) LeaveOutOthers(*BladeSurface(), *task.station, threads, &portion);
  return Register({*BladeSurface(), portions, MachineCalibration::Exact()}, task);
}

double ErrorAtStationUm(const Registered& registered, const Isometry3d& truth) {
  return 1e3 * GreatestDisplacement(*BladeSurface(), Placed(registered.fit).zero_from_part, truth);
}

// Each within a few um of its own truth: the bound of its points alone is 0.1 um, and what is left of plate and clamps pulls. Where the flanks are
// 3 mm apart, and where they are 1.5 mm apart: then either may stand where the other nominally does.
TEST(Station, EachBladeIsFoundAtItsOwn) {
  for (const double pitch_mm : {8.0, 6.5}) {
    const Fixture fixture = SideBySide(pitch_mm, 3);
    std::mt19937_64 random(41);
    double worst_um = 0;
    for (int draw = 0; draw < 6; ++draw) {
      const std::vector<Isometry3d> truth = ClampedOff(fixture, &random);
      const std::vector<ScanPortion> scans = Scan(fixture, truth, std::nullopt, &random);
      for (std::size_t station = 0; station < 3; ++station) {
        const auto registered = RegisterAt(fixture, station, scans);
        ASSERT_TRUE(registered.ok()) << registered.status();
        ASSERT_EQ(registered->fit.outcome, Outcome::kConverged) << station << ": " << registered->fit.evidence.remark;
        worst_um = std::max(worst_um, ErrorAtStationUm(*registered, truth[station]));
      }
    }
    std::printf("pitch %.1f mm: 18 blades at their own stations, worst vertex %.2f um\n", pitch_mm, worst_um);
    EXPECT_LT(worst_um, 3) << pitch_mm;
  }
}

// From a coarse start, too, which of all the points would find whichever blade fits best.
TEST(Station, FromACoarseStartToo) {
  const Fixture fixture = SideBySide(8, 3);
  std::mt19937_64 random(43);
  double worst_um = 0;
  const std::vector<Isometry3d> truth = ClampedOff(fixture, &random);
  const std::vector<ScanPortion> scans = Scan(fixture, truth, std::nullopt, &random);
  for (std::size_t station = 0; station < 3; ++station) {
    const auto registered = RegisterAt(fixture, station, scans, true);
    ASSERT_TRUE(registered.ok()) << registered.status();
    ASSERT_EQ(registered->fit.outcome, Outcome::kConverged) << station << ": " << registered->fit.evidence.remark;
    worst_um = std::max(worst_um, ErrorAtStationUm(*registered, truth[station]));
  }
  std::printf("coarse start: 3 blades at their own stations, worst vertex %.2f um\n", worst_um);
  EXPECT_LT(worst_um, 3);
}

// Without its blade a station has no pose, whatever of its neighbours, the plate, clamps and chips lies near: 60 tries.
TEST(Station, WithoutItsBladeHasNoPose) {
  int tries = 0, refused = 0;
  std::map<std::string, int> why;
  for (const double pitch_mm : {8.0, 6.5}) {
    const Fixture fixture = SideBySide(pitch_mm, 3);
    std::mt19937_64 random(47);
    for (int draw = 0; draw < 8; ++draw) {
      const std::vector<Isometry3d> truth = ClampedOff(fixture, &random);
      for (std::size_t station = 0; station < 3; ++station) {
        const std::vector<ScanPortion> scans = Scan(fixture, truth, station, &random);
        for (const bool coarse_start : {false, true}) {
          if (coarse_start && draw >= 2) continue;
          ++tries;
          const auto registered = RegisterAt(fixture, station, scans, coarse_start);
          if (!registered.ok()) {
            ++refused;
            continue;
          }
          EXPECT_FALSE(registered->fit.placed.has_value())
              << pitch_mm << " mm, draw " << draw << ", station " << station << ", coarse " << coarse_start
              << ": surface " << registered->fit.evidence.surface_part << ", overlap "
              << registered->fit.evidence.overlap << "; " << registered->fit.evidence.remark;
          EXPECT_NE(registered->fit.evidence.remark, "");
          ++why[registered->fit.evidence.remark.find("seen through") != std::string::npos ? "seen through the part"
                : registered->fit.evidence.remark.find("is seen at the station") != std::string::npos
                    ? "too little of the surface"
                : registered->fit.evidence.remark.find("capture_mm") != std::string::npos ? "beyond the capture"
                                                                                          : "no fit"];
        }
      }
    }
  }
  std::printf("%d tries without the blade, no pose: %d refused", tries, refused);
  for (const auto& [reason, count] : why) std::printf(", %d %s", count, reason.c_str());
  std::printf("\n");
}

// Alone at its station it may stand nearly so far off as it may at all; and no farther.
TEST(Station, AsFarAsItsCaptureAndNoFarther) {
  const Fixture fixture = SideBySide(30, 3);
  for (const double off_mm : {2.8, 3.3, 4.5}) {
    std::mt19937_64 random(53);
    std::vector<Isometry3d> truth = fixture.nominal;
    truth[0] =
        Perturbed(truth[0], (Vector6d() << Vector3d::Zero(), Vector3d(1, -1, 1).normalized() * off_mm).finished(),
                  truth[0] * kPartCentreMm);
    const auto registered = RegisterAt(fixture, 0, Scan(fixture, truth, std::nullopt, &random));
    ASSERT_TRUE(registered.ok()) << registered.status();
    if (off_mm < 3) {
      ASSERT_TRUE(registered->fit.placed.has_value()) << registered->fit.evidence.remark;
      const double error_um = ErrorAtStationUm(*registered, truth[0]);
      std::printf("%.1f mm off of 3: worst vertex %.2f um\n", off_mm, error_um);
      EXPECT_LT(error_um, 3);
    } else {
      EXPECT_FALSE(registered->fit.placed.has_value()) << off_mm;
      std::printf("%.1f mm off of 3: %s\n", off_mm, registered->fit.evidence.remark.c_str());
    }
  }
}

// A nest has the faces of the part that lies in it: the empty one is told from the part by the side alone from which it is seen. Seen from below, as no
// scanner could, the same points are the part's: so a cloud of which nobody knows from where it was seen has no place at a station.
TEST(Station, AnEmptyNestIsToldByTheSideItIsSeenFrom) {
  const Fixture fixture = SideBySide(30, 3);
  std::mt19937_64 random(71);
  std::normal_distribution<double> noise(0, kNoiseMm);
  const Isometry3d& nominal = fixture.nominal[0];
  // What of the blade looks down by more than 11 degrees, and is the nest's.
  const Vector3d up = (nominal.linear() * Vector3d(0.2, 1, 0.3)).normalized();
  for (const bool from_above : {true, false}) {
    ScanPortion portion;
    portion.id = "nest";
    portion.zero_from_sensor.linear() =
        Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), from_above ? up : -up).toRotationMatrix();
    const SpreadSamples samples = Spread(*BladeSurface(), 20'000, 1);
    for (std::size_t i = 0; i < samples.points_mm.size(); ++i)
      if ((nominal.linear() * samples.normals[i]).dot(up) < -0.2)
        portion.sensor.Add(portion.zero_from_sensor.linear().transpose() *
                           (nominal * samples.points_mm[i] + Vector3d(noise(random), noise(random), noise(random))));
    const auto registered = RegisterAt(fixture, 0, {portion});
    ASSERT_TRUE(registered.ok()) << registered.status();
    EXPECT_EQ(registered->fit.placed.has_value(), !from_above) << registered->fit.evidence.remark;
    if (!from_above) continue;
    EXPECT_EQ(registered->fit.outcome, Outcome::kTooLittleOverlap);
    EXPECT_NE(registered->fit.evidence.remark.find("seen through the part"), std::string::npos);
  }
}

TEST(Station, SaysHowFarOffItWouldStand) {
  const Fixture fixture = SideBySide(30, 3);
  std::mt19937_64 random(59);
  PoseFit fit;
  fit.outcome = Outcome::kConverged;
  Isometry3d far = fixture.nominal[0];
  far.translation().x() += 3.5;
  fit.placed.emplace(far, Vector3d::Zero(), Matrix6d::Identity(),
                     MappingSensitivity::Zero(6, kCalibrationParameterCount), MachineCalibration::Exact());
  HoldToStation(*BladeSurface(), {}, fixture.At(0), FitOptions(), &fit);
  EXPECT_EQ(fit.outcome, Outcome::kNotConverged);
  EXPECT_FALSE(fit.placed.has_value());
  EXPECT_EQ(fit.evidence.remark,
            "the part would stand 3.5 mm from its nominal place at the station, want at most its capture_mm, 3");
}

// What is kept is every point that is nearer to this nominal part than 3 mm and than to the others', by one look at each; the same on any number
// of threads. How far a search looks goes by flat triangles: by 20 um of its limit it may keep one or not.
TEST(Station, KeepsWhatIsNearestToItsOwnPart) {
  const Fixture fixture = SideBySide(6.5, 3);
  std::mt19937_64 random(61);
  const ScanPortion whole = Scan(fixture, ClampedOff(fixture, &random), std::nullopt, &random)[0];
  const auto distance_mm = [&](const Isometry3d& pose, const Vector3d& p) {
    return std::abs(BladeSurface()->Closest(pose.inverse() * p).signed_distance_mm);
  };
  for (std::size_t station = 0; station < 3; ++station) {
    ScanPortion one = whole;
    for (std::size_t i = 0; i < whole.sensor.size(); ++i) {
      one.dense_sensor_mm.push_back(whole.sensor[i]);
      one.dense_zero_mm.push_back(whole.zero_mm(i));
    }
    ScanPortion many = one;
    const std::int64_t left_out = LeaveOutOthers(*BladeSurface(), fixture.At(station), 1, &one);
    EXPECT_EQ(LeaveOutOthers(*BladeSurface(), fixture.At(station), 5, &many), left_out);
    EXPECT_EQ(many.sensor.values_nm(), one.sensor.values_nm());
    EXPECT_TRUE(many.dense_zero_mm == one.dense_zero_mm);
    EXPECT_EQ(static_cast<std::size_t>(left_out) + one.sensor.size(), whole.sensor.size());
    ASSERT_EQ(one.dense_zero_mm.size(), one.sensor.size());
    std::size_t next = 0, wrong = 0;
    for (std::size_t i = 0; i < whole.sensor.size(); ++i) {
      const bool is_kept = next < one.sensor.size() && one.dense_sensor_mm[next] == whole.sensor[i];
      next += is_kept ? 1 : 0;
      const double own_mm = distance_mm(fixture.nominal[station], whole.zero_mm(i));
      bool is_own = own_mm <= fixture.capture_mm;
      for (std::size_t k = 0; k < 3; ++k)
        is_own = is_own && (k == station || !(distance_mm(fixture.nominal[k], whole.zero_mm(i)) < own_mm));
      if (is_kept != is_own && std::abs(own_mm - fixture.capture_mm) > 0.02) ++wrong;
    }
    EXPECT_EQ(next, one.sensor.size());
    EXPECT_EQ(wrong, 0u);
  }
}

TEST(Station, SameBitsOnAnyNumberOfThreads) {
  const Fixture fixture = SideBySide(8, 3);
  std::mt19937_64 random(67);
  const std::vector<Isometry3d> truth = ClampedOff(fixture, &random);
  const std::vector<ScanPortion> scans = Scan(fixture, truth, std::nullopt, &random);
  const auto one = RegisterAt(fixture, 1, scans, false, 1), many = RegisterAt(fixture, 1, scans, false, 5);
  ASSERT_TRUE(one.ok() && many.ok());
  EXPECT_EQ(Placed(one->fit).zero_from_part.matrix(), Placed(many->fit).zero_from_part.matrix());
  EXPECT_EQ(Placed(one->fit).covariance.values, Placed(many->fit).covariance.values);
}

}  // namespace
}  // namespace sixpoint::metrology
