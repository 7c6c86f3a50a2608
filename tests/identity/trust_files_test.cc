// The two files by which a server trusts: missing, another's, half written, replaced.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "identity/revocation_list.h"
#include "identity/trust.h"
#include "refusal/refusal.h"
#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;
using testing::CertificateOf;
using testing::Contents;
using ::testing::HasSubstr;
using testing::Must;
using ::testing::Not;
using testing::Plant;

class TrustFiles : public ::testing::Test {
 protected:
  TrustFiles()
      : authority_(plant_.beside("authority.pem")),
        revoked_(plant_.beside("revoked.pem")),
        jane_(CertificateOf(plant_.Issue("users/jane", {Role::kEngineer}))),
        trust_(authority_, revoked_) {
    Put(authority_, Contents(plant_.certificate_file()));
    Put(revoked_, Contents(plant_.revoked_file()));
  }
  // As whoever keeps a server's copies does.
  void Put(const fs::path& file, const std::string& content) {
    std::ofstream(plant_.beside("part"), std::ios::binary) << content;
    fs::rename(plant_.beside("part"), file);
  }
  Standing Jane() { return trust_.Judge(jane_).standing; }
  void ExpectUndecidable(const std::string& what, const fs::path& file) {
    SCOPED_TRACE(what);
    for (int i = 0; i < 2; ++i) {
      for (const std::string& pem : {jane_, std::string(), std::string("garbage")}) {
        const Judgement judgement = trust_.Judge(pem);
        EXPECT_EQ(judgement.standing, Standing::kUndecidable);
        EXPECT_EQ(judgement.identity.name, "");
        EXPECT_THAT(judgement.why_not, ::testing::StartsWith(file.filename().string() + ": "));
        EXPECT_THAT(judgement.why_not, HasSubstr(", want "));
        EXPECT_THAT(judgement.why_not, Not(HasSubstr(file.parent_path().string())));
      }
      const auto violations = ViolationsOf(trust_.CheckFiles());
      ASSERT_EQ(violations.size(), 1U);
      EXPECT_EQ(violations[0].field, file.string());
    }
  }

  Plant plant_, other_{"test"};
  const fs::path authority_, revoked_;
  const std::string jane_;
  Trust trust_;
};

TEST_F(TrustFiles, BelievesNobodyWithoutItsRevocationList) {
  const std::string right = Contents(revoked_);
  EXPECT_EQ(Jane(), Standing::kGood);
  fs::remove(revoked_);
  ExpectUndecidable("missing", revoked_);
  const std::pair<std::string, std::string> wrong[] = {
      {"empty", ""},
      {"garbage", "garbage"},
      {"half", right.substr(0, right.size() / 2)},
      {"twice", right + right},
      {"another authority's of the same name", Contents(other_.revoked_file())},
      {"a certificate", jane_},
      {"too long", right + std::string(9 * 1024 * 1024, '\n')},
  };
  for (const auto& [what, content] : wrong) {
    Put(revoked_, content);
    ExpectUndecidable(what, revoked_);
    Put(revoked_, right);
    EXPECT_EQ(Jane(), Standing::kGood) << "after " << what;
  }
  fs::remove(revoked_);
  fs::create_directory(revoked_);
  ExpectUndecidable("a folder", revoked_);
  fs::remove(revoked_);
  ASSERT_EQ(mkfifo(revoked_.c_str(), 0600), 0);
  ExpectUndecidable("a pipe that nobody writes to", revoked_);
  Put(revoked_, right);
  EXPECT_EQ(Jane(), Standing::kGood);
}

TEST_F(TrustFiles, BelievesNobodyWithoutItsAuthority) {
  const std::string right = Contents(authority_);
  const std::pair<std::string, std::string> wrong[] = {
      {"empty", ""},
      {"garbage", "garbage"},
      {"two authorities", right + Contents(other_.certificate_file())},
      {"a user's certificate", jane_},
      {"too long", right + std::string(17 * 1024, '\n')},
  };
  for (const auto& [what, content] : wrong) {
    Put(authority_, content);
    ExpectUndecidable(what, authority_);
    Put(authority_, right);
    EXPECT_EQ(Jane(), Standing::kGood) << "after " << what;
  }
  fs::remove(authority_);
  ExpectUndecidable("missing", authority_);
  Put(authority_, Contents(other_.certificate_file()));
  ExpectUndecidable("another's, with our list", revoked_);
  Put(revoked_, Contents(other_.revoked_file()));
  EXPECT_EQ(Jane(), Standing::kNotOurs) << "what was remembered of the one before counts no more";
  Put(authority_, right);
  Put(revoked_, Contents(plant_.revoked_file()));
  EXPECT_EQ(Jane(), Standing::kGood);
}

TEST_F(TrustFiles, AreReadWhereTheyCameLater) {
  fs::remove(revoked_);
  Trust early(plant_.beside("nowhere/authority.pem"), revoked_);
  EXPECT_EQ(early.Judge(jane_).standing, Standing::kUndecidable);
  fs::create_directory(plant_.beside("nowhere"));
  Put(plant_.beside("nowhere/authority.pem"), Contents(authority_));
  EXPECT_EQ(early.Judge(jane_).standing, Standing::kUndecidable);
  Put(revoked_, Contents(plant_.revoked_file()));
  EXPECT_EQ(early.Judge(jane_).standing, Standing::kGood);
  EXPECT_EQ(early.CheckFiles(), absl::OkStatus());
}

TEST_F(TrustFiles, MayBeWrittenInPlaceOrBehindALink) {
  EXPECT_EQ(Jane(), Standing::kGood);
  ASSERT_EQ(plant_.authority().Revoke(
                Must(ReadCertificate(plant_.folder() / "issued" / (plant_.authority().Issued()->at(0).serial + ".pem")))
                    .serial),
            absl::OkStatus());
  std::ofstream(revoked_) << Contents(plant_.revoked_file());
  EXPECT_EQ(Jane(), Standing::kRevoked);
  const std::string link = plant_.beside("link").string();
  fs::create_symlink(revoked_, link);
  Trust by_link(authority_, link);
  EXPECT_EQ(by_link.Judge(jane_).standing, Standing::kRevoked);
}

TEST_F(TrustFiles, DoNotGoBackToAnOlderList) {
  const std::string first = Contents(plant_.revoked_file());
  ASSERT_EQ(plant_.authority().Revoke(plant_.authority().Issued()->at(0).serial), absl::OkStatus());
  const std::string second = Contents(plant_.revoked_file());
  EXPECT_EQ(Jane(), Standing::kGood);
  Put(revoked_, second);
  EXPECT_EQ(Jane(), Standing::kRevoked);
  Put(revoked_, first);
  ExpectUndecidable("number 1 after number 2", revoked_);
  // Nor by way of an authority that cannot be read for a while.
  const std::string right = Contents(authority_);
  Put(authority_, "garbage");
  ExpectUndecidable("garbage", authority_);
  Put(authority_, right);
  ExpectUndecidable("number 1 after number 2", revoked_);
  Put(revoked_, second);
  EXPECT_EQ(Jane(), Standing::kRevoked);
  // It is remembered by the process alone: who restores both from a copy, and starts anew, goes on with the copy.
  Put(revoked_, first);
  EXPECT_EQ(Trust(authority_, revoked_).Judge(jane_).standing, Standing::kGood);
}

TEST_F(TrustFiles, RefuseAListThatHoldsForSomeOnly) {
  const AuthorityKey authority = plant_.key();
  const SignedList list = Must(ListOfPem(Contents(revoked_)));
  X509V3_CTX context;
  X509V3_set_ctx(&context, authority.certificate.get(), nullptr, nullptr, list.get(), 0);
  X509V3_set_ctx_nodb(&context);
  const Extension only(X509V3_EXT_nconf_nid(nullptr, &context, NID_delta_crl, "critical,1"));
  const Integer base(ASN1_INTEGER_new());
  ASN1_INTEGER_set(base.get(), 1);
  ASSERT_EQ(X509_CRL_add1_ext_i2d(list.get(), NID_delta_crl, base.get(), 1, X509V3_ADD_DEFAULT), 1);
  ASSERT_GT(X509_CRL_sign(list.get(), authority.key.get(), EVP_sha256()), 0);
  Put(revoked_, Must(PemOf(list.get())));
  ExpectUndecidable("what was added to another list", revoked_);
}

TEST_F(TrustFiles, AreJudgedTheSameByManyThreads) {
  // One thread takes back and others ask: nobody is believed after the taking back returned.
  std::atomic<bool> done{false};
  std::atomic<int> wrong_count{0};
  Trust trust(plant_.certificate_file(), plant_.revoked_file());
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&] {
      while (!done) {
        if (trust.Judge(jane_).standing != Standing::kGood) ++wrong_count;
        if (trust.Judge("garbage").standing != Standing::kUnreadable) ++wrong_count;
      }
    });
  }
  for (int i = 0; i < 50; ++i) {
    const Credentials eve = plant_.Issue("users/eve", {Role::kAdmin});
    EXPECT_EQ(trust.Judge(CertificateOf(eve)).standing, Standing::kGood);
    ASSERT_EQ(plant_.authority().Revoke(testing::SerialOf(eve)), absl::OkStatus());
    EXPECT_EQ(trust.Judge(CertificateOf(eve)).standing, Standing::kRevoked);
  }
  done = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong_count, 0);
}

}  // namespace
}  // namespace sixpoint::identity
