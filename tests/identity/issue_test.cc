// What an authority gives, and refuses to give.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "identity/authority.h"
#include "identity/revocation_list.h"
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
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::KeyOf;
using testing::MessageOf;
using testing::Must;
using testing::NamesIn;
using testing::Plant;
using ::testing::UnorderedElementsAre;
using testing::WishOf;

TEST(Authority, GivesWhatWasWishedFor) {
  Plant plant;
  CertificateWish wish = WishOf("services/ingest");
  wish.hosts = {"plant.example.com", "localhost", "10.0.0.7", "fe80::1", "x"};
  wish.valid_for = hours(48);
  const auto before = system_clock::now();
  const Credentials credentials = plant.Issue(wish);
  EXPECT_EQ(credentials.authority_pem, Contents(plant.certificate_file()));
  ASSERT_EQ(WriteCredentials(plant.beside("deep/er/ingest"), credentials), absl::OkStatus());
  const auto read = Must(ReadCertificate(plant.beside("deep/er/ingest") / kIdentityFile));
  EXPECT_EQ(read.identity.Text(), "services/ingest");
  EXPECT_THAT(read.identity.roles, ElementsAre(Role::kService));
  EXPECT_EQ(read.hosts, wish.hosts);
  EXPECT_EQ(read.revoked_at, std::nullopt);
  // 128 bits, never zero in front.
  EXPECT_EQ(read.serial.size(), 32U);
  EXPECT_GE(read.serial[0], '8');
  // Whole seconds, and three hours for clocks that are late; a second for this test.
  EXPECT_GE(read.not_before, before - hours(3) - seconds(1));
  EXPECT_LE(read.not_before, system_clock::now() - hours(3));
  EXPECT_GE(read.not_after, before + hours(48) - seconds(1));
  EXPECT_LE(read.not_after, system_clock::now() + hours(48));
  const std::string kept = Contents(plant.folder() / "issued" / (read.serial + ".pem"));
  EXPECT_EQ(kept, CertificateOf(credentials));
  EXPECT_THAT(KeyOf(credentials), HasSubstr("BEGIN PRIVATE KEY"));
  // The key is the certificate's.
  EXPECT_EQ(X509_check_private_key(Must(CertificateOfPem(kept)).get(), Must(KeyOfPem(KeyOf(credentials))).get()), 1);
}

TEST(Authority, WritesExtensionsAsTheStandardHasThem) {
  Plant plant;
  const auto usage = [&](const std::string& who, const std::vector<Role>& roles) {
    const auto certificate = Must(CertificateOfPem(CertificateOf(plant.Issue(who, roles))));
    X509* const x = certificate.get();
    EXPECT_EQ(X509_get_version(x), 2);
    EXPECT_EQ(X509_check_ca(x), 0);
    EXPECT_EQ(X509_get_key_usage(x), static_cast<std::uint32_t>(KU_DIGITAL_SIGNATURE));
    EXPECT_NE(X509_get0_subject_key_id(x), nullptr);
    EXPECT_EQ(
        ASN1_OCTET_STRING_cmp(X509_get0_authority_key_id(x), X509_get0_subject_key_id(plant.key().certificate.get())),
        0);
    EXPECT_EQ(EVP_PKEY_get_bits(X509_get0_pubkey(x)), 256);
    EXPECT_EQ(X509_get_signature_nid(x), NID_ecdsa_with_SHA256);
    return X509_get_extended_key_usage(x);
  };
  EXPECT_EQ(usage("users/jane", {Role::kAdmin}), static_cast<std::uint32_t>(XKU_SSL_CLIENT));
  EXPECT_EQ(usage("machines/m1", {}), static_cast<std::uint32_t>(XKU_SSL_CLIENT));
  EXPECT_EQ(usage("services/plant", {}), static_cast<std::uint32_t>(XKU_SSL_CLIENT | XKU_SSL_SERVER));
  const AuthorityKey own = plant.key();
  X509* const authority = own.certificate.get();
  EXPECT_EQ(X509_check_ca(authority), 1);
  EXPECT_EQ(X509_get_pathlen(authority), 0);
  EXPECT_EQ(X509_get_key_usage(authority), static_cast<std::uint32_t>(KU_KEY_CERT_SIGN | KU_CRL_SIGN));
}

TEST(Authority, RefusesWishesByTheirFields) {
  Plant plant;
  const CertificateWish service = WishOf("services/plant"), machine = WishOf("machines/m1");
  const auto fields = [&](CertificateWish wish, auto change) {
    change(&wish);
    std::vector<std::string> found;
    for (const Violation& v : ViolationsOf(plant.authority().Issue(wish).status())) found.push_back(v.field);
    return found;
  };
  using Wish = CertificateWish;
  EXPECT_THAT(fields(service, [](Wish* w) { w->hosts.clear(); }), ElementsAre("hosts"));
  EXPECT_THAT(fields(service, [](Wish* w) { w->hosts.assign(17, "a"); }), ElementsAre("hosts"));
  EXPECT_THAT(fields(machine, [](Wish* w) { w->hosts = {"a"}; }), ElementsAre("hosts"));
  for (const hours life : {hours(0), hours(-1), hours(397 * 24 + 1), hours::max(), hours::min()})
    EXPECT_THAT(fields(machine, [&](Wish* w) { w->valid_for = life; }), ElementsAre("valid_for"));
  EXPECT_THAT(fields(machine, [](Wish* w) { w->valid_for = hours(397 * 24); }), IsEmpty());
  EXPECT_THAT(fields(machine, [](Wish* w) { w->identity.name = "../m1"; }), ElementsAre("identity"));
  EXPECT_THAT(fields(machine, [](Wish* w) { w->identity.roles = {Role::kAdmin}; }), ElementsAre("roles"));
  EXPECT_THAT(fields(machine,
                     [](Wish* w) {
                       w->identity.roles = {Role::kMachine, Role::kAdmin};
                     }),
              ElementsAre("roles"));
  EXPECT_THAT(fields(machine, [](Wish* w) { w->identity.kind = static_cast<Kind>(9); }), ElementsAre("identity"));
  EXPECT_THAT(fields(service,
                     [](Wish* w) {
                       w->hosts = {"ok", "a b", "*"};
                       w->valid_for = hours(0);
                       w->identity.name = "";
                     }),
              ElementsAre("identity", "hosts[1]", "hosts[2]", "valid_for"));
  EXPECT_EQ(plant.authority().Issued()->size(), 1U);
}

TEST(Authority, TakesNamesAndAddressesAsHostsAndNothingElse) {
  const std::string label(63, 'a');
  for (const std::string& host :
       {std::string("a"), std::string("plant-1.example.com"), std::string("127.0.0.1"), std::string("::1"),
        std::string("2001:db8::ff00:42:8329"), label + "." + label + "." + label + "." + label.substr(0, 61)})
    EXPECT_TRUE(IsHost(host)) << host;
  for (const std::string& host : {std::string(),
                                  std::string("."),
                                  std::string("a."),
                                  std::string(".a"),
                                  std::string("a..b"),
                                  std::string("-a"),
                                  std::string("a-.b"),
                                  std::string("*.example.com"),
                                  std::string("a b"),
                                  std::string("a,DNS:b"),
                                  std::string("a\n"),
                                  std::string("a\0b", 3),
                                  std::string("10.0.0.256"),
                                  std::string("10.0.0"),
                                  std::string("127.0.0.1\0", 10),
                                  std::string("fe80::1%eth0"),
                                  std::string("[::1]"),
                                  std::string("a:80"),
                                  std::string("m\xc3\xbcnchen"),
                                  std::string("a_b"),
                                  label + "a",
                                  label + "." + label + "." + label + "." + label.substr(0, 62)})
    EXPECT_FALSE(IsHost(host)) << host;
}

TEST(Authority, GivesNothingThatATrustWouldNotRead) {
  Plant plant;
  CertificateWish wish = WishOf("services/" + std::string(64, 'x'));
  const std::string label(63, 'a');
  wish.hosts.assign(16, label + "." + label + "." + label + "." + label.substr(0, 61));
  EXPECT_LT(CertificateOf(plant.Issue(wish)).size(), kMostCertificate_bytes);
}

// Its own files, as Create would have written them for a shorter life.
void Replace(const Plant& plant, const Span& valid) {
  AuthorityKey authority{Must(NewKey()), nullptr};
  authority.certificate = Must(NewAuthorityCertificate(authority.key.get(), "test", valid));
  std::ofstream(plant.folder() / "key.pem") << Must(PemOf(authority.key.get()));
  std::ofstream(plant.certificate_file()) << Must(PemOf(authority.certificate.get()));
  std::ofstream(plant.revoked_file()) << Must(RevocationListPem(authority, {}, system_clock::now()));
}

TEST(Authority, GivesNothingBeyondItsOwnTime) {
  Plant plant;
  const auto now = system_clock::now();
  Replace(plant, {now - minutes(1), now + hours(3)});
  CertificateWish wish = WishOf("machines/m1");
  const auto authority = ValidityOf(plant.key().certificate.get());
  plant.Issue(wish);
  const auto given = plant.authority().Issued()->at(0);
  EXPECT_EQ(given.not_after, authority->not_after);
  EXPECT_EQ(given.not_before, authority->not_before);
  for (const Span& other : {Span{now - hours(2), now - hours(1)}, Span{now + hours(1), now + hours(2)}}) {
    Replace(plant, other);
    EXPECT_TRUE(absl::IsFailedPrecondition(plant.authority().Issue(wish).status()));
  }
}

TEST(Credentials, ReplaceWhatWasThereAndLeaveNothingElse) {
  Plant plant;
  const fs::path folder = plant.beside("jane");
  for (int i = 0; i < 3; ++i) {
    const Credentials credentials = plant.Issue("users/jane", {Role::kEngineer});
    ASSERT_EQ(WriteCredentials(folder, credentials), absl::OkStatus());
    EXPECT_EQ(Contents(folder / kIdentityFile), credentials.identity_pem);
    EXPECT_EQ(Contents(folder / kAuthorityFile), credentials.authority_pem);
  }
  EXPECT_THAT(NamesIn(folder), UnorderedElementsAre(kIdentityFile, kAuthorityFile));
}

TEST(Credentials, ReplaceALinkAndNotWhereItLeads) {
  Plant plant;
  fs::create_directory(plant.beside("jane"));
  std::ofstream(plant.beside("letter")) << "dear";
  fs::create_symlink(plant.beside("letter"), plant.beside("jane") / kIdentityFile);
  ASSERT_EQ(WriteCredentials(plant.beside("jane"), plant.Issue("machines/m1")), absl::OkStatus());
  EXPECT_EQ(Contents(plant.beside("letter")), "dear");
  EXPECT_TRUE(ReadCertificate(plant.beside("jane") / kIdentityFile).ok());
}

TEST(Credentials, ThatCannotBeReadSayWhichFile) {
  Plant plant;
  const fs::path file = plant.beside(kIdentityFile);
  EXPECT_TRUE(absl::IsNotFound(ReadCertificate(file).status()));
  const Credentials credentials = plant.Issue("machines/m1");
  for (const std::string& content :
       {std::string(), std::string("garbage"), KeyOf(credentials), std::string(40000, 'x'),
        credentials.identity_pem + CertificateOf(credentials), Contents(plant.certificate_file()),
        credentials.identity_pem.substr(0, credentials.identity_pem.size() - 40)}) {
    std::ofstream(file) << content;
    const auto read = ReadCertificate(file);
    EXPECT_TRUE(absl::IsInvalidArgument(read.status())) << read.status();
    EXPECT_THAT(MessageOf(read.status()), HasSubstr(file.string()));
  }
}

}  // namespace
}  // namespace sixpoint::identity
