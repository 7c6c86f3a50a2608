#include "metrology/cloud/draco_codec.h"

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "tests/support/stock_draco.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

// A scan's shape: profiles along x, columns along y, a wavy depth.
Points LineScanLike(int profile_count, int column_count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise_mm(0.0, 0.002);
  Points points_mm;
  for (int i = 0; i < profile_count; ++i) {
    for (int j = 0; j < column_count; ++j) {
      const double y = -12.0 + 24.0 * j / column_count;
      points_mm.emplace_back(0.025 * i, y, 8.0 * std::sin(0.2 * y + 0.01 * i) + noise_mm(random));
    }
  }
  return points_mm;
}

double GreatestDifferenceMm(const Points& a, const Points& b) {
  double greatest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) greatest = std::max(greatest, (a[i] - b[i]).cwiseAbs().maxCoeff());
  return greatest;
}

TEST(EncodeBlock, HoldsItsBoundAndTellsTheTrueErrorForRandomClouds) {
  std::mt19937_64 random(7);
  for (const double bound_mm : {0.05e-3, 0.25e-3, 1e-3, 0.02}) {
    for (const double extent_mm : {0.001, 1.0, 30.0, 200.0, 250.0}) {
      // Draco quantises in float32: 400 mm at 0.05 um is beyond it (refused, see below).
      if (extent_mm / bound_mm > 1e6) continue;
      for (const std::size_t count : {1, 2, 3, 1000}) {
        std::uniform_real_distribution<double> coordinate(-extent_mm, extent_mm);
        Points points_mm(count);
        for (Eigen::Vector3d& p : points_mm) p = {coordinate(random), coordinate(random), coordinate(random)};
        const auto block = EncodeBlock(points_mm, bound_mm);
        ASSERT_TRUE(block.ok()) << block.status();
        const auto decoded = DecodeBlock(block->bytes, static_cast<std::int64_t>(count));
        ASSERT_TRUE(decoded.ok()) << decoded.status();
        // Order kept: compared index by index.
        const double error_mm = GreatestDifferenceMm(points_mm, *decoded);
        EXPECT_LE(error_mm, bound_mm) << bound_mm << " " << extent_mm << " " << count;
        EXPECT_EQ(error_mm, block->proven_error_mm);
      }
    }
  }
}

TEST(EncodeBlock, KeepsOrderAndDuplicates) {
  Points points_mm = LineScanLike(3, 50, 1);
  points_mm.insert(points_mm.end(), 20, points_mm.front());
  std::reverse(points_mm.begin() + 10, points_mm.end());
  const auto block = EncodeBlock(points_mm, 0.25e-3);
  ASSERT_TRUE(block.ok());
  const auto decoded = DecodeBlock(block->bytes, static_cast<std::int64_t>(points_mm.size()));
  ASSERT_TRUE(decoded.ok());
  EXPECT_LE(GreatestDifferenceMm(points_mm, *decoded), 0.25e-3);
}

TEST(EncodeBlock, IsReadByTheStockDecoder) {
  const Points points_mm = LineScanLike(20, 640, 2);
  const auto block = EncodeBlock(points_mm, 0.25e-3);
  ASSERT_TRUE(block.ok());
  draco::DecoderBuffer buffer;
  buffer.Init(block->bytes.data(), block->bytes.size());
  auto cloud = draco::Decoder().DecodePointCloudFromBuffer(&buffer);
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud.value()->num_points(), points_mm.size());
  const draco::PointAttribute* position = cloud.value()->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  ASSERT_NE(position, nullptr);
  for (std::uint32_t i = 0; i < points_mm.size(); ++i) {
    Eigen::Vector3f p;
    position->GetMappedValue(draco::PointIndex(i), p.data());
    ASSERT_LE((p.cast<double>() - points_mm[i]).cwiseAbs().maxCoeff(), 0.25e-3);
  }
}

TEST(EncodeBlock, IsTheSameBytesEveryTime) {
  const Points points_mm = LineScanLike(5, 640, 3);
  EXPECT_EQ(EncodeBlock(points_mm, 0.25e-3)->bytes, EncodeBlock(points_mm, 0.25e-3)->bytes);
}

TEST(EncodeBlock, CostsFewBytesAPoint) {
  const Points points_mm = LineScanLike(50, 1280, 4);
  const auto block = EncodeBlock(points_mm, 0.25e-3);
  ASSERT_TRUE(block.ok());
  // A 2 um noise floor at a 0.5 um step costs about 0.5 bytes in z; plain Draco was measured at 2.07 in all.
  EXPECT_LT(static_cast<double>(block->bytes.size()) / static_cast<double>(points_mm.size()), 2.5);
}

TEST(EncodeBlock, RefusesWhatItCannotKeep) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(EncodeBlock({}, 0.25e-3).ok());
  EXPECT_THAT(EncodeBlock({{0, 0, 0}, {0, nan, 0}}, 0.25e-3).status().message(), HasSubstr("point 1"));
  EXPECT_FALSE(EncodeBlock({{0, 0, 1e300}}, 0.25e-3).ok());
  EXPECT_FALSE(EncodeBlock({{0, 0, 0}}, 0.0).ok());
  EXPECT_FALSE(EncodeBlock({{0, 0, 0}}, -1.0).ok());
  EXPECT_FALSE(EncodeBlock({{0, 0, 0}}, nan).ok());
  // float32 steps by 0.0078 mm at 100 m.
  EXPECT_THAT(EncodeBlock({{100000.003, 0, 0}}, 0.25e-3).status().message(), HasSubstr("float32"));
  EXPECT_FALSE(EncodeBlock({{-100000.0, 0, 0}, {0, 0, 0}, {0.001, 0.0007, 0.0003}}, 1e-6).ok());
}

std::string HeaderOf(std::int32_t count, char type = 0, char method = 0, char flags = 0, char major = 2) {
  std::string bytes = "DRACO";
  bytes += {major, 3, type, method, flags, 0};
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(static_cast<std::uint32_t>(count) >> (8 * i));
  return bytes;
}

// Whatever encoder and lattice a sender has, the points come out bit by bit, in bytes that are ours and no larger than floats.
TEST(ReencodeBlock, KeepsEveryBitOfWhatOthersEncoded) {
  const Points wavy_mm = LineScanLike(20, 640, 5);
  Points far_mm = wavy_mm, flat_mm(50, Eigen::Vector3d(1.5, -2.25, 3));
  for (Eigen::Vector3d& p : far_mm) p += Eigen::Vector3d(700, -900, 40);
  for (const Points& points_mm : {wavy_mm, far_mm, flat_mm, Points{{0.0, -0.0, 1e-30}}}) {
    const auto count = static_cast<std::int64_t>(points_mm.size());
    for (const int bits : {0, 1, 8, 11, 14, 20, 24, 30}) {
      for (const int speed : {0, 5, 10}) {
        const std::string sent = sixpoint::testing::StockDraco(points_mm, bits, speed);
        const auto decoded = DecodeBlock(sent, count);
        ASSERT_TRUE(decoded.ok()) << decoded.status();
        const auto again = ReencodeBlock(sent, count);
        ASSERT_TRUE(again.ok()) << bits << " bits, speed " << speed << ": " << again.status();
        const auto read = DecodeBlock(again->bytes, count);
        ASSERT_TRUE(read.ok()) << read.status();
        EXPECT_EQ(std::memcmp(read->data(), decoded->data(), read->size() * sizeof(Eigen::Vector3d)), 0);
        EXPECT_EQ(std::memcmp(again->points_mm.data(), decoded->data(), read->size() * sizeof(Eigen::Vector3d)), 0);
        EXPECT_LE(again->bytes.size(), 12 * points_mm.size() + 4096);
        if (bits > 0 && bits <= 20 && points_mm.size() > 1000) {
          const auto ours = static_cast<double>(sixpoint::testing::StockDraco(points_mm, bits, 5).size());
          EXPECT_LE(static_cast<double>(again->bytes.size()), 1.1 * ours) << bits;
        }
      }
    }
  }
}

TEST(ReencodeBlock, WritesWhatOurEncoderWroteTheSame) {
  for (const double bound_mm : {0.25e-3, 1e-3}) {
    const Points points_mm = LineScanLike(20, 640, 6);
    const std::string bytes = EncodeBlock(points_mm, bound_mm)->bytes;
    EXPECT_EQ(ReencodeBlock(bytes, static_cast<std::int64_t>(points_mm.size()))->bytes, bytes);
  }
}

TEST(ReencodeBlock, RefusesWhatDecodeBlockRefuses) {
  const Points points_mm = LineScanLike(2, 64, 7);
  const std::string bytes = EncodeBlock(points_mm, 0.25e-3)->bytes;
  EXPECT_FALSE(ReencodeBlock(bytes, 127).ok());
  EXPECT_FALSE(ReencodeBlock(bytes.substr(0, bytes.size() / 2), 128).ok());
  EXPECT_FALSE(ReencodeBlock("", 1).ok());
}

TEST(InspectHeader, LetsOnlyBoundedSequentialCloudsThrough) {
  ASSERT_TRUE(InspectHeader(HeaderOf(10), 10).ok());
  EXPECT_EQ(InspectHeader(HeaderOf(10), 10)->point_count, 10);
  EXPECT_FALSE(InspectHeader(HeaderOf(11), 10).ok());
  EXPECT_FALSE(InspectHeader(HeaderOf(0), 10).ok());
  EXPECT_FALSE(InspectHeader(HeaderOf(-5), 10).ok());
  EXPECT_FALSE(InspectHeader(HeaderOf(10).substr(0, 14), 10).ok());
  EXPECT_FALSE(InspectHeader("", 10).ok());
  EXPECT_FALSE(InspectHeader("PLY" + HeaderOf(10), 10).ok());
  EXPECT_FALSE(InspectHeader(HeaderOf(10, 1), 10).ok());           // a mesh
  EXPECT_FALSE(InspectHeader(HeaderOf(10, 0, 1), 10).ok());        // kd-tree
  EXPECT_FALSE(InspectHeader(HeaderOf(10, 0, 0, 1), 10).ok());     // flags
  EXPECT_FALSE(InspectHeader(HeaderOf(10, 0, 0, 0, 1), 10).ok());  // version 1
}

TEST(DecodeBlock, RefusesABombBeforeDecoding) {
  // 58 bytes: a sound block of one point whose header is made to declare ten million.
  std::string bomb = EncodeBlock({{1, 2, 3}}, 0.25e-3)->bytes;
  bomb.replace(0, 15, HeaderOf(10'000'000));
  bomb.resize(58, '\0');
  EXPECT_THAT(DecodeBlock(bomb, 1280).status().message(), HasSubstr("declares 10000000 points"));
}

TEST(DecodeBlock, RefusesWrongCountsTruncationAndOtherAttributes) {
  const Points points_mm = LineScanLike(2, 100, 5);
  const std::string bytes = EncodeBlock(points_mm, 0.25e-3)->bytes;
  EXPECT_FALSE(DecodeBlock(bytes, 199).ok());
  EXPECT_FALSE(DecodeBlock(bytes, 201).ok());
  for (const std::size_t length : {std::size_t{15}, std::size_t{30}, bytes.size() / 2, bytes.size() - 1}) {
    EXPECT_FALSE(DecodeBlock(std::string_view(bytes).substr(0, length), 200).ok()) << length;
  }
  draco::PointCloud cloud;
  cloud.set_num_points(2);
  draco::GeometryAttribute colour;
  colour.Init(draco::GeometryAttribute::COLOR, nullptr, 3, draco::DT_UINT8, false, 3, 0);
  cloud.AddAttribute(colour, true, 2);
  draco::EncoderBuffer buffer;
  draco::Encoder encoder;
  encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
  ASSERT_TRUE(encoder.EncodePointCloudToBuffer(cloud, &buffer).ok());
  EXPECT_THAT(DecodeBlock({buffer.data(), buffer.size()}, 2).status().message(), HasSubstr("POSITION"));
}

TEST(DecodeBlock, RefusesNonFiniteCoordinates) {
  draco::PointCloud cloud;
  cloud.set_num_points(2);
  draco::GeometryAttribute position;
  position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 12, 0);
  cloud.AddAttribute(position, true, 2);
  const float bad[3] = {0, std::numeric_limits<float>::infinity(), 0};
  const float good[3] = {0, 0, 0};
  cloud.attribute(0)->SetAttributeValue(draco::AttributeValueIndex(0), good);
  cloud.attribute(0)->SetAttributeValue(draco::AttributeValueIndex(1), bad);
  draco::EncoderBuffer buffer;
  draco::Encoder encoder;  // not quantised: floats travel as they are
  encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
  ASSERT_TRUE(encoder.EncodePointCloudToBuffer(cloud, &buffer).ok());
  EXPECT_THAT(DecodeBlock({buffer.data(), buffer.size()}, 2).status().message(), HasSubstr("point 1 is not finite"));
}

// The scans of a real plant: decoded, cut into blocks, encoded and decoded within the bound.
TEST(EncodeBlock, KeepsPlantScansWithinABoundOfAQuarterMicrometre) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  const std::filesystem::path plant = std::filesystem::path(shared == nullptr ? "" : shared) / "data/plant-a";
  if (!std::filesystem::exists(plant / "dataset.json")) GTEST_SKIP() << "no plant-a under SIXPOINT_SHARED_DIR";
  const nlohmann::json dataset = nlohmann::json::parse(std::ifstream(plant / "dataset.json"));
  for (const std::size_t index : {std::size_t{0}, std::size_t{2}, std::size_t{17}}) {
    const nlohmann::json& scan = dataset.at("scans").at(index);
    std::stringstream bytes;
    bytes << std::ifstream(plant / scan.at("file").get<std::string>(), std::ios::binary).rdbuf();
    const auto points_mm = DecodeBlock(bytes.str(), scan.at("point_count").get<std::int64_t>());
    ASSERT_TRUE(points_mm.ok()) << points_mm.status();
    std::size_t stored = 0;
    for (std::size_t begin = 0; begin < points_mm->size(); begin += kUsualBlockPointCount) {
      const std::size_t end = std::min(points_mm->size(), begin + kUsualBlockPointCount);
      const Points block_mm(points_mm->begin() + static_cast<std::ptrdiff_t>(begin),
                            points_mm->begin() + static_cast<std::ptrdiff_t>(end));
      const auto block = EncodeBlock(block_mm, kDefaultErrorBoundMm);
      ASSERT_TRUE(block.ok()) << block.status();
      const auto decoded = DecodeBlock(block->bytes, static_cast<std::int64_t>(block_mm.size()));
      ASSERT_TRUE(decoded.ok());
      EXPECT_LE(GreatestDifferenceMm(block_mm, *decoded), kDefaultErrorBoundMm);
      stored += block->bytes.size();
    }
    RecordProperty("stored_bytes_per_point_" + std::to_string(index),
                   std::to_string(static_cast<double>(stored) / static_cast<double>(points_mm->size())));
  }
}

}  // namespace
}  // namespace sixpoint::metrology
