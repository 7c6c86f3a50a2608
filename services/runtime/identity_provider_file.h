// The file that says by which identity provider people sign in (docs/access.md), as texts. Two read it: the plant's service whom it is to
// believe (services/plant/identity_provider.h), the gateway where it sends people (services/gateway/directory_client.h). So what the other
// one reads is known to both, and a misspelt key to neither. Nothing in it is secret.
#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <string>

namespace sixpoint::runtime {

struct IdentityProviderFile {
  std::string path;
  std::map<std::string, std::string> texts;           // by key, each of them a known one
  std::map<std::string, std::string> roles, persons;  // the two that are tables

  // Empty where the file does not say it.
  std::string Text(const std::string& key) const;
};

// INVALID_ARGUMENT names the key, its value and what was wanted; also of a key that is not known or stands twice.
absl::StatusOr<IdentityProviderFile> ReadIdentityProviderFile(const std::string& path);

}  // namespace sixpoint::runtime
