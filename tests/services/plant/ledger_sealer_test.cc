// The sealer on a fake store: no PostgreSQL. That it seals what a real plant writes is cli/ledger_test.cc's.
#include "services/plant/ledger_sealer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/runtime/server.h"
#include "tests/support/becomes.h"
#include "tests/support/fake_ledger.h"
#include "tests/support/must.h"

namespace sixpoint::plant {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class LedgerSealerTest : public ::testing::Test {
 protected:
  LedgerSealerTest() {
    std::string pattern = (fs::temp_directory_path() / "sixpoint-sealer-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    ledger_->schema_version = runtime::NewestMigration();
  }
  ~LedgerSealerTest() override { fs::remove_all(folder_); }

  std::string HeadsFile() const { return (folder_ / "heads").string(); }
  std::vector<ledger::Head> Sent() const {
    return fs::exists(HeadsFile()) ? testing::Must(ledger::ReadHeads(HeadsFile())) : std::vector<ledger::Head>();
  }
  std::unique_ptr<LedgerSealer> Sealer(const std::string& heads_file, std::chrono::milliseconds every = {}) {
    LedgerSealerOptions options;
    options.every = options.head_every = every;
    options.heads_file = heads_file;
    return std::make_unique<LedgerSealer>(options, ledger_, testing::Must(ledger::SigningKey::OfPem(key_pem_)));
  }
  void RecordSome(int count) {
    for (int i = 0; i < count; ++i) ledger_->Record("scans/m" + std::to_string(i));
  }
  std::optional<storage::KeptHead> Kept() const { return testing::Must(ledger_->NewestHead({})); }

  fs::path folder_;
  const std::string key_pem_ = testing::Must(ledger::SigningKey::NewPem());
  std::shared_ptr<testing::FakeLedger> ledger_ = std::make_shared<testing::FakeLedger>();
};

TEST_F(LedgerSealerTest, SealsAllThatWasRecordedSomeAtATime) {
  RecordSome(2500);
  ASSERT_TRUE(Sealer("")->SealAll().ok());
  EXPECT_EQ(testing::Must(ledger_->End({})).size, 2500);
  EXPECT_EQ(ledger_->AskedCount("Seal"), 3);
  ledger_->commits.Fail(absl::UnavailableError("the database is away"));
  EXPECT_EQ(Sealer("")->SealAll().code(), absl::StatusCode::kUnavailable);
}

TEST_F(LedgerSealerTest, AHeadIsSentOutAndKeptOnceForWhatIsNew) {
  const auto sealer = Sealer(HeadsFile());
  ASSERT_TRUE(sealer->SignHead().ok());
  EXPECT_THAT(Sent(), IsEmpty()) << "of nothing";
  for (int size = 1; size <= 2; ++size) {
    RecordSome(1);
    ASSERT_TRUE(sealer->SealAll().ok());
    for (int times = 0; times < 2; ++times) ASSERT_TRUE(sealer->SignHead().ok());
    ASSERT_THAT(Sent(), SizeIs(size));
    const ledger::Head sent = Sent().back();
    EXPECT_EQ(sent.tree_size, size);
    EXPECT_EQ(sent.record_sequence, size);
    EXPECT_EQ(sent.root, testing::Must(ledger_->Root(size, {})));
    EXPECT_EQ(sent.plant_id, testing::Must(ledger_->PlantId({})));
    ASSERT_TRUE(Kept().has_value());
    EXPECT_EQ(Kept()->head.signature, sent.signature);
    EXPECT_TRUE(ledger::IsSignedBy(sent, Kept()->public_key));
  }
}

TEST_F(LedgerSealerTest, WhereNothingIsSentOutTheKeptHeadTellsWhatIsNew) {
  const auto sealer = Sealer("");
  RecordSome(1);
  ASSERT_TRUE(sealer->SealAll().ok());
  for (int times = 0; times < 2; ++times) ASSERT_TRUE(sealer->SignHead().ok());
  ASSERT_TRUE(Kept().has_value());
  EXPECT_EQ(Kept()->head.tree_size, 1);
  EXPECT_EQ(ledger_->AskedCount("KeepHead"), 1);
  LedgerSealer without_key({std::chrono::milliseconds(0), {}, ""}, ledger_, std::nullopt);
  EXPECT_EQ(without_key.SignHead().code(), absl::StatusCode::kNotFound);
}

// Out first: the plant may lose its database between.
TEST_F(LedgerSealerTest, AHeadThatWasSentOutAndNotKeptIsKeptNextTime) {
  const auto sealer = Sealer(HeadsFile());
  RecordSome(1);
  ASSERT_TRUE(sealer->SealAll().ok());
  ledger_->WhenAsked([this](const std::string& question) {
    if (question == "KeepHead") ledger_->commits.Fail(absl::UnavailableError("the database is away"));
  });
  EXPECT_EQ(sealer->SignHead().code(), absl::StatusCode::kUnavailable);
  ledger_->WhenAsked(nullptr);
  ledger_->commits.Fail(absl::OkStatus());
  ASSERT_THAT(Sent(), SizeIs(1));
  ASSERT_FALSE(Kept().has_value());
  ASSERT_TRUE(sealer->SignHead().ok());
  ASSERT_THAT(Sent(), SizeIs(1));
  ASSERT_TRUE(Kept().has_value());
  EXPECT_EQ(Kept()->head.signature, Sent()[0].signature);
}

TEST_F(LedgerSealerTest, SignsNothingThatContradictsWhatItSentOut) {
  RecordSome(2);
  const auto sealer = Sealer(HeadsFile());
  ASSERT_TRUE(sealer->SealAll().ok() && sealer->SignHead().ok());
  // The same plant, set back, and what it then recorded anew.
  ledger_ = std::make_shared<testing::FakeLedger>();
  const auto after = Sealer(HeadsFile());
  RecordSome(1);
  ASSERT_TRUE(after->SealAll().ok());
  const absl::Status cut_off = after->SignHead();
  EXPECT_EQ(cut_off.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(cut_off.message()), HasSubstr("cut off, or the database was set back"));
  RecordSome(2);
  ASSERT_TRUE(after->SealAll().ok());
  const absl::Status rewritten = after->SignHead();
  EXPECT_EQ(rewritten.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(rewritten.message()), HasSubstr("they were rewritten"));
  EXPECT_THAT(Sent(), SizeIs(1));
  EXPECT_FALSE(Kept().has_value());
}

TEST_F(LedgerSealerTest, ItsThreadSealsAndSignsWhereTheSchemaIsItsOwn) {
  ledger_->schema_version = runtime::NewestMigration() + 1;
  const auto sealer = Sealer(HeadsFile(), std::chrono::milliseconds(5));
  RecordSome(1);
  const auto has_looked = [this] { return ledger_->AskedCount("SchemaVersion") >= 3; };
  ASSERT_TRUE(testing::Becomes(std::chrono::seconds(30), has_looked));
  EXPECT_EQ(ledger_->AskedCount("Seal"), 0);
  ledger_->schema_version = runtime::NewestMigration();
  EXPECT_TRUE(testing::Becomes(std::chrono::seconds(30), [this] { return Kept().has_value(); }));
  EXPECT_THAT(Sent(), SizeIs(1));
}

}  // namespace
}  // namespace sixpoint::plant
