// Snapshots through the whole of ingest: what comes in another unit is stored in mm, in its order; what does not fit is refused, and nothing
// written.
#include <random>

#include "metrology/cloud/draco_codec.h"
#include "tests/services/ingest/scan_service_fixture.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::ingest {
namespace {

using ::testing::HasSubstr;

class SnapshotScansTest : public ScanServiceTest {
 protected:
  SnapshotScansTest() { plant_.gives_snapshots = true; }

  // Anywhere in the view, in no order.
  static metrology::Points Cloud(std::size_t count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> mm(-20, 20);
    metrology::Points cloud;
    for (std::size_t i = 0; i < count; ++i) {
      const double x = mm(random), y = mm(random), z = mm(random);
      cloud.emplace_back(x, y, z);
    }
    return cloud;
  }
  static metrology::Points In(const metrology::Points& points_mm, double per_mm) {
    metrology::Points other;
    for (const Eigen::Vector3d& p : points_mm) other.push_back(per_mm * p);
    return other;
  }
};

TEST_F(SnapshotScansTest, AreStoredInMillimetresWhateverTheyCameIn) {
  const metrology::Points cloud = Cloud(3000, 1);
  struct Unit {
    std::string scan_id;
    v1::LengthUnit unit;
    double per_mm;
  };
  const std::vector<Unit> units = {{"mm", v1::LENGTH_UNIT_MILLIMETRE, 1},
                                   {"m", v1::LENGTH_UNIT_METRE, 1e-3},
                                   {"inch", v1::LENGTH_UNIT_INCH, 1 / 25.4}};
  for (const Unit& unit : units) {
    const auto blocks = SampleBlocks(In(cloud, unit.per_mm), 1000, v1::ENCODING_XYZ_F64);
    const v1::ScanHeader header = SampleSnapshot(unit.scan_id, unit.unit);
    const auto stored = Upload(header, blocks);
    ASSERT_TRUE(stored.ok()) << stored.status();
    const v1::Scan& scan = stored->scan();
    EXPECT_EQ(scan.header().cloud(), v1::CLOUD_KIND_SNAPSHOT);
    EXPECT_EQ(scan.header().length_unit(), unit.unit);
    EXPECT_EQ(scan.stored_encoding(), v1::ENCODING_DRACO);
    EXPECT_EQ(scan.profile_count(), 0);
    EXPECT_EQ(scan.header().profile_pitch_mm(), 0);
    // The digest is of what was sent, in its unit.
    EXPECT_EQ(scan.sent_sha256(), EndOf(blocks).sha256());
    EXPECT_LE(scan.proven_error_um(), 0.25);
    const auto fetched = client_.Fetch(scan.name(), runtime::ContextFor(20));
    ASSERT_TRUE(fetched.ok()) << fetched.status();
    ASSERT_EQ(fetched->scan.points_mm.size(), cloud.size());
    EXPECT_LE(1e3 * metrology::GreatestDifferenceMm(fetched->scan.points_mm, cloud), scan.proven_error_um() + 1e-9);
    EXPECT_GT(scan.proven_error_um(), 0);
    // The same again is the same scan.
    const auto again = Upload(header, blocks);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_TRUE(again->already_stored());
  }
  EXPECT_EQ(Execute("SELECT count(*) FROM scan_blocks WHERE first_profile IS NULL AND profile_count IS NULL").Int(0, 0),
            9);
}

TEST_F(SnapshotScansTest, ComeAsDracoInMillimetres) {
  const metrology::Points cloud = Cloud(2000, 2);
  const auto blocks = SampleBlocks(cloud, 1000);
  const auto stored = Upload(SampleSnapshot("s1", v1::LENGTH_UNIT_MILLIMETRE, v1::ENCODING_DRACO), blocks);
  ASSERT_TRUE(stored.ok()) << stored.status();
  const auto fetched = client_.Fetch("scans/s1", runtime::ContextFor(20));
  ASSERT_TRUE(fetched.ok()) << fetched.status();
  EXPECT_LE(metrology::GreatestDifferenceMm(fetched->scan.points_mm, cloud), 0.25e-3);
  EXPECT_EQ(fetched->scan.profile_pitch_mm, 0);
}

// The client cuts by points alone, and an upload that broke goes on.
TEST_F(SnapshotScansTest, AreSentInWholeBlocksAndGoneOnWith) {
  const metrology::Points cloud = Cloud(150'000, 3);
  const auto stored = client_.Upload(SampleSnapshot("s1", v1::LENGTH_UNIT_MILLIMETRE), cloud,
                                     runtime::ContextFor(sixpoint::testing::kPatience * 60));
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->scan().block_count(), 3);
  const auto blocks = SampleBlocks(In(Cloud(3000, 4), 1e-3), 1000, v1::ENCODING_XYZ_F64);
  const v1::ScanHeader header = SampleSnapshot("s2", v1::LENGTH_UNIT_METRE);
  {
    Conversation upload(stub_.get(), 10);
    upload.Say(header);
    upload.Send(blocks[0]);
    v1::UploadScanResponse response;
    ASSERT_TRUE(upload.Hear(&response));
    EXPECT_EQ(response.acknowledged().next_block(), 1);
  }
  ASSERT_TRUE(Upload(header, blocks).ok());
  v1::ScanHeader other = header;
  other.set_length_unit(v1::LENGTH_UNIT_INCH);
  EXPECT_EQ(runtime::ReasonOf(Upload(other, blocks).status()), "SCAN_DIFFERS");
}

TEST_F(SnapshotScansTest, HaveNoProfilesToAskFor) {
  const metrology::Points cloud = Cloud(2500, 5);
  ASSERT_TRUE(
      Upload(SampleSnapshot("s1", v1::LENGTH_UNIT_MILLIMETRE), SampleBlocks(cloud, 1000, v1::ENCODING_XYZ_F64)).ok());
  const absl::Status refused = client_.Fetch("scans/s1", {0, 5}, runtime::ContextFor(10)).status();
  EXPECT_TRUE(absl::IsInvalidArgument(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("a snapshot has no profiles, and comes whole"));
  v1::PreviewScanRequest preview;
  preview.set_name("scans/s1");
  preview.set_point_count(500);
  v1::PreviewScanResponse picture;
  ASSERT_TRUE(stub_->PreviewScan(runtime::ContextFor(10).get(), preview, &picture).ok());
  EXPECT_EQ(picture.stride(), 5);
  EXPECT_EQ(picture.point_count(), 500);
  v1::ListScanBlocksRequest list;
  list.set_name("scans/s1");
  v1::ListScanBlocksResponse blocks;
  ASSERT_TRUE(stub_->ListScanBlocks(runtime::ContextFor(10).get(), list, &blocks).ok());
  ASSERT_EQ(blocks.blocks_size(), 3);
  EXPECT_EQ(blocks.blocks(2).profile_count(), 0);
  EXPECT_EQ(blocks.blocks(2).point_count(), 500);
}

TEST_F(SnapshotScansTest, WhatDoesNotFitIsRefusedAndNothingWritten) {
  const metrology::Points cloud = Cloud(500, 6);
  const auto blocks = SampleBlocks(cloud, 500, v1::ENCODING_XYZ_F64);
  v1::ScanHeader header = SampleSnapshot("s1", v1::LENGTH_UNIT_MILLIMETRE);
  header.clear_length_unit();
  ExpectRefused(header, blocks, "header.length_unit");
  ExpectRefused(SampleHeader("s1", 500, v1::ENCODING_XYZ_F64), blocks, "header.cloud");
  // In mm, and declared as metres.
  ExpectRefused(SampleSnapshot("s1", v1::LENGTH_UNIT_METRE), blocks, "block[0].payload.x_mm");
  metrology::Points spoiled = cloud;
  spoiled[7].y() = std::numeric_limits<double>::quiet_NaN();
  ExpectRefused(SampleSnapshot("s1", v1::LENGTH_UNIT_MILLIMETRE), SampleBlocks(spoiled, 500, v1::ENCODING_XYZ_F64),
                "block[0].payload");
  metrology::Points huge = cloud;
  huge[3].x() = 1e308;
  ExpectRefused(SampleSnapshot("s1", v1::LENGTH_UNIT_METRE), SampleBlocks(huge, 500, v1::ENCODING_XYZ_F64),
                "block[0].payload");
}

}  // namespace
}  // namespace sixpoint::ingest
