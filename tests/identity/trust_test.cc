// What a server makes of certificates: good ones, and those that somebody made to pass for one.
#include "identity/trust.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/err.h>
#include <openssl/pem.h>

#include <random>

#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

using std::chrono::hours;
using std::chrono::seconds;
using std::chrono::system_clock;
using testing::CertificateOf;
using testing::Contents;
using ::testing::ElementsAre;
using testing::Forged;
using testing::Forgery;
using ::testing::HasSubstr;
using testing::KeyOf;
using testing::Must;
using testing::Plant;

const std::vector<std::string> kJane{"urn:sixpoint:users:jane", "urn:sixpoint:roles:engineer"};

class TrustTest : public ::testing::Test {
 protected:
  Judgement Judge(std::string_view pem) { return trust_.Judge(pem); }
  Standing StandingOf(std::string_view pem) { return trust_.Judge(pem).standing; }
  Forgery Jane() const {
    Forgery forgery;
    forgery.uris = kJane;
    return forgery;
  }

  Plant plant_;
  TimePoint now_ = system_clock::now();
  Trust trust_{plant_.certificate_file(), plant_.revoked_file(), [this] { return now_; }};
};

TEST_F(TrustTest, BelievesWhomTheAuthorityNames) {
  EXPECT_EQ(trust_.CheckFiles(), absl::OkStatus());
  for (const std::string who : {"users/jane", "machines/m1", "services/ingest"}) {
    const Credentials credentials =
        plant_.Issue(who, who[0] == 'u' ? std::vector<Role>{Role::kQuality, Role::kAdmin} : std::vector<Role>{});
    for (int i = 0; i < 3; ++i) {  // remembered from the second time on
      const Judgement judgement = Judge(CertificateOf(credentials));
      EXPECT_EQ(judgement.standing, Standing::kGood) << judgement.why_not;
      EXPECT_EQ(judgement.why_not, "");
      EXPECT_EQ(judgement.identity.Text(), who);
      EXPECT_EQ(judgement.serial, testing::SerialOf(credentials));
      if (who[0] == 'u') {
        EXPECT_THAT(judgement.identity.roles, ElementsAre(Role::kQuality, Role::kAdmin));
      }
    }
  }
}

TEST_F(TrustTest, LooksAtTheTimeAtEveryCall) {
  CertificateWish wish = testing::WishOf("users/jane", {Role::kEngineer});
  wish.valid_for = hours(1);
  const std::string certificate = CertificateOf(plant_.Issue(wish));
  const IssuedCertificate issued = plant_.authority().Issued()->at(0);
  const std::string named = "certificate: of users/jane, ";
  EXPECT_EQ(StandingOf(certificate), Standing::kGood);
  now_ = issued.not_after;
  EXPECT_EQ(StandingOf(certificate), Standing::kGood);
  now_ = issued.not_after + seconds(1);
  const Judgement expired = Judge(certificate);
  EXPECT_EQ(expired.standing, Standing::kExpired);
  EXPECT_EQ(expired.identity.Text(), "users/jane");
  EXPECT_EQ(expired.serial, issued.serial);
  EXPECT_EQ(expired.why_not, named + "expired " + TimeText(issued.not_after) + ", want one that is valid now");
  now_ = issued.not_before;
  EXPECT_EQ(StandingOf(certificate), Standing::kGood);
  now_ = issued.not_before - seconds(1);
  const Judgement early = Judge(certificate);
  EXPECT_EQ(early.standing, Standing::kNotYetValid);
  EXPECT_EQ(early.identity.Text(), "users/jane");
  EXPECT_EQ(early.why_not, named + "from " + TimeText(issued.not_before) + " on, want one that is valid now, " +
                               TimeText(now_) + " by this clock");
}

// A plant that was made, a certificate that was given and a list that was signed a moment ago, by clocks that are an hour off.
TEST_F(TrustTest, AClockThatIsAnHourOffRefusesNobody) {
  const std::string certificate = CertificateOf(plant_.Issue(testing::WishOf("machines/m1", {})));
  const auto now = std::chrono::system_clock::now();
  for (const auto off : {hours(-1), hours(0), hours(1), hours(-2)}) {
    now_ = now + off;
    EXPECT_EQ(StandingOf(certificate), Standing::kGood) << off.count();
  }
}

TEST_F(TrustTest, BelievesNobodyLongerThanTheAuthority) {
  const AuthorityKey authority = plant_.key();
  const Span its = *ValidityOf(authority.certificate.get());
  Forgery forgery = Jane();
  forgery.valid = {its.not_before - hours(1), its.not_after + hours(1)};
  const std::string certificate = Forged(forgery, &authority);
  EXPECT_EQ(StandingOf(certificate), Standing::kGood);
  now_ = its.not_after + seconds(1);
  EXPECT_EQ(StandingOf(certificate), Standing::kExpired);
  now_ = its.not_before - seconds(1);
  EXPECT_EQ(StandingOf(certificate), Standing::kNotYetValid);
}

TEST_F(TrustTest, TakesAnyTimeThatACertificateCanHold) {
  const AuthorityKey authority = plant_.key();
  Forgery forgery = Jane();
  Certificate certificate = Must(CertificateOfPem(Forged(forgery, &authority)));
  const auto with_times = [&](const char* from, const char* until) {
    EXPECT_EQ(ASN1_TIME_set_string(X509_getm_notBefore(certificate.get()), from), 1);
    EXPECT_EQ(ASN1_TIME_set_string(X509_getm_notAfter(certificate.get()), until), 1);
    EXPECT_GT(X509_sign(certificate.get(), authority.key.get(), EVP_sha256()), 0);
    return Must(PemOf(certificate.get()));
  };
  EXPECT_EQ(StandingOf(with_times("00000101000000Z", "99991231235959Z")), Standing::kGood);
  EXPECT_EQ(StandingOf(with_times("99991231235958Z", "99991231235959Z")), Standing::kNotYetValid);
  EXPECT_EQ(StandingOf(with_times("00000101000000Z", "00000101000001Z")), Standing::kExpired);
  EXPECT_EQ(StandingOf(with_times("99991231235959Z", "00000101000000Z")), Standing::kNotYetValid);
}

TEST_F(TrustTest, BelievesNobodyWhoWasTakenBackFromTheNextCallOn) {
  const Credentials jane = plant_.Issue("users/jane", {Role::kEngineer}),
                    again = plant_.Issue("users/jane", {Role::kEngineer});
  EXPECT_EQ(StandingOf(CertificateOf(jane)), Standing::kGood);
  ASSERT_EQ(plant_.authority().Revoke(testing::SerialOf(jane)), absl::OkStatus());
  const Judgement judgement = Judge(CertificateOf(jane));
  EXPECT_EQ(judgement.standing, Standing::kRevoked);
  EXPECT_EQ(judgement.identity.Text(), "users/jane");
  EXPECT_EQ(judgement.serial, testing::SerialOf(jane));
  EXPECT_THAT(judgement.why_not, HasSubstr("certificate: of users/jane, taken back 20"));
  EXPECT_THAT(judgement.why_not, HasSubstr("Z, want one that was not"));
  EXPECT_EQ(StandingOf(CertificateOf(again)), Standing::kGood);
  // What was taken back stays so, whatever the time.
  now_ += hours(24 * 400);
  EXPECT_EQ(StandingOf(CertificateOf(jane)), Standing::kRevoked);
  EXPECT_EQ(StandingOf(CertificateOf(again)), Standing::kExpired);
}

TEST_F(TrustTest, KnowsOthersAuthoritiesHoweverTheyAreCalled) {
  Plant other("test"), another("elsewhere");
  // The same name, and so the same distinguished name; only the key is another.
  EXPECT_EQ(X509_NAME_cmp(X509_get_subject_name(other.key().certificate.get()),
                          X509_get_subject_name(plant_.key().certificate.get())),
            0);
  for (Plant* from : {&other, &another}) {
    const Judgement judgement = Judge(CertificateOf(from->Issue("users/jane", {Role::kAdmin})));
    EXPECT_EQ(judgement.standing, Standing::kNotOurs);
    EXPECT_EQ(judgement.identity.name, "");
    EXPECT_EQ(judgement.why_not,
              "certificate: of another authority, want one that the authority of the plant test gave");
  }
}

TEST_F(TrustTest, BelievesNobodyWhomAnotherNamed) {
  const AuthorityKey authority = plant_.key();
  const Credentials eve = plant_.Issue("users/eve", {Role::kMesReader});
  const AuthorityKey eves{Must(KeyOfPem(KeyOf(eve))), Must(CertificateOfPem(CertificateOf(eve)))};
  EXPECT_EQ(StandingOf(Forged(Jane(), &authority)), Standing::kGood) << "the forger's tool works";
  EXPECT_EQ(StandingOf(Forged(Jane(), &eves)), Standing::kNotOurs) << "a user as an authority";
  EXPECT_EQ(StandingOf(Forged(Jane(), nullptr)), Standing::kNotOurs) << "signed by itself";
  Forgery self = Jane();
  self.same_subject_as = authority.certificate.get();
  EXPECT_EQ(StandingOf(Forged(self, nullptr)), Standing::kNotOurs) << "signed by itself, in the authority's name";
  // The authority's certificate, but another's key.
  const AuthorityKey wrong{Must(NewKey()), Must(CertificateOfPem(Contents(plant_.certificate_file())))};
  EXPECT_EQ(StandingOf(Forged(Jane(), &wrong)), Standing::kNotOurs) << "with the authority's key identifier";
  // One authority below ours: it may sign certificates, but no authorities.
  Forgery below;
  below.is_authority = true;
  const std::string middle = Forged(below, &authority);
  EXPECT_NE(StandingOf(middle), Standing::kGood);
}

TEST_F(TrustTest, BelievesNoCertificateThatWasChanged) {
  const Certificate certificate = Must(CertificateOfPem(CertificateOf(plant_.Issue("users/eve", {Role::kMesReader}))));
  unsigned char* bytes = nullptr;
  const int size = i2d_X509(certificate.get(), &bytes);
  const std::string whole(reinterpret_cast<char*>(bytes), static_cast<std::size_t>(size));
  OPENSSL_free(bytes);
  const auto pem_of = [](std::string der) {
    const Bio bio(BIO_new(BIO_s_mem()));
    const auto* data = reinterpret_cast<const unsigned char*>(der.data());
    EXPECT_GT(PEM_write_bio(bio.get(), PEM_STRING_X509, "", data, static_cast<long>(der.size())), 0);
    char* text = nullptr;
    const long length = BIO_get_mem_data(bio.get(), &text);
    return std::string(text, static_cast<std::size_t>(length));
  };
  ASSERT_EQ(StandingOf(pem_of(whole)), Standing::kGood);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 1);
    EXPECT_NE(StandingOf(pem_of(changed)), Standing::kGood) << "byte " << at;
  }
  EXPECT_EQ(StandingOf(pem_of(whole + '\0')), Standing::kUnreadable);
  EXPECT_EQ(StandingOf(pem_of(whole.substr(0, whole.size() - 1))), Standing::kUnreadable);
}

TEST_F(TrustTest, BelievesNobodyWhomItsOwnAuthorityDoesNotName) {
  const AuthorityKey authority = plant_.key();
  const std::string engineer = "urn:sixpoint:roles:engineer";
  const std::vector<std::string> unnamed[] = {
      {},
      {"https://example.com/users/jane"},
      {kJane[0]},
      {kJane[0], engineer, "urn:sixpoint:machines:m1"},
      {kJane[0], "urn:sixpoint:roles:root"},
      {"urn:sixpoint:machines:m1", engineer},
      {std::string("urn:sixpoint:users:jane\0.example", 32), engineer},
      {std::string("urn:sixpoint:users:\0", 20), engineer},
      {"urn:sixpoint:users:jane\nadmin", engineer},
      {"urn:sixpoint:users:..", engineer},
      {"urn:sixpoint:users:../../etc", engineer},
      {"urn:sixpoint:users:" + std::string(65, 'x'), engineer},
  };
  for (const auto& uris : unnamed) {
    Forgery forgery;
    forgery.uris = uris;
    const Judgement judgement = Judge(Forged(forgery, &authority));
    EXPECT_EQ(judgement.standing, Standing::kUnreadable) << ::testing::PrintToString(uris);
    EXPECT_EQ(judgement.identity.name, "");
    EXPECT_THAT(judgement.why_not, ::testing::StartsWith("certificate: with "));
    EXPECT_THAT(judgement.why_not, ::testing::EndsWith(", want one that names one machine, user or service"));
    EXPECT_EQ(judgement.why_not.find('\n'), std::string::npos);
    EXPECT_EQ(judgement.why_not.find('\0'), std::string::npos);
  }
}

TEST_F(TrustTest, BelievesNoCertificateForAnotherPurpose) {
  const AuthorityKey authority = plant_.key();
  Forgery forgery = Jane();
  for (const char* usage : {"serverAuth", "emailProtection", "codeSigning"}) {
    forgery.usage = usage;
    EXPECT_EQ(StandingOf(Forged(forgery, &authority)), Standing::kNotOurs) << usage;
  }
  const Judgement own = Judge(Contents(plant_.certificate_file()));
  EXPECT_EQ(own.standing, Standing::kNotOurs);
  EXPECT_EQ(own.why_not, "certificate: given for something else, want one to call a service with");
}

TEST_F(TrustTest, ReadsOneCertificateOnly) {
  const Credentials jane = plant_.Issue("users/jane", {Role::kEngineer}),
                    eve = plant_.Issue("users/eve", {Role::kAdmin});
  const std::string certificate = CertificateOf(jane);
  const std::string trusted = [&] {
    std::string text = certificate;
    for (std::size_t at = 0; (at = text.find("CERTIFICATE", at)) != std::string::npos; at += 20)
      text.insert(at, "TRUSTED ");
    return text;
  }();
  const std::string unreadable[] = {
      "",
      "garbage",
      std::string("\0\0\0", 3),
      certificate + certificate,
      certificate + CertificateOf(eve),
      certificate + Contents(plant_.certificate_file()),
      jane.identity_pem,
      certificate + Contents(plant_.revoked_file()),
      Contents(plant_.revoked_file()),
      trusted,
      certificate.substr(0, certificate.size() / 2),
      certificate + "-----BEGIN CERTIFICATE-----\n!!!!\n-----END CERTIFICATE-----\n",
      "-----BEGIN CERTIFICATE-----\n-----END CERTIFICATE-----\n",
      "-----BEGIN CERTIFICATE-----\nProc-Type: 4,ENCRYPTED\nDEK-Info: AES-256-CBC,00\n\n" + certificate.substr(28),
      std::string(16 * 1024, '\n') + certificate,
      certificate + std::string(16 * 1024, ' '),
  };
  for (const std::string& pem : unreadable) {
    const Judgement judgement = Judge(pem);
    EXPECT_EQ(judgement.standing, Standing::kUnreadable) << pem.substr(0, 200);
    EXPECT_THAT(judgement.why_not, ::testing::MatchesRegex("certificate: .*, want .*"));
  }
  EXPECT_EQ(StandingOf(certificate), Standing::kGood);
}

TEST_F(TrustTest, OutlivesHostileBytes) {
  const std::string certificate = CertificateOf(plant_.Issue("users/jane", {Role::kEngineer}));
  std::mt19937 random(7);
  constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (int i = 0; i < 3000; ++i) {
    std::string pem = certificate;
    // Within the base64, so that most are read as some certificate.
    for (unsigned n = 1 + random() % 4; n > 0; --n)
      pem[28 + random() % (pem.size() - 56)] = i % 4 == 0 ? static_cast<char>(random()) : kLetters[random() % 64];
    if (pem == certificate) continue;
    const Judgement judgement = Judge(pem);
    // The same bytes may be written in two ways; nothing else is good.
    if (judgement.standing == Standing::kGood) {
      EXPECT_EQ(judgement.identity.Text(), "users/jane");
    }
  }
  for (int i = 0; i < 300; ++i) {
    std::string bytes(random() % 2000, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    EXPECT_EQ(StandingOf(bytes), Standing::kUnreadable);
  }
}

TEST_F(TrustTest, RemembersNoMoreThanItsBound) {
  // More than it remembers, each once more: still judged right.
  const AuthorityKey authority = plant_.key();
  const std::string jane = Forged(Jane(), &authority);
  for (int i = 0; i < 1500; ++i) EXPECT_EQ(StandingOf("# " + std::to_string(i) + "\n" + jane), Standing::kGood);
  EXPECT_EQ(StandingOf(jane), Standing::kGood);
}

TEST_F(TrustTest, LeavesTheErrorsOfOthersAlone) {
  ERR_clear_error();
  Judge("garbage");
  Judge(Forged(Jane(), nullptr));
  EXPECT_EQ(ERR_peek_error(), 0U);
  ERR_raise(ERR_LIB_USER, 7);
  Judge("garbage");
  EXPECT_EQ(ERR_GET_REASON(ERR_peek_last_error()), 7);
  ERR_clear_error();
}

}  // namespace
}  // namespace sixpoint::identity
