// What every call of our own services passes before its handler: is its client still there, may the caller (access.h), is the server
// ready, is there room for one more of his (call_gate.h), is the request as small as the method's is (message_limits.h), does each of its
// fields keep its bound (request_checks.h), is it about the caller's own machine, and about parts that he may see (clearance.h). Nothing
// of a request is read before the first four: of a stranger no more is held than HTTP/2's window. What a client streams is its handler's
// to check.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/service_type.h>

#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "services/runtime/access.h"
#include "services/runtime/call_gate.h"
#include "services/runtime/clearance.h"

namespace sixpoint::runtime {

// Thread-safe. Outlives the services that it admits to.
class Admission {
 public:
  // All live longer.
  Admission(const Access* access, const Clearance* clearance, CallGate* gate)
      : access_(*access), clearance_(*clearance), gate_(*gate) {}

  // SERVICE_NOT_READY with that sentence; at first, before anything is known, with one of its own.
  void SetNotReady(const std::string& why);
  void SetReady();

  // The methods of `service`, each behind this. full_name: sixpoint.plant.v1.PlantService, whose methods it has. `service`
  // lives longer.
  std::unique_ptr<grpc::Service> Admit(const std::string& full_name, grpc::Service* service);

  // Ends the calls that run for a certificate or a session that does not count any more.
  void EndUnbelieved();

 private:
  friend class AdmittedMethod;
  struct OpenCall {
    const grpc::ServerContextBase* context;
    std::string certificate_pem, session_token;
    bool is_ended = false;
  };
  absl::Status CheckReady() const;

  const Access& access_;
  const Clearance& clearance_;
  CallGate& gate_;
  mutable std::mutex mutex_;
  std::list<OpenCall> open_calls_;
  std::optional<std::string> not_ready_ = "it has not asked its database yet";
};

}  // namespace sixpoint::runtime
