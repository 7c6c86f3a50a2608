#include "services/runtime/access.h"

#include <algorithm>
#include <vector>

#include "refusal/message_text.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/request_names.h"
#include "sixpoint/access/v1/access.pb.h"
#include "storage/record.h"

namespace sixpoint::runtime {
namespace {

using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using identity::Identity;
using identity::Role;

constexpr std::size_t kLongestName = 80;

// Exhaustive by its lack of a default.
access::v1::Role Wire(Role role) {
  switch (role) {
    case Role::kMachine:
      return access::v1::ROLE_MACHINE;
    case Role::kEngineer:
      return access::v1::ROLE_ENGINEER;
    case Role::kQuality:
      return access::v1::ROLE_QUALITY;
    case Role::kMesReader:
      return access::v1::ROLE_MES_READER;
    case Role::kAdmin:
      return access::v1::ROLE_ADMIN;
    case Role::kService:
      return access::v1::ROLE_SERVICE;
    case Role::kGateway:
      return access::v1::ROLE_GATEWAY;
  }
  return access::v1::ROLE_UNSPECIFIED;
}

std::string WantedRoles(const access::v1::Rule& rule) {
  std::string wanted;
  for (const Role role : {Role::kMachine, Role::kEngineer, Role::kQuality, Role::kMesReader, Role::kAdmin,
                          Role::kService, Role::kGateway})
    if (std::count(rule.roles().begin(), rule.roles().end(), Wire(role)) > 0)
      wanted += (wanted.empty() ? "" : " or ") + identity::RoleText(role);
  return wanted.empty() ? "nobody" : wanted;
}

// What the field says, each of them where it is repeated.
absl::Status NotOwn(const std::string& field, const std::string& name, const Identity& caller) {
  return Failure(errors::v1::MACHINE_DIFFERS,
                 field + ": " + (name.empty() ? "empty" : Tame(name, kLongestName)) + ", want what is of " +
                     caller.Text() + ", whose certificate was shown",
                 {{"resource", caller.Text()}, {"machine", Tame(name, kLongestName)}});
}

// Whom a service says that it calls for is a text of its own; no more is taken than an identity could be.
absl::Status CheckRequestedFor(const grpc::ServerContextBase& context, const Identity& caller) {
  const auto [begin, end] = context.client_metadata().equal_range(kRequestedFor);
  if (begin == end) return absl::OkStatus();
  const std::string other(begin->second.data(), begin->second.size());
  if (caller.Has(Role::kService) && std::next(begin) == end && identity::IsIdentity(other)) return absl::OkStatus();
  return Failure(errors::v1::ROLE_MISSING,
                 std::string(kRequestedFor) + ": " + Tame(other, kLongestName) +
                     ", want none: who asks is told by his certificate",
                 {{"resource", caller.Text()}});
}

// A person's session is the gateway's to send, once; from anybody else it is refused, whatever it holds.
absl::Status CheckMaySendSession(const grpc::ServerContextBase& context, const Identity& caller) {
  if (caller.Has(Role::kGateway) && context.client_metadata().count(kSession) == 1) return absl::OkStatus();
  return Failure(errors::v1::ROLE_MISSING,
                 std::string(kSession) + ": with a call of " + caller.Text() +
                     ", want none: a session is sent by services/gateway alone, and one a call",
                 {{"resource", caller.Text()}});
}

}  // namespace

absl::StatusOr<Identity> Access::BelieveSession(const std::string& token) const {
  identity::SessionJudgement judged = sessions_.Judge(token);
  if (absl::Status status = StatusOf(judged); !status.ok()) return status;
  const absl::Status lasts = session_ends_->Check(judged.session, std::chrono::steady_clock::now());
  if (!lasts.ok()) return lasts;
  return std::move(judged.session.person);
}

absl::Status Access::StillCounts(const std::string& certificate_pem, const std::string& session_token) const {
  const absl::Status counts = Believe(certificate_pem).status();
  if (!counts.ok() || session_token.empty()) return counts;
  const absl::Status session = BelieveSession(session_token).status();
  // What is not known for so long does not count: a certificate is judged by files that lie here, a session's end by the database.
  return absl::IsUnavailable(session) ? absl::UnauthenticatedError(session.message()) : session;
}

absl::StatusOr<Identity> Access::Admit(const MethodDescriptor& method, const grpc::ServerContextBase& context) const {
  const access::v1::Rule& rule = method.options().GetExtension(access::v1::rule);
  const bool by_session = context.client_metadata().count(kSession) > 0;
  if (rule.anybody() && !by_session) return Identity();
  absl::StatusOr<Identity> caller = Believe(ShownCertificate(context));
  if (!caller.ok()) return caller;
  if (by_session) {
    if (absl::Status status = CheckMaySendSession(context, *caller); !status.ok()) return status;
    caller = BelieveSession(ShownSession(context));
    if (!caller.ok() || rule.anybody()) return caller;
  }
  const bool may = std::any_of(caller->roles.begin(), caller->roles.end(), [&](Role role) {
    return std::count(rule.roles().begin(), rule.roles().end(), Wire(role)) > 0;
  });
  if (!may) {
    return Failure(errors::v1::ROLE_MISSING,
                   method.name() + ": " + caller->Text() + " is " + caller->RolesText() + ", want " + WantedRoles(rule),
                   {{"resource", caller->Text()}});
  }
  if (absl::Status status = CheckRequestedFor(context, *caller); !status.ok()) return status;
  return caller;
}

absl::Status Access::CheckMachine(const MethodDescriptor& method, const Identity& caller, const Message& request,
                                  std::chrono::steady_clock::time_point deadline) const {
  const access::v1::Rule& rule = method.options().GetExtension(access::v1::rule);
  if (caller.kind != identity::Kind::kMachine || rule.any_machine() || method.client_streaming())
    return absl::OkStatus();
  const std::string& field = rule.own_machine();
  std::vector<std::string> names;
  if (field.empty() || !NamesAt(request, field, &names))
    return NotOwn("request", field, caller);  // a rule that says neither: nobody's
  for (const std::string& name : names) {
    if (name.rfind("machines/", 0) == 0) {
      if (storage::IdOfName(name).id != caller.name) return NotOwn(field, name, caller);
      continue;
    }
    if (name.empty()) return NotOwn(field, name, caller);
    const absl::StatusOr<std::optional<std::string>> machine = machine_of_(name, deadline);
    if (!machine.ok()) return machine.status();
    // What other instruments measured is no machine's; what the plant registers is everybody's.
    const bool elsewhere = name.rfind("measurements/", 0) == 0 || name.rfind("assessments/", 0) == 0;
    const bool foreign = !machine->has_value() || ((*machine)->empty() ? elsewhere : **machine != caller.name);
    if (foreign) return NotOwn(field, name, caller);
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::runtime
