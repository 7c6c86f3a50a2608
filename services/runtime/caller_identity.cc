#include "services/runtime/caller_identity.h"

#include <grpc/grpc_security_constants.h>

#include <vector>

#include "refusal/message_text.h"
#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

std::vector<std::string> Shown(const grpc::ServerContextBase& context, const char* property) {
  std::vector<std::string> values;
  const auto shown = context.auth_context();
  if (shown == nullptr) return values;
  for (const grpc::string_ref& value : shown->FindPropertyValues(property))
    values.emplace_back(value.data(), value.size());
  return values;
}

std::string MetadataFor(const grpc::ServerContextBase& context, const char* key) {
  const auto found = context.client_metadata().find(key);
  if (found == context.client_metadata().end()) return "";
  return std::string(found->second.data(), found->second.size());
}

// Of a judgement that is not good.
ErrorReason ReasonOf(identity::Standing standing) {
  switch (standing) {
    case identity::Standing::kNotOurs:
      return errors::v1::CERTIFICATE_FOREIGN;
    case identity::Standing::kNotYetValid:
    case identity::Standing::kExpired:
      return errors::v1::CERTIFICATE_EXPIRED;
    case identity::Standing::kRevoked:
      return errors::v1::CERTIFICATE_REVOKED;
    case identity::Standing::kUndecidable:
      return errors::v1::SERVICE_NOT_READY;
    case identity::Standing::kGood:
    case identity::Standing::kUnreadable:
      break;
  }
  return errors::v1::CERTIFICATE_MISSING;
}

}  // namespace

std::optional<identity::Identity> ShownIdentity(const grpc::ServerContextBase& context) {
  absl::StatusOr<identity::Identity> shown = identity::IdentityOfUris(Shown(context, GRPC_PEER_URI_PROPERTY_NAME));
  if (!shown.ok()) return std::nullopt;
  return *std::move(shown);
}

std::string ShownCertificate(const grpc::ServerContextBase& context) {
  const std::vector<std::string> shown = Shown(context, GRPC_X509_PEM_CERT_PROPERTY_NAME);
  return shown.empty() ? "" : shown.front();
}

std::string ShownSession(const grpc::ServerContextBase& context) {
  const auto shown = ShownIdentity(context);
  const bool may = shown && shown->Has(identity::Role::kGateway) && context.client_metadata().count(kSession) == 1;
  return may ? MetadataFor(context, kSession) : "";
}

std::optional<identity::Session> SessionOf(const grpc::ServerContextBase& context) {
  const std::string token = ShownSession(context);
  if (token.empty()) return std::nullopt;
  absl::StatusOr<identity::Session> session = identity::ReadSession(token);
  if (!session.ok()) return std::nullopt;
  return *std::move(session);
}

std::optional<identity::Identity> CallingIdentity(const grpc::ServerContextBase& context) {
  const std::optional<identity::Session> session = SessionOf(context);
  return session ? session->person : ShownIdentity(context);
}

std::string RequestedFor(const grpc::ServerContextBase& context) {
  const auto caller = CallingIdentity(context);
  if (!caller) return "";
  const std::string other = caller->Has(identity::Role::kService) ? MetadataFor(context, kRequestedFor) : "";
  return other.empty() ? caller->Text() : other;
}

std::string RequestedBy(const grpc::ServerContextBase& context) {
  const auto shown = ShownIdentity(context);
  if (!shown) return context.peer();
  const std::string asker = RequestedFor(context), own = shown->Text();
  return asker == own ? own : asker + " via " + own;
}

storage::Reader ReaderOf(const grpc::ServerContextBase& context) {
  const std::string asker = RequestedFor(context);
  return asker.rfind("services/", 0) == 0 ? storage::Reader::Everything() : storage::Reader{asker};
}

absl::Status CheckOwnMachine(const grpc::ServerContextBase& context, const std::string& field,
                             const std::string& machine) {
  const auto shown = CallingIdentity(context);
  if (!shown || shown->kind != identity::Kind::kMachine || machine == shown->Text()) return absl::OkStatus();
  return Failure(errors::v1::MACHINE_DIFFERS,
                 field + ": " + Tame(machine, 80) + ", want " + shown->Text() + ", whose certificate was shown",
                 {{"resource", shown->Text()}, {"machine", machine}});
}

absl::StatusOr<identity::Identity> BelievedIdentity(identity::Trust* trust, const std::string& certificate_pem) {
  if (certificate_pem.empty())
    return Failure(errors::v1::CERTIFICATE_MISSING,
                   "certificate: none was shown, want one that the plant's authority gave");
  const identity::Judgement judged = trust->Judge(certificate_pem);
  if (judged.standing == identity::Standing::kGood) return judged.identity;
  const bool named = !judged.identity.name.empty();
  return Failure(ReasonOf(judged.standing), judged.why_not,
                 named ? Metadata{{"resource", judged.identity.Text()}} : Metadata{});
}

absl::Status StatusOf(const identity::SessionJudgement& judged) {
  using identity::SessionStanding;
  switch (judged.standing) {
    case SessionStanding::kGood:
      break;
    case SessionStanding::kNotValid:
      return Failure(errors::v1::SESSION_NOT_VALID, judged.why_not);
    case SessionStanding::kOver:
      return Failure(errors::v1::SESSION_ENDED, judged.why_not, {{"resource", judged.session.person.Text()}});
    case SessionStanding::kUndecidable:
      return Failure(errors::v1::SERVICE_NOT_READY, judged.why_not);
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::runtime
