// Scans whose bytes live in a real S3 server.
#include "storage/s3_object_store.h"
#include "tests/services/ingest/scan_service_fixture.h"
#include "tests/support/object_store_server.h"

namespace sixpoint::ingest {
namespace {

std::unique_ptr<storage::BlobStore> S3OrPostgresql() {
  if (!testing::WhyNoObjectStore().empty()) return storage::MakePostgresqlBlobStore();
  return storage::MakeObjectBlobStore(storage::MakeS3ObjectStore(testing::ObjectStoreConfig()));
}

class ObjectStoreScansTest : public ScanServiceTest {
 protected:
  ObjectStoreScansTest() : ScanServiceTest(S3OrPostgresql()) {}
  void SetUp() override {
    if (!testing::WhyNoObjectStore().empty()) GTEST_SKIP() << testing::WhyNoObjectStore();
  }
};

TEST_F(ObjectStoreScansTest, AreAcknowledgedResumedAndReadLikeAnyOther) {
  const auto points_mm = SampleProfiles(8, 100);
  const auto blocks = SampleBlocks(points_mm, 300, v1::ENCODING_XYZ_F64);
  const v1::ScanHeader header = SampleHeader("s1", 0, v1::ENCODING_XYZ_F64);
  {
    Conversation broken(stub_.get(), 60.0);  // a gateway that has just begun makes its pools first
    broken.Say(header);
    ASSERT_TRUE(broken.Send(blocks[0]));
    ASSERT_EQ(broken.HearAcknowledged(), 1);
    broken.Cancel();
  }
  const auto stored = Upload(header, blocks);
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(Count("blobs WHERE store = 's3' AND bytes IS NULL"), 3);
  EXPECT_EQ(Count("blobs JOIN scan_blocks ON blob_sha256 = sha256 WHERE bytes IS NOT NULL"), 0);
  const auto fetched = client_.Fetch("scans/s1", runtime::ContextFor(20.0));
  ASSERT_TRUE(fetched.ok()) << fetched.status();
  ASSERT_EQ(fetched->scan.points_mm.size(), points_mm.size());
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    ASSERT_LE((fetched->scan.points_mm[i] - points_mm[i]).cwiseAbs().maxCoeff(), 0.25e-3);
  }
  // An object that somebody deleted behind our back is a damaged scan, not a shorter one.
  const storage::Rows row =
      Execute("SELECT sha256, object_id FROM blobs JOIN scan_blocks ON blob_sha256 = sha256 WHERE block_index = 1");
  const std::string key = storage::ObjectKeyOf(row.Digest(0, 0), row.Text(0, 1));
  ASSERT_TRUE(blobs_->objects()->Delete(key, testing::Soon()).ok());
  const absl::Status damaged = client_.Fetch("scans/s1", runtime::ContextFor(20.0)).status();
  EXPECT_TRUE(absl::IsDataLoss(damaged)) << damaged;
  EXPECT_EQ(runtime::ReasonOf(damaged), "SCAN_DAMAGED");
}

}  // namespace
}  // namespace sixpoint::ingest
