#include "identity/authority.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cctype>
#include <ctime>
#include <fstream>
#include <set>
#include <utility>

#include "identity/revocation_list.h"
#include "refusal/refusal.h"
#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using std::chrono::system_clock;
using testing::CertificateOf;
using testing::Contents;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;
using testing::ModeOf;
using testing::Must;
using testing::NamesIn;
using testing::Plant;
using testing::TemporaryFolder;
using ::testing::UnorderedElementsAre;
using testing::WishOf;

TEST(Authority, IsAFolderThatItsOwnerAloneReads) {
  Plant plant;
  plant.Issue("users/jane", {Role::kEngineer});
  const std::string file = testing::SerialOf(plant.Issue("machines/m1")) + ".pem";
  EXPECT_THAT(NamesIn(plant.folder()),
              UnorderedElementsAre("key.pem", "certificate.pem", "revoked.pem", "issued", "lock"));
  EXPECT_EQ(ModeOf(plant.folder()), 0700U);
  EXPECT_EQ(ModeOf(plant.folder() / "key.pem"), 0600U);
  EXPECT_EQ(ModeOf(plant.folder() / "lock"), 0600U);
  EXPECT_EQ(ModeOf(plant.folder() / "issued"), 0700U);
  EXPECT_EQ(ModeOf(plant.folder() / "issued" / file), 0644U);
  EXPECT_EQ(ModeOf(plant.certificate_file()), 0644U);
  EXPECT_EQ(ModeOf(plant.revoked_file()), 0644U);
}

TEST(Authority, KeepsTheModesWhateverTheUmask) {
  for (const mode_t mask : {mode_t{0}, mode_t{0077}, mode_t{0022}}) {
    const mode_t before = umask(mask);
    Plant plant;
    const fs::path folder = plant.beside("jane");
    EXPECT_EQ(WriteCredentials(folder, plant.Issue("machines/m1")), absl::OkStatus());
    umask(before);
    EXPECT_EQ(ModeOf(plant.folder() / "key.pem"), 0600U);
    EXPECT_EQ(ModeOf(plant.certificate_file()), 0644U);
    EXPECT_EQ(ModeOf(folder), 0700U);
    EXPECT_EQ(ModeOf(folder / kIdentityFile), 0600U);
    EXPECT_EQ(ModeOf(folder / kAuthorityFile), 0644U);
  }
}

TEST(Authority, IsOnlyOpenedWhereTheKeyIsItsOwnersAlone) {
  Plant plant;
  const fs::path key = plant.folder() / "key.pem";
  for (const mode_t mode : {0640, 0604, 0660, 0601, 0620}) {
    ASSERT_EQ(chmod(key.c_str(), mode), 0);
    const auto opened = Authority::Open(plant.folder());
    EXPECT_TRUE(absl::IsPermissionDenied(opened.status())) << opened.status();
    EXPECT_THAT(MessageOf(opened.status()), HasSubstr(key.string()));
    EXPECT_THAT(MessageOf(opened.status()), HasSubstr("want 0600"));
    // Looked at anew each time, not only at first.
    EXPECT_TRUE(absl::IsPermissionDenied(plant.authority().Issue(WishOf("machines/m1")).status()));
  }
  ASSERT_EQ(chmod(key.c_str(), 0400), 0);
  EXPECT_TRUE(Authority::Open(plant.folder()).ok());
  ASSERT_EQ(chmod(plant.folder().c_str(), 0770), 0);
  EXPECT_TRUE(absl::IsPermissionDenied(Authority::Open(plant.folder()).status()));
  ASSERT_EQ(chmod(plant.folder().c_str(), 0755), 0);  // whoever may look sees certificates
  EXPECT_TRUE(Authority::Open(plant.folder()).ok());
}

TEST(Authority, IsNotOpenedWhereTheKeyIsAnothers) {
  if (geteuid() != 0) GTEST_SKIP() << "SKIPPED: only root gives files to another";
  constexpr uid_t kNobody = 65534;
  Plant plant;
  ASSERT_EQ(chown((plant.folder() / "key.pem").c_str(), kNobody, kNobody), 0);
  EXPECT_TRUE(absl::IsPermissionDenied(Authority::Open(plant.folder()).status()));
  ASSERT_EQ(chown((plant.folder() / "key.pem").c_str(), 0, 0), 0);
  ASSERT_EQ(chown(plant.folder().c_str(), kNobody, kNobody), 0);
  EXPECT_TRUE(absl::IsPermissionDenied(Authority::Open(plant.folder()).status()));
}

TEST(Authority, IsNotFoundWhereThereIsNone) {
  const TemporaryFolder folder;
  EXPECT_TRUE(absl::IsNotFound(Authority::Open(folder / "nowhere").status()));
  EXPECT_TRUE(absl::IsNotFound(Authority::Open(folder / "").status()));
}

TEST(Authority, FollowsNoLinkToAKey) {
  Plant plant;
  const fs::path key = plant.folder() / "key.pem";
  fs::rename(key, plant.beside("key.pem"));
  fs::create_symlink(plant.beside("key.pem"), key);
  EXPECT_FALSE(Authority::Open(plant.folder()).ok());
  EXPECT_TRUE(absl::IsAlreadyExists(Authority::Create(plant.folder(), "test")));
}

TEST(Authority, RefusesFilesThatDoNotBelongTogether) {
  Plant plant, other;
  const std::pair<std::string, std::string> files[] = {
      {"certificate.pem", Contents(other.certificate_file())},
      {"certificate.pem", CertificateOf(plant.Issue("machines/m1"))},
      {"certificate.pem", "no certificate"},
      {"key.pem", Contents(other.folder() / "key.pem")},
      {"key.pem", ""},
      {"key.pem", Contents(plant.folder() / "key.pem") + Contents(other.folder() / "key.pem")},
      {"key.pem", std::string(20000, 'x')},
  };
  for (const auto& [name, content] : files) {
    const std::string right = Contents(plant.folder() / name);
    std::ofstream(plant.folder() / name) << content;
    const auto opened = Authority::Open(plant.folder());
    EXPECT_EQ(ViolationsOf(opened.status()).size(), 1U) << name << ": " << opened.status();
    EXPECT_THAT(MessageOf(opened.status()), HasSubstr((plant.folder() / "").string()));
    std::ofstream(plant.folder() / name) << right;
  }
  fs::remove(plant.certificate_file());
  EXPECT_TRUE(absl::IsInvalidArgument(Authority::Open(plant.folder()).status()));
}

TEST(Authority, IsNeverMadeAnew) {
  Plant plant;
  const std::string key = Contents(plant.folder() / "key.pem");
  EXPECT_TRUE(absl::IsAlreadyExists(Authority::Create(plant.folder(), "test")));
  EXPECT_EQ(Contents(plant.folder() / "key.pem"), key);
  // Who lost the key is not helped by another: what was given would count for nothing.
  plant.Issue("machines/m1");
  fs::remove(plant.folder() / "key.pem");
  EXPECT_TRUE(absl::IsAlreadyExists(Authority::Create(plant.folder(), "test")));
}

TEST(Authority, IsMadeAgainWhereItWasCutOff) {
  Plant whole;
  for (const std::vector<std::string>& left :
       {std::vector<std::string>{}, {"lock"}, {"lock", "revoked.pem"}, {"lock", "revoked.pem", "certificate.pem"}}) {
    const TemporaryFolder folder;
    fs::create_directories(folder / "authority/issued");
    for (const std::string& name : left) fs::copy_file(whole.folder() / name, folder / ("authority/" + name));
    std::ofstream(folder / "authority/.new-1") << "half a ke";
    ASSERT_EQ(Authority::Create(folder / "authority", "test"), absl::OkStatus());
    auto authority = Must(Authority::Open(folder / "authority"));
    EXPECT_TRUE(authority.Issue(WishOf("machines/m1")).ok());
    EXPECT_EQ(authority.Issued()->size(), 1U);
    EXPECT_TRUE(authority.RevokedPem().ok());
  }
}

TEST(Authority, TakesNoFolderThatSomebodyElseUses) {
  const TemporaryFolder folder;
  std::ofstream(folder / "letter") << "dear";
  const mode_t before = ModeOf(folder / "");
  ASSERT_EQ(chmod((folder / "").c_str(), 0755), 0);
  EXPECT_EQ(ViolationsOf(Authority::Create(folder / "", "test")).size(), 1U);
  EXPECT_EQ(ModeOf(folder / ""), 0755U);
  EXPECT_THAT(NamesIn(folder / ""), ElementsAre("letter"));
  EXPECT_EQ(before, 0700U);
}

TEST(Authority, HasThePlantsName) {
  const TemporaryFolder folder;
  int number = 0;
  for (const std::string& name : {std::string(), std::string(65, 'x'), std::string("a\nb"), std::string("a\0b", 3),
                                  std::string("\xff\xfe"), std::string("a\x1b[2J"), std::string("\xc2\x85")})
    EXPECT_EQ(ViolationsOf(Authority::Create(folder / "refused", name)).at(0).field, "plant") << name;
  EXPECT_FALSE(fs::exists(folder / "refused"));
  std::string umlauts;
  for (int i = 0; i < 64; ++i) umlauts += "\xc3\xbc";
  for (const std::string& name : {std::string("Werk S\xc3\xbc"
                                              "d, Halle 3/+=\"#"),
                                  std::string(64, 'x'), umlauts}) {
    const fs::path path = folder / std::to_string(++number);
    ASSERT_EQ(Authority::Create(path, name), absl::OkStatus());
    const auto certificate = Must(CertificateOfPem(*Must(Authority::Open(path)).CertificatePem()));
    EXPECT_EQ(PlantOf(certificate.get()), name);
  }
}

TEST(Authority, ListsTheNewestFirstWithWhatItTookBack) {
  Plant plant;
  EXPECT_THAT(*plant.authority().Issued(), IsEmpty());
  std::vector<std::string> serials;  // many within one second
  for (int i = 0; i < 20; ++i) serials.push_back(testing::SerialOf(plant.Issue("machines/m" + std::to_string(i))));
  const auto before = system_clock::now() - seconds(1);
  ASSERT_EQ(plant.authority().Revoke(serials[7]), absl::OkStatus());
  std::ofstream(plant.folder() / "issued/.new-17") << "half a certif";
  const auto issued = Must(plant.authority().Issued());
  ASSERT_EQ(issued.size(), 20U);
  for (std::size_t i = 0; i < issued.size(); ++i) {
    EXPECT_EQ(issued[i].serial, serials[19 - i]);
    EXPECT_EQ(issued[i].identity.Text(), "machines/m" + std::to_string(19 - i));
    EXPECT_EQ(issued[i].revoked_at.has_value(), issued[i].serial == serials[7]);
  }
  EXPECT_GE(*issued[12].revoked_at, before);
  EXPECT_LE(*issued[12].revoked_at, system_clock::now());
}

TEST(Authority, WritesTimesThatTellOneFileFromTheNext) {
  Plant plant;
  for (int i = 0; i < 20; ++i) {
    timespec before{};
    ASSERT_EQ(clock_gettime(CLOCK_REALTIME, &before), 0);
    struct stat file {};
    const std::string serial = testing::SerialOf(plant.Issue("machines/m1"));
    ASSERT_EQ(stat((plant.folder() / "issued" / (serial + ".pem")).c_str(), &file), 0);
    // The kernel's own time is that of its last tick: before, nearly always.
    EXPECT_GE(std::make_pair(file.st_mtim.tv_sec, file.st_mtim.tv_nsec), std::make_pair(before.tv_sec, before.tv_nsec));
  }
}

TEST(Authority, SaysWhichOfItsCertificatesCannotBeRead) {
  Plant plant;
  const std::string serial = testing::SerialOf(plant.Issue("machines/m1"));
  const std::string other(32, 'a');
  fs::copy_file(plant.folder() / "issued" / (serial + ".pem"), plant.folder() / "issued" / (other + ".pem"));
  const auto issued = plant.authority().Issued();
  EXPECT_THAT(MessageOf(issued.status()), HasSubstr(other + ".pem: holds another certificate"));
}

TEST(Authority, TakesBackOnlyWhatItGave) {
  Plant plant, other;
  plant.Issue("machines/m1");
  const std::string others = testing::SerialOf(other.Issue("machines/m1"));
  const std::string list = Contents(plant.revoked_file());
  for (const std::string& serial : {std::string(), others, std::string("../../certificate"), std::string("../key"),
                                    std::string("8"), std::string(5000, 'a'), others + "\n", std::string("a\0b", 3)}) {
    const absl::Status revoked = plant.authority().Revoke(serial);
    EXPECT_TRUE(absl::IsNotFound(revoked)) << revoked;
    EXPECT_LT(revoked.message().size(), 300U);
  }
  EXPECT_EQ(Contents(plant.revoked_file()), list);
}

TEST(Authority, ChangesNothingWhenItTakesBackOnceMore) {
  Plant plant;
  const std::string serial = testing::SerialOf(plant.Issue("machines/m1"));
  std::string upper = serial;
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  ASSERT_EQ(plant.authority().Revoke(upper), absl::OkStatus());  // as `openssl x509 -serial` prints it
  const std::string list = Contents(plant.revoked_file());
  EXPECT_EQ(plant.authority().Revoke(serial), absl::OkStatus());
  EXPECT_EQ(Contents(plant.revoked_file()), list);
  EXPECT_EQ(*plant.authority().RevokedPem(), list);
}

TEST(Authority, CountsItsLists) {
  Plant plant;
  const AuthorityKey key = plant.key();
  for (std::uint64_t number = 1; number <= 4; ++number) {
    const auto list = Must(RevocationListOf(*plant.authority().RevokedPem(), key.certificate.get()));
    EXPECT_EQ(list.number, number);
    EXPECT_EQ(list.revoked_at.size(), number - 1);
    ASSERT_EQ(plant.authority().Revoke(testing::SerialOf(plant.Issue("machines/m1"))), absl::OkStatus());
  }
  const auto list = Must(ListOfPem(*plant.authority().RevokedPem()));
  EXPECT_EQ(ASN1_TIME_compare(X509_CRL_get0_nextUpdate(list.get()), X509_get0_notAfter(key.certificate.get())), 0);
}

TEST(Authority, DoesNotBeginItsListAnewWhereItCannotReadIt) {
  Plant plant, other;
  const std::string serial = testing::SerialOf(plant.Issue("machines/m1"));
  for (const std::string& content : {std::string(), std::string("garbage"), Contents(other.revoked_file())}) {
    std::ofstream(plant.revoked_file()) << content;
    EXPECT_TRUE(absl::IsInvalidArgument(plant.authority().Revoke(serial)));
    EXPECT_FALSE(plant.authority().RevokedPem().ok());
    EXPECT_FALSE(plant.authority().Issued().ok());
    EXPECT_EQ(Contents(plant.revoked_file()), content);
  }
  fs::remove(plant.revoked_file());
  EXPECT_TRUE(absl::IsInvalidArgument(plant.authority().Revoke(serial)));
  EXPECT_FALSE(fs::exists(plant.revoked_file()));
}

}  // namespace
}  // namespace sixpoint::identity
