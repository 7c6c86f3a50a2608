// VerifyLedger on a fake ledger: no PostgreSQL. What a tampering of the database looks like is ledger_test.cc's of tests/storage.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ledger/audit.h"
#include "tests/services/plant/ledger_service_fixture.h"

namespace sixpoint::plant {
namespace {

using sixpoint::testing::FakeLedger;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Whom nobody can ask.
class LostClearances final : public storage::ClearanceReader {
 public:
  absl::StatusOr<std::optional<std::string>> FirstHidden(const storage::Reader&, const std::vector<std::string>&,
                                                         storage::Unrecorded, storage::Deadline) const override {
    return absl::UnavailableError("the database is away");
  }
};

class LedgerChecksTest : public LedgerHandlersTest {};

TEST_F(LedgerChecksTest, ACheckOfWhatIsWellTellsEachLeafAndEnds) {
  RecordMany(100);
  std::vector<ledger::Head> sent = {Sign()};
  RecordMany(2000);
  sent.push_back(Sign());
  const std::int64_t last = testing::Must(ledger_->End({})).record_sequence;
  RecordMany(3);
  const auto verified = Verify();
  ASSERT_TRUE(verified.status.ok()) << verified.status;
  // Leaves by 2000, the tables' kinds, each table, and the end.
  ASSERT_THAT(verified.messages, SizeIs(2 + 1 + storage::LedgerTables().size() + 1));
  ledger::Audit audit(sent, key_.public_pem());
  for (const v1::LedgerSlice& slice : verified.messages) {
    EXPECT_THAT(slice.damages(), IsEmpty());
    EXPECT_THAT(slice.detached(), IsEmpty());
    EXPECT_EQ(slice.tree_size(), 2100);
    EXPECT_EQ(slice.is_last(), &slice == &verified.messages.back());
    EXPECT_EQ(slice.checked_blob_count(), 0);
    if (!slice.leaf_hashes().empty()) {
      EXPECT_EQ(slice.first_leaf_index(), audit.size());
    }
    std::vector<ledger::Hash> hashes;
    for (std::size_t at = 0; at < slice.leaf_hashes().size(); at += 32)
      hashes.push_back(slice.leaf_hashes().substr(at, 32));
    audit.AddLeaves(hashes);
  }
  audit.Finish();
  EXPECT_THAT(audit.findings(), IsEmpty());
  EXPECT_EQ(audit.size(), 2100);
  EXPECT_EQ(audit.last_good().tree_size, 2100);
  ASSERT_EQ(verified.messages[0].heads_size(), 1);
  EXPECT_EQ(verified.messages[0].heads(0).signature(), sent[0].signature);
  ASSERT_EQ(verified.messages[1].heads_size(), 1);
  EXPECT_EQ(verified.messages[1].heads(0).tree_size(), 2100);
  EXPECT_EQ(verified.messages[0].last_record_sequence(), 2000);
  EXPECT_EQ(verified.messages.back().last_record_sequence(), last);
  EXPECT_EQ(verified.messages.back().unsealed_count(), 3);
  EXPECT_EQ(ledger_->AskedCount("CheckLeaves"), 2);
  EXPECT_EQ(ledger_->AskedCount("CheckBlobSlice"), 0) << "nobody asked for the bytes";
  ledger_->SpoilNodes();
  EXPECT_THAT(SentencesOf(Damages()),
              ElementsAre("CHANGED ledger_nodes : subtrees that do not follow from the leaves",
                          "CHANGED ledger_nodes : subtrees that do not follow from the leaves"));
}

TEST_F(LedgerChecksTest, ACheckOfNothingEnds) {
  const auto verified = Verify();
  ASSERT_TRUE(verified.status.ok()) << verified.status;
  EXPECT_TRUE(verified.messages.back().is_last());
  EXPECT_EQ(verified.messages.back().tree_size(), 0);
  EXPECT_EQ(verified.messages.back().last_record_sequence(), 0);
  EXPECT_EQ(ledger_->AskedCount("CheckLeaves"), 0);
}

TEST_F(LedgerChecksTest, WhatIsNotAsItWasSealedIsTold) {
  RecordMany(7);
  Seal();
  const auto tamper = [&](const char* name, const std::function<void(FakeLedger::Entry & entry)>& change) {
    ledger_->Tamper(name, change);
  };
  tamper("scans/m0", [](FakeLedger::Entry& entry) { entry.rows["record_entries"] = {"another"}; });
  tamper("scans/m1", [](FakeLedger::Entry& entry) { entry.rows["record_roots"].clear(); });
  tamper("scans/m2", [](FakeLedger::Entry& entry) { entry.rows["record_inputs"] = {"one more"}; });
  tamper("scans/m3", [](FakeLedger::Entry& entry) { entry.sequence = 5; });
  tamper("scans/m4", [](FakeLedger::Entry& entry) { entry.sequence = 4; });
  tamper("scans/m5", [](FakeLedger::Entry& entry) { entry.is_named = false; });
  ledger_->MakeUnplain("inspections");
  const std::vector<v1::LedgerDamage> damages = Damages();
  ASSERT_THAT(damages, SizeIs(9));
  const std::string lost = damages[5].record_id() + ": belongs to nothing recorded";
  EXPECT_THAT(
      SentencesOf(damages),
      ElementsAre("CHANGED record_entries scans/m0: 1 rows, sealed 1",
                  "MISSING record_roots scans/m1: 0 rows, sealed 1", "EXTRA record_inputs scans/m2: 1 rows, sealed 0",
                  "SWAPPED record_names scans/m3: stands as entry 5",
                  "SWAPPED record_names scans/m4: stands as entry 4", "MISSING record_names : the entry",
                  "CHANGED inspections : not a plain table: kind r, want r or p, without rules and policies",
                  "EXTRA record_entries : " + lost, "EXTRA record_roots : " + lost));
  for (int i = 0; i < 6; ++i) EXPECT_EQ(damages[static_cast<std::size_t>(i)].record_sequence(), i + 1);
  EXPECT_TRUE(storage::IsUuid(damages[0].record_id()));
  EXPECT_EQ(damages[6].record_id(), "");
  EXPECT_EQ(damages[6].record_sequence(), 0);
}

TEST_F(LedgerChecksTest, AnEntrysNameIsToldToWhoMaySeeItsPart) {
  RecordMany(2);
  Seal();
  for (const char* name : {"scans/m0", "scans/m1"})
    ledger_->Tamper(name, [](FakeLedger::Entry& entry) { entry.rows["record_roots"].clear(); });
  stores_.fake_clearances->customers["vane"] = "acme";
  stores_.fake_clearances->part_of = {{"scans/m0", "vane"}, {"scans/m1", "blade"}};
  const std::vector<v1::LedgerDamage> damages = Damages();
  EXPECT_THAT(SentencesOf(damages), ElementsAre("MISSING record_roots : 0 rows, sealed 1",
                                                "MISSING record_roots scans/m1: 0 rows, sealed 1"));
  EXPECT_TRUE(storage::IsUuid(damages.at(0).record_id()));
  EXPECT_EQ(damages.at(0).record_sequence(), 1);
}

TEST_F(LedgerChecksTest, WhereNobodyCanSayWhoMaySeeItNoNameIsTold) {
  RecordMany(1);
  Seal();
  ledger_->Tamper("scans/m0", [](FakeLedger::Entry& entry) { entry.rows["record_roots"].clear(); });
  LedgerService service(ledger_, stores_.blades, std::make_shared<LostClearances>(), nullptr);
  const testing::InProcessServer server({&service});
  stub_ = v1::LedgerService::NewStub(server.Connect());
  EXPECT_THAT(SentencesOf(Damages()), ElementsAre("MISSING record_roots : 0 rows, sealed 1"));
}

TEST_F(LedgerChecksTest, AMonthThatWasDetachedIsToldAsNotHere) {
  ledger_->Record("scans/march", "", "019cbb4b-4c00-7000-8000-000000000001");
  RecordMany(1);
  Seal();
  ledger_->DetachMonth("2026_03");
  const auto verified = Verify();
  ASSERT_TRUE(verified.status.ok()) << verified.status;
  const v1::LedgerSlice& first = verified.messages.at(0);
  EXPECT_THAT(first.damages(), IsEmpty());
  ASSERT_EQ(first.detached_size(), 1);
  EXPECT_EQ(first.detached(0).month(), "2026_03");
  EXPECT_EQ(first.detached(0).entry_count(), 1);
}

TEST_F(LedgerChecksTest, BytesAreCheckedWhereTheyAreAskedFor) {
  RecordMany(1);
  Seal();
  for (int i = 0; i < 150; ++i) ledger_->PutBlob(std::to_string(i));
  const std::string spoilt = ledger_->PutBlob("spoilt"), lost(64, '0');
  ledger_->SpoilBlob(spoilt);
  ledger_->NameBlob(lost, "scan_blocks");
  EXPECT_THAT(Damages(), IsEmpty());
  EXPECT_THAT(SentencesOf(Damages(true)), ElementsAre("MISSING blobs : " + lost + ": named by scan_blocks",
                                                      "CHANGED blobs : " + spoilt + ": other bytes"));
  EXPECT_EQ(ledger_->AskedCount("CheckBlobSlice"), 3) << "100, 51, none";
  EXPECT_EQ(Verify(true).messages.back().checked_blob_count(), 151);
}

TEST_F(LedgerChecksTest, AnotherReleasesSchemaIsNotCompared) {
  RecordMany(1);
  Sign();
  ledger_->schema_version = runtime::NewestMigration() + 1;
  const auto verified = Verify();
  EXPECT_EQ(runtime::ReasonOf(verified.status), "SERVICE_NOT_READY");
  EXPECT_THAT(verified.messages, IsEmpty());
  EXPECT_EQ(ledger_->AskedCount("CheckLeaves"), 0);
  EXPECT_TRUE(GetHead().ok());
}

TEST_F(LedgerChecksTest, OneCheckRunsAtATime) {
  RecordMany(1);
  Seal();
  absl::Status second;
  std::atomic<bool> is_first{true};
  ledger_->WhenAsked([&](const std::string& /*question*/) {
    if (is_first.exchange(false)) second = Verify().status;
  });
  EXPECT_TRUE(Verify().status.ok());
  EXPECT_EQ(runtime::ReasonOf(second), "LEDGER_CHECKS_FULL");
  EXPECT_TRUE(Verify().status.ok());
}

TEST_F(LedgerChecksTest, ACheckEndsOnceItsClientIsGoneAndLeavesItsPlace) {
  RecordMany(1);
  Seal();
  const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  ledger_->WhenAsked([&](const std::string& question) {
    if (question != "CheckOrphans" || ledger_->AskedCount(question) != 1) return;
    context->TryCancel();
    EXPECT_TRUE(watched_.BecomesCancelled());
  });
  const auto reader = stub_->VerifyLedger(context.get(), {});
  for (v1::LedgerSlice slice; reader->Read(&slice);) continue;
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(watched_.EndsWith(grpc::StatusCode::CANCELLED));
  EXPECT_EQ(ledger_->AskedCount("CountUnsealed"), 0);
  EXPECT_LT(ledger_->AskedCount("CheckOrphans"), 5);
  EXPECT_TRUE(Verify().status.ok());
}

}  // namespace
}  // namespace sixpoint::plant
