// A new certificate for a key that its holder keeps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cctype>
#include <fstream>
#include <set>
#include <thread>

#include "identity/authority.h"
#include "identity/revocation_list.h"
#include "identity/trust.h"
#include "refusal/refusal.h"
#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;
using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;
using std::chrono::system_clock;
using testing::CertificateOf;
using testing::Contents;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Must;
using testing::Plant;
using testing::WishOf;

constexpr hours kRenewalTime{24 * 30};

class RenewTest : public ::testing::Test {
 protected:
  std::string Renew(const Credentials& credentials, hours valid_for = kRenewalTime) {
    return Must(plant_.authority().Renew(testing::SerialOf(credentials), valid_for));
  }
  IssuedCertificate Listed(const std::string& serial) {
    for (const IssuedCertificate& one : Must(plant_.authority().Issued()))
      if (one.serial == serial) return one;
    ADD_FAILURE() << serial << " is not listed";
    return {};
  }
  // A certificate of the authority's, as it would have been kept in the past.
  std::string Keep(const Span& valid) {
    const AuthorityKey authority = plant_.key();
    const Certificate certificate =
        Must(NewCertificate(authority, Must(NewKey()).get(), Must(IdentityOf("machines/m1", {})), {}, valid));
    const std::string serial = Must(SerialOf(certificate.get()));
    std::ofstream(FileOf(serial)) << Must(PemOf(certificate.get()));
    return serial;
  }
  fs::path FileOf(const std::string& serial) const { return plant_.folder() / "issued" / (serial + ".pem"); }

  Plant plant_;
  TimePoint now_ = system_clock::now();
  Trust trust_{plant_.certificate_file(), plant_.revoked_file(), [this] { return now_; }};
};

std::string SerialOfPem(const std::string& pem) { return Must(SerialOf(Must(CertificateOfPem(pem)).get())); }

TEST_F(RenewTest, KeepsKeyAndNamesAndGivesTimeAnew) {
  CertificateWish service = WishOf("services/ingest");
  service.hosts = {"plant.example.com", "10.0.0.7", "::1", "::ffff:10.0.0.7"};
  for (const CertificateWish& wish :
       {service, WishOf("machines/m1"), WishOf("users/jane", {Role::kEngineer, Role::kAdmin})}) {
    const Credentials first = plant_.Issue(wish);
    const TimePoint before = system_clock::now();
    const std::string pem = Renew(first, hours(24 * 100));
    const Certificate old = Must(CertificateOfPem(CertificateOf(first))), renewed = Must(CertificateOfPem(pem));
    EXPECT_EQ(EVP_PKEY_eq(X509_get0_pubkey(old.get()), X509_get0_pubkey(renewed.get())), 1);
    EXPECT_EQ(X509_NAME_cmp(X509_get_subject_name(old.get()), X509_get_subject_name(renewed.get())), 0);
    EXPECT_EQ(X509_get_extended_key_usage(renewed.get()), X509_get_extended_key_usage(old.get()));
    EXPECT_EQ(X509_check_private_key(renewed.get(), Must(KeyOfPem(testing::KeyOf(first))).get()), 1);

    const IssuedCertificate was = Listed(testing::SerialOf(first)), is = Listed(SerialOfPem(pem));
    EXPECT_NE(is.serial, was.serial);
    EXPECT_EQ(is.identity.Text(), wish.identity.Text());
    EXPECT_EQ(is.identity.roles, was.identity.roles);
    EXPECT_EQ(is.hosts, wish.hosts);
    EXPECT_THAT(is.public_key_sha256, ::testing::MatchesRegex("[0-9a-f]{64}"));
    EXPECT_EQ(is.public_key_sha256, was.public_key_sha256);
    EXPECT_LE(is.not_before, system_clock::now() - hours(3));
    EXPECT_GE(is.not_after, before + hours(24 * 100) - seconds(1));
    EXPECT_LE(is.not_after, system_clock::now() + hours(24 * 100));
    EXPECT_EQ(Contents(FileOf(is.serial)), pem);
    EXPECT_EQ(testing::ModeOf(FileOf(is.serial)), 0644U);
    for (const std::string& shown : {pem, CertificateOf(first)}) {
      const Judgement judgement = trust_.Judge(shown);
      EXPECT_EQ(judgement.standing, Standing::kGood) << judgement.why_not;
      EXPECT_EQ(judgement.identity.Text(), wish.identity.Text());
      EXPECT_EQ(judgement.identity.roles, was.identity.roles);
    }
  }
}

TEST_F(RenewTest, LeavesTheOldOneItsTime) {
  CertificateWish wish = WishOf("machines/m1");
  wish.valid_for = hours(2);
  const Credentials first = plant_.Issue(wish);
  const std::string renewed = Renew(first);
  const TimePoint end = Listed(testing::SerialOf(first)).not_after;
  now_ = end;
  EXPECT_EQ(trust_.Judge(CertificateOf(first)).standing, Standing::kGood);
  EXPECT_EQ(trust_.Judge(renewed).standing, Standing::kGood);
  now_ = end + seconds(1);
  EXPECT_EQ(trust_.Judge(CertificateOf(first)).standing, Standing::kExpired);
  EXPECT_EQ(trust_.Judge(renewed).standing, Standing::kGood);
}

TEST_F(RenewTest, IsListedNewestFirstBesideOthersOfItsHolder) {
  const Credentials first = plant_.Issue("machines/m1"), new_key = plant_.Issue("machines/m1");
  std::vector<std::string> oldest_first{testing::SerialOf(first), testing::SerialOf(new_key)};
  for (int i = 0; i < 10; ++i)
    oldest_first.push_back(SerialOfPem(Must(plant_.authority().Renew(oldest_first[i == 0 ? 0 : i + 1], kRenewalTime))));
  const std::vector<IssuedCertificate> issued = Must(plant_.authority().Issued());
  ASSERT_EQ(issued.size(), 12U);
  for (std::size_t i = 0; i < issued.size(); ++i) EXPECT_EQ(issued[i].serial, oldest_first[11 - i]);
  // Those of one key, and all of one machine.
  for (std::size_t i = 0; i < issued.size(); ++i) {
    EXPECT_EQ(issued[i].public_key_sha256 == issued[11].public_key_sha256, i != 10);
    EXPECT_EQ(issued[i].identity.Text(), "machines/m1");
    ASSERT_EQ(plant_.authority().Revoke(issued[i].serial), absl::OkStatus());
  }
  for (const std::string& serial : oldest_first)
    EXPECT_EQ(trust_.Judge(Contents(FileOf(serial))).standing, Standing::kRevoked);
}

TEST_F(RenewTest, IsRefusedOfWhatDoesNotHold) {
  const Credentials taken_back = plant_.Issue("machines/m1");
  const std::string renewed = SerialOfPem(Renew(taken_back));
  ASSERT_EQ(plant_.authority().Revoke(testing::SerialOf(taken_back)), absl::OkStatus());
  const std::string expired = Keep({now_ - hours(2), now_ - seconds(2)});
  const std::string revoked_and_expired = Keep({now_ - hours(2), now_ - seconds(2)});
  ASSERT_EQ(plant_.authority().Revoke(revoked_and_expired), absl::OkStatus());
  for (const std::string& serial : {testing::SerialOf(taken_back), expired, revoked_and_expired}) {
    const absl::Status refused = plant_.authority().Renew(serial, kRenewalTime).status();
    EXPECT_TRUE(absl::IsFailedPrecondition(refused)) << refused;
    EXPECT_THAT(std::string(refused.message()), HasSubstr("serial: " + serial + " of machines/m1, "));
    EXPECT_THAT(std::string(refused.message()), HasSubstr(serial == expired ? "expired 20" : "taken back 20"));
  }
  EXPECT_EQ(Must(plant_.authority().Issued()).size(), 4U);
  // One that holds yet, though an older one of its key was taken back: each is taken back for itself.
  EXPECT_TRUE(plant_.authority().Renew(renewed, kRenewalTime).ok());
  EXPECT_TRUE(plant_.authority().Renew(Keep({now_ - hours(2), now_ + hours(1)}), kRenewalTime).ok());
}

TEST_F(RenewTest, IsOfWhatItGaveAlone) {
  Plant other;
  const Credentials machine = plant_.Issue("machines/m1"), others = other.Issue("machines/m1");
  for (const std::string& serial :
       {std::string(), testing::SerialOf(others), std::string("../../certificate"), std::string(5000, 'a'),
        testing::SerialOf(machine) + "\n", testing::SerialOf(machine).substr(1), std::string("a\0b", 3)})
    EXPECT_TRUE(absl::IsNotFound(plant_.authority().Renew(serial, kRenewalTime).status())) << serial;
  // Another's certificate and one's own under a wrong name, laid into its folder.
  std::ofstream(FileOf(testing::SerialOf(others))) << CertificateOf(others);
  const absl::Status foreign = plant_.authority().Renew(testing::SerialOf(others), kRenewalTime).status();
  EXPECT_THAT(std::string(foreign.message()), HasSubstr(".pem: not signed by the authority"));
  std::ofstream(FileOf(std::string(32, 'a'))) << CertificateOf(machine);
  const absl::Status renamed = plant_.authority().Renew(std::string(32, 'a'), kRenewalTime).status();
  EXPECT_THAT(std::string(renamed.message()), HasSubstr(".pem: holds another certificate"));
  fs::remove(FileOf(std::string(32, 'a')));
  EXPECT_EQ(Must(plant_.authority().Issued()).size(), 2U);
  std::string upper = testing::SerialOf(machine);
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  EXPECT_TRUE(plant_.authority().Renew(upper, kRenewalTime).ok());  // as `openssl x509 -serial` prints it
}

TEST_F(RenewTest, IsBoundedInItsTime) {
  const std::string serial = testing::SerialOf(plant_.Issue("machines/m1"));
  for (const hours life : {hours(0), hours(-1), hours(397 * 24 + 1), hours::max(), hours::min()})
    EXPECT_EQ(ViolationsOf(plant_.authority().Renew(serial, life).status()).at(0).field, "valid_for");
  EXPECT_EQ(Must(plant_.authority().Issued()).size(), 1U);
  EXPECT_TRUE(plant_.authority().Renew(serial, hours(397 * 24)).ok());
}

TEST_F(RenewTest, NeverOutlivesTheAuthority) {
  // The same key and name, for three hours more.
  const AuthorityKey authority = plant_.key();
  const Span its{now_ - minutes(1), now_ + hours(3)};
  const Certificate shorter = Must(NewAuthorityCertificate(authority.key.get(), "test", its));
  std::ofstream(plant_.certificate_file()) << Must(PemOf(shorter.get()));
  const std::string serial = Keep(its);
  const IssuedCertificate renewed = Listed(SerialOfPem(Must(plant_.authority().Renew(serial, kRenewalTime))));
  EXPECT_EQ(renewed.not_after, ValidityOf(shorter.get())->not_after);
  EXPECT_EQ(renewed.not_before, ValidityOf(shorter.get())->not_before);
}

TEST_F(RenewTest, IsRefusedWhereTheListCannotBeRead) {
  const std::string serial = testing::SerialOf(plant_.Issue("machines/m1"));
  fs::remove(plant_.revoked_file());
  EXPECT_TRUE(absl::IsInvalidArgument(plant_.authority().Renew(serial, kRenewalTime).status()));
  std::ofstream(plant_.revoked_file()) << "garbage";
  EXPECT_TRUE(absl::IsInvalidArgument(plant_.authority().Renew(serial, kRenewalTime).status()));
}

TEST_F(RenewTest, LosesNothingOfThreeThreads) {
  constexpr std::size_t kRenewed_count = 20;
  std::atomic<int> wrong_count{0};
  std::vector<std::thread> threads;
  for (const std::string who : {"machines/a", "machines/b", "machines/c"})
    threads.emplace_back([&, who] {
      auto authority = Authority::Open(plant_.folder());
      const auto first = authority.ok() ? authority->Issue(WishOf(who)) : authority.status();
      std::string serial = first.ok() ? testing::SerialOf(*first) : "";
      for (std::size_t i = 0; i < kRenewed_count && !serial.empty(); ++i) {
        const auto pem = authority->Renew(serial, kRenewalTime);
        if (pem.ok() && !authority->Revoke(serial).ok()) ++wrong_count;
        serial = pem.ok() ? SerialOfPem(*pem) : "";
      }
      if (serial.empty()) ++wrong_count;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong_count, 0);
  std::set<std::string> keys;
  std::size_t revoked_count = 0;
  const std::vector<IssuedCertificate> issued = Must(plant_.authority().Issued());
  for (const IssuedCertificate& one : issued) {
    keys.insert(one.public_key_sha256);
    revoked_count += one.revoked_at.has_value() ? 1 : 0;
  }
  EXPECT_EQ(issued.size(), 3 * (kRenewed_count + 1));
  EXPECT_EQ(revoked_count, 3 * kRenewed_count);
  EXPECT_EQ(keys.size(), 3U);
}

}  // namespace
}  // namespace sixpoint::identity
