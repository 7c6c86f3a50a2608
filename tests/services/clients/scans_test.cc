// What a service hands out wrong is DATA_LOSS, never points.
#include "services/clients/scans.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/clients/scan_blocks.h"
#include "services/runtime/call.h"
#include "tests/support/fake_scan_service.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::clients {
namespace {

using ::testing::HasSubstr;
namespace v1 = ingest::v1;

// Hands out what a test put in.
struct Reader final : v1::ScanService::Service {
  v1::Scan record;
  std::vector<v1::ScanBlock> blocks;
  grpc::Status DownloadScan(grpc::ServerContext*, const v1::DownloadScanRequest*,
                            grpc::ServerWriter<v1::DownloadScanResponse>* writer) override {
    v1::DownloadScanResponse response;
    *response.mutable_scan() = record;
    writer->Write(response);
    for (const v1::ScanBlock& block : blocks) {
      *response.mutable_block() = block;
      if (!writer->Write(response)) break;
    }
    return grpc::Status::OK;
  }
};

metrology::Points FlatProfiles(int profile_count) {
  metrology::Points points_mm;
  for (int p = 0; p < profile_count; ++p)
    for (int i = 0; i < 100; ++i) points_mm.emplace_back(0.1 * p, 0.02 * i, 1);
  return points_mm;
}

v1::ScanHeader HeaderOfS1(v1::Encoding encoding) {
  v1::ScanHeader header;
  header.set_scan_id("s1");
  header.set_encoding(encoding);
  return header;
}

class FetchTest : public ::testing::Test {
 protected:
  FetchTest() : server_({&reader_}), client_(server_.Connect()) {
    const auto scan = PrepareScan(HeaderOfS1(v1::ENCODING_DRACO), FlatProfiles(150));
    EXPECT_TRUE(scan.ok()) << scan.status();
    reader_.record.set_sha256(scan->sha256);
    *reader_.record.mutable_header() = scan->header;
    reader_.record.set_profile_count(150);
    for (const OutgoingBlock& block : scan->blocks) {
      v1::ScanBlock& out = reader_.blocks.emplace_back();
      out.set_index(static_cast<int>(reader_.blocks.size()) - 1);
      out.set_point_count(block.point_count);
      out.set_payload(block.payload);
    }
    EXPECT_GT(reader_.blocks.size(), 1u);
  }
  absl::StatusOr<FetchedScan> Fetch() { return client_.Fetch("scans/s1", runtime::ContextFor(10)); }
  void ExpectDamaged(const std::string& what) {
    const auto fetched = Fetch();
    EXPECT_EQ(fetched.status().code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(std::string(fetched.status().message()), HasSubstr(what));
  }

  Reader reader_;
  testing::InProcessServer server_;
  ScanClient client_;
};

TEST_F(FetchTest, GivesAllPoints) {
  const auto fetched = Fetch();
  ASSERT_TRUE(fetched.ok()) << fetched.status();
  const metrology::Points sent = FlatProfiles(150);
  ASSERT_EQ(fetched->scan.points_mm.size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i)
    EXPECT_LT((fetched->scan.points_mm[i] - sent[i]).cwiseAbs().maxCoeff(), 0.25e-3);
}

TEST_F(FetchTest, FindsAnotherDigest) {
  reader_.record.set_sha256(std::string(64, '0'));
  ExpectDamaged("sha256");
}

TEST_F(FetchTest, FindsAMissingBlock) {
  reader_.blocks.erase(reader_.blocks.begin());
  ExpectDamaged("block 0 is missing");
}

TEST_F(FetchTest, FindsAMissingEnd) {
  reader_.blocks.pop_back();
  ExpectDamaged("points came");
}

TEST_F(FetchTest, FindsMorePointsThanTheScanHas) {
  reader_.blocks.back().set_point_count(1 << 30);
  ExpectDamaged("points, want");
}

TEST_F(FetchTest, FindsARangeThatIsNotWhatWasAsked) {
  // Profiles 10 to 12, where 10 to 13 were asked for.
  metrology::Points part = FlatProfiles(13);
  part.erase(part.begin(), part.begin() + 1000);
  reader_.blocks.resize(1);
  reader_.blocks[0].set_index(5);
  reader_.blocks[0].set_point_count(300);
  reader_.blocks[0].set_payload(std::string(reinterpret_cast<const char*>(part.data()), 24 * part.size()));
  const auto three = client_.Fetch("scans/s1", {10, 3}, runtime::ContextFor(10));
  ASSERT_TRUE(three.ok()) << three.status();
  EXPECT_EQ(three->scan.points_mm, part);
  const auto four = client_.Fetch("scans/s1", {10, 4}, runtime::ContextFor(10));
  EXPECT_EQ(four.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(four.status().message()), HasSubstr("3 profiles came, want 4"));
  reader_.blocks[0].mutable_payload()->pop_back();
  EXPECT_EQ(client_.Fetch("scans/s1", {10, 3}, runtime::ContextFor(10)).status().code(), absl::StatusCode::kDataLoss);
}

TEST(ScanClient, UploadsAndFetchesTheSame) {
  testing::FakeScanService service;
  testing::InProcessServer server({&service});
  const ScanClient client(server.Connect());
  for (const v1::Encoding encoding : {v1::ENCODING_DRACO, v1::ENCODING_XYZ_F64}) {
    v1::ScanHeader header = HeaderOfS1(encoding);
    header.set_scan_id(v1::Encoding_Name(encoding));
    const auto stored = client.Upload(header, FlatProfiles(150), runtime::ContextFor(10));
    ASSERT_TRUE(stored.ok()) << stored.status();
    const auto fetched = client.Fetch(stored->scan().name(), runtime::ContextFor(10));
    ASSERT_TRUE(fetched.ok()) << fetched.status();
    EXPECT_EQ(fetched->scan.points_mm.size(), 15000u);
  }
  const auto some = client.Fetch("scans/ENCODING_XYZ_F64", {148, 0}, runtime::ContextFor(10));
  ASSERT_TRUE(some.ok()) << some.status();
  EXPECT_EQ(some->scan.points_mm.size(), 200u);
}

}  // namespace
}  // namespace sixpoint::clients
