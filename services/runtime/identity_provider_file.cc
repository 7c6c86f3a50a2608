#include "services/runtime/identity_provider_file.h"

#include <yaml-cpp/yaml.h>

#include <set>

#include "identity/files.h"
#include "refusal/refusal.h"

namespace sixpoint::runtime {
namespace {

constexpr std::size_t kLongestConfig_bytes = 65536;

}  // namespace

std::string IdentityProviderFile::Text(const std::string& key) const {
  const auto found = texts.find(key);
  return found == texts.end() ? "" : found->second;
}

absl::StatusOr<IdentityProviderFile> ReadIdentityProviderFile(const std::string& path) {
  static const std::set<std::string> kKnown = {"issuer",    "client_id",          "keys_url",     "keys_file",
                                               "ca_file",   "name_claim",         "roles_claim",  "authorization_url",
                                               "token_url", "client_secret_file", "display_name", "scope",
                                               "asks_again"};
  const absl::StatusOr<std::string> text = identity::ReadFile(path, kLongestConfig_bytes);
  if (!text.ok()) return Refuse("--oidc", path, "a file of at most 64 KiB");
  IdentityProviderFile file;
  file.path = path;
  try {
    const YAML::Node root = YAML::Load(*text);
    if (!root.IsMap()) return Refuse(path, "something else", "keys and values (issuer, client_id, ...)");
    std::set<std::string> seen;
    for (const auto& entry : root) {
      const std::string key = entry.first.as<std::string>();
      if (!seen.insert(key).second) return Refuse(path + ": " + key, "twice", "once");
      if ((key == "roles" || key == "persons") && entry.second.IsMap()) {
        std::map<std::string, std::string>& of_key = key == "roles" ? file.roles : file.persons;
        for (const auto& one : entry.second)
          if (!of_key.emplace(one.first.as<std::string>(), one.second.as<std::string>()).second)
            return Refuse(path + ": " + key, one.first.as<std::string>() + " twice", "once");
        continue;
      }
      if (kKnown.count(key) == 0) return Refuse(path, key, "a key that docs/access.md lists");
      if (!entry.second.IsScalar()) return Refuse(path + ": " + key, "not one value", "one text");
      file.texts[key] = entry.second.as<std::string>();
    }
  } catch (const YAML::Exception& error) {
    return Refuse(path, "line " + std::to_string(error.mark.line + 1), "YAML");
  }
  return file;
}

}  // namespace sixpoint::runtime
