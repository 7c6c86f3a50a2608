// What a caller may choose of a best fit, and what its evidence shows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "metrology/registration/patch_fit.h"
#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// Pose change between two poses as a turn and a shift of the part about its centroid, part axes.
Vector6d InPart(const Isometry3d& from, const Isometry3d& to) {
  const Isometry3d between = from.inverse() * to;
  const Vector3d centroid = BladeSurface()->centroid_mm();
  Vector6d change;
  change << VectorFromRotation(between.linear()), between * centroid - centroid;
  return change;
}

TEST(DegreesOfFreedom, FixedOnesKeepTheNominals) {
  const Points zero = Scanned(Spread(*BladeSurface(), 20000, 21).points_mm, BladePose(), kNoiseMm, 21);
  for (int fixed = 0; fixed < 6; ++fixed) {
    FitOptions options;
    options.free[static_cast<std::size_t>(fixed)] = false;
    // The nominal stands right in that direction and wrong in the others.
    Vector6d off;
    off << 0.012, -0.009, 0.01, 0.6, -0.5, 0.45;
    off[fixed] = 0;
    const Isometry3d start = BladePose() * Perturbed(Isometry3d::Identity(), off, BladeSurface()->centroid_mm());
    const PoseFit fit = FitToBlade({PortionAtZero(zero)}, options, start);
    EXPECT_EQ(fit.outcome, Outcome::kConverged) << fit.evidence.remark;
    EXPECT_LT(1e3 * GreatestDisplacement(*BladeSurface(), Placed(fit).zero_from_part, BladePose()), 2) << fixed;
    Matrix6d to_part = Matrix6d::Zero();
    to_part.topLeftCorner<3, 3>() = to_part.bottomRightCorner<3, 3>() = Placed(fit).zero_from_part.linear().transpose();
    const Matrix6d covariance = to_part * Placed(fit).noise_covariance.values * to_part.transpose();
    EXPECT_LT(covariance(fixed, fixed), 1e-20) << fixed;
    EXPECT_GT(covariance((fixed + 1) % 6, (fixed + 1) % 6), 1e-14) << fixed;
  }
}

// A part that does not stand where it is held: what that does to the pose, against fits that hold it elsewhere.
TEST(DegreesOfFreedom, WhatIsHeldIsAsUncertainAsIsStated) {
  const Points zero = Scanned(Spread(*BladeSurface(), 20000, 24).points_mm, BladePose(), kNoiseMm, 24);
  FitOptions options;
  options.free[1] = options.free[3] = false;
  const auto fit_from = [&](const Vector6d& off) {
    return FitToBlade({PortionAtZero(zero)}, options,
                      BladePose() * Perturbed(Isometry3d::Identity(), off, BladeSurface()->centroid_mm()));
  };
  const PoseFit bare = fit_from(Vector6d::Zero());
  for (const ErrorSource& source : Placed(bare).sources) EXPECT_NE(source.name, kHeldDirections);
  const auto is_held = [](const ErrorSource& source) { return source.name == kHeldDirections; };
  options.held_turn_rad = 1.5e-4;
  options.held_shift_mm = 2e-3;
  const PoseFit fit = fit_from(Vector6d::Zero());
  const auto held_source = std::find_if(Placed(fit).sources.begin(), Placed(fit).sources.end(), is_held);
  ASSERT_NE(held_source, Placed(fit).sources.end());
  const auto& columns = held_source->pose_per_sigma;
  ASSERT_EQ(columns.cols(), 6);
  const Matrix6d added = Placed(fit).covariance.values - Placed(bare).covariance.values;
  EXPECT_LT((added - columns * columns.transpose()).norm(), 1e-6 * added.norm());
  const double radius_mm = BladeSurface()->radius_of_gyration_mm();
  for (const int held : {1, 3}) {
    Vector6d off = Vector6d::Zero();
    off[held] = held < 3 ? options.held_turn_rad : options.held_shift_mm;
    const Isometry3d moved = Placed(fit_from(off)).zero_from_part;
    const Isometry3d between = moved * Placed(fit).zero_from_part.inverse();
    const Vector3d centroid = Placed(fit).covariance.reference_mm;
    Vector6d change;
    change << radius_mm * VectorFromRotation(between.linear()), between * centroid - centroid;
    Vector6d said = columns.col(held);
    said.head<3>() *= radius_mm;
    EXPECT_GT(said.norm(), 1e-3) << held;
    EXPECT_LT((change - said).norm(), 0.1 * said.norm()) << held;
  }
  for (const int free : {0, 2, 4, 5}) EXPECT_EQ(columns.col(free).norm(), 0) << free;
  options.held_shift_mm = -1;
  EXPECT_FALSE(
      FitToSurface(*BladeSurface(), {PortionAtZero(zero)}, StartPose(), MachineCalibration::Exact(), options).ok());
}

TEST(DegreesOfFreedom, OneAloneMoves) {
  const Points zero = Scanned(Spread(*BladeSurface(), 20000, 22).points_mm, BladePose(), kNoiseMm, 22);
  FitOptions options;
  options.free = {false, false, false, false, true, false};
  Vector6d off = Vector6d::Zero();
  off[4] = 0.2;
  const Isometry3d start = BladePose() * Perturbed(Isometry3d::Identity(), off, BladeSurface()->centroid_mm());
  const PoseFit fit = FitToBlade({PortionAtZero(zero)}, options, start);
  EXPECT_EQ(fit.outcome, Outcome::kConverged) << fit.evidence.remark;
  const Vector6d moved = InPart(start, Placed(fit).zero_from_part);
  EXPECT_NEAR(moved[4], -0.2, 1e-3);
  for (const int k : {0, 1, 2, 3, 5}) EXPECT_LT(std::abs(moved[k]), 1e-6) << k;
}

// A blade whose upper half was bent by 0.1 mm: the lower half alone, or all but the upper, stands where CAD says.
TEST(Regions, DecideWhatCounts) {
  SpreadSamples samples = Spread(*BladeSurface(), 40000, 23);
  for (Vector3d& p : samples.points_mm)
    if ((p - kPartCentreMm).z() > 0) p.y() += 0.1;
  const std::vector<ScanPortion> portions = {PortionAtZero(Scanned(samples.points_mm, BladePose(), kNoiseMm, 23))};
  Region upper;
  upper.centre_mm = kPartCentreMm + Vector3d(0, 0, 30);
  upper.half_mm = Vector3d(50, 50, 30);
  Region lower = upper;
  lower.centre_mm = kPartCentreMm - Vector3d(0, 0, 30);
  FitOptions in, out, ball;
  in.regions_in = {lower};
  out.regions_out = {upper};
  Region round;
  round.shape = Region::Shape::kBall;
  round.centre_mm = kPartCentreMm + Vector3d(0, 0, 19);
  round.half_mm.x() = 18.5;
  ball.regions_in = {round};
  for (const FitOptions& options : {in, out}) {
    const PoseFit fit = FitToBlade(portions, options);
    EXPECT_EQ(fit.outcome, Outcome::kConverged) << fit.evidence.remark;
    EXPECT_LT(1e3 * GreatestDisplacement(*BladeSurface(), Placed(fit).zero_from_part, BladePose()), 3);
    EXPECT_LT(fit.evidence.point_count, 22000);
    EXPECT_GT(fit.evidence.overlap, 0.9);
  }
  // In the ball the part stands 0.1 mm off along y.
  const PoseFit local = FitToBlade(portions, ball);
  EXPECT_EQ(local.outcome, Outcome::kConverged) << local.evidence.remark;
  const Vector3d moved = BladePose().inverse() * (Placed(local).zero_from_part * round.centre_mm) - round.centre_mm;
  EXPECT_NEAR(moved.y(), 0.1, 5e-3) << moved.transpose();
}

TEST(Regions, WithoutPointsAreRefused) {
  FitOptions options;
  Region nowhere;
  nowhere.centre_mm = kPartCentreMm + Vector3d(500, 0, 0);
  nowhere.half_mm = Vector3d::Constant(1);
  options.regions_in = {nowhere};
  const Points zero = Scanned(Spread(*BladeSurface(), 3000, 24).points_mm, BladePose(), kNoiseMm, 24);
  const auto fit =
      FitToSurface(*BladeSurface(), {PortionAtZero(zero)}, StartPose(), MachineCalibration::Exact(), options);
  EXPECT_EQ(fit.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(fit.status().message().find("regions: 0 points"), std::string::npos) << fit.status();
}

// Two scans that differ by 20 um along x: the pose lies between them by their weights.
TEST(ScanWeights, PullByTheirShare) {
  const SpreadSamples samples = Spread(*BladeSurface(), 20000, 25);
  Points one = Scanned(samples.points_mm, BladePose(), kNoiseMm, 25), other = one;
  const Vector3d along = 0.006 * (BladePose().linear() * Vector3d::UnitY());
  for (Vector3d& p : other) p += along;
  const std::vector<ScanPortion> portions = {PortionAtZero(one), PortionAtZero(other)};
  FitOptions options;
  double before = -1;
  for (const double weight : {0.1, 1.0, 10.0}) {
    options.scan_weights = {1, weight};
    const PoseFit fit = FitToBlade(portions, options);
    const double at =
        1e3 * along.normalized().dot(Placed(fit).zero_from_part * kPartCentreMm - BladePose() * kPartCentreMm);
    EXPECT_GT(at, before) << weight;
    EXPECT_LT(at, 6.2);
    if (weight == 1.0) {
      EXPECT_NEAR(at, 3, 0.3);
    }
    before = at;
  }
}

TEST(ScanWeights, AreRefusedWhereTheyMeanNothing) {
  const Points zero = Scanned(Spread(*BladeSurface(), 3000, 26).points_mm, BladePose(), kNoiseMm, 26);
  FitOptions options;
  for (const std::vector<double>& weights : {std::vector<double>{0.0}, {-1.0}, {std::nan("")}, {1.0, 1.0}}) {
    options.scan_weights = weights;
    const auto status =
        FitToSurface(*BladeSurface(), {PortionAtZero(zero)}, StartPose(), MachineCalibration::Exact(), options)
            .status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_NE(status.message().find("scan_weights"), std::string::npos);
  }
}

// What a wrong rotation centre does: two scans of the same surface, one of them 10 um off along its normals' mean.
TEST(Evidence, ShowsScansThatDisagree) {
  const SpreadSamples samples = Spread(*BladeSurface(), 40000, 27);
  const Points one = Scanned(samples.points_mm, BladePose(), kNoiseMm, 27);
  Points same = Scanned(samples.points_mm, BladePose(), kNoiseMm, 28), off = same;
  for (Vector3d& p : off) p += 0.01 * (BladePose().linear() * Vector3d::UnitY());
  const auto agreement = [&](const Points& other) {
    std::vector<ScanPortion> portions = {PortionAtZero(one), PortionAtZero(other)};
    portions[0].id = "first";
    portions[1].id = "second";
    const PoseFit fit = FitToBlade(portions);
    EXPECT_EQ(fit.evidence.agreements.size(), 1u);
    return fit.evidence.agreements.empty() ? PortionAgreement() : fit.evidence.agreements[0];
  };
  const PortionAgreement well = agreement(same), badly = agreement(off);
  EXPECT_EQ(well.scan + " " + well.other, "first second");
  EXPECT_GT(well.patch_count, 200);
  // The mean of as many patches scatters by some per cent.
  EXPECT_NEAR(well.difference_rms_mm / well.expected_rms_mm, 1, 0.2);
  EXPECT_GT(badly.difference_rms_mm, 0.005);
  EXPECT_LT(badly.difference_rms_mm, 0.0105);
  EXPECT_GT(badly.difference_rms_mm / badly.expected_rms_mm, 4);
}

TEST(Evidence, ShowsTheDeviationByRegion) {
  SpreadSamples samples = Spread(*BladeSurface(), 40000, 29);
  for (std::size_t i = 0; i < samples.points_mm.size(); ++i)
    if ((samples.points_mm[i] - kPartCentreMm).z() > 14 && samples.normals[i].y() > 0.5)
      samples.points_mm[i] += 0.008 * samples.normals[i];
  const PoseFit fit = FitToBlade({PortionAtZero(Scanned(samples.points_mm, BladePose(), kNoiseMm, 29))});
  ASSERT_FALSE(fit.evidence.regions.empty());
  RegionResidual greatest;
  for (const RegionResidual& region : fit.evidence.regions)
    if (region.point_count > 200 && region.mean_mm > greatest.mean_mm) greatest = region;
  EXPECT_GT((greatest.centre_mm - kPartCentreMm).z(), 0);
  EXPECT_NEAR(1e3 * greatest.mean_mm, 8, 4);
  EXPECT_GT(fit.evidence.surface_part, 0.7);
}

// The tip alone holds the span: an airfoil of constant section, its tip seen by a fiftieth of the points. From a start that
// is off by `off_mm` along the span, with a casting's bump besides.
std::shared_ptr<const Surface> Prism() {
  const auto point = [](double u, double v) {
    const double a = 2 * M_PI * u, x = 12 * std::cos(a), y = 2.5 * std::sin(a) + 0.012 * x * x;
    return Vector3d(x, y, 40 * (v - 0.5));
  };
  TriangleMesh mesh = shapes::Grid(point, 160, 80, false);
  const auto middle = static_cast<std::uint32_t>(mesh.vertices_mm.size());
  mesh.vertices_mm.emplace_back(0, 0.6, 20);
  const Eigen::Vector3f up(0, 0, 1);
  for (std::uint32_t i = 0; i < 160; ++i) {
    mesh.triangles.push_back({middle, 80 * 160 + i, 80 * 160 + (i + 1) % 160});
    mesh.corner_normals.push_back({up, up, up});
  }
  return *Surface::Prepare(mesh);
}

TEST(TipTrap, TheLossDoesNotTakeTheTipForForeign) {
  const auto surface = Prism();
  const auto is_tip = [](const SurfacePoint& on) { return on.normal.z() > 0.9; };
  const auto is_wall = [](const SurfacePoint& on) { return std::abs(on.normal.z()) < 0.1; };
  for (const double off_mm : {0.014, 0.05, 0.3, -0.014, -0.3})
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SpreadSamples samples = Spread(*surface, 49000, seed, is_wall);
      for (std::size_t i = 0; i < samples.points_mm.size(); ++i) {
        const Vector3d& p = samples.points_mm[i];
        if (samples.normals[i].y() > 0.35)
          samples.points_mm[i] += 0.2 * std::exp(-(p.x() * p.x() + p.z() * p.z()) / (2 * 25)) * samples.normals[i];
      }
      const SpreadSamples tip = Spread(*surface, 1000, seed + 50, is_tip);
      samples.points_mm.insert(samples.points_mm.end(), tip.points_mm.begin(), tip.points_mm.end());
      Isometry3d start = Isometry3d::Identity();
      start.translation().z() = off_mm;
      const auto fit =
          FitToSurface(*surface, {PortionAtZero(Scanned(samples.points_mm, Isometry3d::Identity(), kNoiseMm, seed))},
                       start, MachineCalibration::Exact(), {});
      ASSERT_TRUE(fit.ok()) << fit.status();
      EXPECT_EQ(fit->outcome, Outcome::kConverged) << fit->evidence.remark;
      // A thousand points of 2 um hold the span to 0.06 um; four of those.
      EXPECT_LT(1e3 * std::abs(Placed(*fit).zero_from_part.translation().z()), 0.3) << off_mm;
      EXPECT_GT(fit->evidence.information_kept, 0.5);
    }
}

// Summed 14 um off along the span, where the loss over points no longer reaches the tip of a fit that trusts the airfoil: the
// patches at the tip come back, because nothing else knows of the span.
TEST(TipTrap, PatchesThatAloneHoldADirectionAreKept) {
  const auto surface = Prism();
  const auto is_tip = [](const SurfacePoint& on) { return on.normal.z() > 0.9; };
  SpreadSamples samples = Spread(*surface, 49000, 7);
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < samples.points_mm.size(); ++i)
    if (std::abs(samples.normals[i].z()) < 0.1) points.push_back(samples.points_mm[i]);
  const SpreadSamples tip = Spread(*surface, 1000, 8, is_tip);
  points.insert(points.end(), tip.points_mm.begin(), tip.points_mm.end());
  Isometry3d off = Isometry3d::Identity();
  off.translation().z() = 0.014;
  const std::vector<ScanPortion> portions = {PortionAtZero(Scanned(points, Isometry3d::Identity(), kNoiseMm, 7))};
  const auto sums = SumPatches(*surface, portions, off, {0.03, 1, true}, {});
  ASSERT_TRUE(sums.ok());
  // Whatever the fit believed before of the span: 10 um, or, wrongly, 0.1 um.
  for (const double span_mm : {1e-2, 1e-4}) {
    PatchFitOptions options;
    options.patch_mm = 1;
    options.start_covariance = 1e-8 * Matrix6d::Identity();
    options.start_covariance(5, 5) = span_mm * span_mm;
    const PatchFit fit = FitPatches(*sums, options);
    EXPECT_NEAR(1e3 * fit.change[5], -14, 0.5) << span_mm;
    EXPECT_GT(fit.information_kept, 0.9) << span_mm;
  }
}

}  // namespace
}  // namespace sixpoint::metrology
