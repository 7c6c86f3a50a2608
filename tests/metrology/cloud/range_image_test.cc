#include "metrology/cloud/range_image.h"

#include <draco/compression/decode.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

constexpr double kRadPerDeg = M_PI / 180;
const ScannerFan kFan{1280, 20 * kRadPerDeg, 66.0};

struct Scan {
  Points points_mm;
  std::vector<int> columns;
};

// A wavy surface under a fan whose columns span `line_angle_deg`, ends included or not; 2 um noise along the ray. Every
// sixty-first point is missing.
Scan FanScan(int profile_count, double line_angle_deg, bool ends_included, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise_mm(0.0, 0.002);
  Scan scan;
  for (int i = 0; i < profile_count; ++i) {
    for (int column = 0; column < kFan.column_count; ++column) {
      if ((i + 3 * column) % 61 == 0) continue;
      const double along =
          ends_included ? 2.0 * column / (kFan.column_count - 1) - 1 : 2.0 * (column + 0.5) / kFan.column_count - 1;
      const double angle_rad = 0.5 * line_angle_deg * kRadPerDeg * along;
      const double z = 1.5 * std::sin(0.004 * column + 0.01 * i) + noise_mm(random);
      scan.points_mm.emplace_back(-11.2 + 0.025 * i, (kFan.mid_range_mm - z) * std::tan(angle_rad), z);
      scan.columns.push_back(column);
    }
  }
  return scan;
}

double BytesPerPoint(const EncodedBlock& block, const Points& points_mm) {
  return static_cast<double>(block.bytes.size()) / static_cast<double>(points_mm.size());
}

TEST(RangeImage, HoldsItsBoundAndTellsTheTrueErrorWhateverTheFan) {
  for (const double bound_mm : {0.05e-3, 0.25e-3, 2e-3}) {
    for (const double line_angle_deg : {19.9, 20.0, 20.15}) {
      const Scan scan = FanScan(12, line_angle_deg, line_angle_deg != 20.0, 5);
      for (const bool told : {true, false}) {
        const auto columns = told ? scan.columns : std::vector<int>();
        const auto block = EncodeRangeImage(scan.points_mm, columns, kFan, StepFor(bound_mm));
        ASSERT_TRUE(block.ok()) << block.status();
        const auto decoded = DecodeBlock(block->bytes, static_cast<std::int64_t>(scan.points_mm.size()));
        ASSERT_TRUE(decoded.ok()) << decoded.status();
        const double error_mm = GreatestDifferenceMm(scan.points_mm, *decoded);
        EXPECT_LE(error_mm, bound_mm);
        EXPECT_EQ(error_mm, block->proven_error_mm);
        EXPECT_GT(error_mm, 0.9 * bound_mm);  // a bound that is not used up would cost bytes
      }
    }
  }
}

TEST(RangeImage, CostsLittleMoreThanTheNoiseOfZ) {
  const Scan scan = FanScan(50, 20.0, false, 3);
  for (const bool told : {true, false}) {
    const auto block =
        EncodeRangeImage(scan.points_mm, told ? scan.columns : std::vector<int>(), kFan, StepFor(kDefaultErrorBoundMm));
    ASSERT_TRUE(block.ok()) << block.status();
    EXPECT_LT(BytesPerPoint(*block, scan.points_mm), 0.85);
    EXPECT_GT(BytesPerPoint(*block, scan.points_mm), 0.51);  // the entropy of the noise: less would be a lost point
  }
}

// The fan as stated is never quite the sensor's own.
TEST(RangeImage, FindsTheColumnsOfAFanThatIsNotQuiteAsStated) {
  const Scan scan = FanScan(50, 20.1, true, 4);
  const auto told = EncodeRangeImage(scan.points_mm, scan.columns, kFan, StepFor(kDefaultErrorBoundMm));
  const auto found = EncodeRangeImage(scan.points_mm, {}, kFan, StepFor(kDefaultErrorBoundMm));
  ASSERT_TRUE(told.ok() && found.ok()) << told.status() << found.status();
  EXPECT_LT(std::abs(BytesPerPoint(*told, scan.points_mm) - BytesPerPoint(*found, scan.points_mm)), 0.02);
}

TEST(RangeImage, KeepsPointsThatNoFanExplains) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> coordinate(-90, 90);
  for (const std::size_t count : {1, 2, 3, 1000}) {
    Points points_mm(count);
    for (Eigen::Vector3d& p : points_mm) p = {100 * coordinate(random), coordinate(random), coordinate(random)};
    const auto block = EncodeRangeImage(points_mm, {}, kFan, StepFor(kDefaultErrorBoundMm));
    ASSERT_TRUE(block.ok()) << block.status();
    const auto decoded = DecodeBlock(block->bytes, static_cast<std::int64_t>(count));
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_LE(GreatestDifferenceMm(points_mm, *decoded), kDefaultErrorBoundMm);
  }
}

TEST(RangeImage, WholeStepsStayExact) {
  EXPECT_EQ(StepFor(0.25e-3, 0.5e-3), 0.5e-3);
  EXPECT_EQ(StepFor(0.25e-3, 1e-3), 1e-3);
  EXPECT_NEAR(StepFor(0.25e-3, 0.1e-3), 0.5e-3, 1e-15);
  EXPECT_NEAR(StepFor(0.25e-3, 0.2e-3), 0.4e-3, 1e-15);
  Scan scan = FanScan(4, 20.0, false, 8);
  for (Eigen::Vector3d& p : scan.points_mm) p.z() = std::round(p.z() / 0.5e-3) * 0.5e-3;
  const auto block = EncodeRangeImage(scan.points_mm, scan.columns, kFan, StepFor(0.25e-3, 0.5e-3));
  ASSERT_TRUE(block.ok()) << block.status();
  const auto decoded = DecodeBlock(block->bytes, static_cast<std::int64_t>(scan.points_mm.size()));
  ASSERT_TRUE(decoded.ok());
  for (std::size_t i = 0; i < decoded->size(); ++i) ASSERT_EQ((*decoded)[i].z(), scan.points_mm[i].z()) << i;
}

// As docs/stored_clouds.md tells it to whoever has nothing but Draco.
TEST(RangeImage, TheStockDecoderAndTheDocumentedFormulaGiveThePoints) {
  const Scan scan = FanScan(3, 20.0, true, 6);
  const auto block = EncodeRangeImage(scan.points_mm, {}, kFan, StepFor(kDefaultErrorBoundMm));
  ASSERT_TRUE(block.ok()) << block.status();
  draco::DecoderBuffer buffer;
  buffer.Init(block->bytes.data(), block->bytes.size());
  draco::Decoder decoder;
  const auto cloud = decoder.DecodePointCloudFromBuffer(&buffer).value();
  ASSERT_EQ(cloud->num_points(), scan.points_mm.size());
  double step_mm = 0, mid_range_mm = 0, first_ray_rad = 0, ray_pitch_rad = 0;
  ASSERT_TRUE(cloud->GetMetadata()->GetEntryDouble("step_mm", &step_mm));
  ASSERT_TRUE(cloud->GetMetadata()->GetEntryDouble("mid_range_mm", &mid_range_mm));
  ASSERT_TRUE(cloud->GetMetadata()->GetEntryDouble("first_ray_rad", &first_ray_rad));
  ASSERT_TRUE(cloud->GetMetadata()->GetEntryDouble("ray_pitch_rad", &ray_pitch_rad));
  const auto value = [&](const std::string& name, std::uint32_t point) {
    const int id = cloud->GetAttributeIdByMetadataEntry("name", name);
    EXPECT_GE(id, 0) << name;
    std::int32_t steps = 0;
    cloud->attribute(id)->GetMappedValue(draco::PointIndex(point), &steps);
    return steps;
  };
  for (std::uint32_t i = 0; i < cloud->num_points(); ++i) {
    const double x = value("x", i) * step_mm;
    const double z = value("z", i) * step_mm;
    const double y = (mid_range_mm - z) * std::tan(first_ray_rad + value("column", i) * ray_pitch_rad) +
                     value("y_from_ray", i) * step_mm;
    ASSERT_LE((Eigen::Vector3d(x, y, z) - scan.points_mm[i]).cwiseAbs().maxCoeff(), 0.25e-3 + 1e-9);
    ASSERT_EQ(value("column", i), scan.columns[i]);
  }
}

TEST(RangeImage, RefusesWhatItCannotKeep) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double step_mm = StepFor(kDefaultErrorBoundMm);
  EXPECT_FALSE(EncodeRangeImage({}, {}, kFan, step_mm).ok());
  EXPECT_THAT(EncodeRangeImage({{0, 0, 0}, {0, nan, 0}}, {}, kFan, step_mm).status().message(), HasSubstr("point 1"));
  EXPECT_THAT(EncodeRangeImage({{1e9, 0, 0}}, {}, kFan, step_mm).status().message(), HasSubstr("too far"));
  EXPECT_FALSE(EncodeRangeImage({{0, 0, 0}}, {1, 2}, kFan, step_mm).ok());
  EXPECT_FALSE(EncodeRangeImage({{0, 0, 0}}, {1280}, kFan, step_mm).ok());
  EXPECT_FALSE(EncodeRangeImage({{0, 0, 0}}, {-1}, kFan, step_mm).ok());
  for (const double bad : {0.0, -1.0, nan}) EXPECT_FALSE(EncodeRangeImage({{0, 0, 0}}, {}, kFan, bad).ok());
  EXPECT_FALSE(EncodeRangeImage({{0, 0, 0}}, {}, ScannerFan{0, 0.3, 66}, step_mm).ok());
  EXPECT_FALSE(EncodeRangeImage({{0, 0, 0}}, {}, ScannerFan{1280, 0.0, 66}, step_mm).ok());
  // Positions are not taken for a range image, nor the other way round.
  EXPECT_FALSE(DecodeRangeImage(EncodeBlock({{1, 2, 3}}, 0.25e-3)->bytes, 1).ok());
  const std::string image = EncodeRangeImage({{1, 2, 3}}, {}, kFan, step_mm)->bytes;
  EXPECT_TRUE(IsRangeImage(image));
  EXPECT_FALSE(InspectHeader(image, 1).ok());
  EXPECT_FALSE(DecodeBlock(image, 2).ok());
}

TEST(RangeImage, TheSamePointsAreTheSameBytes) {
  const Scan scan = FanScan(20, 20.0, true, 11);
  const double step_mm = StepFor(kDefaultErrorBoundMm);
  EXPECT_EQ(EncodeRangeImage(scan.points_mm, {}, kFan, step_mm)->bytes,
            EncodeRangeImage(scan.points_mm, {}, kFan, step_mm)->bytes);
}

TEST(RangeImage, ABladeScanOfThePlantCostsLessThanAByteAPoint) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  const std::filesystem::path scans = std::filesystem::path(shared == nullptr ? "" : shared) / "data/plant-a/scans";
  if (!std::filesystem::exists(scans)) GTEST_SKIP() << "../shared/data/plant-a is not there";
  for (const std::string name : {"sn1_b000_0", "sn1_b060_0", "sn1_b300_0", "sn2_b000_0", "sn1_local_g2"}) {
    std::ifstream file(scans / (name + ".drc"), std::ios::binary);
    std::stringstream bytes;
    bytes << file.rdbuf();
    const auto header = InspectHeader(bytes.str(), 10'000'000);
    ASSERT_TRUE(header.ok()) << header.status();
    const auto points_mm = DecodeBlock(bytes.str(), header->point_count);
    ASSERT_TRUE(points_mm.ok()) << points_mm.status();
    double stored = 0;
    for (std::size_t begin = 0; begin < points_mm->size(); begin += kUsualBlockPointCount) {
      const std::size_t end = std::min(points_mm->size(), begin + kUsualBlockPointCount);
      const Points part(points_mm->begin() + static_cast<std::ptrdiff_t>(begin),
                        points_mm->begin() + static_cast<std::ptrdiff_t>(end));
      const auto block = EncodeRangeImage(part, {}, kFan, StepFor(kDefaultErrorBoundMm));
      ASSERT_TRUE(block.ok()) << block.status();
      EXPECT_LE(block->proven_error_mm, kDefaultErrorBoundMm);
      stored += static_cast<double>(block->bytes.size());
    }
    EXPECT_LE(stored / static_cast<double>(points_mm->size()), 1.0) << name;
  }
}

}  // namespace
}  // namespace sixpoint::metrology
