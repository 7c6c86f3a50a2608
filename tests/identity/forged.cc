#include "tests/identity/forged.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace sixpoint::identity::testing {
namespace {

namespace fs = std::filesystem;

fs::path NewFolder() {
  std::string name = (fs::temp_directory_path() / "sixpoint-identity-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) std::abort();
  return name;
}

void Add(X509* certificate, X509* issuer, int nid, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509V3_set_ctx_nodb(&context);
  const Extension extension(X509V3_EXT_nconf_nid(nullptr, &context, nid, value.c_str()));
  EXPECT_EQ(X509_add_ext(certificate, extension.get(), -1), 1) << value;
}

// Byte by byte: with NULs, too.
void AddUris(X509* certificate, const std::vector<std::string>& uris) {
  const Names names(GENERAL_NAMES_new());
  for (const std::string& uri : uris) {
    ASN1_IA5STRING* const text = ASN1_IA5STRING_new();
    ASN1_STRING_set(text, uri.data(), static_cast<int>(uri.size()));
    GENERAL_NAME* const name = GENERAL_NAME_new();
    GENERAL_NAME_set0_value(name, GEN_URI, text);
    sk_GENERAL_NAME_push(names.get(), name);
  }
  EXPECT_EQ(X509_add1_ext_i2d(certificate, NID_subject_alt_name, names.get(), 0, X509V3_ADD_DEFAULT), 1);
}

Authority Made(const fs::path& folder, const std::string& name) {
  EXPECT_EQ(Authority::Create(folder, name), absl::OkStatus());
  return Must(Authority::Open(folder));
}

}  // namespace

std::string Contents(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::set<std::string> NamesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
  return names;
}

std::string MessageOf(const absl::Status& status) { return std::string(status.message()); }

unsigned ModeOf(const fs::path& path) {
  struct stat found {};
  EXPECT_EQ(lstat(path.c_str(), &found), 0) << path;
  return found.st_mode & 07777;
}

TemporaryFolder::TemporaryFolder() : path_(NewFolder()) {}
TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

Plant::Plant(const std::string& name) : authority_(Made(folder_ / "authority", name)) {}

Credentials Plant::Issue(const std::string& who, const std::vector<Role>& roles) { return Issue(WishOf(who, roles)); }

AuthorityKey Plant::key() const {
  return {Must(KeyOfPem(Contents(folder() / "key.pem"))), Must(CertificateOfPem(Contents(certificate_file())))};
}

CertificateWish WishOf(const std::string& who, const std::vector<Role>& roles) {
  CertificateWish wish;
  wish.identity = Must(IdentityOf(who, roles));
  if (wish.identity.kind == Kind::kService) wish.hosts = {"localhost"};
  return wish;
}

std::string CertificateOf(const Credentials& credentials) {
  return credentials.identity_pem.substr(credentials.identity_pem.find("-----BEGIN CERTIFICATE"));
}

std::string KeyOf(const Credentials& credentials) {
  return credentials.identity_pem.substr(0, credentials.identity_pem.find("-----BEGIN CERTIFICATE"));
}

std::string SerialOf(const Credentials& credentials) {
  return Must(identity::SerialOf(Must(CertificateOfPem(CertificateOf(credentials))).get()));
}

std::string Forged(const Forgery& forgery, const AuthorityKey* by) {
  const Key key = Must(NewKey());
  const Certificate made(X509_new());
  X509* const certificate = made.get();
  X509* const issuer = by == nullptr ? certificate : by->certificate.get();
  X509_set_version(certificate, 2);
  X509_set_serialNumber(certificate, Must(NewSerial()).get());
  X509_set1_notBefore(certificate, Must(TimeOf(forgery.valid.not_before)).get());
  X509_set1_notAfter(certificate, Must(TimeOf(forgery.valid.not_after)).get());
  X509_set_pubkey(certificate, key.get());
  if (forgery.same_subject_as != nullptr) {
    X509_set_subject_name(certificate, X509_get_subject_name(forgery.same_subject_as));
  } else {
    X509_NAME_add_entry_by_txt(X509_get_subject_name(certificate), "CN", MBSTRING_ASC,
                               reinterpret_cast<const unsigned char*>("forged"), -1, -1, 0);
  }
  X509_set_issuer_name(certificate, X509_get_subject_name(issuer));
  Add(certificate, issuer, NID_basic_constraints, forgery.is_authority ? "critical,CA:TRUE" : "critical,CA:FALSE");
  Add(certificate, issuer, NID_key_usage, forgery.is_authority ? "critical,keyCertSign,cRLSign" : "digitalSignature");
  if (!forgery.is_authority) Add(certificate, issuer, NID_ext_key_usage, forgery.usage);
  Add(certificate, issuer, NID_subject_key_identifier, "hash");
  Add(certificate, issuer, NID_authority_key_identifier, "keyid:always");
  if (!forgery.uris.empty()) AddUris(certificate, forgery.uris);
  EXPECT_GT(X509_sign(certificate, by == nullptr ? key.get() : by->key.get(), EVP_sha256()), 0);
  return Must(PemOf(certificate));
}

}  // namespace sixpoint::identity::testing
