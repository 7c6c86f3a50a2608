// A plant's authority in a folder of its own, and certificates that it would never give.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "identity/authority.h"
#include "identity/certificates.h"

namespace sixpoint::identity::testing {

std::string Contents(const std::filesystem::path& file);
unsigned ModeOf(const std::filesystem::path& path);  // 0600
std::set<std::string> NamesIn(const std::filesystem::path& folder);
std::string MessageOf(const absl::Status& status);
template <typename Value>
Value Must(absl::StatusOr<Value> value) {
  return std::move(value).value();  // ends the test's program, saying why
}

class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

// In `folder`/authority.
class Plant {
 public:
  explicit Plant(const std::string& name = "test");
  Authority& authority() { return authority_; }
  std::filesystem::path folder() const { return folder_ / "authority"; }
  std::filesystem::path certificate_file() const { return folder() / "certificate.pem"; }
  std::filesystem::path revoked_file() const { return folder() / "revoked.pem"; }
  std::filesystem::path beside(const std::string& name) const { return folder_ / name; }

  Credentials Issue(const CertificateWish& wish) { return Must(authority_.Issue(wish)); }
  Credentials Issue(const std::string& who, const std::vector<Role>& roles = {});
  AuthorityKey key() const;

 private:
  TemporaryFolder folder_;
  Authority authority_;
};

CertificateWish WishOf(const std::string& who, const std::vector<Role>& roles = {});
// The certificate and the key of identity.pem.
std::string CertificateOf(const Credentials& credentials);
std::string KeyOf(const Credentials& credentials);
std::string SerialOf(const Credentials& credentials);

struct Forgery {
  std::vector<std::string> uris;
  bool is_authority = false;
  const char* usage = "clientAuth";
  Span valid{std::chrono::system_clock::now() - std::chrono::hours(1),
             std::chrono::system_clock::now() + std::chrono::hours(1)};
  X509* same_subject_as = nullptr;
};
// Of a new key, signed by `by`; by that key itself where `by` is null.
std::string Forged(const Forgery& forgery, const AuthorityKey* by);

}  // namespace sixpoint::identity::testing
