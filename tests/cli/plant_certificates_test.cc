// What `sixpoint up` and `sixpoint certs renew` make of a plant's certificates.
#include "cli/plant_certificates.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "cli/document.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;

class PlantCertificatesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "sixpoint-plant-certificates-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    plant_.data = pattern;
    plant_.address = *ListenAddressOf("127.0.0.1", "");
    const mode_t before = umask(077);  // as careful users have it
    const absl::Status made = MakeAuthority(plant_, user_);
    umask(before);
    ASSERT_TRUE(made.ok()) << made;
  }
  void TearDown() override { fs::remove_all(plant_.data); }

  // Whose certificate is new: "services/plant", ...
  std::vector<std::string> Renew(Renewal which = Renewal::kWhereDue) {
    const auto renewed = RenewCertificates(plant_, user_, which);
    EXPECT_TRUE(renewed.ok()) << renewed.status();
    std::vector<std::string> names;
    if (renewed.ok())
      for (const Renewed& one : *renewed)
        if (one.is_new) names.push_back(one.certificate.identity.Text());
    return names;
  }
  static unsigned ModeOf(const fs::path& path) {
    struct stat found {};
    EXPECT_EQ(lstat(path.c_str(), &found), 0) << path;
    return found.st_mode & 07777;
  }
  static std::vector<std::string> AllServices() {
    std::vector<std::string> names;
    for (const char* area : kAreas) names.push_back(std::string("services/") + area);
    names.push_back("services/gateway");
    return names;
  }

  const ServiceUser user_{geteuid(), getegid(), {}};
  LocalPlant plant_;
};

TEST_F(PlantCertificatesTest, AreMadeOnceAndThenWhereTheyAreDue) {
  EXPECT_EQ(Renew().size(), kAreas.size() + 2);
  EXPECT_THAT(Renew(), ElementsAre());
  EXPECT_EQ(Renew(Renewal::kAll).size(), kAreas.size() + 2);

  fs::remove(plant_.certificates_of("ingest") / identity::kIdentityFile);
  fs::remove(plant_.certificates_of("plant") / identity::kAuthorityFile);
  std::ofstream(plant_.certificates_of("correction") / identity::kIdentityFile) << "letters\n";
  EXPECT_THAT(Renew(), ElementsAre("services/plant", "services/ingest", "services/correction"));
  EXPECT_THAT(Renew(), ElementsAre());

  plant_.address = *ListenAddressOf("0.0.0.0", "plant.example");
  EXPECT_EQ(Renew(), AllServices());
  EXPECT_THAT(Renew(), ElementsAre());
}

TEST_F(PlantCertificatesTest, HoldForTheServicesHostsAndTheLocalUsersRoles) {
  const auto renewed = RenewCertificates(plant_, user_, Renewal::kWhereDue);
  ASSERT_TRUE(renewed.ok()) << renewed.status();
  ASSERT_EQ(renewed->size(), kAreas.size() + 2);
  const identity::IssuedCertificate& service = renewed->front().certificate;
  EXPECT_EQ(service.identity.Text(), "services/plant");
  for (const char* host : {"localhost", "127.0.0.1", "::1"}) EXPECT_THAT(service.hosts, Contains(host));
  EXPECT_GT(service.not_after - std::chrono::system_clock::now(), std::chrono::hours(24 * 396));
  const identity::IssuedCertificate& local = renewed->back().certificate;
  EXPECT_EQ(local.identity.Text(), "users/" + UserName(geteuid()));
  EXPECT_EQ(local.identity.roles,
            (std::vector{identity::Role::kEngineer, identity::Role::kQuality, identity::Role::kAdmin}));
  EXPECT_THAT(local.hosts, ElementsAre());
}

TEST_F(PlantCertificatesTest, LieWhereOnlyTheirOwnersReadThem) {
  Renew();
  EXPECT_EQ(ModeOf(plant_.authority()), 0700u);
  EXPECT_EQ(ModeOf(plant_.certificates()), 0755u);
  for (const char* name : {"authority.pem", "revoked.pem"}) EXPECT_EQ(ModeOf(plant_.certificates() / name), 0644u);
  for (const fs::path& folder : {plant_.certificates_of("plant"), LocalIdentityIn(plant_.data)}) {
    EXPECT_EQ(ModeOf(folder), 0700u);
    EXPECT_EQ(ModeOf(folder / identity::kIdentityFile), 0600u);
  }
  EXPECT_FALSE(fs::exists(plant_.certificates() / identity::kIdentityFile));  // whoever takes that folder is nobody
  for (const auto& entry : fs::directory_iterator(plant_.certificates()))
    EXPECT_NE(entry.path().extension(), ".part") << entry.path();
}

// A data folder that came back without it: a new authority would shut out whom the old one let in.
TEST_F(PlantCertificatesTest, OfAnotherAuthorityAreMadeAnewOnceTheOldOneIsGivenUp) {
  Renew();
  fs::remove_all(plant_.authority());
  const absl::Status lost = MakeAuthority(plant_, user_);
  EXPECT_EQ(lost.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(lost.message()), ::testing::HasSubstr("no key.pem"));
  EXPECT_FALSE(fs::exists(plant_.authority()));
  fs::remove(plant_.certificates() / "authority.pem");
  ASSERT_TRUE(MakeAuthority(plant_, user_).ok());
  EXPECT_EQ(Renew().size(), kAreas.size() + 2);
  EXPECT_THAT(Renew(), ElementsAre());
}

TEST_F(PlantCertificatesTest, RevokedAreMadeAnew) {
  Renew();
  const std::string serial = (*ServiceCertificates(plant_, user_)[1]).serial;
  EXPECT_EQ(*RevokeCertificates(plant_.authority(), {serial}, plant_.data), true);
  EXPECT_TRUE(ServiceCertificates(plant_, user_)[1]->revoked_at.has_value());
  EXPECT_THAT(Renew(), ElementsAre("services/ingest"));
  EXPECT_FALSE(ServiceCertificates(plant_, user_)[1]->revoked_at.has_value());
}

// A service may put into its own folder what it likes.
TEST_F(PlantCertificatesTest, FollowNoLinkInAServicesFolder) {
  Renew();
  const fs::path target = plant_.data / "target", file = plant_.certificates_of("plant") / identity::kIdentityFile;
  fs::copy_file(LocalIdentityIn(plant_.data) / identity::kIdentityFile, target);
  const std::string before = *ReadFile(target.string(), 65536);
  fs::remove(file);
  fs::create_symlink(target, file);
  EXPECT_FALSE(ServiceCertificates(plant_, user_)[0].has_value());
  EXPECT_THAT(Renew(), ElementsAre("services/plant"));
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(file)));
  EXPECT_EQ(*ReadFile(target.string(), 65536), before);
  fs::remove(file);
  fs::create_directory(file);
  EXPECT_FALSE(RenewCertificates(plant_, user_, Renewal::kWhereDue).ok());
}

TEST_F(PlantCertificatesTest, AreGivenToTheServiceUser) {
  if (geteuid() != 0) GTEST_SKIP() << "SKIPPED: only root can give a file away";
  const ServiceUser daemon{1, 1, {}};
  for (const std::string& area : plant_.Served()) ASSERT_EQ(chown(plant_.certificates_of(area).c_str(), 1, 1), 0);
  ASSERT_TRUE(RenewCertificates(plant_, daemon, Renewal::kWhereDue).ok());
  struct stat found {};
  ASSERT_EQ(lstat((plant_.certificates_of("plant") / identity::kIdentityFile).c_str(), &found), 0);
  EXPECT_EQ(found.st_uid, 1u);
  EXPECT_EQ(found.st_gid, 1u);
  ASSERT_EQ(lstat((LocalIdentityIn(plant_.data) / identity::kIdentityFile).c_str(), &found), 0);
  EXPECT_EQ(found.st_uid, 0u);
  // Root's own file in the service's folder is not the service's.
  EXPECT_FALSE(ServiceCertificates(plant_, user_)[0].has_value());
  EXPECT_TRUE(ServiceCertificates(plant_, daemon)[0].has_value());
}

TEST(ServiceHosts, AreThisMachinesAndThoseThatClientsAreTold) {
  const std::vector<std::string> every = ServiceHosts(*ListenAddressOf("0.0.0.0", "plant.example"));
  EXPECT_THAT(every, Contains("plant.example"));
  EXPECT_THAT(every, ::testing::Not(Contains("0.0.0.0")));
  EXPECT_THAT(ServiceHosts(*ListenAddressOf("10.1.2.3", "")), Contains("10.1.2.3"));
  const std::vector<std::string> local = ServiceHosts(*ListenAddressOf("127.0.0.1", ""));
  EXPECT_EQ(std::count(local.begin(), local.end(), "127.0.0.1"), 1);
}

}  // namespace
}  // namespace sixpoint::cli
