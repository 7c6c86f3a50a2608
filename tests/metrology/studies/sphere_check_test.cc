#include "metrology/studies/sphere_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

const Eigen::Vector3d kCentre(310.2, -55.1, 120.7);

// The 25 points of ISO 10360-5 over a half sphere: pole, and four rings.
Points Probed(double radius_mm, double sigma_mm, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, sigma_mm);
  Points points{kCentre + Eigen::Vector3d(0, 0, radius_mm + noise(random))};
  const std::pair<double, int> rings[] = {{22.5, 4}, {45, 8}, {67.5, 4}, {90, 8}};
  for (const auto& [angle, count] : rings)
    for (int i = 0; i < count; ++i) {
      const double t = angle * M_PI / 180, f = (i + (angle == 67.5 ? 0.5 : 0)) * 2 * M_PI / count;
      const Eigen::Vector3d d(std::sin(t) * std::cos(f), std::sin(t) * std::sin(f), std::cos(t));
      points.push_back(kCentre + (radius_mm + noise(random)) * d);
    }
  return points;
}

SphereCheckOptions Usual() {
  SphereCheckOptions options;
  options.diameter_mm = 25;
  options.diameter_standard_uncertainty_mm = 0.1e-3;
  options.sphere_form_mm = 0.1e-3;
  options.form_mpe_mm = 6e-3;
  options.size_mpe_mm = 3e-3;
  options.length_mpe_mm = 2e-3;
  options.length_mpe_divisor = 300;
  return options;
}

TEST(SphereCheck, AnExactSphereHasNoErrors) {
  const auto check = CheckSphere(Probed(12.5, 0, 1), {{"block-100", 100, 0.1e-3, 100}}, Usual());
  ASSERT_TRUE(check.ok()) << check.status();
  EXPECT_LT((check->centre_mm - kCentre).norm(), 1e-10);
  EXPECT_NEAR(check->diameter_mm, 25, 1e-10);
  EXPECT_LT(check->errors.at(0).error_mm, 1e-10);
  EXPECT_EQ(check->verdict, StudyVerdict::kAccepted);
  EXPECT_EQ(check->errors.size(), 3u);
}

TEST(SphereCheck, FormIsTheRangeOfTheRadii) {
  Points points = Probed(12.5, 0, 1);
  // A bump of 10 um at the pole: the fit takes up a part, the range is the rest.
  points[0].z() += 0.010;
  const auto check = CheckSphere(points, {}, Usual());
  ASSERT_TRUE(check.ok());
  double least = 1e9, greatest = -1e9;
  for (const Eigen::Vector3d& p : points) {
    least = std::min(least, (p - check->centre_mm).norm());
    greatest = std::max(greatest, (p - check->centre_mm).norm());
  }
  EXPECT_NEAR(check->errors.at(0).error_mm, greatest - least, 1e-12);
  EXPECT_GT(check->errors.at(0).error_mm, 6.2e-3);
  EXPECT_EQ(check->errors.at(0).verdict, StudyVerdict::kRejected);
  EXPECT_EQ(check->verdict, StudyVerdict::kRejected);
}

TEST(SphereCheck, UncertaintiesAreTrueOverManySeeds) {
  // 400 checks with 1 um: centre and diameter within what the fit says (chi-squared of 4 about 4 +- 0.14).
  double chi = 0, diameter = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    const auto check = CheckSphere(Probed(12.5, 1e-3, seed), {}, Usual());
    ASSERT_TRUE(check.ok());
    const Eigen::Vector3d d = check->centre_mm - kCentre;
    chi += d.dot(check->centre_covariance_mm2.ldlt().solve(d)) / 400;
    diameter += std::pow((check->diameter_mm - 25) / check->diameter_standard_uncertainty_mm, 2) / 400;
  }
  // With 21 degrees of freedom the mean of F(3) times 3 is 3 * 21 / 19 = 3.3; of t^2 21 / 19 = 1.1.
  EXPECT_NEAR(chi, 3.3, 0.55);
  EXPECT_NEAR(diameter, 1.1, 0.35);
}

TEST(SphereCheck, LengthsAreJudgedWithTheirUncertainty) {
  // MPE at 300 mm: 2 um + 300 / 300 um = 3 um.
  const auto verdict = [](double error_um, double u_um) {
    return CheckSphere(Probed(12.5, 0, 1), {{"bar", 300, u_um * 1e-3, 300 + error_um * 1e-3}}, Usual())->errors.at(2);
  };
  EXPECT_NEAR(verdict(0, 0.1).mpe_mm, 3e-3, 1e-12);
  EXPECT_EQ(verdict(2.7, 0.1).verdict, StudyVerdict::kAccepted);
  EXPECT_EQ(verdict(-2.9, 0.1).verdict, StudyVerdict::kUndecidable);
  EXPECT_EQ(verdict(3.1, 0.1).verdict, StudyVerdict::kUndecidable);
  EXPECT_EQ(verdict(-3.3, 0.1).verdict, StudyVerdict::kRejected);
}

TEST(SphereCheck, RefusesOtherUnitsAndPointsThatSayNothing) {
  const auto message = [](const Points& points, SphereCheckOptions options,
                          const std::vector<MeasuredLength>& lengths = {}) {
    return std::string(CheckSphere(points, lengths, options).status().message());
  };
  Points few = Probed(12.5, 0, 1);
  few.pop_back();
  EXPECT_THAT(message(few, Usual()), HasSubstr("points_mm: 24 of them, want at least 25"));
  Points inches = Probed(12.5, 0, 1);
  for (Eigen::Vector3d& p : inches) p /= 25.4;
  EXPECT_THAT(message(inches, Usual()), HasSubstr("both in millimetres"));
  EXPECT_THAT(message(Probed(12.5, 0, 1), Usual(), {{"bar", 300, 0, 11.811}}),
              HasSubstr("lengths[0].measured_mm: 11.811"));
  Points flat;
  for (int i = 0; i < 30; ++i) flat.emplace_back(std::cos(i), std::sin(i), 0);
  EXPECT_EQ(CheckSphere(flat, {}, Usual()).status().code(), absl::StatusCode::kFailedPrecondition);
  Points odd = Probed(12.5, 0, 1);
  odd[7].x() = std::numeric_limits<double>::infinity();
  EXPECT_THAT(message(odd, Usual()), HasSubstr("points_mm[7]: not finite"));
}

// What a scanner sees of it from above: the cap within 60 deg of the pole.
Points Scanned(double radius_mm, double sigma_mm, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, sigma_mm);
  Points points;
  for (double x = -1; x <= 1; x += 0.01)
    for (double y = -1; y <= 1; y += 0.01) {
      const double across = std::hypot(x, y);
      if (across > std::sin(M_PI / 3)) continue;
      const Eigen::Vector3d direction(x, y, std::sqrt(1 - across * across));
      points.push_back(kCentre + (radius_mm + noise(random)) * direction);
    }
  return points;
}

SphereCheckOptions OfAScanner() {
  SphereCheckOptions options = Usual();
  options.optical = true;
  options.dispersion_mpe_mm = 12e-3;
  return options;
}

// ISO 10360-8: 95 % of normal scatter lie within 3.92 sigma; the means of 25 places hide it, and show what the form is.
TEST(SphereCheck, OfAScannerTellsScatterFromForm) {
  const auto exact = CheckSphere(Scanned(12.5, 0, 1), {}, OfAScanner());
  ASSERT_TRUE(exact.ok()) << exact.status();
  ASSERT_EQ(exact->errors.size(), 4u);
  for (const CheckedError& error : exact->errors) EXPECT_LT(std::abs(error.error_mm), 1e-9) << error.quantity;
  const auto noisy = CheckSphere(Scanned(12.5, 2e-3, 2), {}, OfAScanner());
  ASSERT_TRUE(noisy.ok()) << noisy.status();
  EXPECT_EQ(noisy->errors[0].quantity, "form");
  EXPECT_LT(noisy->errors[0].error_mm, 1e-3);
  EXPECT_EQ(noisy->errors[2].quantity, "dispersion");
  EXPECT_NEAR(noisy->errors[2].error_mm, 3.92 * 2e-3, 0.15e-3);
  EXPECT_EQ(noisy->errors[2].verdict, StudyVerdict::kAccepted);
  // One point in twenty may be anywhere: that many do not count.
  Points stray = Scanned(12.5, 2e-3, 3);
  for (std::size_t i = 0; i < stray.size(); i += 40) stray[i] += 0.3 * (stray[i] - kCentre).normalized();
  const auto with_stray = CheckSphere(stray, {}, OfAScanner());
  ASSERT_TRUE(with_stray.ok()) << with_stray.status();
  EXPECT_LT(with_stray->errors[2].error_mm, 12e-3);
  // A form of 10 um over the cap is seen by both.
  Points bent = Scanned(12.5, 1e-4, 4);
  for (Eigen::Vector3d& p : bent) {
    const Eigen::Vector3d out = (p - kCentre).normalized();
    p += 5e-3 * std::cos(6 * std::atan2(out.y(), out.x())) * std::hypot(out.x(), out.y()) / std::sin(M_PI / 3) * out;
  }
  const auto formed = CheckSphere(bent, {}, OfAScanner());
  ASSERT_TRUE(formed.ok()) << formed.status();
  EXPECT_GT(formed->errors[0].error_mm, 4e-3);
  EXPECT_LE(formed->errors[0].error_mm, 10.5e-3);
}

TEST(SphereCheck, SizeOfAScannerFollowsTheSphere) {
  const auto greater = CheckSphere(Scanned(12.504, 1e-3, 5), {}, OfAScanner());
  ASSERT_TRUE(greater.ok()) << greater.status();
  EXPECT_NEAR(greater->errors[1].error_mm, 8e-3, 1e-3);
  EXPECT_NEAR(greater->errors[3].error_mm, 8e-3, 1e-3);
  EXPECT_EQ(greater->verdict, StudyVerdict::kRejected);
}

TEST(SphereCheck, FlatFormIsWhatMostOfThePlaneLiesWithin) {
  SphereCheckOptions options = Usual();
  options.flat_form_mpe_mm = 10e-3;
  std::mt19937_64 random(6);
  std::normal_distribution<double> noise(0, 2e-3);
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (double x = -15; x <= 15; x += 0.3)
    for (double y = -15; y <= 15; y += 0.3)
      options.plane_points_mm.push_back(kCentre + turned * Eigen::Vector3d(x, y, noise(random)));
  const auto check = CheckSphere(Probed(12.5, 0, 1), {}, options);
  ASSERT_TRUE(check.ok()) << check.status();
  EXPECT_EQ(check->errors[2].quantity, "flat form");
  EXPECT_NEAR(check->errors[2].error_mm, 3.92 * 2e-3, 0.2e-3);
  EXPECT_EQ(check->errors[2].verdict, StudyVerdict::kAccepted);
  // Along one line nobody knows the plane.
  for (Eigen::Vector3d& p : options.plane_points_mm) p = kCentre + Eigen::Vector3d(p.x() - kCentre.x(), 0, 0);
  EXPECT_FALSE(CheckSphere(Probed(12.5, 0, 1), {}, options).ok());
  options.plane_points_mm.resize(50);
  EXPECT_THAT(CheckSphere(Probed(12.5, 0, 1), {}, options).status().message(), HasSubstr("plane_points_mm: 50"));
}

TEST(SphereCheck, AScannerThatSawAStripOrAHandfulIsRefused) {
  EXPECT_THAT(CheckSphere(Probed(12.5, 0, 1), {}, OfAScanner()).status().message(),
              HasSubstr("points_mm: 25 of them, want at least 1000"));
  Points strip;
  for (const Eigen::Vector3d& p : Scanned(12.5, 1e-3, 7))
    if (std::abs(p.y() - kCentre.y()) < 0.5) strip.push_back(p);
  const auto seen = CheckSphere(strip, {}, OfAScanner());
  EXPECT_FALSE(seen.ok());
}

}  // namespace
}  // namespace sixpoint::metrology
