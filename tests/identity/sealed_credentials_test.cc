#include "identity/sealed_credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/err.h>
#include <openssl/hmac.h>

#include <cctype>
#include <functional>
#include <random>

#include "refusal/refusal.h"
#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

using testing::CertificateOf;
using ::testing::HasSubstr;
using testing::KeyOf;
using ::testing::MatchesRegex;
using testing::Must;
using ::testing::Not;
using testing::Plant;

constexpr char kBase32Letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567";
constexpr char kSomeCode[] = "OIBL-2345-67AB-CDEF-GHIJ-KLMN-OI";

// The format once more, from the standards alone: RFC 4648 bit by bit, RFC 5869 by its two HMACs, and AES-GCM as one shot.
std::string BitsOf(const std::string& code) {
  std::string bits;
  for (const char c : code) {
    if (c == '-') continue;
    const std::size_t value = std::string(kBase32Letters).find(c);
    for (int i = 4; i >= 0; --i) bits += (value >> i & 1) != 0 ? '1' : '0';
  }
  std::string bytes;
  for (std::size_t i = 0; i + 8 <= bits.size(); i += 8)
    bytes += static_cast<char>(std::stoi(bits.substr(i, 8), nullptr, 2));
  return bytes;
}

std::string Hmac(const std::string& key, const std::string& text) {
  unsigned char digest[32];
  unsigned size = 0;
  HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), reinterpret_cast<const unsigned char*>(text.data()),
       text.size(), digest, &size);
  return std::string(reinterpret_cast<char*>(digest), size);
}

std::string Derived(const std::string& code, const std::string& use) {
  return Hmac(Hmac(std::string(32, '\0'), BitsOf(code)), use + '\x01');
}

std::string SealedAs(const std::string& plain, const std::string& additional = "sixpoint sealed credentials\x01",
                     char version = 1) {
  const std::string nonce = "twelve bytes", key = Derived(kSomeCode, "sixpoint sealed credentials 1: key");
  const auto bytes = [](const std::string& text) { return reinterpret_cast<const unsigned char*>(text.data()); };
  std::string cipher(plain.size(), '\0'), tag(16, '\0');
  const std::unique_ptr<EVP_CIPHER_CTX, FreedBy<EVP_CIPHER_CTX_free>> context(EVP_CIPHER_CTX_new());
  int size = 0;
  EVP_EncryptInit_ex(context.get(), EVP_aes_256_gcm(), nullptr, bytes(key), bytes(nonce));
  EVP_EncryptUpdate(context.get(), nullptr, &size, bytes(additional), static_cast<int>(additional.size()));
  EVP_EncryptUpdate(context.get(), reinterpret_cast<unsigned char*>(cipher.data()), &size, bytes(plain),
                    static_cast<int>(plain.size()));
  EVP_EncryptFinal_ex(context.get(), nullptr, &size);
  EXPECT_EQ(EVP_CIPHER_CTX_ctrl(context.get(), EVP_CTRL_AEAD_GET_TAG, 16, tag.data()), 1);
  return version + nonce + cipher + tag;
}

std::string WithLength(const std::string& text) {
  std::string length;
  for (int shift = 24; shift >= 0; shift -= 8) length += static_cast<char>(text.size() >> shift);
  return length + text;
}

std::string PlainOf(const Credentials& credentials) {
  return WithLength(credentials.identity_pem) + WithLength(credentials.authority_pem);
}

std::string FieldOf(const absl::Status& status) {
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  const std::vector<Violation> violations = ViolationsOf(status);
  return violations.empty() ? "" : violations[0].field;
}

void Expect(const absl::StatusOr<Credentials>& opened, const Credentials& credentials) {
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_EQ(opened->identity_pem, credentials.identity_pem);
  EXPECT_EQ(opened->authority_pem, credentials.authority_pem);
}

class SealedCredentialsTest : public ::testing::Test {
 protected:
  Plant plant_;
  Credentials machine_ = plant_.Issue("machines/m1");
  SealedCredentials sealed_ = Must(Seal(machine_));
};

TEST_F(SealedCredentialsTest, OpenWithTheirCode) {
  CertificateWish service = testing::WishOf("services/ingest");
  service.hosts.assign(16, std::string(60, 'a') + "." + std::string(60, 'b') + "." + std::string(60, 'c'));
  for (const Credentials& credentials : {machine_, plant_.Issue("users/jane", {Role::kAdmin}), plant_.Issue(service)}) {
    const SealedCredentials sealed = Must(Seal(credentials));
    EXPECT_THAT(sealed.code, MatchesRegex("([A-Z2-7]{4}-){6}[A-Z2-7]{2}"));
    EXPECT_THAT(sealed.pickup_id, MatchesRegex("[0-9a-f]{64}"));
    EXPECT_LE(sealed.sealed.size(), kGreatestSealed_bytes);
    EXPECT_EQ(Must(PickupIdOf(sealed.code)), sealed.pickup_id);
    Expect(Unseal(sealed.code, sealed.sealed), credentials);
    EXPECT_THAT(sealed.sealed, Not(HasSubstr("BEGIN")));
    EXPECT_THAT(sealed.sealed, Not(HasSubstr(sealed.code.substr(0, 9))));
  }
}

TEST_F(SealedCredentialsTest, TakeTheGreatestThatAreHandedOut) {
  Credentials greatest = machine_;
  // Text around a PEM is none of it, but carried along.
  greatest.identity_pem.insert(0, std::string(32 * 1024 - greatest.identity_pem.size() - 1, 'x') + '\n');
  greatest.authority_pem.insert(0, std::string(16 * 1024 - greatest.authority_pem.size() - 1, 'x') + '\n');
  const SealedCredentials sealed = Must(Seal(greatest));
  EXPECT_LE(sealed.sealed.size(), kGreatestSealed_bytes);
  Expect(Unseal(sealed.code, sealed.sealed), greatest);
  Credentials longer = greatest;
  longer.identity_pem.insert(0, "x");
  EXPECT_EQ(FieldOf(Seal(longer).status()), "identity.pem");
  longer = greatest;
  longer.authority_pem.insert(0, "x");
  EXPECT_EQ(FieldOf(Seal(longer).status()), "authority.pem");
}

TEST_F(SealedCredentialsTest, DifferInEverythingEachTime) {
  const SealedCredentials again = Must(Seal(machine_));
  EXPECT_NE(again.code, sealed_.code);
  EXPECT_NE(again.pickup_id, sealed_.pickup_id);
  ASSERT_EQ(again.sealed.size(), sealed_.sealed.size());
  // All but the version: 2^-64 that eight random bytes are alike.
  for (std::size_t at = 1; at + 8 <= again.sealed.size(); ++at)
    ASSERT_NE(again.sealed.compare(at, 8, sealed_.sealed, at, 8), 0) << "byte " << at;
  for (std::size_t group = 0; group + 9 <= again.code.size(); group += 10)
    EXPECT_NE(again.code.substr(group, 9), sealed_.code.substr(group, 9));
}

TEST_F(SealedCredentialsTest, AreOfOneSizeWhoeverTheyAreOf) {
  EXPECT_EQ(Must(Seal(plant_.Issue("machines/" + std::string(64, 'x')))).sealed.size(), sealed_.sealed.size());
  EXPECT_EQ(Must(Seal(plant_.Issue("users/jane", {Role::kAdmin, Role::kQuality}))).sealed.size(),
            sealed_.sealed.size());
}

TEST_F(SealedCredentialsTest, AreWrittenAsTheStandardsHaveIt) {
  EXPECT_EQ(Must(PickupIdOf(kSomeCode)), HexOf(Derived(kSomeCode, "sixpoint sealed credentials 1: pickup id")));
  EXPECT_EQ(sealed_.pickup_id, HexOf(Derived(sealed_.code, "sixpoint sealed credentials 1: pickup id")));
  Expect(Unseal(kSomeCode, SealedAs(PlainOf(machine_))), machine_);
  Expect(Unseal(kSomeCode, SealedAs(PlainOf(machine_) + std::string(100, '\0'))), machine_);
}

TEST_F(SealedCredentialsTest, AreRefusedWithAnyByteChanged) {
  for (std::size_t at = 0; at < sealed_.sealed.size(); ++at) {
    std::string changed = sealed_.sealed;
    for (const int flipped : {1, 2, 4, 8, 16, 32, 64, 128, 255}) {
      changed[at] = static_cast<char>(sealed_.sealed[at] ^ flipped);
      ASSERT_TRUE(absl::IsInvalidArgument(Unseal(sealed_.code, changed).status())) << "byte " << at;
    }
  }
  Expect(Unseal(sealed_.code, sealed_.sealed), machine_);
}

TEST_F(SealedCredentialsTest, AreRefusedWhereNotWhole) {
  for (std::size_t size = 0; size < sealed_.sealed.size(); ++size)
    ASSERT_TRUE(absl::IsInvalidArgument(Unseal(sealed_.code, sealed_.sealed.substr(0, size)).status())) << size;
  EXPECT_EQ(FieldOf(Unseal(sealed_.code, "").status()), "sealed");
  EXPECT_EQ(FieldOf(Unseal(sealed_.code, sealed_.sealed + '\0').status()), "--code");
  EXPECT_EQ(FieldOf(Unseal(sealed_.code, '\1' + sealed_.sealed).status()), "--code");
  EXPECT_EQ(FieldOf(Unseal(sealed_.code, sealed_.sealed + sealed_.sealed).status()), "--code");
  const std::string version(1, '\1');
  EXPECT_EQ(FieldOf(Unseal(sealed_.code, version + std::string(kGreatestSealed_bytes - 1, 'x')).status()), "--code");
  EXPECT_EQ(FieldOf(Unseal(sealed_.code, version + std::string(kGreatestSealed_bytes, 'x')).status()), "sealed");
  EXPECT_EQ(FieldOf(Unseal(sealed_.code, '\2' + sealed_.sealed.substr(1)).status()), "sealed");
}

TEST_F(SealedCredentialsTest, AreRefusedWithAnotherCode) {
  EXPECT_EQ(FieldOf(Unseal(Must(Seal(machine_)).code, sealed_.sealed).status()), "--code");
  EXPECT_EQ(FieldOf(Unseal(sealed_.pickup_id, sealed_.sealed).status()), "--code");
  for (std::size_t at = 0; at < sealed_.code.size(); ++at) {
    if (sealed_.code[at] == '-') continue;
    for (const char letter : std::string(kBase32Letters)) {
      std::string code = sealed_.code;
      code[at] = letter;
      if (code == sealed_.code) continue;
      const auto opened = Unseal(code, sealed_.sealed);
      ASSERT_EQ(FieldOf(opened.status()), "--code") << at << letter;
      EXPECT_THAT(std::string(opened.status().message()), Not(HasSubstr(code.substr(0, 4))));
      // Another code's bytes are not asked for by this one's id.
      const auto id = PickupIdOf(code);
      if (id.ok()) {
        EXPECT_NE(*id, sealed_.pickup_id);
      }
    }
  }
}

TEST_F(SealedCredentialsTest, OpenHoweverTheCodeIsTyped) {
  const auto all = [](std::string code, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = code.find(from, at)) != std::string::npos; at += to.size())
      code.replace(at, from.size(), to);
    return code;
  };
  std::string lower;
  for (const char c : sealed_.code) lower += static_cast<char>(std::tolower(c));
  const std::string typed[] = {
      lower,
      all(sealed_.code, "-", ""),
      all(lower, "-", " "),
      all(sealed_.code, "-", " - "),
      all(sealed_.code, "-", "\xe2\x80\x93"),  // an en dash
      all(sealed_.code, "-", "\xc2\xa0"),      // a space that does not break
      " " + sealed_.code + "\r\n",
      "-" + sealed_.code + "\t",
      sealed_.code.substr(0, 3) + "-" + sealed_.code.substr(3),
      all(all(all(sealed_.code, "O", "0"), "I", "1"), "B", "8"),
  };
  for (const std::string& code : typed) {
    EXPECT_EQ(*PickupIdOf(code), sealed_.pickup_id) << code;
    Expect(Unseal(code, sealed_.sealed), machine_);
  }
  const std::string as_digits = "018l-2345-67a8-cdef-gh1j-klmn-01";
  EXPECT_EQ(*PickupIdOf(as_digits), *PickupIdOf(kSomeCode));
  Expect(Unseal(as_digits, SealedAs(PlainOf(machine_))), machine_);
  // A code has both I and L: one of them is not taken for the other.
  EXPECT_NE(*PickupIdOf(all(kSomeCode, "L", "I")), *PickupIdOf(kSomeCode));
}

TEST_F(SealedCredentialsTest, SayWhatIsWrongWithACodeAndNotWhichItWas) {
  const std::string code = kSomeCode;
  const std::string wrong[] = {
      "",
      "-",
      code.substr(0, code.size() - 1),
      code + "A",
      code + code,
      "9" + code.substr(1),
      code + "=",
      code + std::string(1, '\0'),
      "\xc3\x9c" + code.substr(1),
      code + "\xe2\x80",
      "\xff" + code.substr(1),
      code.substr(0, code.size() - 1) + "J",  // one bit more than a code has
      std::string(26, '7'),
      std::string(300, ' ') + code,
      std::string(1'000'000, 'A'),
  };
  for (const std::string& typed : wrong) {
    for (const absl::Status& status : {PickupIdOf(typed).status(), Unseal(typed, sealed_.sealed).status()}) {
      EXPECT_EQ(FieldOf(status), "--code") << typed.substr(0, 100);
      EXPECT_THAT(std::string(status.message()), Not(HasSubstr("OIBL")));
    }
  }
}

TEST_F(SealedCredentialsTest, AreOnlyOfWhatBelongsTogether) {
  Plant other;
  const Credentials eve = plant_.Issue("users/eve", {Role::kAdmin});
  const AuthorityKey authority = plant_.key();
  const std::string key = KeyOf(machine_), certificate = CertificateOf(machine_);
  const AuthorityKey eves{Must(KeyOfPem(KeyOf(eve))), Must(CertificateOfPem(CertificateOf(eve)))};
  const std::string of_eve = CertificateOf(
      {Must(PemOf(Must(NewCertificate(eves, Must(KeyOfPem(key)).get(), Must(IdentityOf("machines/m1", {})), {},
                                      *ValidityOf(eves.certificate.get())))
                      .get())),
       ""});
  const Credentials wrong[] = {
      {KeyOf(eve) + certificate, machine_.authority_pem},
      {machine_.identity_pem, testing::Contents(other.certificate_file())},
      {machine_.identity_pem, certificate},
      {machine_.identity_pem, ""},
      {machine_.identity_pem, "garbage"},
      {machine_.identity_pem, machine_.authority_pem + machine_.authority_pem},
      {machine_.identity_pem, machine_.authority_pem + certificate},
      {key, machine_.authority_pem},
      {certificate, machine_.authority_pem},
      {"", machine_.authority_pem},
      {machine_.identity_pem + certificate, machine_.authority_pem},
      {machine_.identity_pem + key, machine_.authority_pem},
      {key + machine_.authority_pem, machine_.authority_pem},
      // The authority's own: it names nobody, and is nobody's to hand out.
      {Must(PemOf(authority.key.get())) + machine_.authority_pem, machine_.authority_pem},
      // One whom another than the authority named.
      {key + of_eve, machine_.authority_pem},
      {key + of_eve, CertificateOf(eve)},
  };
  const auto names_a_file = ::testing::AnyOf(::testing::StartsWith("identity.pem"), "authority.pem");
  for (const Credentials& credentials : wrong) {
    EXPECT_THAT(FieldOf(Seal(credentials).status()), names_a_file);
    EXPECT_THAT(FieldOf(Unseal(kSomeCode, SealedAs(PlainOf(credentials))).status()), names_a_file);
  }
}

TEST_F(SealedCredentialsTest, AreNothingElseThatTheCodeSeals) {
  const std::string plain = PlainOf(machine_), identity = WithLength(machine_.identity_pem);
  const std::string wrong[] = {
      "x",
      std::string(4, '\0'),
      identity,
      plain.substr(0, plain.size() - 1),
      plain + "x",
      plain + std::string(50, '\0') + "x",
      std::string("\xff\xff\xff\xff", 4) + plain.substr(4),
      std::string("\x7f\xff\xff\xff", 4) + plain.substr(4),
      std::string(3, '\0'),
      identity + std::string("\0\1\0\0", 4) + machine_.authority_pem,
      machine_.identity_pem + machine_.authority_pem,
  };
  for (const std::string& content : wrong)
    EXPECT_THAT(FieldOf(Unseal(kSomeCode, SealedAs(content)).status()), ::testing::AnyOf("sealed", "identity.pem"))
        << content.substr(0, 100);
  // Sealed for another use with the same code, or for another version.
  for (const std::string& additional : {std::string(), std::string("sixpoint sealed credentials"),
                                        std::string("sixpoint sealed credentials\2"), std::string("else\1")})
    EXPECT_EQ(FieldOf(Unseal(kSomeCode, SealedAs(plain, additional)).status()), "--code");
  EXPECT_EQ(FieldOf(Unseal(kSomeCode, SealedAs(plain, "sixpoint sealed credentials\2", 2)).status()), "sealed");
}

TEST_F(SealedCredentialsTest, OutliveHostileBytes) {
  std::mt19937 random(11);
  const auto bytes = [&](std::size_t size) {
    std::string text(size, '\0');
    for (char& c : text) c = static_cast<char>(random());
    return text;
  };
  for (int i = 0; i < 500; ++i) {
    const std::string any = bytes(random() % 3000);
    EXPECT_TRUE(absl::IsInvalidArgument(Unseal(sealed_.code, any).status()));
    EXPECT_TRUE(absl::IsInvalidArgument(Unseal(sealed_.code, '\1' + any).status()));
    EXPECT_TRUE(absl::IsInvalidArgument(Unseal(any.substr(0, 60), sealed_.sealed).status()));
  }
  // Of whoever has the code: past the seal, into what reads the credentials.
  const std::string plain = PlainOf(machine_);
  for (int i = 0; i < 2000; ++i) {
    std::string changed = plain;
    for (unsigned n = 1 + random() % 4; n > 0; --n) changed[random() % changed.size()] = static_cast<char>(random());
    const auto opened = Unseal(kSomeCode, SealedAs(i % 4 == 0 ? bytes(random() % 3000) : changed));
    // The same bytes may be written in two ways; nothing else is believed.
    if (opened.ok()) {
      EXPECT_EQ(testing::SerialOf(*opened), testing::SerialOf(machine_));
    } else {
      EXPECT_TRUE(absl::IsInvalidArgument(opened.status())) << opened.status();
    }
  }
}

TEST_F(SealedCredentialsTest, LeaveTheErrorsOfOthersAlone) {
  ERR_clear_error();
  EXPECT_FALSE(Unseal(kSomeCode, sealed_.sealed).ok());
  EXPECT_FALSE(Unseal(kSomeCode, SealedAs(WithLength("garbage") + WithLength("garbage"))).ok());
  EXPECT_FALSE(Seal({}).ok());
  EXPECT_EQ(ERR_peek_error(), 0U);
}

}  // namespace
}  // namespace sixpoint::identity
