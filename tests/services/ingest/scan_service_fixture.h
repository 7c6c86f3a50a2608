// ScanService over real gRPC on a real PostgreSQL, with real decode workers, and a plant that knows a little.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/clients/scans.h"
#include "services/ingest/scan_service.h"
#include "storage/blob_store.h"
#include "storage/record.h"
#include "tests/services/ingest/conversation.h"
#include "tests/services/ingest/fake_plant.h"
#include "tests/services/ingest/sample_scans.h"
#include "tests/services/ingest/worker_program.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::ingest {

class ScanServiceTest : public ::testing::Test {
 protected:
  static constexpr int kUploadSlots = 6, kSlotsOfAPeer = kUploadSlots / 2;
  static constexpr std::chrono::milliseconds kStreamPatience{1500};

  explicit ScanServiceTest(std::unique_ptr<storage::BlobStore> blobs = storage::MakePostgresqlBlobStore())
      : plant_server_({&plant_}),
        blobs_(std::move(blobs)),
        service_(OptionsForTest(), storage::ScansIn(database_.database(), blobs_.get()), plant_server_.Connect()),
        server_({&service_}, 0, kStreamPatience),
        channel_(server_.Connect()),
        stub_(v1::ScanService::NewStub(channel_)),
        client_(channel_) {
    testing::RegisterUsual(database_.database());
    for (const std::string serial : {"sn1", "sn2"}) AddBlade(serial);
  }

  void AddBlade(const std::string& serial) {
    auto transaction = database_.database()->Begin(testing::Soon());
    ASSERT_TRUE(transaction.ok()) << transaction.status();
    testing::RegisterBlade(*transaction, serial, "p1");
    ASSERT_TRUE(transaction->Commit().ok());
  }

  static ScanServiceOptions OptionsForTest() {
    ScanServiceOptions options;
    options.decode_worker = WorkerProgram();
    options.greatest_upload_count = kUploadSlots;
    options.place_patience = std::chrono::milliseconds(200);
    options.stream_patience = kStreamPatience;
    return options;
  }

  storage::Rows Execute(const std::string& sql) {
    auto transaction = database_.database()->Begin(testing::Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    auto rows = transaction->Execute(sql);
    EXPECT_TRUE(rows.ok()) << sql << ": " << rows.status();
    EXPECT_TRUE(transaction->Commit().ok());
    return rows.ok() ? *rows : storage::Rows();
  }
  std::int64_t Count(const std::string& table) { return Execute("SELECT count(*) FROM " + table).Int(0, 0); }

  // Nothing that anybody could see, or that a result could rest on.
  void ExpectNothingStored() {
    for (const char* table : {"scans", "scan_blocks", "record_entries WHERE kind = 'scan'"}) {
      EXPECT_EQ(Count(table), 0) << table;
    }
  }

  // The whole conversation as a machine leads it, from the first block that is wanted on.
  absl::StatusOr<v1::StoredScan> Upload(const v1::ScanHeader& header, const std::vector<v1::ScanBlock>& blocks) const {
    return Upload(header, blocks, EndOf(blocks));
  }
  absl::StatusOr<v1::StoredScan> Upload(const v1::ScanHeader& header, const std::vector<v1::ScanBlock>& blocks,
                                        const v1::ScanEnd& end) const {
    Conversation upload(stub_.get(), 30.0);
    v1::UploadScanResponse response = upload.Say(header);
    for (auto next = static_cast<std::size_t>(response.accepted().next_block()); next < blocks.size(); ++next) {
      if (!upload.Send(blocks[next])) break;
    }
    upload.Send(end);
    while (upload.Hear(&response)) {
      if (response.has_stored()) break;
    }
    const absl::Status status = upload.Finish();
    if (!status.ok()) return status;
    return response.stored();
  }

  // As if the day were over that an upload waits.
  void Forget(const std::string& scan_id) { Execute("DELETE FROM scan_uploads WHERE scan_id = '" + scan_id + "'"); }

  void ExpectRefused(const v1::ScanHeader& header, const std::vector<v1::ScanBlock>& blocks, const std::string& field) {
    const absl::Status status = Upload(header, blocks).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << field << ": " << status;
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr(field + ": "));
    EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr(", want "));
    ExpectNothingStored();
  }

  testing::ThrowawayDatabase database_;
  FakePlant plant_;
  testing::InProcessServer plant_server_;
  std::unique_ptr<storage::BlobStore> blobs_;
  ScanService service_;
  testing::InProcessServer server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::ScanService::Stub> stub_;
  clients::ScanClient client_;
};

}  // namespace sixpoint::ingest
