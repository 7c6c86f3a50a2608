// Who calls, and whether he may: the certificate shown (identity/trust.h), over the gateway the person's session (identity/session.h),
// and the method's rule (sixpoint/access/v1). Private to runtime; admission asks.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "identity/identity.h"
#include "identity/session.h"
#include "identity/trust.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/session_ends.h"

namespace sixpoint::runtime {

// Thread-safe.
class Access {
 public:
  // The machine that something recorded under exactly that name is of; empty: no machine's; none: nothing is recorded so.
  using MachineOf = std::function<absl::StatusOr<std::optional<std::string>>(
      const std::string& name, std::chrono::steady_clock::time_point deadline)>;

  // All live longer.
  Access(identity::Trust* trust, const SessionEnds* session_ends, MachineOf machine_of)
      : trust_(trust), sessions_(trust), session_ends_(session_ends), machine_of_(std::move(machine_of)) {}

  // Whose certificate it is, where it counts now; else UNAUTHENTICATED (CERTIFICATE_...).
  absl::StatusOr<identity::Identity> Believe(const std::string& certificate_pem) const {
    return BelievedIdentity(trust_, certificate_pem);
  }
  // Before anything of a request is parsed: UNAUTHENTICATED (CERTIFICATE_...) of a certificate that does not count now,
  // UNAUTHENTICATED (SESSION_...) of a session that does not, PERMISSION_DENIED (ROLE_MISSING) where the method's rule names none of
  // its roles, there is no rule, or a session came that is not the gateway's to send. Where its rule lets in anybody: nobody, without
  // a name.
  absl::StatusOr<identity::Identity> Admit(const google::protobuf::MethodDescriptor& method,
                                           const grpc::ServerContextBase& context) const;
  // PERMISSION_DENIED (MACHINE_DIFFERS) where a machine asks for what is not its own, or is not recorded: it learns no more of
  // other machines' names. A streamed request is its handler's to ask about (caller_identity.h).
  absl::Status CheckMachine(const google::protobuf::MethodDescriptor& method, const identity::Identity& caller,
                            const google::protobuf::Message& request,
                            std::chrono::steady_clock::time_point deadline) const;
  // Of a call that runs: whether its certificate still counts, and the session that came with it (empty: none).
  absl::Status StillCounts(const std::string& certificate_pem, const std::string& session_token) const;

 private:
  absl::StatusOr<identity::Identity> BelieveSession(const std::string& token) const;

  identity::Trust* const trust_;
  mutable identity::SessionTrust sessions_;  // keeps what it found
  const SessionEnds* const session_ends_;
  const MachineOf machine_of_;
};

}  // namespace sixpoint::runtime
