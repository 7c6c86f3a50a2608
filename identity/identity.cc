#include "identity/identity.h"

#include <algorithm>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

constexpr std::size_t kLongestName = 64;
constexpr std::string_view kUrn = "urn:sixpoint:", kRoles = "roles";
constexpr char kWantedIdentity[] =
    "machines/NAME, users/NAME or services/NAME, with a NAME of 1 to 64 of A-Z, a-z, 0-9, '.', '_', '-', the first not "
    "'.'";

constexpr std::pair<Kind, std::string_view> kKinds[] = {
    {Kind::kMachine, "machines"}, {Kind::kUser, "users"}, {Kind::kService, "services"}};
constexpr std::pair<Role, std::string_view> kRoleTexts[] = {
    {Role::kMachine, "machine"},      {Role::kEngineer, "engineer"}, {Role::kQuality, "quality"},
    {Role::kMesReader, "mes-reader"}, {Role::kAdmin, "admin"},       {Role::kService, "service"},
    {Role::kGateway, "gateway"}};

std::string KindText(Kind kind) {
  for (const auto& [known, text] : kKinds)
    if (known == kind) return std::string(text);
  return "nobody";
}

std::optional<Kind> KindOf(std::string_view text) {
  for (const auto& [kind, known] : kKinds)
    if (known == text) return kind;
  return std::nullopt;
}

bool IsNameCharacter(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
}

// As the ids of the plant's machines. No leading dot: a name may become a folder's.
bool IsName(std::string_view name) {
  return !name.empty() && name.size() <= kLongestName && name[0] != '.' &&
         std::all_of(name.begin(), name.end(), IsNameCharacter);
}

Role OwnRole(Kind kind, std::string_view name) {
  if (kind == Kind::kMachine) return Role::kMachine;
  return name == kGatewayName ? Role::kGateway : Role::kService;
}

absl::StatusOr<std::vector<Role>> RolesOf(Kind kind, std::string_view name, const std::vector<Role>& roles) {
  if (kind != Kind::kUser) {
    if (!roles.empty())
      return Refuse("roles", RoleText(roles[0]), "none of " + KindText(kind) + ", who have their own");
    return std::vector<Role>{OwnRole(kind, name)};
  }
  if (roles.empty()) return Refuse("roles", "", "at least one of engineer, quality, mes-reader and admin");
  for (const Role role : roles) {
    if (role != Role::kEngineer && role != Role::kQuality && role != Role::kMesReader && role != Role::kAdmin)
      return Refuse("roles", RoleText(role), "of a user engineer, quality, mes-reader or admin");
  }
  const std::set<Role> each_once(roles.begin(), roles.end());
  return std::vector<Role>(each_once.begin(), each_once.end());
}

}  // namespace

bool Identity::Has(Role role) const { return std::find(roles.begin(), roles.end(), role) != roles.end(); }

std::string Identity::Text() const { return KindText(kind) + "/" + name; }

std::string Identity::RolesText() const {
  std::string text;
  for (const Role role : roles) text += (text.empty() ? "" : ", ") + RoleText(role);
  return text;
}

std::string RoleText(Role role) {
  for (const auto& [known, text] : kRoleTexts)
    if (known == role) return std::string(text);
  return "unknown";
}

absl::StatusOr<Role> RoleOf(const std::string& field, const std::string& text) {
  for (const auto& [role, known] : kRoleTexts)
    if (known == text) return role;
  return Refuse(field, text, "machine, engineer, quality, mes-reader, admin, service or gateway");
}

absl::StatusOr<Identity> IdentityOf(const std::string& text, const std::vector<Role>& roles) {
  const std::size_t slash = text.find('/');
  const std::optional<Kind> kind = KindOf(std::string_view(text).substr(0, slash));
  if (slash == std::string::npos || !kind || !IsName(std::string_view(text).substr(slash + 1)))
    return Refuse("identity", text, kWantedIdentity);
  absl::StatusOr<std::vector<Role>> its_roles = RolesOf(*kind, std::string_view(text).substr(slash + 1), roles);
  if (!its_roles.ok()) return its_roles.status();
  return Identity{*kind, text.substr(slash + 1), *std::move(its_roles)};
}

// No machine or service has a user's role.
bool IsUser(const std::string& text) { return IdentityOf(text, {Role::kMesReader}).ok(); }

bool IsIdentity(const std::string& text) { return IsUser(text) || IdentityOf(text, {}).ok(); }

std::vector<std::string> UrisOf(const Identity& identity) {
  const std::string urn(kUrn);
  std::vector<std::string> uris{urn + KindText(identity.kind) + ":" + identity.name};
  if (identity.kind != Kind::kUser) return uris;  // the others' role is known by their kind
  for (const Role role : identity.roles) uris.push_back(urn + std::string(kRoles) + ":" + RoleText(role));
  return uris;
}

absl::StatusOr<Identity> IdentityOfUris(const std::vector<std::string>& uris) {
  std::string text;
  std::vector<Role> roles;
  for (const std::string& uri : uris) {
    if (uri.compare(0, kUrn.size(), kUrn) != 0) continue;
    const std::string named = uri.substr(kUrn.size());
    const std::size_t colon = named.find(':');
    const std::string word = named.substr(0, colon), name = colon == std::string::npos ? "" : named.substr(colon + 1);
    if (word == kRoles) {
      const absl::StatusOr<Role> role = RoleOf("roles", name);
      if (!role.ok()) return role.status();
      roles.push_back(*role);
    } else if (text.empty()) {
      text = word + "/" + name;
    } else {
      return Refuse("identity", text + " and " + word + "/" + name, "one");
    }
  }
  return IdentityOf(text, roles);
}

}  // namespace sixpoint::identity
