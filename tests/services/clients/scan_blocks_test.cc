#include "cli/scan_blocks.h"

#include <gtest/gtest.h>

#include "metrology/cloud/draco_codec.h"

namespace sixpoint::cli {
namespace {

using metrology::Points;

Points Profiles(int profile_count, int points_per_profile) {
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
  const Points points = Profiles(150, 100);
  const auto spans = SplitIntoBlocks(points);
  ExpectCovers(spans, points.size());
  ASSERT_EQ(spans.size(), 3u);
  EXPECT_EQ(spans[0].count, 6400u);
  EXPECT_EQ(spans[1].count, 6400u);
  EXPECT_EQ(spans[2].count, 2200u);
}

TEST(SplitIntoBlocks, NeverSplitsAProfileBelowTheGreatestBlock) {
  const Points points = Profiles(200, 777);
  for (const BlockSpan& span : SplitIntoBlocks(points)) {
    if (span.first == 0) continue;
    EXPECT_NE(points[span.first].x(), points[span.first - 1].x());
  }
}

TEST(SplitIntoBlocks, ACloudWithoutProfilesStillMakesFewBlocks) {
  const Points points = Profiles(20000, 1);
  const auto spans = SplitIntoBlocks(points);
  ExpectCovers(spans, points.size());
  EXPECT_EQ(spans.size(), 5u);
}

TEST(SplitIntoBlocks, OneEndlessProfileIsCutByNumber) {
  const Points points = Profiles(1, 300000);
  const auto spans = SplitIntoBlocks(points);
  ExpectCovers(spans, points.size());
  EXPECT_EQ(spans.size(), 3u);
}

TEST(SplitIntoBlocks, NoPointsNoBlocks) { EXPECT_TRUE(SplitIntoBlocks({}).empty()); }

TEST(EncodeScan, KeepsOrderAndCountWithinTheProvenError) {
  const Points points = Profiles(200, 120);
  const auto scan = EncodeScan(points);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_LE(scan->proven_error_um, 0.25);
  EXPECT_EQ(scan->point_count, static_cast<std::int64_t>(points.size()));
  std::size_t next = 0;
  for (const EncodedScan::Block& block : scan->blocks) {
    const auto decoded = metrology::DecodeBlock(block.payload, block.point_count);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    for (const Eigen::Vector3d& point : *decoded) {
      ASSERT_LE((point - points[next++]).cwiseAbs().maxCoeff(), scan->proven_error_um * 1e-3);
    }
  }
  EXPECT_EQ(next, points.size());
}

TEST(EncodeScan, TheSamePointsGiveTheSameBytes) {
  const Points points = Profiles(70, 120);
  const auto one = EncodeScan(points), two = EncodeScan(points);
  ASSERT_TRUE(one.ok() && two.ok());
  ASSERT_EQ(one->blocks.size(), two->blocks.size());
  for (std::size_t i = 0; i < one->blocks.size(); ++i) EXPECT_EQ(one->blocks[i].payload, two->blocks[i].payload);
}

TEST(EncodeScan, RefusesNothing) { EXPECT_FALSE(EncodeScan({}).ok()); }

}  // namespace
}  // namespace sixpoint::cli
