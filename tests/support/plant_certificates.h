// The certificates of a plant that lives as long as a test: an authority of its own, and folders of credentials for whoever a test needs.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "identity/authority.h"

namespace sixpoint::testing {

// Everything lies in one folder, which goes with it. A program that cannot make its certificates ends, saying why.
class PlantCertificates {
 public:
  explicit PlantCertificates(const std::string& plant = "test plant");
  ~PlantCertificates();
  PlantCertificates(const PlantCertificates&) = delete;
  PlantCertificates& operator=(const PlantCertificates&) = delete;

  // A folder with identity.pem and authority.pem, for --certificates, --identity and ChannelCredentialsOf. Of the same name once
  // more: the same folder with another certificate.
  // A service that is reached by 127.0.0.1, localhost (unix sockets too) and ::1.
  std::filesystem::path Service(const std::string& area);
  std::filesystem::path User(const std::string& name, const std::vector<identity::Role>& roles);
  std::filesystem::path Machine(const std::string& machine_id);
  // services/gateway, over which people call by their sessions.
  std::filesystem::path Gateway();
  // Of the plant's own authority; ended an hour ago.
  std::filesystem::path Expired(const std::string& user, const std::vector<identity::Role>& roles);
  // Knows the authority, and is nobody: a stranger.
  std::filesystem::path Nobody();
  // Any other: beyond its time soon, reached by another host.
  std::filesystem::path Issue(const identity::CertificateWish& wish);

  // Takes back what such a folder holds; counts for the next call, as revoked_file() says it then.
  void Revoke(const std::filesystem::path& credentials);
  // For --revoked.
  std::filesystem::path revoked_file() const { return folder_ / "revoked.pem"; }
  std::filesystem::path folder() const { return folder_; }
  // Whoever takes back a certificate by the authority itself writes revoked_file() by WriteRevoked.
  identity::Authority& authority() { return *authority_; }
  void WriteRevoked();

 private:
  std::filesystem::path IssueTo(const std::string& name, const std::vector<identity::Role>& roles,
                                const std::vector<std::string>& hosts = {});

  std::filesystem::path folder_;
  std::optional<identity::Authority> authority_;
};

}  // namespace sixpoint::testing
