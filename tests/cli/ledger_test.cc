// `sixpoint ledger` against the service on a real database: what is told of a tampering, what is sent out, and a proof that a stranger
// checks with the documented script.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "ledger/head.h"
#include "services/plant/ledger_service.h"
#include "services/runtime/errors.h"
#include "tests/cli/command_run.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/tamperings.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Soon;

std::string ReadAll(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class LedgerCommandTest : public ::testing::Test {
 protected:
  LedgerCommandTest() : server_({&service_}) {
    std::string pattern = (fs::temp_directory_path() / "sixpoint-ledger-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    EXPECT_TRUE(ledger::SigningKey::MakeFile(In("key.pem")).ok());
  }
  ~LedgerCommandTest() override { fs::remove_all(folder_); }

  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  Ended Run(const std::string& words) {
    return RunCommand(words, [this](Session* session) {
      session->server = server_.address();
      session->credentials = grpc::InsecureChannelCredentials();
      session->deadline_s = 60;
    });
  }
  // Two blades, sealed; heads as they were sent out.
  void Fill() {
    const auto heads = testing::AddTamperedPlant(database_.database(), *ledger::SigningKey::Read(In("key.pem")), 2);
    for (const ledger::Head& head : heads) ASSERT_TRUE(ledger::AppendHead(In("heads"), head).ok());
  }
  std::string Checking() const { return " --heads " + In("heads") + " --key " + In("public.pem"); }
  void Do(const std::string& sql) {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(Soon());
    ASSERT_TRUE(transaction->Execute("SET LOCAL session_replication_role = replica").ok());
    const absl::Status done = transaction->Execute(sql).status();
    ASSERT_TRUE(done.ok() && transaction->Commit().ok()) << done;
  }
  // What the script says, and whether it ended with 0.
  std::pair<bool, std::string> Script(const std::string& words) const {
    const std::string root = std::getenv("SIXPOINT_SOURCE_DIR");
    const int ended = std::system(
        ("python3 " + root + "/docs/examples/check_ledger_proof.py " + words + " > " + In("said") + " 2>&1").c_str());
    return {ended == 0, ReadAll(In("said"))};
  }

  testing::ThrowawayDatabase database_;
  const storage::PlantStores stores_ = storage::PlantIn(database_.database());
  plant::LedgerService service_{storage::LedgerIn(database_.database()), stores_.blades, stores_.clearances, nullptr};
  testing::InProcessServer server_;
  fs::path folder_;
};

TEST_F(LedgerCommandTest, APlantAsItWasSealedIsWell) {
  EXPECT_THAT(Run("ledger head").err, HasSubstr("LEDGER_NOT_SEALED"));
  Fill();
  const Ended verified = Run("ledger verify --blobs" + Checking());
  EXPECT_EQ(verified.exit_code, kDone) << verified.out << verified.err;
  EXPECT_THAT(verified.out, HasSubstr("as it was sealed\n"));
  EXPECT_THAT(verified.out, HasSubstr("compared with 4 heads"));
  EXPECT_EQ(Run("--json ledger verify" + Checking()).json()["covered_record_sequence"],
            Run("--json ledger verify" + Checking()).json()["record_sequence"]);
  EXPECT_THAT(verified.out, Not(HasSubstr("stand under no head")));
  const Ended bare = Run("ledger verify");
  EXPECT_EQ(bare.exit_code, kDone);
  EXPECT_THAT(bare.out, HasSubstr("no --heads"));
  const Ended head = Run("ledger head --json");
  EXPECT_TRUE(ledger::IsSignedBy(*ledger::HeadOfJson(head.out), ReadAll(In("public.pem")))) << head.out;
}

TEST_F(LedgerCommandTest, ATamperingIsToldByRecordTableAndKind) {
  Fill();
  Do("UPDATE inspections SET deviation_point_count = deviation_point_count - 1 WHERE blade_serial = 'SN-0'");
  const Ended changed = Run("--json ledger verify" + Checking());
  EXPECT_EQ(changed.exit_code, kNotUsable);
  const nlohmann::json told = changed.json();
  ASSERT_EQ(told["damages"].size(), 1u) << changed.out;
  EXPECT_EQ(told["damages"][0]["kind"], "CHANGED");
  EXPECT_EQ(told["damages"][0]["table"], "inspections");
  EXPECT_THAT(std::string(told["damages"][0]["name"]), HasSubstr("inspections/"));
  EXPECT_TRUE(told["heads"].empty()) << "its leaf is as it was";
  EXPECT_THAT(Run("ledger verify" + Checking()).out, HasSubstr("NOT as it was sealed"));
}

TEST_F(LedgerCommandTest, WhatWasCutOffIsToldByTheHeadsThatWereSentOut) {
  Fill();
  Do("DELETE FROM ledger_heads WHERE tree_size > (SELECT min(tree_size) FROM ledger_heads)");
  Do("DELETE FROM record_names WHERE record_sequence > (SELECT max(record_sequence) FROM ledger_heads)");
  Do("DELETE FROM ledger_leaves WHERE leaf_index >= (SELECT max(tree_size) FROM ledger_heads)");
  Do("DELETE FROM ledger_contents c WHERE NOT EXISTS (SELECT 1 FROM ledger_leaves l WHERE l.record_id = c.record_id)");
  const Ended cut = Run("--json ledger verify" + Checking());
  EXPECT_EQ(cut.exit_code, kNotUsable);
  EXPECT_EQ(cut.json()["heads"][0]["kind"], "CUT_OFF") << cut.out;
}

TEST_F(LedgerCommandTest, WhatNoHeadCoversIsTold) {
  Fill();
  Do("DELETE FROM ledger_heads WHERE tree_size > (SELECT min(tree_size) FROM ledger_heads)");
  const Ended partly = Run("ledger verify --key " + In("public.pem"));
  EXPECT_EQ(partly.exit_code, kDone) << partly.out;
  EXPECT_THAT(partly.out, HasSubstr(" stand under no head that agrees\n"));
  Do("DELETE FROM ledger_heads");
  const Ended none = Run("--json ledger verify --key " + In("public.pem"));
  EXPECT_EQ(none.exit_code, kNotUsable);
  EXPECT_EQ(none.json()["covered_record_sequence"], 0);
  EXPECT_EQ(none.json()["heads"][0]["kind"], "NO_HEAD") << none.out;
}

// A schema before the built-in functions would answer for them.
TEST_F(LedgerCommandTest, ASessionsPathIsOursWhateverTheRoleSays) {
  Do("DO $$ BEGIN EXECUTE format('ALTER ROLE %I IN DATABASE %I SET search_path = evil, pg_catalog, public', "
     "session_user, current_database()); END $$");
  const auto later = storage::Database::Open(database_.conninfo(), 1);
  absl::StatusOr<storage::Transaction> transaction = later->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto path = transaction->Execute("SELECT current_setting('search_path')");
  ASSERT_TRUE(path.ok()) << path.status();
  EXPECT_EQ(path->Text(0, 0), "public, pg_temp");
}

TEST_F(LedgerCommandTest, BadInputIsRefused) {
  Fill();
  std::ofstream(In("odd")) << "no head\n";
  EXPECT_THAT(Run("ledger verify --heads " + In("none")).err, HasSubstr("none"));
  EXPECT_THAT(Run("ledger verify --heads " + In("odd")).err, HasSubstr("odd:1: no head, want a head, one a line"));
  EXPECT_THAT(Run("ledger verify --key " + In("odd")).err, HasSubstr("--key"));
  EXPECT_THAT(Run("ledger proof SN-9 --out " + In("proof")).err, HasSubstr("BLADE_NOT_FOUND"));
  EXPECT_THAT(Run("ledger proof SN/9 --out " + In("proof")).err, HasSubstr("name"));
  EXPECT_FALSE(fs::exists(In("proof")));
}

TEST_F(LedgerCommandTest, AStrangerChecksAProofAndFindsEachSpoiltOne) {
  Fill();
  const Ended proven = Run("ledger proof SN-0 --out " + In("proof.json"));
  ASSERT_EQ(proven.exit_code, kDone) << proven.err;
  const std::string with = " " + In("public.pem") + " " + In("heads");
  const auto [holds, said] = Script(In("proof.json") + with);
  ASSERT_TRUE(holds) << said;
  EXPECT_THAT(said, HasSubstr("inspections/"));
  EXPECT_THAT(said, HasSubstr("3 inspection_holes"));
  EXPECT_THAT(said, HasSubstr("one of those"));

  using nlohmann::json;
  EXPECT_THAT(said, HasSubstr("that these are all entries of the blade is not proven"));
  ASSERT_EQ(Run("ledger proof SN-1 --out " + In("other.json")).exit_code, kDone);
  const json proof = json::parse(ReadAll(In("proof.json"))), others = json::parse(ReadAll(In("other.json")));
  ASSERT_EQ(proof["entries"].size(), 9u);
  const auto in_row = [](json* p, const char* table, const std::string& was, const std::string& is) {
    for (json& entry : (*p)["entries"]) {
      if (!entry["tables"].contains(table)) continue;
      for (json& row : entry["tables"][table]) {
        std::string text = row;
        if (const std::size_t at = text.find(was); at != std::string::npos) row = text.replace(at, was.size(), is);
      }
    }
  };
  const std::vector<std::pair<const char*, std::function<void(json*)>>> spoilt = {
      {"a verdict", [&](json* p) { in_row(p, "inspections", "\"CONFORM", "\"NOT_CONFORM"); }},
      {"a hole's figure", [&](json* p) { in_row(p, "inspection_holes", "0.0123", "0.0124"); }},
      {"a row left out", [](json* p) { p->at("entries")[8]["tables"]["inspection_holes"].erase(0); }},
      {"a table that was not sealed", [](json* p) { p->at("entries")[8]["tables"]["mine"] = {"{}"}; }},
      {"a content", [](json* p) { p->at("entries")[2]["content"] = std::string(p->at("entries")[1]["content"]); }},
      {"a content left out", [](json* p) { p->at("entries")[2]["content"] = ""; }},
      {"a leaf", [](json* p) { p->at("entries")[2]["leaf"] = std::string(p->at("entries")[1]["leaf"]); }},
      {"a place", [](json* p) { p->at("entries")[2]["leaf_index"] = 0; }},
      {"a path", [](json* p) { p->at("entries")[2]["audit_path"].erase(0); }},
      {"a name", [](json* p) { p->at("entries")[2]["name"] = "scans/other"; }},
      {"a sequence", [](json* p) { p->at("entries")[2]["record_sequence"] = 1; }},
      {"all rows of an entry left out", [](json* p) { p->at("entries")[2]["tables"] = json::object(); }},
      {"which blade it is of left out", [](json* p) { p->at("entries")[2]["tables"].erase("record_entries"); }},
      {"an entry of another blade", [&](json* p) { p->at("entries").push_back(others["entries"].back()); }},
      {"an entry of another blade without its rows",
       [&](json* p) {
         p->at("entries").push_back(others["entries"].back());
         p->at("entries").back()["tables"] = json::object();
       }},
      {"an entry of another blade by its name alone",
       [&](json* p) {
         p->at("entries").push_back(others["entries"].back());
         p->at("entries").back()["tables"] = json::object();
         p->at("entries").back()["content"] = "";
       }},
      {"a blade's name without its collection", [](json* p) { p->at("blade") = "SN-0"; }},
      {"another blade", [](json* p) { p->at("blade") = "blades/SN-1"; }},
      {"entries out of order", [](json* p) { std::swap(p->at("entries")[2], p->at("entries")[3]); }},
      {"a root", [](json* p) { p->at("head")["root_sha256"] = std::string(64, '0'); }},
      {"a size", [](json* p) { p->at("head")["tree_size"] = 1000; }},
      {"a time", [](json* p) { p->at("head")["signed_at"] = "2027-11-25T01:02:03Z"; }},
      {"a signature", [](json* p) { p->at("head")["signature"] = std::string(128, '0'); }},
      {"no entries", [](json* p) { p->at("entries") = json::array(); }},
      {"no proof", [](json* p) { *p = json::array(); }},
  };
  for (const auto& [what, spoil] : spoilt) {
    json changed = proof;
    spoil(&changed);
    ASSERT_NE(changed, proof) << what;
    std::ofstream(In("spoilt.json")) << changed.dump();
    const auto [still_holds, told] = Script(In("spoilt.json") + with);
    EXPECT_FALSE(still_holds) << what << ": " << told;
    EXPECT_THAT(told, HasSubstr("does NOT hold: ")) << what;
    EXPECT_THAT(told, Not(HasSubstr("Traceback"))) << what;
  }
  json part = proof;
  part["entries"][8]["tables"].erase("inspection_holes");
  std::ofstream(In("part.json")) << part.dump();
  const auto [is_whole, told] = Script(In("part.json") + with);
  EXPECT_FALSE(is_whole) << told;
  EXPECT_THAT(told, HasSubstr("3 inspection_holes NOT SHOWN"));
  EXPECT_THAT(told, HasSubstr("NOT whole: "));
  EXPECT_THAT(told, Not(HasSubstr("\nholds")));
  ASSERT_TRUE(ledger::SigningKey::MakeFile(In("") + "other.pem").ok());  // public.pem is now the other's
  EXPECT_FALSE(Script(In("proof.json") + with).first) << "by another key";
}

class SealerTest : public LedgerCommandTest {
 protected:
  std::unique_ptr<plant::LedgerSealer> Sealer(std::chrono::milliseconds every = {}) {
    plant::LedgerSealerOptions options;
    options.every = options.head_every = every;
    options.heads_file = In("sent");
    auto own = storage::Database::Open(testing::AsRole(database_.conninfo(), "plant"), 1);
    return std::make_unique<plant::LedgerSealer>(options, storage::LedgerIn(std::move(own)),
                                                 *ledger::SigningKey::Read(In("key.pem")));
  }
};

TEST_F(SealerTest, SealsBehindTheWritesAndSendsHeadsOut) {
  const auto sealer = Sealer(std::chrono::milliseconds(20));
  testing::RecordName(database_.database(), "scan", "scans/s1");
  absl::StatusOr<std::vector<ledger::Head>> sent;
  for (int i = 0; i < 500 && !(sent.ok() && !sent->empty()); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    sent = ledger::ReadHeads(In("sent"));
  }
  ASSERT_TRUE(sent.ok() && !sent->empty()) << sent.status();
  EXPECT_EQ(sent->back().tree_size, 1);
  EXPECT_TRUE(ledger::IsSignedBy(sent->back(), ReadAll(In("public.pem"))));
  const Ended verified = Run("ledger verify --heads " + In("sent") + " --key " + In("public.pem"));
  EXPECT_EQ(verified.exit_code, kDone) << verified.out << verified.err;
}

TEST_F(SealerTest, SignsNothingThatContradictsWhatItSentOut) {
  const auto sealer = Sealer();
  testing::RecordName(database_.database(), "scan", "scans/s1");
  testing::RecordName(database_.database(), "scan", "scans/s2");
  ASSERT_TRUE(sealer->SealAll().ok());
  ASSERT_TRUE(sealer->SignHead().ok());
  ASSERT_TRUE(sealer->SignHead().ok());
  EXPECT_EQ(ledger::ReadHeads(In("sent"))->size(), 1u) << "nothing new, no head";
  Do("DELETE FROM ledger_heads");
  Do("DELETE FROM ledger_leaves WHERE leaf_index = 1");
  Do("DELETE FROM record_names WHERE name = 'scans/s2'");
  EXPECT_THAT(std::string(sealer->SignHead().message()), HasSubstr("cut off, or the database was set back"));
  testing::RecordName(database_.database(), "scan", "scans/another");
  ASSERT_TRUE(sealer->SealAll().ok());
  EXPECT_THAT(std::string(sealer->SignHead().message()), HasSubstr("rewritten"));
  EXPECT_EQ(ledger::ReadHeads(In("sent"))->size(), 1u);
}

}  // namespace
}  // namespace sixpoint::cli
