// Points with their deviations as a Draco cloud: each at its own precision, far from the origin, and read by the stock decoder.
#include "metrology/cloud/deviation_cloud.h"

#include <draco/compression/decode.h>
#include <draco/metadata/geometry_metadata.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

// Lines over a casting, 6.35 m from its CAD's origin.
DeviationPoints Casting(int lines, int columns) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 2e-3);
  DeviationPoints points;
  for (int i = 0; i < lines; ++i)
    for (int j = 0; j < columns; ++j) {
      const double x = 0.1 * i, y = 0.05 * j;
      const double off = 0.2 * std::sin(x / 5) * std::cos(y / 7) + noise(random);
      points.in_part_mm.emplace_back(6350 + x, y - 20, 320 + 4 * std::sin(y / 9) + off);
      points.deviations_mm.push_back(off);
    }
  return points;
}

TEST(DeviationCloud, KeepsPlaceAndDeviationEachAtItsPrecision) {
  const DeviationPoints points = Casting(200, 500);
  const auto encoded = EncodeDeviations(points, {});
  ASSERT_TRUE(encoded.ok()) << encoded.status();
  EXPECT_LE(encoded->proven_place_error_mm, 5e-3);
  EXPECT_LE(encoded->proven_deviation_error_mm, 0.05e-3);
  const auto decoded = DecodeDeviations(encoded->bytes, 100'000);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  double place = 0, deviation = 0;
  for (std::size_t i = 0; i < points.in_part_mm.size(); ++i) {
    place = std::max(place, (points.in_part_mm[i] - decoded->in_part_mm[i]).cwiseAbs().maxCoeff());
    deviation = std::max(deviation, std::abs(points.deviations_mm[i] - decoded->deviations_mm[i]));
  }
  EXPECT_EQ(place, encoded->proven_place_error_mm);
  EXPECT_EQ(deviation, encoded->proven_deviation_error_mm);
  const double bytes = static_cast<double>(encoded->bytes.size()) / 1e5;
  std::printf("%.2f bytes a point\n", bytes);
  EXPECT_LT(bytes, 3);
}

// A viewer that knows nothing of us: places about an origin, and steps by their name.
TEST(DeviationCloud, IsReadByTheStockDecoder) {
  const DeviationPoints points = Casting(10, 10);
  const auto encoded = EncodeDeviations(points, {});
  ASSERT_TRUE(encoded.ok());
  draco::DecoderBuffer buffer;
  buffer.Init(encoded->bytes.data(), encoded->bytes.size());
  draco::Decoder decoder;
  auto cloud = decoder.DecodePointCloudFromBuffer(&buffer);
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud.value()->num_points(), 100u);
  const int id = cloud.value()->GetAttributeIdByMetadataEntry("name", "deviation");
  ASSERT_GE(id, 0);
  std::int32_t steps = 0;
  cloud.value()->attribute(id)->GetValue(draco::AttributeValueIndex(42), &steps);
  double step_mm = 0, x_mm = 0;
  ASSERT_TRUE(cloud.value()->GetMetadata()->GetEntryDouble("deviation_step_mm", &step_mm));
  ASSERT_TRUE(cloud.value()->GetMetadata()->GetEntryDouble("origin_x_mm", &x_mm));
  EXPECT_NEAR(steps * step_mm, points.deviations_mm[42], 0.05e-3);
  EXPECT_NEAR(x_mm, 6350, 1e-6);
}

TEST(DeviationCloud, RefusesWhatIsMalformed) {
  DeviationPoints points = Casting(2, 2);
  const auto refusal = [](const DeviationPoints& bad, const DeviationPrecision& precision = {}) {
    return std::string(EncodeDeviations(bad, precision).status().message());
  };
  EXPECT_THAT(refusal({}), HasSubstr("no points"));
  points.deviations_mm.pop_back();
  EXPECT_THAT(refusal(points), HasSubstr("3 of 4 points"));
  points.deviations_mm.push_back(std::nan(""));
  EXPECT_THAT(refusal(points), HasSubstr("point 3 is not finite"));
  points.deviations_mm.back() = 1e9;
  EXPECT_THAT(refusal(points), HasSubstr("more than the precision leaves room for"));
  points.deviations_mm.back() = 0;
  EXPECT_THAT(refusal(points, {0, 1e-4}), HasSubstr("precision: 0 mm, want > 0"));
  EXPECT_THAT(refusal(Casting(1, 100'000), {1e-6, 1e-4}), HasSubstr("need more than 24 bits"));
  const auto good = EncodeDeviations(points, {});
  ASSERT_TRUE(good.ok());
  EXPECT_FALSE(DecodeDeviations(good->bytes, 5).ok());
  EXPECT_FALSE(DecodeDeviations(good->bytes.substr(0, good->bytes.size() / 2), 4).ok());
  EXPECT_FALSE(DecodeDeviations("DRACO", 4).ok());
}

}  // namespace
}  // namespace sixpoint::metrology
