#include "tests/support/plant_certificates.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <utility>

#include "identity/certificates.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using identity::Role;

[[noreturn]] void Fail(const std::string& message) {
  std::fprintf(stderr, "plant certificates: %s\n", message.c_str());
  std::exit(1);
}

template <typename Value>
Value Must(absl::StatusOr<Value> value) {
  if (!value.ok()) Fail(value.status().ToString());
  return *std::move(value);
}
void Must(const absl::Status& status) {
  if (!status.ok()) Fail(status.ToString());
}

fs::path NewFolder() {
  std::string pattern = (fs::temp_directory_path() / "sixpoint-certificates-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) Fail("cannot make " + pattern);
  return pattern;
}

}  // namespace

PlantCertificates::PlantCertificates(const std::string& plant) : folder_(NewFolder()) {
  Must(identity::Authority::Create(folder_ / "authority", plant));
  authority_.emplace(Must(identity::Authority::Open(folder_ / "authority")));
  WriteRevoked();
}

PlantCertificates::~PlantCertificates() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

fs::path PlantCertificates::Service(const std::string& area) {
  return IssueTo("services/" + area, {}, {"127.0.0.1", "localhost", "::1"});
}

fs::path PlantCertificates::User(const std::string& name, const std::vector<Role>& roles) {
  return IssueTo("users/" + name, roles);
}

fs::path PlantCertificates::Expired(const std::string& user, const std::vector<Role>& roles) {
  const fs::path folder = User(user, roles);
  std::ostringstream key_pem;
  key_pem << std::ifstream(folder_ / "authority" / "key.pem").rdbuf();
  const identity::AuthorityKey signer{Must(identity::KeyOfPem(key_pem.str())),
                                      Must(identity::CertificateOfPem(Must(authority_->CertificatePem())))};
  const auto now = std::chrono::system_clock::now();
  const identity::Key own = Must(identity::NewKey());
  const identity::Certificate certificate =
      Must(identity::NewCertificate(signer, own.get(), Must(identity::IdentityOf("users/" + user, roles)), {},
                                    {now - std::chrono::hours(2), now - std::chrono::hours(1)}));
  std::ofstream(folder / identity::kIdentityFile)
      << Must(identity::PemOf(own.get())) << Must(identity::PemOf(certificate.get()));
  return folder;
}

fs::path PlantCertificates::Machine(const std::string& machine_id) { return IssueTo("machines/" + machine_id, {}); }

fs::path PlantCertificates::Gateway() { return IssueTo("services/gateway", {}); }

fs::path PlantCertificates::Nobody() {
  const fs::path folder = folder_ / "nobody";
  fs::create_directory(folder);
  std::ofstream(folder / identity::kAuthorityFile) << Must(authority_->CertificatePem());
  return folder;
}

fs::path PlantCertificates::Issue(const identity::CertificateWish& wish) {
  const fs::path folder = folder_ / wish.identity.Text();
  fs::create_directories(folder.parent_path());
  Must(identity::WriteCredentials(folder, Must(authority_->Issue(wish))));
  return folder;
}

void PlantCertificates::Revoke(const fs::path& credentials) {
  const auto certificate = Must(identity::ReadCertificate(credentials / identity::kIdentityFile));
  Must(authority_->Revoke(certificate.serial));
  WriteRevoked();
}

void PlantCertificates::WriteRevoked() {
  // Replaced whole: a server may look at it meanwhile.
  const fs::path beside = folder_ / "revoked.pem.part";
  std::ofstream(beside) << Must(authority_->RevokedPem());
  fs::rename(beside, revoked_file());
}

fs::path PlantCertificates::IssueTo(const std::string& name, const std::vector<Role>& roles,
                                    const std::vector<std::string>& hosts) {
  identity::CertificateWish wish;
  wish.identity = Must(identity::IdentityOf(name, roles));
  wish.hosts = hosts;
  return Issue(wish);
}

}  // namespace sixpoint::testing
