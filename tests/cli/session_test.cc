// Whose certificate a command shows, and what it says where the plant does not believe it.
#include "cli/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "cli/identity_folder.h"
#include "cli/local_plant.h"
#include "tests/cli/command_run.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class IdentityFolderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "sixpoint-identity-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    setenv("XDG_CONFIG_HOME", (folder_ / "config").c_str(), 1);
    unsetenv("SIXPOINT_IDENTITY");
  }
  void TearDown() override {
    unsetenv("XDG_CONFIG_HOME");
    fs::remove_all(folder_);
  }
  fs::path Put(const fs::path& folder) const {
    fs::create_directories(folder);
    std::ofstream(folder / "identity.pem") << "x";
    return folder;
  }
  std::string data() const { return (folder_ / "plant").string(); }

  fs::path folder_;
};

TEST_F(IdentityFolderTest, IsTheOneGivenThenThePlantsThenTheUsersOwn) {
  const absl::Status none = IdentityFolder("", data()).status();
  EXPECT_EQ(none.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(
      std::string(none.message()),
      AllOf(HasSubstr("in " + data() + "/certificates/local or " + folder_.string() + "/config/sixpoint/identity"),
            HasSubstr("`sixpoint certs issue users/NAME --role engineer --folder DIR`")));

  const fs::path own = Put(folder_ / "config" / "sixpoint" / "identity");
  EXPECT_EQ(*IdentityFolder("", data()), own);
  const fs::path local = Put(LocalIdentityIn(data()));
  EXPECT_EQ(*IdentityFolder("", data()), local);
  const fs::path given = Put(folder_ / "given");
  EXPECT_EQ(*IdentityFolder(given.string(), data()), given);
  // What was named is not replaced by another.
  EXPECT_THAT(std::string(IdentityFolder("/nowhere", data()).status().message()), HasSubstr("may read in /nowhere ("));
}

TEST_F(IdentityFolderTest, WithoutOneACommandSaysWhatToDo) {
  const Ended ended = RunCommand("machine list --server 127.0.0.1:1 --data " + data());
  EXPECT_EQ(ended.exit_code, kFailed);
  EXPECT_THAT(ended.err,
              AllOf(HasSubstr("error: FAILED_PRECONDITION\nno certificate to show to the plant"),
                    HasSubstr("next: have one made, and name its folder by --identity or SIXPOINT_IDENTITY")));
  EXPECT_THAT(RunCommand("machine list --server 127.0.0.1:1 --identity /nowhere").err, HasSubstr("/nowhere"));
  const fs::path broken = Put(folder_ / "broken");
  const Ended unreadable = RunCommand("machine list --server 127.0.0.1:1 --identity " + broken.string());
  EXPECT_EQ(unreadable.exit_code, kFailed);
  EXPECT_THAT(unreadable.err, AllOf(HasSubstr("INVALID_ARGUMENT"), HasSubstr(broken.string())));
}

std::string Next(const absl::Status& status) { return NextStep(status, "plant.example:7400"); }

TEST(NextStep, OfWhoIsNotLetInNamesTheCertificate) {
  EXPECT_THAT(Next(runtime::Failure(errors::v1::CERTIFICATE_EXPIRED, "x")), HasSubstr("sixpoint certs show"));
  EXPECT_THAT(Next(runtime::Failure(errors::v1::ROLE_MISSING, "x")), HasSubstr("a certificate with the role"));
  EXPECT_THAT(Next(runtime::Failure(errors::v1::MACHINE_DIFFERS, "x")), HasSubstr("that machine's own certificate"));
  EXPECT_EQ(Next(absl::PermissionDeniedError("/x: cannot be written")), "ask for the right to do this");
}

TEST(NextStep, OfAPlantThatIsNotBelievedNamesItsCertificate) {
  EXPECT_THAT(Next(absl::UnavailableError("Connection refused")), HasSubstr("no plant answers at plant.example:7400"));
  EXPECT_THAT(Next(absl::UnavailableError("routines::certificate verify failed")), HasSubstr("sixpoint certs renew"));
  EXPECT_THAT(Next(absl::UnavailableError("Hostname Verification Check failed.")), HasSubstr("--announce HOST"));
  EXPECT_THAT(Next(absl::UnavailableError("routines::wrong version number")), HasSubstr("speaks no TLS"));
  // A service that says so itself was believed.
  EXPECT_THAT(Next(runtime::Failure(errors::v1::SERVICE_NOT_READY, "certificate")), HasSubstr("no plant answers"));
}

}  // namespace
}  // namespace sixpoint::cli
