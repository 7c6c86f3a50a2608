#include "metrology/registration/allowance.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// A box of 20 x 10 x 6 mm about the origin.
const Vector3d kHalf(10, 5, 3);

std::shared_ptr<const Surface> BoxSurface() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices_mm.push_back(kHalf.cwiseProduct(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  const std::array<std::array<std::uint32_t, 4>, 6> faces = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& f : faces) {
    mesh.triangles.push_back({f[0], f[1], f[2]});
    mesh.triangles.push_back({f[0], f[2], f[3]});
  }
  return *Surface::Prepare(mesh);
}

// The six faces of a blank at their own distances from the middle: low x, high x, low y, ... ; so much of their length and width.
Points Blank(const std::array<double, 6>& faces_mm, double noise_mm, std::uint64_t seed, double scanned = 0.85) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::normal_distribution<double> noise(0, 1);
  Points points;
  for (int face = 0; face < 6; ++face)
    for (int i = 0; i < 4000; ++i) {
      Vector3d p(unit(random), unit(random), unit(random));
      p = scanned * p.cwiseProduct(kHalf);
      p[face / 2] = (face % 2 == 0 ? -1 : 1) * (faces_mm[static_cast<std::size_t>(face)] + noise_mm * noise(random));
      points.push_back(p);
    }
  return points;
}

// What is not about coverage does with what Blank leaves.
AllowanceFit FitWithStock(const Points& points, AllowanceOptions allowance,
                          const Isometry3d& start = Isometry3d::Identity(), const FitOptions& options = {}) {
  allowance.least_side_part = std::min(allowance.least_side_part, 0.6);
  auto fit =
      FitWithAllowance(*BoxSurface(), {PortionAtZero(points)}, start, allowance, MachineCalibration::Exact(), options);
  EXPECT_TRUE(fit.ok()) << fit.status();
  return fit.ok() ? *fit : AllowanceFit();
}

// Stock enough everywhere for the least-squares pose: that is the answer, midway between the faces (points drawn at random
// tilt it by some 1e-4 rad, which moves the middle by a micrometre or two).
TEST(Allowance, IsTheLeastSquaresPoseWhereThatLeavesEnough) {
  const AllowanceFit fit = FitWithStock(Blank({10.4, 10.8, 5.5, 5.3, 3.4, 3.6}, 0, 1), {});
  EXPECT_EQ(fit.fit.outcome, Outcome::kConverged) << fit.fit.evidence.remark;
  EXPECT_NEAR(Placed(fit.fit).zero_from_part.translation().x(), 0.2, 5e-3);
  EXPECT_NEAR(Placed(fit.fit).zero_from_part.translation().y(), -0.1, 5e-3);
  EXPECT_NEAR(Placed(fit.fit).zero_from_part.translation().z(), 0.1, 5e-3);
  EXPECT_TRUE(fit.stock.holding.empty());
  EXPECT_EQ(fit.stock.lacking_mm, 0);
}

// A pit of 0.3 mm in the high x face, 0.2 mm under the design where least squares would put it: the part has to go low x by
// just so much that the pit has the stock asked for.
TEST(Allowance, GivesWayToAPitByJustEnough) {
  Points points = Blank({10.1, 10.1, 5.1, 5.1, 3.1, 3.1}, 0, 2);
  for (Vector3d& p : points)
    if (p.x() > 10 && std::abs(p.y()) < 2.001 && std::abs(p.z()) < 1.001) p.x() -= 0.15;
  AllowanceOptions allowance;
  allowance.least_stock_mm = 0.02;
  const AllowanceFit fit = FitWithStock(points, allowance);
  EXPECT_EQ(fit.fit.outcome, Outcome::kConverged) << fit.fit.evidence.remark;
  EXPECT_NEAR(fit.stock.least_stock_mm, 0.02, 1e-4);
  ASSERT_FALSE(fit.stock.holding.empty());
  for (const AllowancePatch& patch : fit.stock.holding) {
    EXPECT_NEAR(patch.stock_mm, 0.02, 1e-4);
    EXPECT_GT(patch.normal.x(), 0.99);
    EXPECT_LT(std::abs(patch.point_mm.y()), 2.6);
  }
  // The pit's 9.95 mm less 0.02; the middle of the pit need not tilt the part.
  EXPECT_NEAR((Placed(fit.fit).zero_from_part * Vector3d(10, 0, 0)).x(), 9.93, 5e-3);
}

// Pits opposite each other in the large faces, so that there are some hundredths of a millimetre for the pose, or
// micrometres: the steps come to rest, at a pose that is right, whatever patches the points fall into. Faces that lie a round
// number of millimetres from the middle, as a design's do, take no part in two rows of patches by chance.
TEST(Allowance, ComesToRestWhereItHasLittleRoom) {
  for (int seed = 0; seed < 40; ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    std::uniform_real_distribution<double> unit(-1, 1);
    std::array<double, 6> faces{10.5, 10.5, 5.5, 5.5, 3.5, 3.5};
    for (double& face : faces) face += 0.15 * unit(random);
    const double margin_mm = seed % 2 == 0 ? 0.02 : 5e-3, stock_mm = 0.1, share = 0.5 + 0.3 * unit(random);
    const double pits_mm = faces[4] + faces[5] - 2 * (3 + stock_mm + margin_mm);
    const Vector3d pit(5 * unit(random), 1.5 * unit(random), 0);
    Points points = Blank(faces, 2e-3, static_cast<std::uint64_t>(seed));
    for (Vector3d& p : points)
      if (std::abs(p.z()) > 3.2 && (p - pit).head<2>().cwiseAbs().maxCoeff() < 2)
        p.z() -= (p.z() > 0 ? share : -(1 - share)) * pits_mm;
    Vector6d off;
    for (Eigen::Index k = 0; k < 6; ++k) off[k] = (k < 3 ? 5e-3 : 0.1) * unit(random);
    AllowanceOptions allowance;
    allowance.least_stock_mm = stock_mm;
    const AllowanceFit fit = FitWithStock(points, allowance, Perturbed(Isometry3d::Identity(), off, Vector3d::Zero()));
    EXPECT_EQ(fit.fit.outcome, Outcome::kConverged) << seed << ": " << fit.fit.evidence.remark;
    EXPECT_GE(fit.stock.least_stock_mm, stock_mm - 1e-4) << seed;
    EXPECT_LE(fit.fit.evidence.iteration_count, 15) << seed;
  }
}

// A blank thinner than the part by 0.1 mm: no pose contains it; the best shares the lack between both faces.
TEST(Allowance, ProvesThatThereIsNoPose) {
  const AllowanceFit fit = FitWithStock(Blank({10.3, 10.3, 5.3, 5.3, 2.98, 2.92}, 0, 3), {});
  EXPECT_EQ(fit.fit.outcome, Outcome::kInfeasible);
  EXPECT_NEAR(fit.stock.lacking_mm, 0.05, 1e-3);
  EXPECT_FALSE(fit.fit.placed.has_value());
  EXPECT_NEAR(fit.fit.evidence.stopped_at->translation().z(), -0.03, 2e-3);
  // Faces that pull against each other: their forces balance.
  Vector3d force = Vector3d::Zero();
  double sum = 0;
  for (const AllowancePatch& patch : fit.stock.holding) {
    EXPECT_GT(std::abs(patch.normal.z()), 0.99);
    force += patch.share * patch.normal;
    sum += patch.share;
  }
  EXPECT_LT(force.norm(), 1e-3);
  EXPECT_NEAR(sum, 1, 1e-9);
  EXPECT_NE(fit.fit.evidence.remark.find("no pose"), std::string::npos);
}

// The same thin blank suffices where the design's lower tolerance may be used up.
TEST(Allowance, UsesTheLowerTolerance) {
  AllowanceOptions allowance;
  allowance.least_stock_mm = -0.06;
  const AllowanceFit fit = FitWithStock(Blank({10.3, 10.3, 5.3, 5.3, 2.98, 2.92}, 0, 4), allowance);
  EXPECT_EQ(fit.fit.outcome, Outcome::kConverged) << fit.fit.evidence.remark;
  EXPECT_GE(fit.stock.least_stock_mm, -0.0601);
}

AllowanceFit FitSeen(const Points& points, const AllowanceOptions& allowance = {}, const FitOptions& options = {}) {
  auto fit = FitWithAllowance(*BoxSurface(), {PortionAtZero(points)}, Isometry3d::Identity(), allowance,
                              MachineCalibration::Exact(), options);
  EXPECT_TRUE(fit.ok()) << fit.status();
  return fit.ok() ? *fit : AllowanceFit();
}

// A blank's low x face and half of its low z face were not scanned: the pose would be pushed out there, and nothing would show it.
TEST(Allowance, CertifiesNoSideThatItDidNotSee) {
  const Points whole = Blank({10.4, 10.8, 5.5, 5.3, 3.4, 3.6}, 0, 9, 0.999);
  EXPECT_EQ(FitSeen(whole).fit.outcome, Outcome::kConverged);
  Points points;
  for (const Vector3d& p : whole)
    if (p.x() > -10 && !(p.z() < -3 && p.x() < 0)) points.push_back(p);
  const AllowanceFit fit = FitSeen(points);
  EXPECT_EQ(fit.fit.outcome, Outcome::kNotDetermined);
  EXPECT_FALSE(fit.fit.placed.has_value());
  EXPECT_NE(fit.fit.evidence.remark.find("-x 0 % seen; -z "), std::string::npos) << fit.fit.evidence.remark;
  ASSERT_EQ(fit.stock.sides.size(), 6u);
  double area = 0, seen = 0;
  for (const SeenSide& side : fit.stock.sides) {
    const double here = side.direction.cwiseAbs().dot(Vector3d(60, 120, 200));  // of a face, mm2
    EXPECT_NEAR(side.area_mm2, here, 1e-6 * here);
    area += side.area_mm2;
    seen += side.seen_mm2;
    if (side.direction.z() < 0) {
      EXPECT_NEAR(side.seen_part(), 0.5, 0.06);  // to whole cells
      EXPECT_LT(side.unseen_about_mm.x(), -3);
    } else {
      EXPECT_NEAR(side.seen_part(), side.direction.x() < 0 ? 0 : 1, 0.06);
    }
  }
  EXPECT_NEAR(fit.fit.evidence.surface_part, seen / area, 1e-12);

  // Where nobody asks about them they may stay unseen; and who says so takes them on trust.
  FitOptions above;
  above.regions_in = {{Region::Shape::kBox, {2, 0, 1}, {7, 6, 3.5}}};
  const AllowanceFit part = FitSeen(points, {}, above);
  EXPECT_EQ(part.fit.outcome, Outcome::kConverged) << part.fit.evidence.remark;
  EXPECT_EQ(part.stock.sides.size(), 3u);  // both y and high z
  AllowanceOptions trusting;
  trusting.least_side_part = 0;
  EXPECT_EQ(FitSeen(points, trusting).fit.outcome, Outcome::kConverged);
  // A blank that is too small is so whatever else was not seen.
  AllowanceOptions more;
  more.least_stock_mm = 0.5;
  EXPECT_EQ(FitSeen(points, more).fit.outcome, Outcome::kInfeasible);
}

// A spot every three millimetres has not seen a face, however wide the patches are over which stock is averaged.
TEST(Allowance, SeesNoMoreForWiderPatches) {
  Points spots;
  for (const Vector3d& p : Blank({10.4, 10.8, 5.5, 5.3, 3.4, 3.6}, 0, 10, 0.999))
    if (!(p.z() > 3 && (std::fmod(p.x() + 30, 3) > 1 || std::fmod(p.y() + 30, 3) > 1))) spots.push_back(p);
  for (const double patch_mm : {1.0, 3.0, 10.0}) {
    AllowanceOptions wide;
    wide.patch_mm = patch_mm;
    const AllowanceFit fit = FitSeen(spots, wide);
    EXPECT_EQ(fit.fit.outcome, Outcome::kNotDetermined) << patch_mm;
    EXPECT_NE(fit.fit.evidence.remark.find("+z "), std::string::npos) << fit.fit.evidence.remark;
    EXPECT_LT(fit.fit.evidence.surface_part, 0.93) << patch_mm;
  }
}

TEST(Allowance, ComesFromAPoseThatIsOff) {
  Vector6d off;
  off << 0.02, -0.015, 0.01, 0.4, -0.3, 0.2;
  const AllowanceFit fit = FitWithStock(Blank({10.4, 10.8, 5.5, 5.3, 3.4, 3.6}, 0, 5), {},
                                        Perturbed(Isometry3d::Identity(), off, Vector3d::Zero()));
  EXPECT_EQ(fit.fit.outcome, Outcome::kConverged) << fit.fit.evidence.remark;
  EXPECT_LT((Placed(fit.fit).zero_from_part.translation() - Vector3d(0.2, -0.1, 0.1)).norm(), 2e-3);
}

TEST(Allowance, KeepsWhatMayNotMove) {
  FitOptions options;
  options.free = {false, false, false, true, false, false};
  const AllowanceFit fit =
      FitWithStock(Blank({10.4, 10.8, 5.5, 5.3, 3.4, 3.6}, 0, 6), {}, Isometry3d::Identity(), options);
  EXPECT_NEAR(Placed(fit.fit).zero_from_part.translation().x(), 0.2, 1e-3);
  EXPECT_EQ(Placed(fit.fit).zero_from_part.translation().z(), 0);
  EXPECT_LT((Placed(fit.fit).zero_from_part.linear() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

// Squared pose error over the stated covariance, held by a face and free in the rest: 6 on average over the draws; the mean
// of 80 scatters by sqrt(2 * 6 / 80) = 0.39. Which patches hold changes from draw to draw, so three of those, and a half.
TEST(Allowance, StatedCovarianceIsWhatNoiseDoes) {
  double sum = 0;
  constexpr int kDraws = 80;
  AllowanceOptions allowance;
  allowance.patch_mm = 2;
  for (int draw = 0; draw < kDraws; ++draw) {
    const AllowanceFit exact = FitWithStock(Blank({10.4, 10.8, 5.5, 5.3, 3.4, 3.6}, 0, 100 + draw), allowance);
    const AllowanceFit fit = FitWithStock(Blank({10.4, 10.8, 5.5, 5.3, 3.4, 3.6}, 2e-3, 100 + draw), allowance);
    const Isometry3d off = Placed(fit.fit).zero_from_part * Placed(exact.fit).zero_from_part.inverse();
    const Vector3d reference = Placed(fit.fit).noise_covariance.reference_mm;
    Vector6d error;
    error << VectorFromRotation(off.linear()), off * reference - reference;
    sum += error.dot(Placed(fit.fit).noise_covariance.values.ldlt().solve(error));
  }
  EXPECT_NEAR(sum / kDraws, 6, 1.7);
}

TEST(Allowance, RefusesWhatCannotBeMeant) {
  const Points points = Blank({10.4, 10.8, 5.5, 5.3, 3.4, 3.6}, 0, 7);
  const auto status = [&](const AllowanceOptions& allowance) {
    return FitWithAllowance(*BoxSurface(), {PortionAtZero(points)}, Isometry3d::Identity(), allowance,
                            MachineCalibration::Exact(), {})
        .status();
  };
  AllowanceOptions bad;
  bad.least_stock_mm = 11;
  EXPECT_NE(status(bad).message().find("allowance.least_stock_mm"), std::string::npos);
  bad = {};
  bad.greatest_stock_mm = -1;
  EXPECT_NE(status(bad).message().find("allowance.greatest_stock_mm"), std::string::npos);
  bad = {};
  bad.patch_mm = 0;
  EXPECT_NE(status(bad).message().find("allowance.patch_mm"), std::string::npos);
  // A box of 760 mm2 in patches of 0.06 mm: 211 thousand.
  bad = {};
  bad.patch_mm = 0.06;
  EXPECT_NE(status(bad).message().find("allowance.patch_mm: 0.06, want at least 0.0616"), std::string::npos)
      << status(bad);
  Isometry3d away = Isometry3d::Identity();
  away.translation().x() = 100;
  EXPECT_NE(FitWithAllowance(*BoxSurface(), {PortionAtZero(points)}, away, {}, MachineCalibration::Exact(), {})
                .status()
                .message()
                .find("scans: 0"),
            std::string::npos);
}

}  // namespace
}  // namespace sixpoint::metrology
