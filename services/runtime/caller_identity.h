// Who asks for a call, by the certificate that was shown with its connection, and over the gateway by the person's session. Admission
// (admission.h) has judged both before any handler runs, but certificates of methods that let in anybody; nothing here judges again.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <optional>
#include <string>

#include "identity/identity.h"
#include "identity/session.h"
#include "identity/trust.h"
#include "storage/reader.h"

namespace sixpoint::runtime {

// Metadata of a call that one of the plant's services makes for another: whom it does it for. Nobody else may send it.
inline constexpr char kRequestedFor[] = "sixpoint-requested-for";
// Metadata of a call that the gateway makes for a person: his session's token (identity/session.h). The caller is that person then.
inline constexpr char kSession[] = "sixpoint-session";

// Of the certificate, whether it counts or not; none where none was shown, or one that names nobody.
std::optional<identity::Identity> ShownIdentity(const grpc::ServerContextBase& context);
// The certificate itself; empty: none was shown.
std::string ShownCertificate(const grpc::ServerContextBase& context);

// The session's token, and what it says; empty and none where the call came without one, or by another than the gateway.
std::string ShownSession(const grpc::ServerContextBase& context);
std::optional<identity::Session> SessionOf(const grpc::ServerContextBase& context);
// Whose certificate it is, where it counts now; else UNAUTHENTICATED (CERTIFICATE_...), UNAVAILABLE where nobody can be judged.
absl::StatusOr<identity::Identity> BelievedIdentity(identity::Trust* trust, const std::string& certificate_pem);
// What a session that does not count is refused with; OK of a good one.
absl::Status StatusOf(const identity::SessionJudgement& judged);
// The one place that says who calls: the session's person, else whom the certificate names.
std::optional<identity::Identity> CallingIdentity(const grpc::ServerContextBase& context);

// As the record keeps it: "users/jane", "users/jane via services/inspection" or "users/jane via services/gateway". Without a certificate, which only
// methods that let in anybody do without, the address.
std::string RequestedBy(const grpc::ServerContextBase& context);
// Whom a call to another service is made for: the caller, or whom the caller does it for. Empty without a certificate.
std::string RequestedFor(const grpc::ServerContextBase& context);

// Whose eyes an answer is for: whom the call is made for. A service that calls for nobody does the plant's own work, and sees all.
storage::Reader ReaderOf(const grpc::ServerContextBase& context);

// Where requests are streamed, their handler asks this of the first: MACHINE_DIFFERS where a machine names another's.
absl::Status CheckOwnMachine(const grpc::ServerContextBase& context, const std::string& field,
                             const std::string& machine);

}  // namespace sixpoint::runtime
