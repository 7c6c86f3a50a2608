// The service over real gRPC on a real PostgreSQL, with real decode workers.
#include "services/ingest/scan_service.h"

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
#include <thread>

#include "metrology/cloud/draco_codec.h"
#include "services/clients/scans.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/blob_store.h"
#include "storage/blobs.h"
#include "storage/record.h"
#include "storage/retention.h"
#include "tests/services/ingest/conversation.h"
#include "tests/services/ingest/sample_scans.h"
#include "tests/services/ingest/scan_service_fixture.h"
#include "tests/support/call.h"
#include "tests/support/stock_draco.h"

namespace sixpoint::ingest {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(ScanServiceTest, StoresADracoScanAndGivesItBackAsSent) {
  const auto points_mm = SampleProfiles(8, 100);
  const auto blocks = SampleBlocks(points_mm, 300);
  v1::ScanHeader header = SampleHeader("s1", 800);
  header.set_sender_error_um(0.25);
  const auto stored = Upload(header, blocks);
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_FALSE(stored->already_stored());
  const v1::Scan& scan = stored->scan();
  EXPECT_EQ(scan.name(), "scans/s1");
  EXPECT_EQ(scan.block_count(), 3);
  EXPECT_EQ(scan.proven_error_um(), 0.25);
  EXPECT_GT(scan.record_sequence(), 0);
  EXPECT_EQ(scan.sha256(), EndOf(blocks).sha256());
  EXPECT_EQ(scan.sent_sha256(), scan.sha256());
  EXPECT_EQ(scan.stored_encoding(), v1::ENCODING_DRACO);
  EXPECT_EQ(scan.profile_count(), 8);
  std::int64_t bytes = 0;
  for (const auto& block : blocks) bytes += static_cast<std::int64_t>(block.payload().size());
  EXPECT_EQ(scan.stored_bytes(), bytes);

  v1::ScanHeader as_stored = header;
  as_stored.mutable_measured_at()->set_nanos(123'456'000);  // microseconds are kept
  EXPECT_EQ(scan.header().SerializeAsString(), as_stored.SerializeAsString());

  const auto context = runtime::ContextFor(20.0);
  v1::DownloadScanRequest request;
  request.set_name("scans/s1");
  const auto reader = stub_->DownloadScan(context.get(), request);
  v1::DownloadScanResponse response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.scan().SerializeAsString(), scan.SerializeAsString());
  for (const auto& block : blocks) {
    ASSERT_TRUE(reader->Read(&response));
    EXPECT_EQ(response.block().payload(), block.payload());
    EXPECT_EQ(response.block().index(), block.index());
    EXPECT_EQ(response.block().point_count(), block.point_count());
    EXPECT_EQ(response.block().first_profile(), 3 * block.index());  // 300 points, 100 to a profile
    EXPECT_EQ(response.block().profile_count(), block.index() == 2 ? 2 : 3);
  }
  EXPECT_FALSE(reader->Read(&response));
  EXPECT_TRUE(reader->Finish().ok());
}

// What another encoder wrote stays as evidence, and is decoded by nobody but the worker; readers get the same points of ours.
TEST_F(ScanServiceTest, KeepsWhatWasSentBesideWhatReadersDecode) {
  const auto points_mm = SampleProfiles(8, 100);
  v1::ScanBlock sent;
  sent.set_point_count(800);
  sent.set_payload(testing::StockDraco(points_mm, 14, 10));
  const auto stored = Upload(SampleHeader("s1", 800), {sent});
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->scan().sent_sha256(), EndOf({sent}).sha256());
  EXPECT_NE(stored->scan().sha256(), stored->scan().sent_sha256());
  const auto block_in = [&](v1::PointFormat format) {
    const auto context = runtime::ContextFor(20.0);
    v1::DownloadScanRequest request;
    request.set_name("scans/s1");
    request.set_format(format);
    const auto reader = stub_->DownloadScan(context.get(), request);
    v1::DownloadScanResponse response;
    while (reader->Read(&response)) {
    }
    EXPECT_TRUE(reader->Finish().ok());
    return response.block().payload();
  };
  EXPECT_EQ(block_in(v1::POINT_FORMAT_SENT), sent.payload());
  const std::string read = block_in(v1::POINT_FORMAT_STORED);
  EXPECT_NE(read, sent.payload());
  EXPECT_EQ(static_cast<std::size_t>(stored->scan().stored_bytes()), read.size() + sent.payload().size());
  EXPECT_EQ(
      metrology::GreatestDifferenceMm(*metrology::DecodeBlock(read, 800), *metrology::DecodeBlock(sent.payload(), 800)),
      0);
  EXPECT_TRUE(Upload(SampleHeader("s1", 800), {sent})->already_stored());

  // Both go with the scan's points.
  const auto deleted =
      storage::DeleteScanPoints(database_.database(), nullptr, {"s1", "a test", "x", "x", {}}, testing::Soon());
  ASSERT_TRUE(deleted.ok()) << deleted.status();
  EXPECT_EQ(deleted->freed_count, 2);
}

// By digest, so that what was read once may be kept: every blob of a scan, pages of them, ranges, and no other's.
TEST_F(ScanServiceTest, TellsAndGivesTheBlobsOfAScan) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 100);
  ASSERT_TRUE(Upload(SampleHeader("s1", 800), blocks).ok());
  ASSERT_TRUE(Upload(SampleHeader("s2", 800), SampleBlocks(SampleProfiles(8, 100, 2), 400)).ok());
  v1::ListScanBlocksRequest list;
  list.set_name("scans/s1");
  list.set_page_size(3);
  std::vector<v1::StoredBlock> told;
  int page_count = 0;
  do {
    const auto page = testing::Call(*stub_, &v1::ScanService::Stub::ListScanBlocks, list);
    ASSERT_TRUE(page.ok()) << page.status();
    told.insert(told.end(), page->blocks().begin(), page->blocks().end());
    list.set_page_token(page->next_page_token());
    ++page_count;
  } while (!list.page_token().empty());
  EXPECT_EQ(page_count, 3);
  ASSERT_EQ(told.size(), blocks.size());
  v1::GetScanBlobRequest get;
  get.set_name("scans/s1");
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_EQ(told[i].index(), static_cast<int>(i));
    EXPECT_EQ(told[i].point_count(), blocks[i].point_count());
    EXPECT_EQ(told[i].sha256(), storage::Sha256Hex(blocks[i].payload()));
    get.set_sha256(told[i].sha256());
    const auto blob = testing::Call(*stub_, &v1::ScanService::Stub::GetScanBlob, get);
    ASSERT_TRUE(blob.ok()) << blob.status();
    EXPECT_EQ(blob->data(), blocks[i].payload());
  }
  const std::string& whole = blocks.back().payload();
  const auto size = static_cast<std::int64_t>(whole.size());
  const auto range = [&](std::int64_t first, std::int64_t count) {
    get.set_first_byte(first);
    get.set_byte_count(count);
    return testing::Call(*stub_, &v1::ScanService::Stub::GetScanBlob, get);
  };
  EXPECT_EQ(range(5, 7)->data(), whole.substr(5, 7));
  EXPECT_EQ(range(5, 7)->size_bytes(), size);
  EXPECT_EQ(range(size - 2, 100)->data(), whole.substr(whole.size() - 2));
  EXPECT_THAT(range(size, 1).status().message(), HasSubstr("first_byte"));
  EXPECT_THAT(range(-1, 1).status().message(), HasSubstr("first_byte"));
  EXPECT_THAT(range(0, -1).status().message(), HasSubstr("byte_count"));
  get.set_name("scans/s2");
  EXPECT_EQ(runtime::ReasonOf(range(0, 0).status()), "BLOB_NOT_FOUND");
  get.set_sha256("");
  EXPECT_EQ(runtime::ReasonOf(range(0, 0).status()), "BLOB_NOT_FOUND");
  list.set_page_token("9");
  EXPECT_THAT(testing::Call(*stub_, &v1::ScanService::Stub::ListScanBlocks, list).status().message(),
              HasSubstr("page_token"));
}

TEST_F(ScanServiceTest, EncodesDoublesOnArrivalWithinTheBoundAsked) {
  const auto points_mm = SampleProfiles(8, 100);
  for (const double bound_um : {0.0, 0.05, 2.5}) {
    v1::ScanHeader header =
        SampleHeader("s" + std::to_string(static_cast<int>(100 * bound_um)), 800, v1::ENCODING_XYZ_F64);
    header.set_error_bound_um(bound_um);
    const auto stored = Upload(header, SampleBlocks(points_mm, 300, v1::ENCODING_XYZ_F64));
    ASSERT_TRUE(stored.ok()) << stored.status();
    const auto fetched = client_.Fetch(stored->scan().name(), runtime::ContextFor(20.0));
    ASSERT_TRUE(fetched.ok()) << fetched.status();
    ASSERT_EQ(fetched->scan.points_mm.size(), points_mm.size());
    double greatest_um = 0;
    for (std::size_t i = 0; i < points_mm.size(); ++i) {
      greatest_um = std::max(greatest_um, 1e3 * (fetched->scan.points_mm[i] - points_mm[i]).cwiseAbs().maxCoeff());
    }
    EXPECT_LE(greatest_um, bound_um == 0 ? 0.25 : bound_um);
    EXPECT_EQ(greatest_um, stored->scan().proven_error_um());
  }
}

TEST_F(ScanServiceTest, TheClientSendsAndFetchesWhatKernelsHold) {
  const auto points_mm = SampleProfiles(60, 1280);  // more than one block
  const auto stored = client_.Upload(SampleHeader("s1", 0), points_mm, runtime::ContextFor(30.0));
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->scan().block_count(), 2);
  const auto fetched = client_.Fetch("scans/s1", runtime::ContextFor(20.0));
  ASSERT_TRUE(fetched.ok()) << fetched.status();
  EXPECT_EQ(fetched->scan.points_mm.size(), points_mm.size());
  EXPECT_NEAR(fetched->scan.a_rad, -50 * M_PI / 180, 1e-15);
  EXPECT_NEAR(fetched->scan.b_rad, M_PI, 1e-15);
  EXPECT_EQ(fetched->scan.v0_mm, Eigen::Vector3d(-190.0088, -178.8434, 275.2997));
  EXPECT_EQ(fetched->scan.profile_pitch_mm, 0.05);
  const auto again = client_.Upload(SampleHeader("s1", 0), points_mm, runtime::ContextFor(30.0));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->already_stored());
}

TEST_F(ScanServiceTest, RecordsWhatAScanCameFrom) {
  v1::ScanHeader header = SampleHeader("plate.1", 800);
  header.set_kind(v1::SCAN_KIND_ARTEFACT);
  header.set_subject("artefacts/a1");
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  const auto artefact_scan = Upload(header, blocks);
  ASSERT_TRUE(artefact_scan.ok()) << artefact_scan.status();
  ASSERT_TRUE(Upload(SampleHeader("s1", 800), blocks).ok());
  auto transaction = database_.database()->Begin(testing::Soon());
  ASSERT_TRUE(transaction.ok());
  const auto derived = storage::DerivedFrom(*transaction, "artefacts/a1");
  ASSERT_TRUE(derived.ok());
  ASSERT_EQ(derived->size(), 1U);
  const storage::JournalEntry& entry = derived->front();
  EXPECT_EQ(entry.entry.kind, "scan");
  EXPECT_EQ(entry.entry.name, "scans/plate.1");
  EXPECT_THAT(entry.entry.inputs, ElementsAre("machines/m1@3", "artefacts/a1@2"));
  EXPECT_EQ(entry.entry.machine, "m1");
  EXPECT_FALSE(entry.entry.blade.has_value());
  EXPECT_TRUE(entry.entry.measured_at.has_value());
  EXPECT_EQ(entry.recorded.sequence, artefact_scan->scan().record_sequence());
  const auto of_blade = storage::RecordOfBlade(*transaction, "sn1");
  ASSERT_TRUE(of_blade.ok());
  ASSERT_EQ(of_blade->size(), 2U);  // the blade, then its scan
  EXPECT_THAT(of_blade->back().entry.inputs, ElementsAre("machines/m1@3", "blades/sn1"));
}

TEST_F(ScanServiceTest, TheSameScanTwiceIsOneScan) {
  const auto points_mm = SampleProfiles(8, 100);
  const auto blocks = SampleBlocks(points_mm, 300);
  const v1::ScanHeader header = SampleHeader("s1", 800);
  const auto first = Upload(header, blocks);
  ASSERT_TRUE(first.ok()) << first.status();
  const auto second = Upload(header, blocks);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_TRUE(second->already_stored());
  EXPECT_EQ(second->scan().SerializeAsString(), first->scan().SerializeAsString());
  EXPECT_EQ(Count("scans"), 1);
  EXPECT_EQ(Count("record_entries WHERE kind = 'scan'"), 1);
}

TEST_F(ScanServiceTest, OtherContentUnderTheSameIdIsRefusedWithWhatDiffers) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  v1::ScanHeader header = SampleHeader("s1", 800);
  ASSERT_TRUE(Upload(header, blocks).ok());
  const absl::Status other_points = Upload(header, SampleBlocks(SampleProfiles(8, 100, 2), 300)).status();
  EXPECT_TRUE(absl::IsAlreadyExists(other_points)) << other_points;
  EXPECT_THAT(std::string(other_points.message()), HasSubstr("SHA-256"));
  EXPECT_EQ(runtime::ReasonOf(other_points), "SCAN_DIFFERS");
  header.set_a_deg(-49);
  const absl::Status other_header = Upload(header, blocks).status();
  EXPECT_TRUE(absl::IsAlreadyExists(other_header)) << other_header;
  EXPECT_THAT(std::string(other_header.message()), HasSubstr("a_deg: -50 -> -49"));
  header.set_a_deg(-50);
  // Sent again in spite of `accepted`: compared block by block.
  Conversation again(stub_.get(), 20.0);
  EXPECT_TRUE(again.Say(header).accepted().complete());
  EXPECT_TRUE(again.Send(blocks[0]));
  EXPECT_EQ(again.HearAcknowledged(), 3);
  v1::ScanBlock other = blocks[1];
  other.set_payload(blocks[2].payload());
  EXPECT_TRUE(again.Send(other));
  EXPECT_EQ(again.HearAcknowledged(), -1);
  EXPECT_EQ(runtime::ReasonOf(again.Finish()), "BLOCK_DIFFERS");
  EXPECT_EQ(Count("scans"), 1);
}

// One of those that its part has, and no other. Elsewhere in the fixture it would be another scan.
TEST_F(ScanServiceTest, AScansStationIsOneOfItsParts) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  v1::ScanHeader header = SampleHeader("s1", 800);
  plant_.stations = {"left", "right"};
  for (const char* station : {"", "middle"}) {
    header.set_station(station);
    ExpectRefused(header, blocks, "header.station");
    EXPECT_THAT(std::string(Upload(header, blocks).status().message()),
                HasSubstr(std::string("header.station: ") + (*station == 0 ? "empty" : station) +
                          ", want a station of parts/p1 (left, right)"));
  }
  header.set_station("left");
  const auto stored = Upload(header, blocks);
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->scan().header().station(), "left");
  EXPECT_EQ(Count("scans WHERE station = 'left'"), 1);
  EXPECT_TRUE(Upload(header, blocks)->already_stored());
  header.set_station("right");
  const absl::Status other = Upload(header, blocks).status();
  EXPECT_TRUE(absl::IsAlreadyExists(other)) << other;
  EXPECT_THAT(std::string(other.message()), HasSubstr("station: \"left\" -> \"right\""));
}

TEST_F(ScanServiceTest, IdenticalUploadsAtOnceAreOneScan) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  std::atomic<int> stored_count = 0;
  std::atomic<int> already_count = 0;
  std::vector<std::thread> machines;
  for (int i = 0; i < kSlotsOfAPeer; ++i) {
    machines.emplace_back([&] {
      auto answer = Upload(SampleHeader("s1", 800), blocks);
      // Another stream may go on with what this one began: it calls again, as it is told to.
      while (absl::IsAborted(answer.status())) answer = Upload(SampleHeader("s1", 800), blocks);
      EXPECT_TRUE(answer.ok()) << answer.status();
      if (answer.ok()) ++(answer->already_stored() ? already_count : stored_count);
    });
  }
  for (std::thread& machine : machines) machine.join();
  EXPECT_EQ(stored_count, 1);
  EXPECT_EQ(already_count, kSlotsOfAPeer - 1);
  EXPECT_EQ(Count("scans"), 1);
}

TEST_F(ScanServiceTest, RefusesBadHeadersByFieldAndStoresNothing) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  v1::ScanHeader header = SampleHeader("s1", 800);
  header.set_machine("machines/unknown");
  ExpectRefused(header, blocks, "header.machine");
  header = SampleHeader("s1", 800);
  header.set_subject("blades/unknown");
  ExpectRefused(header, blocks, "header.subject");
  header = SampleHeader("s1", 800);
  header.mutable_v0_mm()->set_y_mm(std::numeric_limits<double>::quiet_NaN());
  ExpectRefused(header, blocks, "header.v0_mm.y_mm");
  header = SampleHeader("s1", 800);
  header.set_a_deg(101);
  ExpectRefused(header, blocks, "header.a_deg");
  header = SampleHeader("s1", 800);
  header.set_station("left");  // the part has none
  ExpectRefused(header, blocks, "header.station");
  header = SampleHeader("s1", -1);
  ExpectRefused(header, {}, "header.point_count");
  header = SampleHeader("s1", 800, v1::ENCODING_XYZ_F64);
  header.set_error_bound_um(3.01);  // the part's tightest tolerance is 30 um
  ExpectRefused(header, {}, "header.error_bound_um");
  header = SampleHeader("s1", 800);
  header.set_sender_error_um(3.01);
  ExpectRefused(header, {}, "header.sender_error_um");
  header = SampleHeader("s1", 800, v1::ENCODING_RAW_PROFILES);
  ExpectRefused(header, {}, "header.raw_step_um");
  header = SampleHeader("s1", 800, v1::ENCODING_RANGE_IMAGE);
  ExpectRefused(header, {}, "header.encoding");
}

TEST_F(ScanServiceTest, RefusesBadBlocksByFieldAndStoresNothing) {
  const auto points_mm = SampleProfiles(8, 100);
  const auto blocks = SampleBlocks(points_mm, 300);
  const v1::ScanHeader header = SampleHeader("s1", 800);
  ExpectRefused(header, {}, "end.block_count");  // an empty scan
  // Truncated: the end tells, and the upload can still be gone on with.
  ExpectRefused(header, {blocks[0], blocks[1]}, "header.point_count");
  EXPECT_EQ(Count("scan_upload_blocks"), 2);
  Forget("s1");
  ExpectRefused(header, {blocks[0], blocks[2]}, "block[1].index");  // a gap
  Forget("s1");
  ExpectRefused(SampleHeader("s1", 700), blocks, "block[2].point_count");  // too many points
  Forget("s1");
  v1::ScanEnd end = EndOf(blocks);
  end.set_sha256(std::string(64, '0'));
  EXPECT_THAT(std::string(Upload(header, blocks, end).status().message()), HasSubstr("end.sha256: "));
  end = EndOf(blocks);
  end.set_point_count(801);
  EXPECT_THAT(std::string(Upload(header, blocks, end).status().message()), HasSubstr("end.point_count: "));
  end = EndOf(blocks);
  end.set_block_count(4);
  EXPECT_THAT(std::string(Upload(header, blocks, end).status().message()), HasSubstr("end.block_count: "));
  ExpectNothingStored();
  Forget("s1");
  auto broken = blocks;
  broken[1].mutable_payload()->resize(broken[1].payload().size() / 2);
  ExpectRefused(header, broken, "block[1].payload");  // truncated Draco; block 0 stays acknowledged
  broken = blocks;
  broken[1].set_payload(DracoHeaderOf(10'000'000) + std::string(43, '\x01'));
  ExpectRefused(header, broken, "block[1].payload");  // 58 bytes that declare ten million points
  broken = blocks;
  broken[2].set_point_count(199);
  ExpectRefused(header, broken, "block[2].payload");  // counts that lie
}

TEST_F(ScanServiceTest, RefusesPointsThatNoSensorGives) {
  const auto upload_point = [&](const Eigen::Vector3d& point_mm, v1::Encoding encoding, const std::string& field) {
    auto points_mm = SampleProfiles(8, 100);
    points_mm[750] = point_mm;
    Forget("s1");
    ExpectRefused(SampleHeader("s1", 800, encoding), SampleBlocks(points_mm, 300, encoding), field);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  upload_point({0.35, nan, 0}, v1::ENCODING_XYZ_F64, "block[2].payload");
  for (const v1::Encoding encoding : {v1::ENCODING_XYZ_F64, v1::ENCODING_DRACO}) {
    upload_point({0.35, 0, 13}, encoding, "block[2].payload.z_mm");
    upload_point({0.35, -15, 0}, encoding, "block[2].payload.y_mm");
    upload_point({0.05, 0, 0}, encoding, "block[2].payload.x_mm");
  }
  v1::ScanHeader header = SampleHeader("s1", 800);
  header.set_columns_per_profile(99);
  Forget("s1");
  ExpectRefused(header, SampleBlocks(SampleProfiles(8, 100), 300), "block[0].payload");
}

TEST_F(ScanServiceTest, RefusesAStreamWithoutItsHeaderOrWithoutItsEnd) {
  Conversation headless(stub_.get(), 20.0);
  headless.Send(SampleBlocks(SampleProfiles(1, 10), 10)[0]);
  const absl::Status status = headless.Finish();
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("header: missing"));
  Conversation endless(stub_.get(), 20.0);
  endless.Say(SampleHeader("s1", 10));
  endless.Send(SampleBlocks(SampleProfiles(1, 10), 10)[0]);
  EXPECT_THAT(std::string(endless.Finish().message()), HasSubstr("end: missing"));
  ExpectNothingStored();
}

TEST_F(ScanServiceTest, GoesOnFromTheLastAcknowledgedBlockAfterAnyBreak) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  const v1::ScanHeader header = SampleHeader("s1", 0);  // a machine that does not know its count yet
  {
    Conversation broken(stub_.get(), 20.0);
    EXPECT_EQ(broken.Say(header).accepted().next_block(), 0);
    ASSERT_TRUE(broken.Send(blocks[0]));
    ASSERT_EQ(broken.HearAcknowledged(), 1);
    ASSERT_TRUE(broken.Send(blocks[1]));
    ASSERT_EQ(broken.HearAcknowledged(), 2);
    broken.Cancel();
  }
  ExpectNothingStored();  // not visible yet
  Conversation again(stub_.get(), 20.0);
  const v1::UploadProgress accepted = again.Say(header).accepted();
  EXPECT_EQ(accepted.next_block(), 2);
  EXPECT_EQ(accepted.point_count(), 600);
  EXPECT_FALSE(accepted.complete());
  ASSERT_TRUE(again.Send(blocks[1]));  // the same block twice is one block
  ASSERT_EQ(again.HearAcknowledged(), 2);
  ASSERT_TRUE(again.Send(blocks[2]));
  ASSERT_EQ(again.HearAcknowledged(), 3);
  ASSERT_TRUE(again.Send(EndOf(blocks)));
  v1::UploadScanResponse response;
  ASSERT_TRUE(again.Hear(&response));
  EXPECT_FALSE(response.stored().already_stored());
  EXPECT_EQ(response.stored().scan().header().point_count(), 800);
  EXPECT_TRUE(again.Finish().ok());
  EXPECT_EQ(Count("scan_blocks"), 3);
  EXPECT_EQ(Count("scan_uploads"), 0);
  EXPECT_EQ(Count("scan_upload_blocks"), 0);
  EXPECT_TRUE(client_.Fetch("scans/s1", runtime::ContextFor(20.0)).ok());
}

TEST_F(ScanServiceTest, AnotherBlockOrHeaderUnderTheSameNumberIsAnError) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  const auto others = SampleBlocks(SampleProfiles(8, 100, 2), 300);
  Conversation first(stub_.get(), 20.0);
  first.Say(SampleHeader("s1", 800));
  ASSERT_TRUE(first.Send(blocks[0]));
  ASSERT_EQ(first.HearAcknowledged(), 1);
  ASSERT_TRUE(first.Send(others[0]));
  const absl::Status differs = first.Finish();
  EXPECT_TRUE(absl::IsAlreadyExists(differs)) << differs;
  EXPECT_EQ(runtime::ReasonOf(differs), "BLOCK_DIFFERS");
  v1::ScanHeader header = SampleHeader("s1", 800);
  header.set_b_deg(12);
  Conversation second(stub_.get(), 20.0);
  second.Say(header);
  EXPECT_EQ(runtime::ReasonOf(second.Finish()), "SCAN_DIFFERS");
}

// A machine whose connection broke comes again while its old stream still hangs.
TEST_F(ScanServiceTest, TwoStreamsOfOneScanAreOneScan) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  Conversation old(stub_.get(), 20.0);
  old.Say(SampleHeader("s1", 800));
  ASSERT_TRUE(old.Send(blocks[0]));
  ASSERT_EQ(old.HearAcknowledged(), 1);
  Conversation young(stub_.get(), 20.0);
  ASSERT_EQ(young.Say(SampleHeader("s1", 800)).accepted().next_block(), 1);
  ASSERT_TRUE(young.Send(blocks[1]));
  ASSERT_EQ(young.HearAcknowledged(), 2);
  ASSERT_TRUE(old.Send(blocks[1]));  // it does not know yet
  ASSERT_EQ(old.HearAcknowledged(), 2);
  ASSERT_TRUE(old.Send(blocks[2]));
  ASSERT_EQ(old.HearAcknowledged(), 3);
  ASSERT_TRUE(old.Send(EndOf(blocks)));
  EXPECT_TRUE(old.Finish().ok());
  ASSERT_TRUE(young.Send(blocks[2]));
  ASSERT_EQ(young.HearAcknowledged(), 3);
  ASSERT_TRUE(young.Send(EndOf(blocks)));
  v1::UploadScanResponse response;
  ASSERT_TRUE(young.Hear(&response));
  EXPECT_TRUE(response.stored().already_stored());
  EXPECT_EQ(Count("scans"), 1);
  EXPECT_EQ(Count("scan_blocks"), 3);
}

TEST_F(ScanServiceTest, EndsAClientThatSendsNothingAtItsDeadline) {
  Conversation silent(stub_.get(), 0.5);
  silent.Say(SampleHeader("s1", 800));
  v1::UploadScanResponse response;
  EXPECT_FALSE(silent.Hear(&response));
  EXPECT_TRUE(absl::IsDeadlineExceeded(silent.Finish()));
  ExpectNothingStored();
}

TEST_F(ScanServiceTest, EndsAStreamThatStandsStillAndKeepsWhatWasAcknowledged) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  Conversation standing(stub_.get(), 60.0);
  standing.Say(SampleHeader("s1", 800));
  ASSERT_TRUE(standing.Send(blocks[0]));
  ASSERT_EQ(standing.HearAcknowledged(), 1);
  const auto begin = std::chrono::steady_clock::now();
  v1::UploadScanResponse response;
  EXPECT_FALSE(standing.Hear(&response));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 4 * kStreamPatience);
  EXPECT_FALSE(standing.Finish().ok());
  Conversation again(stub_.get(), 20.0);
  EXPECT_EQ(again.Say(SampleHeader("s1", 800)).accepted().next_block(), 1);
}

// Half of the slots are other peers'.
TEST_F(ScanServiceTest, RefusesMoreUploadsOfOnePeerThanItsShare) {
  std::vector<std::unique_ptr<Conversation>> uploads;
  for (int i = 0; i < kSlotsOfAPeer; ++i) {
    uploads.push_back(std::make_unique<Conversation>(stub_.get(), 20.0));
    ASSERT_TRUE(uploads.back()->Say(SampleHeader("s" + std::to_string(i), 800)).has_accepted());
  }
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  const absl::Status refused = Upload(SampleHeader("more", 800), blocks).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_EQ(runtime::ReasonOf(refused), "UPLOADS_FULL");
  // Reads go on meanwhile.
  v1::ListScansResponse list;
  const auto list_context = runtime::ContextFor(20.0);
  EXPECT_TRUE(stub_->ListScans(list_context.get(), {}, &list).ok());
  uploads.clear();
  absl::Status stored = refused;
  for (int attempt = 0; attempt < 200 && absl::IsResourceExhausted(stored); ++attempt) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    stored = Upload(SampleHeader("after", 800), blocks).status();
  }
  EXPECT_TRUE(stored.ok()) << stored;
}

// Each raw profile: x, mask, then y and z of the valid columns.
std::string RawProfile(double x_mm, const std::vector<int>& columns, const std::vector<std::int32_t>& yz,
                       int mask_bytes) {
  std::string bytes(reinterpret_cast<const char*>(&x_mm), sizeof x_mm);
  std::string mask(static_cast<std::size_t>(mask_bytes), '\0');
  for (const int column : columns) mask[static_cast<std::size_t>(column / 8)] |= static_cast<char>(1 << column % 8);
  bytes += mask;
  bytes.append(reinterpret_cast<const char*>(yz.data()), yz.size() * sizeof(std::int32_t));
  return bytes;
}

TEST_F(ScanServiceTest, KeepsRawProfilesInWholeSteps) {
  v1::ScanHeader header = SampleHeader("s1", 0, v1::ENCODING_RAW_PROFILES);
  header.set_raw_step_um(0.5);
  header.set_columns_per_profile(10);
  v1::ScanBlock block;
  block.set_point_count(5);
  block.set_payload(RawProfile(1.25, {0, 3, 9}, {-8000, 120, 10, -7, 9000, 2}, 2) + RawProfile(1.3, {}, {}, 2) +
                    RawProfile(1.35, {4, 5}, {1, 2, 3, 4}, 2));
  const auto stored = Upload(header, {block});
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->scan().stored_encoding(), v1::ENCODING_RANGE_IMAGE);
  EXPECT_EQ(stored->scan().profile_count(), 2);  // the one in the middle has no points
  EXPECT_EQ(stored->scan().header().raw_step_um(), 0.5);
  EXPECT_LE(stored->scan().proven_error_um(), 0.25 + 1e-9);
  const auto fetched = client_.Fetch("scans/s1", runtime::ContextFor(20.0));
  ASSERT_TRUE(fetched.ok()) << fetched.status();
  const metrology::Points sent_mm = {
      {1.25, -4.0, 0.06}, {1.25, 0.005, -0.0035}, {1.25, 4.5, 0.001}, {1.35, 0.0005, 0.001}, {1.35, 0.0015, 0.002}};
  ASSERT_EQ(fetched->scan.points_mm.size(), sent_mm.size());
  for (std::size_t i = 0; i < sent_mm.size(); ++i) {
    EXPECT_EQ(fetched->scan.points_mm[i].z(), sent_mm[i].z()) << i;
    EXPECT_LE((fetched->scan.points_mm[i] - sent_mm[i]).cwiseAbs().maxCoeff(), 0.25e-3 + 1e-9) << i;
  }
}

TEST_F(ScanServiceTest, RefusesRawProfilesThatLie) {
  v1::ScanHeader header = SampleHeader("s1", 0, v1::ENCODING_RAW_PROFILES);
  header.set_raw_step_um(0.5);
  header.set_columns_per_profile(10);
  const std::string sound = RawProfile(1.25, {0, 3}, {1, 2, 3, 4}, 2);
  const auto refuse = [&](const std::string& payload, int point_count, const std::string& why) {
    v1::ScanBlock block;
    block.set_point_count(point_count);
    block.set_payload(payload);
    const absl::Status status = Upload(header, {block}).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("block[0].payload"));
    EXPECT_THAT(std::string(status.message()), HasSubstr(why));
  };
  refuse(sound.substr(0, 9), 2, "ends inside its head");
  refuse(sound.substr(0, sound.size() - 1), 2, "ends inside its points");
  refuse(sound, 1, "more points");
  refuse(sound, 3, "fewer");
  refuse(RawProfile(1.25, {0, 10}, {1, 2, 3, 4}, 2), 2, "beyond column 9");
  refuse(RawProfile(std::numeric_limits<double>::quiet_NaN(), {0}, {1, 2}, 2), 1, "x is not finite");
  refuse(RawProfile(1.25, {0}, {1, 2'000'000'000}, 2), 1, "the range of the sensor");
  refuse(sound + RawProfile(1.0, {0}, {1, 2}, 2), 3, "x runs backwards");
  EXPECT_EQ(Count("scan_upload_blocks"), 0);
  ExpectNothingStored();
}

TEST_F(ScanServiceTest, GivesAnyRangeOfProfilesAndADecimatedPreview) {
  const auto points_mm = SampleProfiles(20, 100);
  // Cut inside profiles: one profile lies in two blocks.
  ASSERT_TRUE(
      Upload(SampleHeader("s1", 2000, v1::ENCODING_XYZ_F64), SampleBlocks(points_mm, 330, v1::ENCODING_XYZ_F64)).ok());
  const auto download = [&](int first, int count, v1::PointFormat format, metrology::Points* out_mm) {
    const auto context = runtime::ContextFor(20.0);
    v1::DownloadScanRequest request;
    request.set_name("scans/s1");
    request.set_first_profile(first);
    request.set_profile_count(count);
    request.set_format(format);
    const auto reader = stub_->DownloadScan(context.get(), request);
    for (v1::DownloadScanResponse response; reader->Read(&response);) {
      if (!response.has_block()) continue;
      const v1::ScanBlock& block = response.block();
      metrology::Points part_mm(static_cast<std::size_t>(block.point_count()));
      if (format == v1::POINT_FORMAT_XYZ_F64) {
        EXPECT_EQ(block.payload().size(), 24 * part_mm.size());
        std::memcpy(part_mm.data()->data(), block.payload().data(), block.payload().size());
      } else {
        part_mm = metrology::DecodeBlock(block.payload(), block.point_count()).value();
      }
      out_mm->insert(out_mm->end(), part_mm.begin(), part_mm.end());
    }
    return runtime::FromGrpc(reader->Finish());
  };
  for (const auto& [first, count] : {std::pair{0, 1}, {3, 1}, {3, 4}, {17, 0}, {0, 0}, {19, 1}}) {
    metrology::Points range_mm;
    const absl::Status status = download(first, count, v1::POINT_FORMAT_XYZ_F64, &range_mm);
    ASSERT_TRUE(status.ok()) << status;
    const int profiles = count == 0 ? 20 - first : count;
    ASSERT_EQ(range_mm.size(), static_cast<std::size_t>(100 * profiles)) << first << " " << count;
    for (std::size_t i = 0; i < range_mm.size(); ++i) {
      ASSERT_LE((range_mm[i] - points_mm[static_cast<std::size_t>(100 * first) + i]).cwiseAbs().maxCoeff(), 0.25e-3);
    }
  }
  metrology::Points whole_blocks_mm;
  ASSERT_TRUE(download(3, 1, v1::POINT_FORMAT_STORED, &whole_blocks_mm).ok());
  EXPECT_EQ(whole_blocks_mm.size(), 660U);  // the two blocks that hold the profile
  metrology::Points none_mm;
  EXPECT_THAT(std::string(download(20, 1, v1::POINT_FORMAT_XYZ_F64, &none_mm).message()),
              HasSubstr("first_profile: 20"));
  EXPECT_THAT(std::string(download(18, 3, v1::POINT_FORMAT_XYZ_F64, &none_mm).message()),
              HasSubstr("profile_count: 3"));
  EXPECT_THAT(std::string(download(-1, 3, v1::POINT_FORMAT_XYZ_F64, &none_mm).message()),
              HasSubstr("first_profile: -1"));

  v1::PreviewScanRequest request;
  request.set_name("scans/s1");
  request.set_point_count(150);
  v1::PreviewScanResponse preview;
  const auto context = runtime::ContextFor(20.0);
  ASSERT_TRUE(stub_->PreviewScan(context.get(), request, &preview).ok());
  EXPECT_EQ(preview.stride(), 14);
  ASSERT_EQ(preview.point_count(), 143);
  ASSERT_EQ(preview.xyz_f32().size(), 143U * 12);
  for (std::size_t i = 0; i < 143; ++i) {
    Eigen::Vector3f p;
    std::memcpy(p.data(), preview.xyz_f32().data() + 12 * i, 12);
    ASSERT_LE((p.cast<double>() - points_mm[14 * i]).cwiseAbs().maxCoeff(), 0.26e-3) << i;
  }
}

TEST_F(ScanServiceTest, SurvivesMutatedUploads) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 400);
  std::mt19937 random(3);
  int refused_count = 0;
  for (int i = 0; i < 150; ++i) {
    auto mutated = blocks;
    std::string& bytes = *mutated[1].mutable_payload();
    for (int flips = 1 + static_cast<int>(random() % 4); flips > 0; --flips) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    const auto answer = Upload(SampleHeader("m" + std::to_string(i), 800), mutated);
    if (answer.ok()) continue;  // other points, but sound ones
    EXPECT_TRUE(absl::IsInvalidArgument(answer.status())) << answer.status();
    ++refused_count;
  }
  EXPECT_GT(refused_count, 50);
  EXPECT_EQ(Count("scans"), 150 - refused_count);
  EXPECT_EQ(Count("scan_blocks"), 2 * (150 - refused_count));
  EXPECT_TRUE(Upload(SampleHeader("s1", 800), blocks).ok());
}

TEST_F(ScanServiceTest, ListsNewestFirstByPagesAndFilters) {
  const auto points_mm = SampleProfiles(2, 10);
  for (int i = 0; i < 7; ++i) {
    v1::ScanHeader header = SampleHeader("s" + std::to_string(i), 20);
    header.set_subject(i % 2 == 0 ? "blades/sn1" : "blades/sn2");
    if (i == 6) header.set_kind(v1::SCAN_KIND_PINS);
    ASSERT_TRUE(Upload(header, SampleBlocks(points_mm, 20)).ok());
  }
  const auto list = [&](v1::ListScansRequest request) {
    std::vector<std::string> names;
    for (int pages = 0; pages < 20; ++pages) {
      v1::ListScansResponse response;
      const auto context = runtime::ContextFor(20.0);
      EXPECT_TRUE(stub_->ListScans(context.get(), request, &response).ok());
      for (const v1::Scan& scan : response.scans()) names.push_back(scan.header().scan_id());
      if (response.next_page_token().empty()) break;
      EXPECT_EQ(response.scans_size(), request.page_size());
      request.set_page_token(response.next_page_token());
    }
    return names;
  };
  v1::ListScansRequest request;
  EXPECT_THAT(list(request), ElementsAre("s6", "s5", "s4", "s3", "s2", "s1", "s0"));
  request.set_page_size(3);
  EXPECT_THAT(list(request), ElementsAre("s6", "s5", "s4", "s3", "s2", "s1", "s0"));
  request.set_page_size(1);
  request.set_subject("blades/sn2");
  EXPECT_THAT(list(request), ElementsAre("s5", "s3", "s1"));
  request.Clear();
  request.set_kind(v1::SCAN_KIND_PINS);
  EXPECT_THAT(list(request), ElementsAre("s6"));
  request.Clear();
  request.set_machine("machines/m2");
  EXPECT_THAT(list(request), ElementsAre());
  request.Clear();
  request.set_part("parts/p1");
  EXPECT_EQ(list(request).size(), 7u);
  request.set_part("parts/p2");
  EXPECT_THAT(list(request), ElementsAre());
  request.Clear();
  v1::GetScanRequest get;
  get.set_name("scans/s4");
  v1::Scan scan;
  ASSERT_TRUE(stub_->GetScan(runtime::ContextFor(20.0).get(), get, &scan).ok());
  *request.mutable_recorded()->mutable_from() = scan.received_at();
  EXPECT_THAT(list(request), ElementsAre("s6", "s5", "s4"));
  request.clear_recorded();
  *request.mutable_recorded()->mutable_until() = scan.received_at();
  EXPECT_THAT(list(request), ElementsAre("s3", "s2", "s1", "s0"));
}

TEST_F(ScanServiceTest, RefusesBadPagesAndNames) {
  const auto list = [&](const v1::ListScansRequest& request) {
    v1::ListScansResponse response;
    const auto context = runtime::ContextFor(20.0);
    return runtime::FromGrpc(stub_->ListScans(context.get(), request, &response));
  };
  v1::ListScansRequest request;
  request.set_page_size(-1);
  EXPECT_THAT(std::string(list(request).message()), HasSubstr("page_size: -1"));
  for (const char* token : {"x", "0", "000000000000-5", "-", "zzz-zz"}) {
    request.Clear();
    request.set_page_token(token);
    EXPECT_THAT(std::string(list(request).message()), HasSubstr("page_token: ")) << token;
  }
  request.Clear();
  request.set_subject("parts/p1");
  EXPECT_THAT(std::string(list(request).message()), HasSubstr("subject: parts/p1"));
  v1::GetScanRequest get;
  v1::Scan scan;
  get.set_name("scans/none");
  const auto context = runtime::ContextFor(20.0);
  EXPECT_EQ(stub_->GetScan(context.get(), get, &scan).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_TRUE(absl::IsNotFound(client_.Fetch("scans/none", runtime::ContextFor(20.0)).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(client_.Fetch("blades/sn1", runtime::ContextFor(20.0)).status()));
}

TEST_F(ScanServiceTest, TellsWhenStoredBytesHaveRotted) {
  ASSERT_TRUE(Upload(SampleHeader("s1", 800), SampleBlocks(SampleProfiles(8, 100), 300)).ok());
  Execute("ALTER TABLE blobs DISABLE TRIGGER ALL");
  Execute(
      "UPDATE blobs SET bytes = set_bit(bytes, 200, 1 - get_bit(bytes, 200)) WHERE sha256 = "
      "(SELECT blob_sha256 FROM scan_blocks WHERE block_index = 1)");
  Execute("ALTER TABLE blobs ENABLE TRIGGER ALL");
  const absl::Status status = client_.Fetch("scans/s1", runtime::ContextFor(20.0)).status();
  EXPECT_TRUE(absl::IsDataLoss(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("scans/s1 block[1]"));
}

TEST_F(ScanServiceTest, AcknowledgedScansOutliveTheDatabaseServer) {
  const auto blocks = SampleBlocks(SampleProfiles(8, 100), 300);
  ASSERT_TRUE(Upload(SampleHeader("s1", 800), blocks).ok());
  testing::ThrowawayDatabase::KillServer();
  const absl::Status away = Upload(SampleHeader("s2", 800), blocks).status();
  EXPECT_TRUE(absl::IsUnavailable(away)) << away;
  testing::ThrowawayDatabase::StartServer();
  const auto again = Upload(SampleHeader("s1", 800), blocks);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->already_stored());
  EXPECT_TRUE(client_.Fetch("scans/s1", runtime::ContextFor(20.0)).ok());
}

// Real scans through the whole way, against the points of their files.
TEST_F(ScanServiceTest, KeepsPlantScansWithinTheBound) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  const std::filesystem::path folder = std::filesystem::path(shared == nullptr ? "" : shared) / "data/plant-a";
  if (!std::filesystem::exists(folder / "dataset.json")) GTEST_SKIP() << "no plant-a under SIXPOINT_SHARED_DIR";
  const nlohmann::json dataset = nlohmann::json::parse(std::ifstream(folder / "dataset.json"));
  std::vector<std::string> done;
  for (const nlohmann::json& scan : dataset.at("scans")) {
    const std::string kind = scan.at("kind");
    if (std::find(done.begin(), done.end(), kind) != done.end()) continue;  // one of each kind
    done.push_back(kind);
    std::stringstream bytes;
    bytes << std::ifstream(folder / scan.at("file").get<std::string>(), std::ios::binary).rdbuf();
    const auto points_mm = metrology::DecodeBlock(bytes.str(), scan.at("point_count").get<std::int64_t>());
    ASSERT_TRUE(points_mm.ok()) << points_mm.status();
    const bool of_artefact = kind == "artefact" || kind == "arm";
    v1::ScanHeader header = SampleHeader(scan.at("id"), 0, of_artefact ? v1::ENCODING_DRACO : v1::ENCODING_XYZ_F64);
    header.set_subject(of_artefact ? "artefacts/a1" : "blades/sn1");
    v1::ScanKind scan_kind = v1::SCAN_KIND_UNSPECIFIED;
    std::string upper = "SCAN_KIND_";
    for (const char c : kind) upper += static_cast<char>(std::toupper(c));
    ASSERT_TRUE(v1::ScanKind_Parse(upper, &scan_kind));
    header.set_kind(scan_kind);
    header.set_a_deg(scan.at("a_deg"));
    header.set_b_deg(scan.at("b_deg"));
    header.set_profile_pitch_mm(scan.at("profile_pitch_mm"));
    const auto stored = client_.Upload(header, *points_mm, runtime::ContextFor(60.0));
    ASSERT_TRUE(stored.ok()) << kind << ": " << stored.status();
    const auto fetched = client_.Fetch(stored->scan().name(), runtime::ContextFor(60.0));
    ASSERT_TRUE(fetched.ok()) << fetched.status();
    ASSERT_EQ(fetched->scan.points_mm.size(), points_mm->size());
    double greatest_um = 0;
    for (std::size_t i = 0; i < points_mm->size(); ++i) {
      greatest_um = std::max(greatest_um, 1e3 * (fetched->scan.points_mm[i] - (*points_mm)[i]).cwiseAbs().maxCoeff());
    }
    EXPECT_LE(greatest_um, 0.25) << kind;
    if (!of_artefact) {
      EXPECT_LE(static_cast<double>(stored->scan().stored_bytes()), 1.0 * static_cast<double>(points_mm->size()))
          << kind;
    }
    EXPECT_DOUBLE_EQ(greatest_um, stored->scan().proven_error_um()) << kind;
    RecordProperty(kind + "_bytes_per_point", std::to_string(static_cast<double>(stored->scan().stored_bytes()) /
                                                             static_cast<double>(points_mm->size())));
  }
  EXPECT_EQ(done.size(), 5U);
}

}  // namespace
}  // namespace sixpoint::ingest
