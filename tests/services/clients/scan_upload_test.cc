// Against a service that breaks off where it is told to: what is sent again, what is not, and when it is given up.
#include "services/clients/scan_upload.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/support/fake_scan_service.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::clients {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::StreamScript;

constexpr int kAll = StreamScript::kAll;
const grpc::Status kAway(grpc::StatusCode::UNAVAILABLE, "restarting");

// Eight blocks of 4096 points, each one profile.
OutgoingScan SampleScan(double z_mm = 0) {
  metrology::Points points_mm;
  for (int block = 0; block < 8; ++block)
    for (int i = 0; i < 4096; ++i) points_mm.emplace_back(0.1 * block, 1e-3 * i, z_mm);
  ingest::v1::ScanHeader header;
  header.set_scan_id("s1");
  header.set_encoding(ingest::v1::ENCODING_XYZ_F64);
  auto scan = PrepareScan(header, points_mm);
  OutgoingScan out;
  EXPECT_TRUE(scan.ok()) << scan.status();
  // One profile a block.
  out.header = scan->header;
  out.point_count = scan->point_count;
  PayloadsDigest digest;
  std::string all;
  for (const OutgoingBlock& block : scan->blocks) all += block.payload;
  constexpr std::size_t kBytes = 4096 * 24;
  for (std::size_t at = 0; at < all.size(); at += kBytes) {
    out.blocks.push_back({4096, 1, all.substr(at, kBytes)});
    digest.Add(out.blocks.back().payload);
  }
  out.sha256 = digest.ToHex();
  return out;
}

class ScanUploadTest : public ::testing::Test {
 protected:
  ScanUploadTest() : server_({&service_}), channel_(server_.Connect()) {
    options_.retry.away_s = options_.retry.full_s = 10;
    options_.retry.say = [this](const std::string& text) { said_.push_back(text); };
    options_.acknowledged = [this](std::int64_t count) {
      EXPECT_GT(count, 0);
      acknowledged_ += count;
      EXPECT_LE(acknowledged_, scan_.point_count);
    };
  }

  absl::StatusOr<ingest::v1::StoredScan> Upload() { return UploadScan(channel_, scan_, options_); }
  absl::StatusOr<ingest::v1::StoredScan> UploadByAndBy() {
    ScanUploader uploader(channel_, options_);
    ingest::v1::ScanHeader header = scan_.header;
    header.set_point_count(0);
    absl::Status status = uploader.Begin(header);
    for (std::size_t i = 0; status.ok() && i < scan_.blocks.size(); ++i) status = uploader.Send(scan_.blocks[i]);
    if (!status.ok()) return status;
    return uploader.End();
  }
  void ExpectStored(const absl::StatusOr<ingest::v1::StoredScan>& stored) {
    ASSERT_TRUE(stored.ok()) << stored.status();
    EXPECT_FALSE(stored->already_stored());
    EXPECT_EQ(stored->scan().sent_sha256(), scan_.sha256);
    EXPECT_EQ(stored->scan().header().point_count(), scan_.point_count);
    const auto& blocks = service_.stored("s1").blocks;
    ASSERT_EQ(blocks.size(), scan_.blocks.size());
    for (std::size_t i = 0; i < blocks.size(); ++i) EXPECT_EQ(blocks[i].payload(), scan_.blocks[i].payload) << i;
    EXPECT_EQ(acknowledged_, scan_.point_count);
  }

  testing::FakeScanService service_;
  testing::InProcessServer server_;
  std::shared_ptr<grpc::Channel> channel_;
  OutgoingScan scan_ = SampleScan();
  UploadOptions options_;
  std::vector<std::string> said_;
  std::int64_t acknowledged_ = 0;
};

TEST_F(ScanUploadTest, SendsEachBlockOnceAndThenTheEnd) {
  ExpectStored(Upload());
  EXPECT_THAT(service_.received(), ElementsAre(ElementsAre(0, 1, 2, 3, 4, 5, 6, 7)));
  EXPECT_THAT(said_, IsEmpty());
}

TEST_F(ScanUploadTest, GoesOnFromTheMiddle) {
  service_.Script({kAway, 3});
  ExpectStored(Upload());
  EXPECT_THAT(service_.received(), ElementsAre(ElementsAre(0, 1, 2), ElementsAre(3, 4, 5, 6, 7)));
  EXPECT_THAT(said_, ElementsAre(HasSubstr("ingest is away or full (restarting)"), HasSubstr("ingest is back")));
}

TEST_F(ScanUploadTest, SendsNoMoreThanAcceptedAsksFor) {
  // Five came and are durable, two were acknowledged.
  StreamScript lost_answers{kAway, 5};
  lost_answers.acknowledged_blocks = 2;
  service_.Script(lost_answers);
  ExpectStored(Upload());
  EXPECT_THAT(service_.received(), ElementsAre(ElementsAre(0, 1, 2, 3, 4), ElementsAre(5, 6, 7)));
}

TEST_F(ScanUploadTest, SendsAgainWhatWasNotDurable) {
  StreamScript lost_blocks{kAway, 5};
  lost_blocks.durable_blocks = lost_blocks.acknowledged_blocks = 2;
  service_.Script(lost_blocks);
  ExpectStored(UploadByAndBy());
  EXPECT_THAT(service_.received(), ElementsAre(ElementsAre(0, 1, 2, 3, 4), ElementsAre(2, 3, 4, 5, 6, 7)));
}

TEST_F(ScanUploadTest, BeginsAgainWhereTheServiceForgotAWholeScan) {
  service_.Script({kAway, 4});
  StreamScript forgets;
  forgets.forgets = true;
  service_.Script(forgets);
  ExpectStored(Upload());
  EXPECT_THAT(service_.received(), ElementsAre(ElementsAre(0, 1, 2, 3), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7)));
}

TEST_F(ScanUploadTest, AStreamingSourceCannotGiveBackWhatWasAcknowledged) {
  service_.Script({kAway, 4});
  StreamScript forgets;
  forgets.forgets = true;
  service_.Script(forgets);
  const auto stored = UploadByAndBy();
  EXPECT_EQ(stored.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(stored.status().message()), HasSubstr("goes on from block 0"));
}

TEST_F(ScanUploadTest, EveryReasonToTryAgainIsOne) {
  // INTERNAL without details is what gRPC itself says of a broken stream.
  for (const grpc::StatusCode code : {grpc::StatusCode::ABORTED, grpc::StatusCode::RESOURCE_EXHAUSTED,
                                      grpc::StatusCode::INTERNAL, grpc::StatusCode::UNAVAILABLE})
    service_.Script({grpc::Status(code, "again"), 1});
  service_.Script({kAway, 0});
  service_.Script({kAway, kAll, false});
  service_.Script({kAway, kAll});
  ExpectStored(UploadByAndBy());
  EXPECT_THAT(service_.received(), ElementsAre(ElementsAre(0), ElementsAre(1), ElementsAre(2), ElementsAre(3),
                                               IsEmpty(), IsEmpty(), ElementsAre(4, 5, 6, 7), IsEmpty()));
}

TEST_F(ScanUploadTest, ARefusalIsReturnedAtOnce) {
  service_.Script({grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "header.a_deg: 400, want less"), kAll, false});
  const auto at_header = Upload();
  EXPECT_EQ(at_header.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(at_header.status().message(), "header.a_deg: 400, want less");
  acknowledged_ = 0;
  service_.Script({grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "block[1]: not so"), 2});
  const auto at_block = Upload();
  EXPECT_EQ(at_block.status().message(), "block[1]: not so");
  acknowledged_ = 0;
  service_.refused_scan = "s1";
  EXPECT_EQ(Upload().status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(service_.received().size(), 3u);  // streams
  EXPECT_THAT(said_, IsEmpty());
}

TEST_F(ScanUploadTest, GivesUpAfterItsPatienceWithTheLastError) {
  options_.retry.away_s = 1;
  for (int i = 0; i < 30; ++i) service_.Script({grpc::Status(grpc::StatusCode::UNAVAILABLE, std::to_string(i)), 0});
  const auto start = std::chrono::steady_clock::now();
  const auto stored = Upload();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_EQ(stored.status().code(), absl::StatusCode::kUnavailable);
  const std::size_t streams = service_.received().size();
  EXPECT_EQ(stored.status().message(), std::to_string(streams - 1));
  // Pauses of 100, 200 and 400 ms; the next would end after 1.5 s.
  EXPECT_EQ(streams, 4u);
  EXPECT_LT(seconds, 1);
  EXPECT_THAT(said_.back(), HasSubstr("did not answer"));
}

TEST_F(ScanUploadTest, EachAcknowledgedBlockRenewsThePatience) {
  options_.retry.away_s = 0.25;  // one pause of 100 ms, not a second one
  for (int i = 0; i < 7; ++i) service_.Script({kAway, 1});
  ExpectStored(Upload());
  EXPECT_EQ(service_.received().size(), 8u);
}

TEST_F(ScanUploadTest, TheCallersDeadlineHolds) {
  options_.retry.deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(250);
  for (int i = 0; i < 9; ++i) service_.Script({kAway, 0});
  EXPECT_FALSE(Upload().ok());
  EXPECT_LE(service_.received().size(), 3u);
}

TEST_F(ScanUploadTest, AStoredScanIsNotSentAgain) {
  ExpectStored(Upload());
  acknowledged_ = 0;
  const auto again = UploadByAndBy();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->already_stored());
  EXPECT_EQ(acknowledged_, scan_.point_count);
  EXPECT_THAT(service_.received()[1], IsEmpty());
  scan_ = SampleScan(1);
  acknowledged_ = 0;
  EXPECT_EQ(Upload().status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(ScanUploadTest, AnotherProcessGoesOnWhereTheFirstDied) {
  ingest::v1::ScanHeader header = scan_.header;
  header.set_point_count(0);
  {
    ScanUploader first(channel_, options_);
    ASSERT_TRUE(first.Begin(header).ok());
    for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(first.Send(scan_.blocks[i]).ok());
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    while (service_.received()[0].size() < 3 && std::chrono::steady_clock::now() < patience)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  acknowledged_ = 0;
  ExpectStored(UploadByAndBy());
  EXPECT_THAT(service_.received(), ElementsAre(ElementsAre(0, 1, 2), ElementsAre(3, 4, 5, 6, 7)));
}

TEST_F(ScanUploadTest, WhatWaitsIsBounded) {
  const std::size_t block_bytes = scan_.blocks[0].payload.size();
  options_.unacknowledged_limit_bytes = 3 * block_bytes;
  ScanUploader uploader(channel_, options_);
  ASSERT_TRUE(uploader.Begin(scan_.header).ok());
  for (const OutgoingBlock& block : scan_.blocks) {
    ASSERT_TRUE(uploader.Send(block).ok());
    EXPECT_LE(uploader.unacknowledged_bytes(), options_.unacknowledged_limit_bytes);
  }
  ExpectStored(uploader.End());
  EXPECT_EQ(uploader.unacknowledged_bytes(), 0u);
}

TEST_F(ScanUploadTest, WithoutAcknowledgementsTheSourceWaits) {
  StreamScript silent;
  silent.acknowledged_blocks = 0;
  service_.Script(silent);
  options_.unacknowledged_limit_bytes = 3 * scan_.blocks[0].payload.size();
  options_.retry.deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(500);
  ScanUploader uploader(channel_, options_);
  ASSERT_TRUE(uploader.Begin(scan_.header).ok());
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(uploader.Send(scan_.blocks[i]).ok());
  EXPECT_EQ(uploader.unacknowledged_bytes(), options_.unacknowledged_limit_bytes);
  const absl::Status fourth = uploader.Send(scan_.blocks[3]);
  EXPECT_EQ(fourth.code(), absl::StatusCode::kDeadlineExceeded) << fourth;
  EXPECT_EQ(uploader.Send(scan_.blocks[4]).code(), absl::StatusCode::kDeadlineExceeded);
}

TEST_F(ScanUploadTest, SendsAtTheScannersPace) {
  options_.profiles_per_s = 20;
  const auto start = std::chrono::steady_clock::now();
  ExpectStored(Upload());
  // The last of eight profiles is measured after 0.4 s.
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(400));
}

TEST(ScanUpload, OutlivesItsServer) {
  testing::FakeScanService service;
  auto server = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{&service});
  const int port = server->port();
  const auto channel = server->Connect();
  UploadOptions options;
  options.retry.away_s = 30;
  ScanUploader uploader(channel, options);
  const OutgoingScan scan = SampleScan();
  ASSERT_TRUE(uploader.Begin(scan.header).ok());
  for (std::size_t i = 0; i < 4; ++i) ASSERT_TRUE(uploader.Send(scan.blocks[i]).ok());
  server.reset();
  std::thread restart([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    server = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{&service}, port);
  });
  for (std::size_t i = 4; i < 8; ++i) EXPECT_TRUE(uploader.Send(scan.blocks[i]).ok());
  const auto stored = uploader.End();
  restart.join();
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->scan().sent_sha256(), scan.sha256);
  EXPECT_EQ(service.received().size(), 2u);
}

}  // namespace
}  // namespace sixpoint::clients
