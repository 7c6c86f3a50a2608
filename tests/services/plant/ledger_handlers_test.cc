// GetLedgerHead and GetBladeProof on a fake ledger, and every handler of its service where a store fails: no PostgreSQL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "services/runtime/time_proto.h"
#include "tests/services/plant/ledger_service_fixture.h"

namespace sixpoint::plant {
namespace {

using sixpoint::testing::FakeLedger;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST_F(LedgerHandlersTest, TheHeadIsTheNewestThatWasSigned) {
  const absl::Status none = GetHead().status();
  EXPECT_EQ(runtime::ReasonOf(none), "LEDGER_NOT_SEALED");
  EXPECT_EQ(none.code(), absl::StatusCode::kNotFound);
  RecordMany(2);
  Sign();
  const std::int64_t last = ledger_->Record("scans/s3");
  const ledger::Head signed_head = Sign();
  const auto head = GetHead();
  ASSERT_TRUE(head.ok()) << head.status();
  EXPECT_EQ(head->plant_id(), testing::kSomeUuid);
  EXPECT_EQ(head->tree_size(), 3);
  EXPECT_EQ(head->root_sha256(), signed_head.root);
  EXPECT_EQ(head->record_sequence(), last);
  EXPECT_EQ(std::chrono::system_clock::to_time_t(runtime::MomentOf(head->signed_at())),
            1'795'568'523);  // as it is signed
  EXPECT_EQ(head->key_id(), key_.key_id());
  EXPECT_EQ(head->signature(), signed_head.signature);
  EXPECT_EQ(head->public_key(), key_.public_pem());
}

// As a stranger checks it (docs/ledger.md).
TEST_F(LedgerHandlersTest, ABladesEntriesAreProvenUnderTheHead) {
  AddBlade("SN-1");
  for (const char* name : {"scans/s1", "scans/s2"}) {
    ledger_->Record(name, "SN-1");
    ledger_->Record(std::string(name) + "-other", "SN-2");
  }
  const ledger::Head head = Sign();
  ledger_->Record("scans/s3", "SN-1");
  Seal();  // beyond that head
  const auto proof = Prove("blades/SN-1");
  ASSERT_TRUE(proof.status.ok()) << proof.status;
  ASSERT_THAT(proof.messages, SizeIs(2));
  EXPECT_EQ(proof.messages[0].head().SerializeAsString(), GetHead()->SerializeAsString());
  EXPECT_EQ(proof.messages[0].unsealed_count(), 1);
  EXPECT_FALSE(proof.messages[1].has_head());
  EXPECT_EQ(proof.messages[1].unsealed_count(), 0);
  for (int i = 0; i < 2; ++i) {
    const v1::ProvenEntry& entry = proof.messages[static_cast<std::size_t>(i)];
    EXPECT_EQ(entry.name(), "scans/s" + std::to_string(i + 1));
    EXPECT_EQ(entry.leaf_index(), 2 * i);
    EXPECT_EQ(entry.record_sequence(), 2 * i + 1);
    EXPECT_TRUE(ledger::PathProves(ledger::LeafHash(entry.leaf()), entry.leaf_index(), head.tree_size,
                                   {entry.audit_path().begin(), entry.audit_path().end()}, head.root));
    EXPECT_THAT(entry.leaf(), HasSubstr(ledger::HexOf(ledger::Sha256(entry.name_row()))));
    EXPECT_THAT(entry.leaf(), HasSubstr(ledger::HexOf(ledger::Sha256(entry.content()))));
    ASSERT_EQ(entry.tables_size(), 2);
    EXPECT_EQ(entry.tables(0).table(), "record_entries");
    EXPECT_EQ(entry.tables(1).table(), "record_roots");
    for (const v1::SealedRows& sealed : entry.tables()) {
      ASSERT_EQ(sealed.rows_size(), 1);
      EXPECT_THAT(entry.content(), HasSubstr(ledger::HexOf(ledger::Sha256(ledger::Sha256(sealed.rows(0))))));
    }
  }
}

TEST_F(LedgerHandlersTest, AProofIsReadByPagesAndItsHeadComesOnce) {
  AddBlade("SN-1");
  RecordMany(120, "SN-1");
  Sign();
  const auto proof = Prove("blades/SN-1");
  ASSERT_TRUE(proof.status.ok()) << proof.status;
  ASSERT_THAT(proof.messages, SizeIs(120));
  for (std::size_t i = 0; i < 120; ++i) {
    EXPECT_EQ(proof.messages[i].leaf_index(), static_cast<std::int64_t>(i));
    EXPECT_EQ(proof.messages[i].has_head(), i == 0);
  }
  EXPECT_EQ(ledger_->AskedCount("ProofOfBlade"), 3);
}

TEST_F(LedgerHandlersTest, APageHoldsFewLargeEntriesAndATableThatIsTooLargeComesWithoutItsRows) {
  AddBlade("SN-1");
  RecordMany(12, "SN-1");
  for (int i = 0; i < 12; ++i)
    ledger_->Tamper("scans/m" + std::to_string(i),
                    [](FakeLedger::Entry& entry) { entry.rows["record_roots"] = {std::string(900'000, 'r')}; });
  ledger_->Tamper("scans/m11", [](FakeLedger::Entry& entry) {
    entry.rows["scans"] = {std::string(600'000, 'a'), std::string(600'000, 'b')};
  });
  Sign();
  const auto proof = Prove("blades/SN-1");
  ASSERT_TRUE(proof.status.ok()) << proof.status;
  ASSERT_THAT(proof.messages, SizeIs(12));
  EXPECT_EQ(ledger_->AskedCount("ProofOfBlade"), 2);
  const v1::ProvenEntry& last = proof.messages.back();
  ASSERT_EQ(last.tables_size(), 3);
  EXPECT_EQ(last.tables(1).rows_size(), 1);
  EXPECT_EQ(last.tables(2).table(), "scans");
  EXPECT_EQ(last.tables(2).rows_size(), 0);
  EXPECT_THAT(last.content(), HasSubstr("scans 2 "));
}

TEST_F(LedgerHandlersTest, AProofIsOfABladeThatIsThereAndSealed) {
  for (const char* name : {"", "SN-1", "parts/vane", "blades/SN/1"}) {
    const std::vector<Violation> refused = ViolationsOf(Prove(name).status);
    ASSERT_THAT(refused, SizeIs(1)) << name;
    EXPECT_EQ(refused[0].field, "name");
  }
  const absl::Status unknown = Prove("blades/SN-9").status;
  EXPECT_EQ(runtime::ReasonOf(unknown), "BLADE_NOT_FOUND");
  EXPECT_EQ(runtime::MetadataOf(unknown)["resource"], "blades/SN-9");
  AddBlade("SN-1");
  ledger_->Record("scans/s1", "SN-1");
  EXPECT_EQ(runtime::ReasonOf(Prove("blades/SN-1").status), "LEDGER_NOT_SEALED");  // no head
  Sign();
  EXPECT_TRUE(Prove("blades/SN-1").status.ok());
  AddBlade("SN-2");
  ledger_->Record("scans/s2", "SN-2");
  Seal();
  const auto beyond = Prove("blades/SN-2");  // not under the head
  EXPECT_THAT(beyond.messages, IsEmpty());
  EXPECT_EQ(runtime::ReasonOf(beyond.status), "LEDGER_NOT_SEALED");
  EXPECT_THAT(std::string(beyond.status.message()), HasSubstr("nothing of blades/SN-2 is sealed yet"));
  // Of one whose name is gone nothing is shown.
  ledger_->Tamper("scans/s1", [](FakeLedger::Entry& entry) { entry.is_named = false; });
  EXPECT_EQ(Prove("blades/SN-1").status.code(), absl::StatusCode::kNotFound);
}

TEST_F(LedgerHandlersTest, AStoreThatFailsComesToTheClient) {
  AddBlade("SN-1");
  RecordMany(120, "SN-1");
  Sign();
  const absl::Status away = absl::UnavailableError("the database is away");
  const auto fails_at = [&](const std::string& wanted, int count) {
    ledger_->commits.Fail(absl::OkStatus());
    ledger_->WhenAsked([=](const std::string& question) {
      if (question == wanted && ledger_->AskedCount(question) == count) ledger_->commits.Fail(away);
    });
  };
  // In the middle: what was sent stays, and is no whole.
  fails_at("ProofOfBlade", 2);
  const auto proof = Prove("blades/SN-1");
  EXPECT_EQ(proof.status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(proof.messages, SizeIs(50));
  fails_at("CheckOrphans", 3);
  const auto verified = Verify();
  EXPECT_EQ(verified.status.code(), absl::StatusCode::kUnavailable);
  ASSERT_THAT(verified.messages, SizeIs(1 + 1 + 2));
  EXPECT_FALSE(verified.messages.back().is_last());
  // At once.
  ledger_->WhenAsked(nullptr);
  ledger_->commits.Fail(away);
  EXPECT_EQ(GetHead().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Prove("blades/SN-1").status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Verify().status.code(), absl::StatusCode::kUnavailable);
  ledger_->commits.Fail(absl::OkStatus());
  stores_.record->Fail(away);
  EXPECT_EQ(Prove("blades/SN-1").status.code(), absl::StatusCode::kUnavailable);
}

TEST_F(LedgerHandlersTest, AProofEndsOnceItsClientIsGone) {
  AddBlade("SN-1");
  RecordMany(200, "SN-1");
  Sign();
  const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  ledger_->WhenAsked([&](const std::string& question) {
    if (question != "ProofOfBlade" || ledger_->AskedCount(question) != 2) return;
    context->TryCancel();
    EXPECT_TRUE(watched_.BecomesCancelled());
  });
  v1::GetBladeProofRequest request;
  request.set_name("blades/SN-1");
  const auto reader = stub_->GetBladeProof(context.get(), request);
  for (v1::ProvenEntry entry; reader->Read(&entry);) continue;
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(watched_.EndsWith(grpc::StatusCode::CANCELLED));
  EXPECT_EQ(ledger_->AskedCount("ProofOfBlade"), 2);
}

}  // namespace
}  // namespace sixpoint::plant
