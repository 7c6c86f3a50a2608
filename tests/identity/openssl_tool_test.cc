// The independent oracle: what `openssl` on the command line makes of our files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>

#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

using testing::CertificateOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Plant;

class OpenSslTool : public ::testing::Test {
 protected:
  void SetUp() override {
    if (Says("version").find("OpenSSL") == std::string::npos) GTEST_SKIP() << "SKIPPED: no openssl on this computer";
  }
  static std::string Says(const std::string& arguments) {
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(("openssl " + arguments + " 2>&1").c_str(), "r"), pclose);
    std::string text;
    char piece[4096];
    for (std::size_t got; pipe != nullptr && (got = fread(piece, 1, sizeof piece, pipe.get())) > 0;)
      text.append(piece, got);
    return text;
  }
  std::string FileOf(const std::string& name, const Credentials& credentials) {
    const std::string file = plant_.beside(name).string();
    std::ofstream(file) << CertificateOf(credentials);
    return file;
  }
  std::string Verify(const std::string& options, const std::string& file) {
    return Says("verify -x509_strict -CAfile " + plant_.certificate_file().string() + " -crl_check -CRLfile " +
                plant_.revoked_file().string() + " " + options + " " + file);
  }

  Plant plant_;
};

TEST_F(OpenSslTool, BelievesWhomWeBelieve) {
  const Credentials jane = plant_.Issue("users/jane", {Role::kEngineer, Role::kQuality});
  const std::string file = FileOf("jane.pem", jane);
  EXPECT_THAT(Verify("-purpose sslclient", file), HasSubstr("jane.pem: OK"));
  EXPECT_THAT(Verify("-purpose sslserver", file), Not(HasSubstr(": OK")));
  CertificateWish wish = testing::WishOf("services/ingest");
  wish.hosts = {"plant.example.com", "10.0.0.7", "::1"};
  const std::string service = FileOf("ingest.pem", plant_.Issue(wish));
  for (const std::string options : {"-purpose sslclient", "-purpose sslserver", "-verify_hostname plant.example.com",
                                    "-verify_ip 10.0.0.7", "-verify_ip ::1"})
    EXPECT_THAT(Verify(options, service), HasSubstr("ingest.pem: OK")) << options;
  EXPECT_THAT(Verify("-verify_hostname other.example.com", service), Not(HasSubstr(": OK")));
}

TEST_F(OpenSslTool, BelievesNobodyWhomWeTookBack) {
  const Credentials jane = plant_.Issue("users/jane", {Role::kEngineer}),
                    eve = plant_.Issue("users/eve", {Role::kAdmin});
  ASSERT_EQ(plant_.authority().Revoke(testing::SerialOf(eve)), absl::OkStatus());
  EXPECT_THAT(Verify("", FileOf("jane.pem", jane)), HasSubstr("jane.pem: OK"));
  EXPECT_THAT(Verify("", FileOf("eve.pem", eve)), HasSubstr("certificate revoked"));
  const std::string list = Says("crl -noout -text -in " + plant_.revoked_file().string());
  EXPECT_THAT(list, HasSubstr("Version 2"));
  std::string upper = testing::SerialOf(eve);
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  EXPECT_THAT(list, HasSubstr("Serial Number: " + upper));
  EXPECT_THAT(list, Not(HasSubstr("Reason")));
  EXPECT_THAT(list, HasSubstr("X509v3 CRL Number: \n                2\n"));
}

TEST_F(OpenSslTool, PrintsWhomACertificateNames) {
  CertificateWish wish = testing::WishOf("services/ingest");
  wish.hosts = {"plant.example.com", "10.0.0.7"};
  const Credentials ingest = plant_.Issue(wish);
  const std::string service = Says("x509 -noout -text -serial -in " + FileOf("ingest.pem", ingest));
  EXPECT_THAT(service, HasSubstr("URI:urn:sixpoint:services:ingest, DNS:plant.example.com, IP Address:10.0.0.7"));
  EXPECT_THAT(service, HasSubstr("Subject: OU = services, CN = ingest"));
  EXPECT_THAT(service, HasSubstr("Issuer: O = Sixpoint plant, CN = test"));
  EXPECT_THAT(service, HasSubstr("TLS Web Client Authentication, TLS Web Server Authentication"));
  EXPECT_THAT(service, HasSubstr("CA:FALSE"));
  EXPECT_THAT(service, HasSubstr("NIST CURVE: P-256"));
  const std::string jane =
      Says("x509 -noout -text -in " + FileOf("jane.pem", plant_.Issue("users/jane", {Role::kMesReader})));
  EXPECT_THAT(jane, HasSubstr("URI:urn:sixpoint:users:jane, URI:urn:sixpoint:roles:mes-reader"));
  EXPECT_THAT(jane, Not(HasSubstr("Server Authentication")));
  const std::string authority = Says("x509 -noout -text -in " + plant_.certificate_file().string());
  EXPECT_THAT(authority, HasSubstr("CA:TRUE, pathlen:0"));
  EXPECT_THAT(authority, HasSubstr("Certificate Sign, CRL Sign"));
}

TEST_F(OpenSslTool, FindsTheOldKeyInARenewedCertificate) {
  CertificateWish wish = testing::WishOf("services/ingest");
  wish.hosts = {"plant.example.com", "10.0.0.7"};
  const Credentials first = plant_.Issue(wish);
  const std::string serial = testing::SerialOf(first);
  const std::string renewed = testing::Must(plant_.authority().Renew(serial, std::chrono::hours(24)));
  const std::string old_file = FileOf("old.pem", first), new_file = plant_.beside("new.pem").string();
  std::ofstream(new_file) << renewed;
  for (const std::string options :
       {"-purpose sslclient", "-purpose sslserver", "-verify_hostname plant.example.com", "-verify_ip 10.0.0.7"})
    EXPECT_THAT(Verify(options, new_file), HasSubstr("new.pem: OK")) << options;
  const std::string key = Says("x509 -noout -pubkey -in " + old_file);
  EXPECT_THAT(key, HasSubstr("BEGIN PUBLIC KEY"));
  EXPECT_EQ(Says("x509 -noout -pubkey -in " + new_file), key);
  const std::string names =
      "x509 -noout -subject -issuer -ext subjectAltName,extendedKeyUsage,subjectKeyIdentifier -in ";
  EXPECT_EQ(Says(names + new_file), Says(names + old_file));
  EXPECT_NE(Says("x509 -noout -serial -in " + new_file), Says("x509 -noout -serial -in " + old_file));
  const std::string key_file = plant_.beside("key.der").string();
  Says("x509 -noout -pubkey -in " + new_file + " | openssl pkey -pubin -outform DER -out " + key_file);
  for (const IssuedCertificate& one : testing::Must(plant_.authority().Issued()))
    EXPECT_THAT(Says("dgst -sha256 " + key_file), HasSubstr("= " + one.public_key_sha256));
  // The old one is taken back for itself alone.
  ASSERT_EQ(plant_.authority().Revoke(serial), absl::OkStatus());
  EXPECT_THAT(Verify("", old_file), HasSubstr("certificate revoked"));
  EXPECT_THAT(Verify("", new_file), HasSubstr("new.pem: OK"));
}

}  // namespace
}  // namespace sixpoint::identity
