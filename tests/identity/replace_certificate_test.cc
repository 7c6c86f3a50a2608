// A renewed certificate, put beside the key that stays.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <set>

#include "identity/authority.h"
#include "identity/files.h"
#include "refusal/refusal.h"
#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;
using std::chrono::hours;
using std::chrono::seconds;
using testing::CertificateOf;
using testing::Contents;
using ::testing::HasSubstr;
using testing::KeyOf;
using testing::ModeOf;
using testing::Must;
using testing::Plant;

constexpr hours kMonth{24 * 30};

class ReplaceCertificateTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(WriteCredentials(folder_, jane_), absl::OkStatus()); }

  std::string Renewed(hours valid_for = kMonth + hours(1)) {
    return Must(plant_.authority().Renew(testing::SerialOf(jane_), valid_for));
  }
  // Of the same key, by the authority itself, which would never say it.
  std::string Given(const std::string& who, const std::vector<Role>& roles, const AuthorityKey& by, Span valid) {
    return Must(PemOf(
        Must(NewCertificate(by, Must(KeyOfPem(KeyOf(jane_))).get(), Must(IdentityOf(who, roles)), {}, valid)).get()));
  }
  void ExpectRefused(const std::string& pem, const std::string& said) {
    const absl::Status refused = ReplaceCertificate(file_, pem);
    ASSERT_TRUE(absl::IsInvalidArgument(refused)) << said << ": " << refused;
    EXPECT_THAT(ViolationsOf(refused).at(0).field, ::testing::StartsWith("certificate"));
    EXPECT_THAT(std::string(refused.message()), HasSubstr(said));
    EXPECT_EQ(Contents(file_), jane_.identity_pem) << said;
  }

  Plant plant_;
  Credentials jane_ = plant_.Issue("users/jane", {Role::kEngineer});
  Span valid_ = *ValidityOf(Must(CertificateOfPem(CertificateOf(jane_))).get());
  fs::path folder_ = plant_.beside("jane"), file_ = folder_ / kIdentityFile;
};

TEST_F(ReplaceCertificateTest, KeepsTheKey) {
  const std::string renewed = Renewed();
  for (int i = 0; i < 2; ++i) {  // once more: nothing changes
    ASSERT_EQ(ReplaceCertificate(file_, renewed), absl::OkStatus());
    EXPECT_EQ(Contents(file_), KeyOf(jane_) + renewed);
    EXPECT_EQ(Must(ReadCertificate(file_)).serial, Must(SerialOf(Must(CertificateOfPem(renewed)).get())));
  }
  EXPECT_EQ(Contents(folder_ / kAuthorityFile), jane_.authority_pem);
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_)) names.insert(entry.path().filename());
  EXPECT_EQ(names, (std::set<std::string>{kIdentityFile, kAuthorityFile}));
}

TEST_F(ReplaceCertificateTest, TakesAPathWithoutAFolder) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  EXPECT_EQ(ReplaceCertificate(kIdentityFile, Renewed()), absl::OkStatus());
  fs::current_path(before);
  EXPECT_NE(Contents(file_), jane_.identity_pem);
}

TEST_F(ReplaceCertificateTest, LeavesTheFileItsOwnersAlone) {
  ASSERT_EQ(chmod(file_.c_str(), 0644), 0);
  const Descriptor reader(open(file_.c_str(), O_RDONLY | O_CLOEXEC));
  ASSERT_EQ(ReplaceCertificate(file_, Renewed()), absl::OkStatus());
  EXPECT_EQ(ModeOf(file_), 0600U);
  // Whole: who reads the old one goes on reading it.
  std::string old(jane_.identity_pem.size() + 1, '\0');
  EXPECT_EQ(read(reader.number(), old.data(), old.size()), static_cast<ssize_t>(jane_.identity_pem.size()));
  if (geteuid() != 0) GTEST_SKIP() << "SKIPPED: only root gives files to another";
  ASSERT_EQ(chown(file_.c_str(), 65534, 12), 0);
  ASSERT_EQ(ReplaceCertificate(file_, Renewed(kMonth + hours(2))), absl::OkStatus());
  struct stat found {};
  ASSERT_EQ(stat(file_.c_str(), &found), 0);
  EXPECT_EQ(found.st_uid, 65534U);
  EXPECT_EQ(found.st_gid, 12U);
  EXPECT_EQ(ModeOf(file_), 0600U);
}

TEST_F(ReplaceCertificateTest, TakesNobodysFileFromHim) {
  if (geteuid() != 0) GTEST_SKIP() << "SKIPPED: only root gives files to another";
  const std::string renewed = Renewed();
  ASSERT_EQ(chmod(plant_.beside("").c_str(), 0755), 0);
  ASSERT_EQ(chmod(folder_.c_str(), 0777), 0);
  ASSERT_EQ(chmod(file_.c_str(), 0644), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (setgroups(0, nullptr) != 0 || setgid(65534) != 0 || setuid(65534) != 0) _exit(2);
    _exit(absl::IsPermissionDenied(ReplaceCertificate(file_, renewed)) ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_EQ(Contents(file_), jane_.identity_pem);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 2);
}

TEST_F(ReplaceCertificateTest, RefusesWhatIsNoRenewal) {
  const AuthorityKey authority = plant_.key();
  const Span later{valid_.not_before, valid_.not_after + hours(1)};
  ExpectRefused(CertificateOf(plant_.Issue("users/jane", {Role::kEngineer})), "of another key");
  ExpectRefused(Given("users/eve", {Role::kEngineer}, authority, later), "of users/eve");
  ExpectRefused(Given("users/jane", {Role::kEngineer, Role::kAdmin}, authority, later), "the same roles");
  ExpectRefused(Given("users/jane", {Role::kEngineer}, authority, {valid_.not_before, valid_.not_after - seconds(1)}),
                "ends " + TimeText(valid_.not_after - seconds(1)) + ", want " + TimeText(valid_.not_after));
  ExpectRefused(Renewed(kMonth - hours(1)), "as the one there");
  // The same end is no step back.
  EXPECT_EQ(ReplaceCertificate(file_, Given("users/jane", {Role::kEngineer}, authority, valid_)), absl::OkStatus());
}

TEST_F(ReplaceCertificateTest, RefusesWhatTheAuthorityDidNotSign) {
  Plant other;
  const Span later{valid_.not_before, valid_.not_after + hours(1)};
  ExpectRefused(Given("users/jane", {Role::kEngineer}, other.key(), later), "not signed by the authority");
  // Its name alone is anybody's to take.
  const AuthorityKey wrong{Must(NewKey()), Must(CertificateOfPem(jane_.authority_pem))};
  ExpectRefused(Given("users/jane", {Role::kEngineer}, wrong, later), "not signed by the authority");
  std::ofstream(folder_ / kAuthorityFile) << "garbage";
  EXPECT_THAT(std::string(ReplaceCertificate(file_, Renewed()).message()),
              HasSubstr((folder_ / kAuthorityFile).string()));
  EXPECT_EQ(Contents(file_), jane_.identity_pem);
  fs::remove(folder_ / kAuthorityFile);
  EXPECT_EQ(ReplaceCertificate(file_, Renewed()), absl::OkStatus());
}

TEST_F(ReplaceCertificateTest, RefusesWhatIsNoCertificate) {
  const std::string renewed = Renewed();
  ExpectRefused("", "one certificate");
  ExpectRefused("garbage", "one certificate");
  ExpectRefused(renewed + renewed, "holds several");
  ExpectRefused(KeyOf(jane_) + renewed, "holds something else");
  ExpectRefused(renewed.substr(0, renewed.size() / 2), "one certificate");
  ExpectRefused(renewed + std::string(16 * 1024, '\n'), "16 KiB");
}

TEST_F(ReplaceCertificateTest, RefusesAFileThatIsNoIdentity) {
  const std::string renewed = Renewed(), other_key = KeyOf(plant_.Issue("users/jane", {Role::kEngineer}));
  EXPECT_TRUE(absl::IsNotFound(ReplaceCertificate(plant_.beside("nowhere") / kIdentityFile, renewed)));
  EXPECT_TRUE(absl::IsNotFound(ReplaceCertificate(folder_ / "nothing", renewed)));
  EXPECT_FALSE(ReplaceCertificate(folder_, renewed).ok());
  EXPECT_FALSE(ReplaceCertificate("", renewed).ok());
  for (const std::string& content :
       {std::string(), std::string("garbage"), KeyOf(jane_), CertificateOf(jane_), other_key + CertificateOf(jane_),
        jane_.identity_pem + other_key, std::string(40000, 'x')}) {
    std::ofstream(file_) << content;
    const absl::Status refused = ReplaceCertificate(file_, renewed);
    EXPECT_TRUE(absl::IsInvalidArgument(refused)) << refused;
    EXPECT_THAT(std::string(refused.message()), HasSubstr(file_.string()));
    EXPECT_EQ(Contents(file_), content);
  }
}

TEST_F(ReplaceCertificateTest, FollowsNoLink) {
  fs::rename(file_, plant_.beside("elsewhere.pem"));
  fs::create_symlink(plant_.beside("elsewhere.pem"), file_);
  EXPECT_FALSE(ReplaceCertificate(file_, Renewed()).ok());
  EXPECT_TRUE(fs::is_symlink(file_));
  EXPECT_EQ(Contents(plant_.beside("elsewhere.pem")), jane_.identity_pem);
}

}  // namespace
}  // namespace sixpoint::identity
