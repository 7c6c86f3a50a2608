// `sixpoint certs`, on folders of the test's own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "cli/document.h"
#include "cli/plant_certificates.h"
#include "identity/trust.h"
#include "tests/cli/command_run.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CertsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "sixpoint-certs-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    unsetenv("SIXPOINT_IDENTITY");
    const Ended made = RunCommand("certs init --plant works-2 --authority " + authority());
    ASSERT_EQ(made.exit_code, kDone) << made.err;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string authority() const { return At("authority"); }
  std::string At(const std::string& name) const { return (folder_ / name).string(); }
  // On the test's authority; `data` is a folder without a plant.
  Ended Run(const std::string& words) const {
    return RunCommand("certs " + words + " --authority " + authority() + " --data " + At("plant"));
  }
  Ended Issue(const std::string& words, const std::string& out) const {
    return Run("issue " + words + " --json --folder " + At(out));
  }
  std::string Pem(const std::string& name) const {
    return ReadFile((folder_ / name / identity::kIdentityFile).string(), 65536).value_or("");
  }
  nlohmann::json Listed(const std::string& more = "") const { return Run("list --json" + more).json(); }

  fs::path folder_;
};

TEST_F(CertsTest, GivesAUserACertificateWithRoles) {
  const Ended issued = Issue("users/jane --role quality --role engineer", "jane");
  ASSERT_EQ(issued.exit_code, kDone) << issued.err;
  const nlohmann::json certificate = issued.json();
  EXPECT_EQ(certificate["who"], "users/jane");
  EXPECT_EQ(certificate["roles"], (nlohmann::json{"engineer", "quality"}));
  EXPECT_EQ(certificate["state"], "valid");
  EXPECT_EQ(certificate["folder"], At("jane"));
  EXPECT_EQ(fs::status(At("jane")).permissions(), fs::perms::owner_all);
  EXPECT_EQ(fs::status(At("jane/identity.pem")).permissions(), fs::perms::owner_read | fs::perms::owner_write);

  EXPECT_EQ(RunCommand("certs show --json " + At("jane")).json(), certificate);
  EXPECT_EQ(RunCommand("certs show --json --identity " + At("jane")).json(), certificate);
  EXPECT_THAT(RunCommand("certs show " + At("jane")).out,
              AllOf(HasSubstr("who           users/jane\nroles         engineer, quality\nserial        "),
                    HasSubstr("  valid\nfolder        " + At("jane"))));
  EXPECT_EQ(Listed()[0]["serial"], certificate["serial"]);
  EXPECT_THAT(Run("list").out, AllOf(HasSubstr("serial"), HasSubstr("users/jane"), HasSubstr("engineer, quality")));
}

TEST_F(CertsTest, GivesMachinesAndServicesTheirOwnRole) {
  const nlohmann::json machine = Issue("machines/sarix-1 --valid-days 397", "m").json();
  EXPECT_EQ(machine["roles"], nlohmann::json{"machine"});
  const nlohmann::json service = Issue("services/plant --host plant.example --host 10.1.2.3", "s").json();
  EXPECT_EQ(service["hosts"], (nlohmann::json{"plant.example", "10.1.2.3"}));
  EXPECT_THAT(RunCommand("certs show " + At("s")).out, HasSubstr("hosts         plant.example, 10.1.2.3\n"));
  // Who calls for people is no service: it may do what they may. Behind a proxy nobody asks for its certificate.
  const nlohmann::json gateway = Issue("services/gateway", "g").json();
  EXPECT_EQ(Issue("services/gateway --host plant.example", "h").json()["hosts"], nlohmann::json{"plant.example"});
  EXPECT_EQ(gateway["roles"], nlohmann::json{"gateway"});
}

TEST_F(CertsTest, ListsTheNewestUpToALimit) {
  for (const char* name : {"ann", "bob", "joe"})
    ASSERT_EQ(Issue("users/" + std::string(name) + " --role quality", name).exit_code, kDone);
  ASSERT_EQ(Run("revoke users/joe").exit_code, kDone);
  // What is not shown does not count.
  const nlohmann::json two = Listed(" --limit 2"), one = Listed(" --limit 1"), all = Listed();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(two, all);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0], all[0]);
  EXPECT_EQ(Listed(" --all --limit 1")[0]["state"], "revoked");
  EXPECT_THAT(Run("list --limit 0").err, HasSubstr("--limit"));
}

TEST_F(CertsTest, RefusesWhatIsNobody) {
  for (const auto& [words, sentence] :
       {std::pair("jane --role engineer", "jane, want machines/NAME, users/NAME or services/NAME"),
        std::pair("users/a/b --role engineer", "want machines/NAME"),
        std::pair("users/jane", "at least one of engineer, quality, mes-reader and admin"),
        std::pair("users/jane --role boss", "--role: boss, want machine, engineer"),
        std::pair("users/jane --role machine", "want of a user engineer"),
        std::pair("machines/m1 --role engineer", "want none of machines"),
        std::pair("machines/m1 --host plant.example", "plant.example, want none but of a service"),
        std::pair("services/plant", "want 1 to 16 of a service"),
        std::pair("services/plant --host a_b", "a_b, want a host's name"),
        std::pair("services/gateway --role admin", "want none of services"),
        std::pair("services/kitchen --host plant.example",
                  "services/kitchen, want services/ and one of plant, ingest")}) {
    const Ended refused = Run("issue " + std::string(words) + " --folder " + At("nobody"));
    EXPECT_EQ(refused.exit_code, kFailed) << words;
    EXPECT_THAT(refused.err, HasSubstr(sentence)) << words;
    EXPECT_FALSE(fs::exists(At("nobody"))) << words;
  }
  EXPECT_THAT(Listed(" --all"), IsEmpty());
}

TEST_F(CertsTest, HoldsNoLongerThanAnAuthorityGives) {
  for (const char* days : {"0", "398", "-1", "x"})
    EXPECT_THAT(Run("issue users/jane --role admin --folder x --valid-days " + std::string(days)).err,
                HasSubstr("--valid-days"))
        << days;
  EXPECT_EQ(Issue("users/jane --role admin --valid-days 1", "jane").exit_code, kDone);
}

TEST_F(CertsTest, RenewsWhatIsThereAndTakesNobodyElses) {
  ASSERT_EQ(Issue("users/jane --role engineer", "jane").exit_code, kDone);
  const std::string first = Pem("jane");
  EXPECT_EQ(Issue("users/jane --role quality", "jane").json()["roles"], nlohmann::json{"quality"});
  const std::string second = Pem("jane");
  EXPECT_NE(second, first);

  EXPECT_THAT(Run("issue users/joe --role engineer --folder " + At("jane")).err,
              HasSubstr("--folder: " + At("jane") + " (of users/jane), want a folder without identity.pem"));
  EXPECT_THAT(Run("issue machines/jane --folder " + At("jane")).err, HasSubstr("(of users/jane)"));
  ASSERT_EQ(RunCommand("certs init --authority " + At("other")).exit_code, kDone);
  EXPECT_THAT(
      RunCommand("certs issue users/jane --role quality --folder " + At("jane") + " --authority " + At("other")).err,
      HasSubstr("(of another plant)"));
  EXPECT_EQ(Pem("jane"), second);

  fs::create_directory(At("broken"));
  std::ofstream(At("broken/identity.pem")) << "letters\n";
  EXPECT_EQ(Run("issue users/jane --role quality --folder " + At("broken")).exit_code, kFailed);
  EXPECT_EQ(Pem("broken"), "letters\n");
}

TEST_F(CertsTest, WantsAnAuthority) {
  const std::string nowhere = " --authority " + At("nowhere");
  for (const char* words : {"issue users/jane --role admin --folder x", "list", "revoke users/jane"}) {
    const Ended refused = RunCommand("certs " + std::string(words) + nowhere);
    EXPECT_EQ(refused.exit_code, kFailed) << words;
    EXPECT_THAT(refused.err, AllOf(HasSubstr("authority: none in " + At("nowhere")), HasSubstr("next: start a plant")));
  }
  // A plant's own is its authority unless another is named.
  EXPECT_THAT(RunCommand("certs list --data " + At("plant")).err, HasSubstr("none in " + At("plant/authority")));
  const Ended again = RunCommand("certs init --authority " + authority());
  EXPECT_EQ(again.exit_code, kFailed);
  EXPECT_THAT(again.err, HasSubstr("ALREADY_EXISTS"));
  EXPECT_EQ(RunCommand("certs renew --data " + At("plant")).exit_code, kFailed);
}

TEST_F(CertsTest, RevokesOneOrAllOfSomebody) {
  ASSERT_EQ(Issue("users/jane --role engineer", "jane").exit_code, kDone);
  ASSERT_EQ(Issue("users/jane --role engineer", "jane").exit_code, kDone);
  const std::string joe = Issue("users/joe --role admin", "joe").json()["serial"];

  EXPECT_THAT(Run("revoke users/jane").out, HasSubstr("2 certificates revoked (users/jane); no plant was told"));
  EXPECT_EQ(Listed().size(), 1u);
  EXPECT_EQ(Listed(" --all").size(), 3u);
  EXPECT_EQ(Run("revoke users/jane --json").json()["revoked_count"], 0);

  std::string as_openssl = joe;  // in capitals, with colons
  std::transform(as_openssl.begin(), as_openssl.end(), as_openssl.begin(),
                 [](unsigned char c) { return std::toupper(c); });
  as_openssl.insert(2, ":");
  EXPECT_EQ(Run("revoke --json " + as_openssl).json()["revoked_count"], 1);
  EXPECT_THAT(Listed(), IsEmpty());
  for (const auto& certificate : Listed(" --all")) EXPECT_EQ(certificate["state"], "revoked");

  const Ended unknown = Run("revoke 0123456789abcdef");
  EXPECT_EQ(unknown.exit_code, kFailed);
  EXPECT_THAT(unknown.err,
              AllOf(HasSubstr("NOT_FOUND"), HasSubstr("next: see which there are: sixpoint certs list --all")));
  EXPECT_THAT(Run("revoke users/nobody").err, HasSubstr("users/nobody, want a serial or a name"));
  EXPECT_EQ(Run("revoke ../../etc/passwd").exit_code, kFailed);
}

// What the services of a plant look at before each call.
TEST_F(CertsTest, TellsThePlantOfItsAuthorityWhatWasRevoked) {
  const fs::path certificates = CertificatesIn(At("plant"));
  fs::create_directories(certificates);
  ASSERT_EQ(Issue("users/jane --role engineer", "jane").exit_code, kDone);
  fs::copy_file(At("jane/authority.pem"), certificates / identity::kAuthorityFile);
  EXPECT_EQ(Run("revoke users/nobody").exit_code, kFailed);
  EXPECT_FALSE(fs::exists(certificates / kRevokedFile));
  EXPECT_THAT(Run("revoke users/jane").out,
              HasSubstr("1 certificate revoked (users/jane); the plant refuses the next"));

  identity::Trust trust(certificates / identity::kAuthorityFile, certificates / kRevokedFile);
  ASSERT_TRUE(trust.CheckFiles().ok()) << trust.CheckFiles();
  const std::string pem = Pem("jane");
  EXPECT_EQ(trust.Judge(pem.substr(pem.find("-----BEGIN CERTIFICATE"))).standing, identity::Standing::kRevoked);
}

}  // namespace
}  // namespace sixpoint::cli
