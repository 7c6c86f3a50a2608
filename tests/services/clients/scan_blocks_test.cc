#include "services/clients/scan_blocks.h"

#include <gtest/gtest.h>

#include <cstring>

#include "metrology/cloud/draco_codec.h"

namespace sixpoint::clients {
namespace {

using metrology::Points;

Points WavyProfiles(int profile_count, int points_per_profile) {
  Points points;
  for (int p = 0; p < profile_count; ++p) {
    for (int i = 0; i < points_per_profile; ++i)
      points.emplace_back(0.025 * p, 0.02 * i - 10, 0.001 * ((p * 31 + i * 17) % 97));
  }
  return points;
}

void ExpectCovers(const std::vector<BlockSpan>& spans, std::size_t count) {
  std::size_t next = 0;
  for (const BlockSpan& span : spans) {
    EXPECT_EQ(span.first, next);
    EXPECT_GT(span.count, 0u);
    EXPECT_LE(span.count, kGreatestBlockPointCount);
    next += span.count;
  }
  EXPECT_EQ(next, count);
}

TEST(SplitIntoBlocks, CutsAfterSixtyFourProfilesAndKeepsTheRest) {
  const Points points = WavyProfiles(150, 100);
  const auto spans = SplitIntoBlocks(points);
  ExpectCovers(spans, points.size());
  ASSERT_EQ(spans.size(), 3u);
  EXPECT_EQ(spans[0].count, 6400u);
  EXPECT_EQ(spans[1].count, 6400u);
  EXPECT_EQ(spans[2].count, 2200u);
}

TEST(SplitIntoBlocks, NeverSplitsAProfileBelowTheGreatestBlock) {
  const Points points = WavyProfiles(200, 777);
  for (const BlockSpan& span : SplitIntoBlocks(points)) {
    if (span.first == 0) continue;
    EXPECT_NE(points[span.first].x(), points[span.first - 1].x());
  }
}

TEST(SplitIntoBlocks, ACloudWithoutProfilesStillMakesFewBlocks) {
  const Points points = WavyProfiles(20000, 1);
  const auto spans = SplitIntoBlocks(points);
  ExpectCovers(spans, points.size());
  EXPECT_EQ(spans.size(), 5u);
}

TEST(SplitIntoBlocks, OneEndlessProfileIsCutByNumber) {
  const Points points = WavyProfiles(1, 300000);
  const auto spans = SplitIntoBlocks(points);
  ExpectCovers(spans, points.size());
  EXPECT_EQ(spans.size(), 3u);
}

TEST(SplitIntoBlocks, NoPointsNoBlocks) { EXPECT_TRUE(SplitIntoBlocks({}).empty()); }

TEST(SplitIntoBlocks, WideProfilesAreCutByTheirPoints) {
  const Points points = WavyProfiles(60, 1280);
  const auto spans = SplitIntoBlocks(points);
  ExpectCovers(spans, points.size());
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_EQ(spans[0].profile_count, 52);  // 66560 points, the first border beyond 65536
  EXPECT_EQ(spans[1].profile_count, 8);
}

ingest::v1::ScanHeader HeaderOf(ingest::v1::Encoding encoding) {
  ingest::v1::ScanHeader header;
  header.set_encoding(encoding);
  header.set_sender_error_um(0.5);
  return header;
}

TEST(PrepareScan, DracoKeepsOrderAndCountWithinTheProvenError) {
  const Points points = WavyProfiles(200, 120);
  const auto scan = PrepareScan(HeaderOf(ingest::v1::ENCODING_UNSPECIFIED), points);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->header.encoding(), ingest::v1::ENCODING_DRACO);
  const double proven_um = scan->header.sender_error_um() - 0.5;  // on top of what the sender said
  EXPECT_GT(proven_um, 0);
  EXPECT_LE(proven_um, 0.25);
  EXPECT_EQ(scan->header.point_count(), static_cast<std::int64_t>(points.size()));
  std::size_t next = 0;
  for (const OutgoingBlock& block : scan->blocks) {
    const auto decoded = metrology::DecodeBlock(block.payload, block.point_count);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    for (const Eigen::Vector3d& point : *decoded)
      ASSERT_LE((point - points[next++]).cwiseAbs().maxCoeff(), proven_um * 1e-3 + 1e-12);
  }
  EXPECT_EQ(next, points.size());
}

TEST(PrepareScan, DoublesGoOutAsTheyAre) {
  const Points points = WavyProfiles(100, 90);
  const auto scan = PrepareScan(HeaderOf(ingest::v1::ENCODING_XYZ_F64), points);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->header.sender_error_um(), 0.5);
  std::string all;
  for (const OutgoingBlock& block : scan->blocks) all += block.payload;
  ASSERT_EQ(all.size(), 24 * points.size());
  EXPECT_EQ(std::memcmp(all.data(), points.data(), all.size()), 0);
  EXPECT_EQ(scan->payload_bytes, static_cast<std::int64_t>(all.size()));
}

TEST(PrepareScan, TheSamePointsGiveTheSameBytes) {
  const Points points = WavyProfiles(70, 120);
  const auto one = PrepareScan(HeaderOf(ingest::v1::ENCODING_DRACO), points);
  const auto two = PrepareScan(HeaderOf(ingest::v1::ENCODING_DRACO), points);
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_EQ(one->sha256, two->sha256);
  ASSERT_EQ(one->blocks.size(), two->blocks.size());
  for (std::size_t i = 0; i < one->blocks.size(); ++i) EXPECT_EQ(one->blocks[i].payload, two->blocks[i].payload);
}

TEST(PrepareScan, RefusesNothingAndRawProfiles) {
  EXPECT_FALSE(PrepareScan(HeaderOf(ingest::v1::ENCODING_DRACO), {}).ok());
  EXPECT_FALSE(PrepareScan(HeaderOf(ingest::v1::ENCODING_RAW_PROFILES), WavyProfiles(2, 2)).ok());
}

// The proto's words, byte by byte.
TEST(AppendRawProfile, LaysOutReadingMaskAndColumns) {
  OutgoingBlock block;
  ASSERT_TRUE(AppendRawProfile({1.5, {{0, 1, -1}, {9, 258, 3}}}, 12, &block).ok());
  ASSERT_TRUE(AppendRawProfile({2.0, {{11, 0, 0x01020304}}}, 12, &block).ok());
  EXPECT_EQ(block.point_count, 3);
  EXPECT_EQ(block.profile_count, 2);
  using namespace std::string_literals;  // doubles 1.5 and 2.0 are 3ff8... and 4000...
  EXPECT_EQ(block.payload, "\0\0\0\0\0\0\xf8\x3f"s + "\x01\x02"s + "\1\0\0\0\xff\xff\xff\xff"s + "\2\1\0\0\3\0\0\0"s +
                               "\0\0\0\0\0\0\0\x40"s + "\x00\x08"s + "\0\0\0\0\4\3\2\1"s);
}

TEST(AppendRawProfile, RefusesColumnsThatDoNotGrowOrDoNotExist) {
  OutgoingBlock block;
  EXPECT_FALSE(AppendRawProfile({0, {{3, 0, 0}, {3, 0, 0}}}, 12, &block).ok());
  EXPECT_FALSE(AppendRawProfile({0, {{-1, 0, 0}}}, 12, &block).ok());
  EXPECT_FALSE(AppendRawProfile({0, {{12, 0, 0}}}, 12, &block).ok());
  EXPECT_TRUE(block.payload.empty());
  EXPECT_EQ(block.point_count, 0);
}

// printf abc | sha256sum | xxd -r -p, the same of "def", both through sha256sum again.
TEST(PayloadsDigest, IsTheDigestOfTheDigests) {
  PayloadsDigest digest;
  EXPECT_EQ(digest.ToHex(), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  digest.Add("abc");
  EXPECT_EQ(digest.ToHex(), "4f8b42c22dd3729b519ba6f68d2da7cc5b2d606d05daed5ad5128cc03e6c6358");
  digest.Add("def");
  EXPECT_EQ(digest.ToHex(), "9c04d30057b754af1b2d2d4f5675782dd61a5a659c34ee6c2af47526b66cafa6");
}

}  // namespace
}  // namespace sixpoint::clients
