// Who somebody is to the plant: a machine, a user (a person, or a program that asks for one: an MES), or one of its services. It
// stands in the certificate that the plant's authority gave (authority.h), and nowhere else.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

namespace sixpoint::identity {

enum class Kind { kMachine, kUser, kService };

// What one may do goes by these (proto/sixpoint/access/v1). A machine's and a service's are their own, services/gateway has
// kGateway in kService's stead; a user has those that the authority gave.
enum class Role { kMachine, kEngineer, kQuality, kMesReader, kAdmin, kService, kGateway };

// services/gateway: people reach the plant by it, and it calls for them by their sessions (session.h).
inline constexpr char kGatewayName[] = "gateway";

struct Identity {
  Kind kind = Kind::kUser;
  std::string name;  // letters, digits and . _ -, 1 to 64, the first no dot: of a machine its id, of a service its area
  std::vector<Role> roles;  // at least one, ascending, each once

  bool Has(Role role) const;
  // "machines/m1", "users/jane", "services/ingest": how the record names who asked.
  std::string Text() const;
  // "engineer, quality".
  std::string RolesText() const;
};

// "machine", "engineer", "quality", "mes-reader", "admin", "service", "gateway".
std::string RoleText(Role role);
// None of an unknown word: INVALID_ARGUMENT naming `field`.
absl::StatusOr<Role> RoleOf(const std::string& field, const std::string& text);
// Of "machines/m1" and the like. `roles`: a user's, at least one of engineer, quality, mes-reader and admin; none of others.
absl::StatusOr<Identity> IdentityOf(const std::string& text, const std::vector<Role>& roles);
// Whether a text names somebody, of whatever roles; a user.
bool IsIdentity(const std::string& text);
bool IsUser(const std::string& text);

// As subject alternative names (RFC 5280): urn:sixpoint:machines:m1, urn:sixpoint:users:jane, urn:sixpoint:roles:engineer.
std::vector<std::string> UrisOf(const Identity& identity);
// Of a certificate's. Others than urn:sixpoint: count for nothing. INVALID_ARGUMENT where they name nobody, or more than one.
absl::StatusOr<Identity> IdentityOfUris(const std::vector<std::string>& uris);

}  // namespace sixpoint::identity
