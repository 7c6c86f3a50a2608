// Blades known everywhere, cut off at three quarters: their tips told by each method.
#include "metrology/repair/extrapolation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrology/repair/deviation_process.h"
#include "metrology/repair/height_polynomial.h"
#include "metrology/sections/profile.h"
#include "tests/metrology/repair/bent_blades.h"

namespace sixpoint::metrology {
namespace {

constexpr double kCut_mm = 30, kTop_mm = 40, kStep_mm = 1.5;

struct Stack {
  std::vector<BladeSection> measured, nominal, asked;
};

Stack ExactStack(const SectionMotion& motion) {
  Stack stack;
  for (double z_mm = 0; z_mm <= kCut_mm; z_mm += kStep_mm) {
    stack.measured.push_back(KnownSection(z_mm, motion));
    stack.nominal.push_back(KnownSection(z_mm, nullptr));
  }
  for (const double z_mm : {32.0, 36.0, kTop_mm}) stack.asked.push_back(KnownSection(z_mm, nullptr));
  return stack;
}

double Rms_mm(const Extrapolation& made, const SectionMotion& motion) {
  double squares = 0, count = 0;
  for (const TargetSection& section : made.sections)
    for (const Eigen::Vector2d& point : KnownPolygon(section.z_mm, motion))
      squares += std::pow(SignedDistance(section.outline, point, nullptr), 2), ++count;
  return std::sqrt(squares / count);
}

TEST(Extrapolation, OfAnUndeformedBladeIsItsDrawing) {
  const Stack stack = ExactStack(nullptr);
  for (const auto method : {ExtrapolationMethod::kProcessOfDeviation, ExtrapolationMethod::kPolynomialOfDeviation}) {
    const auto made = Extrapolate(stack.measured, stack.nominal, stack.asked, method);
    ASSERT_TRUE(made.ok()) << made.status();
    // The envelope of 101 circles alone stands between: half a micrometre.
    EXPECT_LT(Rms_mm(*made, nullptr), 5e-4) << static_cast<int>(method);
  }
}

TEST(Extrapolation, OfABentBladeIsBetterThanThePublishedRegression) {
  const SectionMotion motion = Bent(0.3, 0.006, 0.01);
  const Stack stack = ExactStack(motion);
  double rms_mm[3] = {};
  for (const auto method : {ExtrapolationMethod::kPolynomial, ExtrapolationMethod::kPolynomialOfDeviation,
                            ExtrapolationMethod::kProcessOfDeviation}) {
    const auto made = Extrapolate(stack.measured, stack.nominal, stack.asked, method);
    ASSERT_TRUE(made.ok()) << made.status();
    rms_mm[static_cast<int>(method)] = Rms_mm(*made, motion);
    if (method == ExtrapolationMethod::kPolynomial) {
      ASSERT_TRUE(made->determination.has_value());
      EXPECT_GT(made->determination->camber, 0.99);
    }
  }
  EXPECT_LT(rms_mm[2], 0.5 * rms_mm[0]);
  EXPECT_LT(rms_mm[2], 0.015);
  // What it says of itself grows with the height.
  const auto made = Extrapolate(stack.measured, stack.nominal, stack.asked, ExtrapolationMethod::kProcessOfDeviation);
  EXPECT_GT(made->sections[2].standard_mm[50], made->sections[0].standard_mm[50]);
}

TEST(Extrapolation, IsTheSameOnAnyNumberOfThreads) {
  const Stack stack = ExactStack(Bent(0.2, 0.004, 0.01));
  const auto one = Extrapolate(stack.measured, stack.nominal, stack.asked, ExtrapolationMethod::kProcessOfDeviation, 1);
  const auto four =
      Extrapolate(stack.measured, stack.nominal, stack.asked, ExtrapolationMethod::kProcessOfDeviation, 4);
  ASSERT_TRUE(one.ok() && four.ok());
  for (std::size_t k = 0; k < one->sections.size(); ++k)
    for (std::size_t i = 0; i < one->sections[k].outline.size(); ++i) {
      EXPECT_EQ(one->sections[k].outline.nodes()[i].point_mm, four->sections[k].outline.nodes()[i].point_mm);
      EXPECT_EQ(one->sections[k].standard_mm[i], four->sections[k].standard_mm[i]);
    }
}

TEST(Extrapolation, RefusesByName) {
  Stack stack = ExactStack(nullptr);
  const auto method = ExtrapolationMethod::kProcessOfDeviation;
  std::vector<BladeSection> few(stack.measured.begin(), stack.measured.begin() + 11);
  EXPECT_NE(
      Extrapolate(few, few, stack.asked, method).status().message().find("measured: 11 sections, want at least 12"),
      std::string::npos);
  std::vector<BladeSection> low(stack.measured.begin(), stack.measured.begin() + 18);
  EXPECT_NE(
      Extrapolate(low, low, stack.asked, method).status().message().find("measured: sections up to 25.5, want up to"),
      std::string::npos);
  stack.nominal[3].z_mm += 0.1;
  EXPECT_NE(Extrapolate(stack.measured, stack.nominal, stack.asked, method).status().message().find("measured[3].z_mm"),
            std::string::npos);
}

TEST(Extrapolation, LeavesOutWhatIsNotNearItsDrawing) {
  const SectionMotion motion = Bent(0.2, 0.004, 0.01);
  Stack stack = ExactStack(motion);
  const auto method = ExtrapolationMethod::kProcessOfDeviation;
  // One section was not measured, another is of something else.
  stack.measured.erase(stack.measured.begin() + 5);
  const auto without = [&](const Stack& given) {
    Stack fewer = given;
    fewer.measured.erase(fewer.measured.begin() + 9);
    return Extrapolate(fewer.measured, fewer.nominal, fewer.asked, method);
  };
  const auto expected = without(stack);
  const double z_mm = stack.measured[9].z_mm;
  stack.measured[9] = KnownSection(z_mm, [](double, const Eigen::Vector2d& point_mm) -> Eigen::Vector2d {
    return {0, -2 * point_mm.y()};  // mirrored: bowed the other way
  });
  stack.measured[9].z_mm = z_mm;
  const auto made = Extrapolate(stack.measured, stack.nominal, stack.asked, method);
  ASSERT_TRUE(made.ok() && expected.ok()) << made.status();
  ASSERT_EQ(made->left_out.size(), 1u);
  EXPECT_EQ(made->left_out[0].index, 9u);
  EXPECT_EQ(made->left_out[0].z_mm, z_mm);
  for (std::size_t i = 0; i < made->sections[0].outline.size(); ++i)
    EXPECT_EQ(made->sections[0].outline.nodes()[i].point_mm, expected->sections[0].outline.nodes()[i].point_mm);
}

TEST(Extrapolation, KnowsItsSectionsByHeight) {
  Stack stack = ExactStack(nullptr);
  stack.measured.erase(stack.measured.begin() + 5);
  const auto made = Extrapolate(stack.measured, stack.nominal, stack.asked, ExtrapolationMethod::kProcessOfDeviation);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_LT(Rms_mm(*made, nullptr), 5e-4);  // as above: not a neighbour's deviation
}

TEST(HeightProcess, IsExactOfALineAndSureOfIt) {
  std::vector<double> known, asked = {35, 40};
  Eigen::VectorXd values(21);
  for (int k = 0; k <= 20; ++k) {
    known.push_back(1.5 * k);
    values[k] = 0.3 - 0.01 * known.back();
  }
  const auto predicted = HeightProcess(known, asked).Predict(values);
  for (std::size_t a = 0; a < asked.size(); ++a) {
    EXPECT_NEAR(predicted[a].mean, 0.3 - 0.01 * asked[a], 1e-9);
    EXPECT_LT(predicted[a].variance, 1e-15);
  }
}

TEST(HeightProcess, OneWildValueIsReplaced) {
  std::vector<double> z_mm;
  Eigen::VectorXd values(25);
  for (int k = 0; k < 25; ++k) {
    z_mm.push_back(k);
    values[k] = 1e-3 * std::sin(0.2 * k) + (k % 2 == 0 ? 1e-5 : -1e-5);
  }
  Eigen::VectorXd wild = values;
  wild[12] += 0.05;
  const Eigen::VectorXd kept = WithoutWild(z_mm, wild);
  EXPECT_NEAR(kept[12], values[12], 1e-4);
  for (int k = 0; k < 25; ++k) EXPECT_EQ(kept[k], k == 12 ? kept[12] : wild[k]) << k;
}

TEST(HeightPolynomial, IsExactOfAPolynomialOfItsDegree) {
  std::vector<PolynomialPlace> places;
  std::vector<double> values;
  const auto law = [](double y, double z) {
    return 1 + 2 * y - y * y * y + 0.1 * z * z - 1e-4 * std::pow(z, 5) + y * z;
  };
  for (double y = -2; y <= 2; y += 0.25)
    for (double z = 0; z <= 10; z += 0.5) {
      places.push_back({y, z});
      values.push_back(law(y, z));
    }
  const HeightPolynomial polynomial(places, values, 3, 5);
  EXPECT_NEAR(polynomial.At({1.5, 12}).value, law(1.5, 12), 1e-7);
  EXPECT_NEAR(polynomial.r_squared(), 1, 1e-12);
}

}  // namespace
}  // namespace sixpoint::metrology
